#pragma once

#include "glint/math/vec.h"

namespace glint {

/// Three colour channels: a reflectance, a radiance, or one parameter of a material for each.
struct Rgb {
  float r = 0;
  float g = 0;
  float b = 0;

  static GLINT_HD constexpr Rgb grey(float value) { return {value, value, value}; }

  friend GLINT_HD constexpr Rgb operator+(Rgb x, Rgb y) { return {x.r + y.r, x.g + y.g, x.b + y.b}; }
  friend GLINT_HD constexpr Rgb operator*(Rgb x, Rgb y) { return {x.r * y.r, x.g * y.g, x.b * y.b}; }
  friend GLINT_HD constexpr Rgb operator*(float s, Rgb a) { return {s * a.r, s * a.g, s * a.b}; }
  friend constexpr bool operator==(Rgb, Rgb) = default;
};

inline GLINT_HD Rgb finitePositive(Rgb c) { return {finitePositive(c.r), finitePositive(c.g), finitePositive(c.b)}; }

/// Brightness of linear Rec. 709 colours.
GLINT_HD constexpr float luminance(Rgb c) { return 0.2126f * c.r + 0.7152f * c.g + 0.0722f * c.b; }

}  // namespace glint
