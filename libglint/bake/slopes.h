#pragma once

#include <span>
#include <vector>

#include "glint/model/map_slopes.h"
#include "glint/model/normal_map.h"
#include "glint/model/vec.h"

namespace glint::bake {

/// Normal of the surface z = h(x, y) with these slopes: (-p, -q, 1) normalised, projected on the disk.
Vec2 normalFromSlopes(float dh_dx, float dh_dy);

/// Normals of a periodic height field. Slopes are central differences, (h[i+1] - h[i-1]) / 2, wrapped: the exact derivative of
/// the field that is quadratic between neighbours, and the scheme of every tool that turns heights into normals.
/// @param heights  [height][width], texels, bottom row first
/// @return [height][width]; texels whose neighbours are not finite have NaN
std::vector<Vec2> normalsFromHeights(int width, int height, std::span<const float> heights);

/// Moments of the slopes of a height field under the same scheme.
struct SlopeMoments {
  double variance_x = 0;  ///< mean of p^2; the mean slope of a periodic field is 0
  double variance_y = 0;
  float steepest = 0;  ///< largest length of (p, q)
};
SlopeMoments slopeMoments(int width, int height, std::span<const float> heights);

/// Mean and covariance of the slopes of all texels of a map. The same for any number of threads.
MapSlopes mapSlopes(const NormalMap& map);

}  // namespace glint::bake
