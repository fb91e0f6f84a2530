#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/vec.h"

namespace glint {

/// Direction of the upper hemisphere at a point of [-1, 1]^2: the square is mapped to the disk by concentric squares (Shirley
/// and Chiu 1997) and the disk to the hemisphere, both preserving relative areas. So a regular grid on the square divides the
/// hemisphere into parts of equal solid angle.
inline GLINT_HD Vec3 concentricDirection(Vec2 square) {
  constexpr float kQuarterPi = 0.785398163397448310f;
  const float a = square.x, b = square.y;
  if (a == 0 && b == 0) return {0, 0, 1};
  const bool wide = std::fabs(a) > std::fabs(b);
  const float r = wide ? a : b;
  const float angle = wide ? kQuarterPi * (b / a) : 2 * kQuarterPi - kQuarterPi * (a / b);
  const float sine = r * std::sqrt(std::fmax(0.0f, 2 - r * r));
  return {sine * std::cos(angle), sine * std::sin(angle), 1 - r * r};
}

/// The point of [-1, 1]^2 of a direction: inverse of concentricDirection. Directions below the horizon are put on the border.
inline GLINT_HD Vec2 concentricSquare(Vec3 direction) {
  constexpr float kQuarterPi = 0.785398163397448310f;
  const float r = std::sqrt(std::clamp(1 - direction.z, 0.0f, 1.0f));
  const float x = direction.x, y = direction.y;
  if (x == 0 && y == 0) return {0, 0};
  if (std::fabs(x) > std::fabs(y)) return {std::copysign(r, x), r / kQuarterPi * std::atan(y / std::fabs(x))};
  return {r / kQuarterPi * std::atan(x / std::fabs(y)), std::copysign(r, y)};
}

/// Direction at the centre of cell `index` = row * n + column of the grid of n x n cells on the square.
inline GLINT_HD Vec3 gridDirection(int index, int n) {
  const float scale = 2 / static_cast<float>(n);
  return concentricDirection(
      {(static_cast<float>(index % n) + 0.5f) * scale - 1, (static_cast<float>(index / n) + 0.5f) * scale - 1});
}

/// The four cells whose centres surround a direction, and their bilinear weights. Clamped at the border of the grid.
struct GridPlace {
  int cell[4];
  float weight[4];
};

inline GLINT_HD GridPlace gridPlace(Vec3 direction, int n) {
  const Vec2 square = concentricSquare(direction);
  const float last = static_cast<float>(n - 1);
  const float x = std::clamp((square.x + 1) * 0.5f * static_cast<float>(n) - 0.5f, 0.0f, last);
  const float y = std::clamp((square.y + 1) * 0.5f * static_cast<float>(n) - 0.5f, 0.0f, last);
  const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
  const int x1 = std::min(x0 + 1, n - 1), y1 = std::min(y0 + 1, n - 1);
  const float fx = x - static_cast<float>(x0), fy = y - static_cast<float>(y0);
  return {{y0 * n + x0, y0 * n + x1, y1 * n + x0, y1 * n + x1}, {(1 - fx) * (1 - fy), fx * (1 - fy), (1 - fx) * fy, fx * fy}};
}

}  // namespace glint
