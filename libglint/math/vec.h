#pragma once

#include <cstddef>

#include "glint/math/device.h"

namespace glint {

/// The largest number below 1.
inline constexpr float kBelowOne = 0x1.fffffep-1f;

/// A sum as an answer that cannot be negative: infinities, negative numbers and NaN become 0. Opening a file does not check its
/// numbers, so sums of them may be any of these.
inline GLINT_HD float finitePositive(float x) { return x > 0 && x <= 0x1.fffffep127f ? x : 0.0f; }

/// Index of element (column, row) in an array whose rows have `columns` elements. None may be negative.
GLINT_HD constexpr std::size_t rowMajorIndex(int column, int row, int columns) {
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
}

/// A point or vector of texture space, or of the unit disk of normals and half vectors.
struct Vec2 {
  float x = 0;
  float y = 0;

  friend GLINT_HD constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
  friend GLINT_HD constexpr Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
  friend GLINT_HD constexpr Vec2 operator*(float s, Vec2 a) { return {s * a.x, s * a.y}; }
  friend constexpr bool operator==(Vec2, Vec2) = default;
};

GLINT_HD constexpr float dot(Vec2 a, Vec2 b) { return a.x * b.x + a.y * b.y; }

/// A direction of the tangent frame: x along dp/du, y along dp/dv, z out of the surface.
struct Vec3 {
  float x = 0;
  float y = 0;
  float z = 0;

  friend GLINT_HD constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend GLINT_HD constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend GLINT_HD constexpr Vec3 operator*(float s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
  friend constexpr bool operator==(Vec3, Vec3) = default;
};

GLINT_HD constexpr float dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// Axis-aligned box [low.x, high.x] x [low.y, high.y].
struct Box2 {
  Vec2 low;
  Vec2 high;

  GLINT_HD constexpr float width() const { return high.x - low.x; }
  GLINT_HD constexpr float height() const { return high.y - low.y; }
  GLINT_HD constexpr float area() const { return width() * height(); }
  friend constexpr bool operator==(Box2, Box2) = default;
};

}  // namespace glint
