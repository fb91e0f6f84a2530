#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "glint/bake/displace/height_surface.h"

namespace glint::bake {

/// Tells which directions each facet of a periodic surface sees: one bit for each direction, found at the centroid of the
/// facet.
///
/// For each direction, a running maximum of heights (the horizon) sweeps once over the map, from far ahead in that direction.
/// It advances one cell at a time along the longer axis of the direction, and interpolates heights along the shorter axis. So
/// the cost does not depend on how far shadows reach: O(facets x directions).
///
/// A bit does not say whether the facet faces the direction: multiply by its cosine.
class VisibilityMasks {
 public:
  /// @param directions  unit vectors with z > 0
  /// @note memory: 2 bytes for every facet and 16 directions
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
  std::size_t slots_ = 0;             ///< number of 16-bit words of a facet
  std::vector<std::uint16_t> place_;  ///< [directions]: slot * 16 + bit
  std::vector<std::uint16_t> bits_;   ///< [facets][slots_]
};

}  // namespace glint::bake
