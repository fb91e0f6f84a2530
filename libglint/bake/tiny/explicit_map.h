#pragma once

#include <cstdint>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/model/tiny_example.h"
#include "glint/query/detail/tiny/scattered_pieces.h"
#include "glint/query/detail/tiny/tiled_pieces.h"

namespace glint::bake {

/// Normal of an example at a position in it: of the texel, or on a smooth surface between the texel centres, linear over the two
/// triangles of each cell. A tiled example repeats; a scattered one is even beyond its outermost texel centres.
/// @param x, y  texels from the lower left corner
Vec2 exampleNormal(const TinyExample& example, double x, double y);

/// The surface of a plane, point by point: what TinyExampleNdf filters.
class TinySurface {
 public:
  explicit TinySurface(const TinyExample& example) : example_(example), tiled_(example), scattered_(example) {}

  struct Seen {
    Vec2 normal;
    bool background = false;  ///< no example covers the point
  };
  Seen at(const PlanePoint& point) const;

 private:
  TinyExample example_;
  TiledPieces tiled_;
  ScatteredPieces scattered_;
};

/// A part of a plane as an ordinary map.
struct PlaneWindow {
  std::int64_t x = 0, y = 0;  ///< texel of the plane at the lower left corner
  int width = 0, height = 0;  ///< of the map, texels of the map
  int per_texel = 1;          ///< texels of the map along a texel of the plane, 1 to kMostPerTexel

  static constexpr int kMostPerTexel = 16;
};

/// The normals at the centres of the map's texels.
/// @return [height][width], bottom row first
std::vector<Vec2> explicitNormals(const TinyExample& example, const PlaneWindow& window, const ProgressFn& progress = {});

}  // namespace glint::bake
