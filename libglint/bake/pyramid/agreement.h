#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "glint/model/ndf_pyramid.h"

namespace glint::bake {

/// Decodes all pixels of an image of a level, block by block; pixels of blocks that are not stored are 0.
using DecodeFn = std::function<void(int level, std::size_t image, std::vector<float>& pixels)>;

/// DecodeFn of one image.
/// @param image  index in the arrays of the level
void decodeImage(const NdfPyramid& pyramid, int level, std::size_t image, std::vector<float>& pixels);

/// With automatic levels, the coarsest level of footprints is dropped while its `levelDisagreement` with the next finer level
/// is less than this.
inline constexpr double kAgreement = 0.01;

/// The number of levels of footprints of a pyramid that is left when levels that agree are dropped.
int disagreeingLevels(const PyramidShape& shape, const DecodeFn& decode);

/// Drops levels of footprints from the coarse end. The mean of the map stays the last level.
/// @param kept  levels of footprints that stay, >= 1
void keepLevels(PyramidShape& shape, int kept);

/// Measures how much level `level + 1` of a pyramid differs from `level`: rel_l2 between every image of the latter and the
/// image of the former nearest to it, over the whole level. Where the difference is small, `level` can answer the
/// larger footprints too.
/// @param level  0 to level_count - 2
double levelDisagreement(const PyramidShape& shape, int level, const DecodeFn& decode);
double levelDisagreement(const NdfPyramid& pyramid, int level);

}  // namespace glint::bake
