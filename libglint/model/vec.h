#pragma once

#include "glint/model/device.h"

namespace glint {

/// A point or vector of the plane: texture space, or the unit disk that holds normals and half vectors.
struct Vec2 {
  float x = 0;
  float y = 0;

  friend GLINT_HD constexpr Vec2 operator+(Vec2 a, Vec2 b) { return {a.x + b.x, a.y + b.y}; }
  friend GLINT_HD constexpr Vec2 operator-(Vec2 a, Vec2 b) { return {a.x - b.x, a.y - b.y}; }
  friend GLINT_HD constexpr Vec2 operator*(float s, Vec2 a) { return {s * a.x, s * a.y}; }
  friend constexpr bool operator==(Vec2, Vec2) = default;
};

GLINT_HD constexpr float dot(Vec2 a, Vec2 b) { return a.x * b.x + a.y * b.y; }

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
