#pragma once

#include "glint/model/ndf_pyramid.h"

namespace glint::bake {

/// Measures how much level `level + 1` of a pyramid differs from `level`: rel_l2 between every image of the latter and the
/// image of the former nearest to it, over the whole level. Where the difference is small, `level` can answer the
/// larger footprints too.
/// @param level  0 to level_count - 2
double levelDisagreement(const NdfPyramid& pyramid, int level);

}  // namespace glint::bake
