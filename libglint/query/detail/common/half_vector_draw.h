#pragma once

#include <cmath>

#include "glint/math/gaussian.h"
#include "glint/query/detail/common/texel_choice.h"

namespace glint {

/// A half vector that was drawn from the texels of a footprint.
struct DrawnHalfVector {
  bool found = false;  ///< false: no texel has a weight
  Vec2 h;              ///< may lie outside the disk
};

/// Draws a texel (or triangle) by its weight in the footprint, one of its normals, and a point of the lobe around the normal. Each choice
/// uses up the leading digits of `xi` that are left.
/// @tparam Map  NormalMap or NearNormals
template <class Map>
GLINT_HD DrawnHalfVector drawHalfVector(const Map& map, const TexelGrid& grid, const FootprintWeights& weights, float sigma_r,
                                        Vec2 xi) {
  const TexelChoice texel = chooseTexel(weights, grid, xi);
  if (!texel.found) return {};
  const auto normal = [&](int i, int j) { return map.at(wrapIndex(i, grid.width), wrapIndex(j, grid.height)); };
  Vec2 n = normal(texel.i, texel.j);
  if (grid.surface == Surface::smooth) {
    const Vec2 side = texel.half == 0 ? normal(texel.i + 1, texel.j) : normal(texel.i, texel.j + 1);
    const Vec2 far = normal(texel.i + 1, texel.j + 1);
    const float r = std::sqrt(xi.y);  // makes the point uniform in the triangle
    n = (1 - r) * n + (r * (1 - xi.x)) * side + (r * xi.x) * far;
    xi = {lowerDigits(xi.x, 7), lowerDigits(xi.y, 7)};
  }
  return {true, n + sigma_r * Vec2{normalQuantile(xi.x), normalQuantile(xi.y)}};
}

}  // namespace glint
