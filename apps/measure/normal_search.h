#pragma once

#include <cstdint>
#include <vector>

#include "glint/model/footprint.h"
#include "glint/model/normal_map.h"
#include "glint/query/reference.h"

namespace glint::apps {

/// Exact densities of a map of flat facets, for pictures from far away. The same sum as Reference: the texels are visited whose normals
/// are near the half vector, or the texels of the footprint where these are fewer.
class NormalSearch {
 public:
  /// @param map  must outlive this object
  NormalSearch(const NormalMap& map, float sigma_r);

  /// Density as Reference answers it under Boundary::wrap. O(the smaller number of texels). Thread-safe.
  float density(const Footprint& footprint, Vec2 half) const;

 private:
  static constexpr int kCells = 128;  ///< along each axis of the disk

  static int cellOf(float coordinate);

  NormalMap map_;
  float sigma_r_;
  Reference reference_;
  std::vector<std::size_t> first_;     ///< [kCells * kCells + 1] where the texels of a cell begin
  std::vector<std::uint32_t> texels_;  ///< row-major indices, by the cells of their normals
};

}  // namespace glint::apps
