#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "glint/bake/displace/height_surface.h"

namespace glint::bake {

/// Where a ray meets a surface.
struct SurfaceHit {
  std::size_t facet = 0;
  Vec3 point;          ///< wrapped into the map
  float distance = 0;  ///< horizontal, cells
};

/// Traces rays against a periodic height surface. A pyramid with the largest height of every square of 2^k x 2^k cells lets
/// rays skip squares that they pass above. The pyramid takes a third more memory than heights do; a ray that leaves the map
/// enters at the opposite side.
class HeightTracer {
 public:
  explicit HeightTracer(const HeightSurface& surface);

  /// Finds the first facet that a ray meets from above after it has left `facet`.
  /// @param origin     a point of `facet`
  /// @param direction  unit vector on the upper side of `facet`
  /// @return nothing if the ray escapes
  std::optional<SurfaceHit> trace(std::size_t facet, Vec3 origin, Vec3 direction) const;

 private:
  struct Level {
    int columns = 0;
    int rows = 0;
    std::vector<float> highest;  ///< [rows][columns]: largest height of a square
  };
  struct Ray;
  float hitCell(const Ray& ray, int i, int j, float t_in, float t_out, std::size_t& facet) const;

  HeightSurface surface_;
  std::vector<Level> levels_;
};

}  // namespace glint::bake
