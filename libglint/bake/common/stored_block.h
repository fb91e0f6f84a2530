#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "glint/bake/common/half_array.h"
#include "glint/model/ndf_pyramid.h"

namespace glint::bake {

/// Loads the pixels of a stored block of a pyramid, in the order of ndf_pyramid.h, without multiplying by value_scale.
/// @param block  number of the block among the stored blocks of the level
/// @param out    [kBlockPixels]
inline void loadStoredBlock(const NdfPyramid& pyramid, const PyramidLevel& level, std::uint64_t block, float* out) {
  const std::size_t first = static_cast<std::size_t>(block) * kBlockPixels;
  if (pyramid.precision == BlockPrecision::f16)
    halvesToFloats(static_cast<const std::uint16_t*>(level.pixels) + first, kBlockPixels, out);
  else
    std::copy_n(static_cast<const float*>(level.pixels) + first, kBlockPixels, out);
}

}  // namespace glint::bake
