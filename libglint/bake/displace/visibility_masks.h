#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "glint/bake/displace/height_surface.h"

namespace glint::bake {

/// Which facets of a periodic surface see which directions: one bit for each, taken at the facet's centroid.
///
/// One running maximum is swept over the whole map for each direction: towards the horizon and back along lines that advance by
/// one cell of the direction's longer axis at a time; heights between the cells of the shorter axis are interpolated. So the
/// cost does not depend on how far shadows reach, O(facets x directions).
///
/// Bits say nothing about whether a facet faces the direction: multiply by its cosine.
class VisibilityMasks {
 public:
  /// @param directions  unit vectors with z > 0
  /// @note memory: 2 bytes for every 16 directions and facet
  VisibilityMasks(const HeightSurface& surface, std::span<const Vec3> directions);

  bool visible(std::size_t facet, std::size_t direction) const {
    return bits_[facet * slots_ + place_[direction] / 16] >> (place_[direction] % 16) & 1;
  }

  /// Sets out[d] to 1 or 0 for every direction d.
  void expand(std::size_t facet, float* out) const {
    const std::uint16_t* bits = &bits_[facet * slots_];
    for (std::size_t d = 0; d < place_.size(); ++d) out[d] = static_cast<float>(bits[place_[d] / 16] >> (place_[d] % 16) & 1);
  }

 private:
  std::size_t slots_ = 0;             ///< 16-bit words of each facet
  std::vector<std::uint16_t> place_;  ///< [directions]: slot * 16 + bit
  std::vector<std::uint16_t> bits_;   ///< [facets][slots_]
};

}  // namespace glint::bake
