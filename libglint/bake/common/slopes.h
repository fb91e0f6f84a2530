#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "glint/math/vec.h"
#include "glint/model/map_slopes.h"
#include "glint/model/normal_map.h"

namespace glint::bake {

/// Largest radius of a normal on the disk: a tilt of 89.9 degrees, a slope of 577. Steeper normals are moved to this radius,
/// since nz = sqrt(1 - r^2) loses all digits of a float nearer to the rim, and must not be 0.
inline constexpr float kRimRadius = 0.9999985f;

/// Normal of the surface z = h(x, y) with these slopes: (-dh/dx, -dh/dy, 1), normalised and projected on the disk. At most
/// kRimRadius long.
Vec2 normalFromSlopes(float dh_dx, float dh_dy);

/// How slopes of a height field are computed from the heights around a texel.
enum class Gradient : std::uint8_t {
  central,  ///< central differences
  sobel,    ///< mean of central differences of three rows (columns) with weights 1, 2, 1: smoother, and less steep
};

/// Computes the normals of a height field. By default slopes are central differences, (h[i+1] - h[i-1]) / 2: the exact slopes of a
/// parabola through three heights, and the scheme of other tools that turn heights into normals. At the border, differences
/// wrap around the map, or under `clamp` are one-sided (h[1] - h[0]).
/// @param heights  [height][width], texels, bottom row first
/// @param cliffs   if not null, gets the number of normals that were moved to kRimRadius
/// @return [height][width]; NaN where a neighbouring height is not finite
std::vector<Vec2> normalsFromHeights(int width, int height, std::span<const float> heights, Boundary boundary = Boundary::wrap,
                                     std::size_t* cliffs = nullptr, Gradient gradient = Gradient::central);

/// The same, into an array.
/// @param normals  [height][width]
void normalsFromHeights(int width, int height, std::span<const float> heights, std::span<Vec2> normals,
                        Boundary boundary = Boundary::wrap, std::size_t* cliffs = nullptr,
                        Gradient gradient = Gradient::central);

/// Computes the slopes (dh/dx, dh/dy) of row j of a height field. Heights beyond the border are wrapped, or under `clamp` those of
/// the border; central differences are one-sided there.
/// @param heights  [height][width], texels, bottom row first
/// @param slopes   [width]
void rowSlopes(int width, int height, std::span<const float> heights, int j, Boundary boundary, Gradient gradient,
               std::span<Vec2> slopes);

/// Measures whether a height map tiles. x: root mean square of the height steps from the last column to the first, over the
/// largest root mean square of the steps between two neighbouring columns inside. y: the same for rows. About 1 or less if the
/// map tiles; 0 with fewer than three columns (rows).
Vec2 seamRoughness(int width, int height, std::span<const float> heights);

/// Moments of the slopes of a periodic height field, by the central differences of normalsFromHeights.
struct SlopeVariances {
  double variance_x = 0;  ///< mean of (dh/dx)^2; the mean slope of a periodic field is 0
  double variance_y = 0;
  float steepest = 0;  ///< largest length of (dh/dx, dh/dy)
};
SlopeVariances slopeVariances(int width, int height, std::span<const float> heights);

/// Mean and covariance of the slopes of all texels of a map: as the map says, or computed. Does not depend on the number of
/// threads.
MapSlopes mapSlopes(const NormalMap& map);

}  // namespace glint::bake
