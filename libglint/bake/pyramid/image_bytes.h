#pragma once

#include <cstddef>
#include <functional>

#include "glint/model/ndf_pyramid_shard.h"

namespace glint::bake {

/// Tells how many blocks an image stores.
/// @param level  of footprints: the mean of the map is not asked
/// @param image  index in the level
using BlockCountFn = std::function<std::size_t(int level, std::size_t image)>;

/// The memory that the images of a pyramid take while they are built, bytes: before and after they are packed. Where every block
/// of every image would fit into `most_bytes`, it is the bytes of all blocks; otherwise blocks are counted on a few images of each
/// level.
/// @param region  only the images of this region
/// @param spread  blocks of an image for each that `blocks` counts, >= 1
double imageBytes(const PyramidShape& shape, BlockPrecision precision, double most_bytes, const BlockCountFn& blocks,
                  double spread = 1, PyramidRegion region = {});

}  // namespace glint::bake
