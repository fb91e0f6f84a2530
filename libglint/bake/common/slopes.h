#pragma once

#include <span>
#include <vector>

#include "glint/math/vec.h"
#include "glint/model/map_slopes.h"
#include "glint/model/normal_map.h"

namespace glint::bake {

/// Normals nearer to the rim of the disk than this are moved here, a tilt of 89.9 degrees (a slope of 577): floats near the rim
/// do not tell nz, and on it there is none.
inline constexpr float kRimRadius = 0.9999985f;

/// Normal of the surface z = h(x, y) with these slopes: (-p, -q, 1) normalised, projected on the disk; at most kRimRadius long.
Vec2 normalFromSlopes(float dh_dx, float dh_dy);

/// Normals of a height field. Slopes are central differences, (h[i+1] - h[i-1]) / 2: the exact derivative of the field that is
/// quadratic between neighbours, and the scheme of every tool that turns heights into normals. At the border they are wrapped,
/// or one-sided (h[1] - h[0]) under `clamp`.
/// @param heights  [height][width], texels, bottom row first
/// @param cliffs   number of normals that were moved to kRimRadius
/// @return [height][width]; texels whose neighbours are not finite have NaN
std::vector<Vec2> normalsFromHeights(int width, int height, std::span<const float> heights, Boundary boundary = Boundary::wrap,
                                     std::size_t* cliffs = nullptr);

/// How much more heights step from one border to the opposite one than inside: the root mean square of the steps from the last
/// column to the first over that of the roughest pair of columns inside, and the same for rows. About 1 or less if the map
/// tiles; 0 where there are fewer than three columns (rows).
Vec2 seamRoughness(int width, int height, std::span<const float> heights);

/// Moments of the slopes of a height field under the same scheme.
struct SlopeMoments {
  double variance_x = 0;  ///< mean of p^2; the mean slope of a periodic field is 0
  double variance_y = 0;
  float steepest = 0;  ///< largest length of (p, q)
};
SlopeMoments slopeMoments(int width, int height, std::span<const float> heights);

/// Mean and covariance of the slopes of all texels of a map: what the map says, or computed. The same for any number of threads.
MapSlopes mapSlopes(const NormalMap& map);

}  // namespace glint::bake
