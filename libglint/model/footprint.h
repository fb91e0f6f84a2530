#pragma once

#include <cmath>
#include <cstdint>

#include "glint/math/vec.h"

namespace glint {

/// Symmetric 2x2 covariance, texels^2.
struct Covariance {
  float xx = 0;
  float xy = 0;
  float yy = 0;
};

/// A position in texture space as the centre of a footprint: (u, v) modulo the map, each in [0, 1). What is not finite becomes 0.
///
/// Takes doubles, because far out in a tiled texture floats lose texels: next to 4096 they are half a thousandth of the map apart.
/// A float between 0 and 1 is exact to 3e-8 of the map.
inline GLINT_HD Vec2 wrappedUv(double u, double v) {
  const auto wrapped = [](double x) {
    const double part = x - std::floor(x);
    const auto rounded = static_cast<float>(part);
    return !(part >= 0) ? 0.0f : rounded < 1 ? rounded : float{kBelowOne};
  };
  return {wrapped(u), wrapped(v)};
}

/// The region of texture space that a shading point sees.
///
/// `centre` is a uv; the plane is periodic, so any finite uv is valid (wrappedUv keeps the digits of one far out). Sizes are in
/// texels:
///  - `gaussian`: weights exp(-d^T C^-1 d / 2), normalised to 1, with C = `covariance`;
///  - `box`: the parallelogram centre +- axis_a +- axis_b, texels weighted by their covered area.
struct Footprint {
  enum class Kind : std::uint8_t { gaussian, box };

  Kind kind = Kind::gaussian;
  Vec2 centre;
  Covariance covariance;
  Vec2 axis_a;
  Vec2 axis_b;

  /// Isotropic Gaussian of standard deviation `sigma_texels`. Deviations above 1e15 count as 1e15.
  static GLINT_HD constexpr Footprint isotropic(Vec2 centre_uv, float sigma_texels) {
    constexpr float kLargest = 1e15f;  // its square is finite
    const bool large = sigma_texels > kLargest && sigma_texels <= 0x1.fffffep127f;
    const float variance = large ? kLargest * kLargest : sigma_texels * sigma_texels;
    return gaussian(centre_uv, {variance, 0, variance});
  }

  static GLINT_HD constexpr Footprint gaussian(Vec2 centre_uv, Covariance covariance_texels2) {
    Footprint p;
    p.kind = Kind::gaussian;
    p.centre = centre_uv;
    p.covariance = covariance_texels2;
    return p;
  }

  /// Parallelogram with two half axes. Its `covariance` member holds its second moments.
  static GLINT_HD constexpr Footprint box(Vec2 centre_uv, Vec2 half_axis_a, Vec2 half_axis_b) {
    Footprint p;
    p.kind = Kind::box;
    p.centre = centre_uv;
    p.axis_a = half_axis_a;
    p.axis_b = half_axis_b;
    p.covariance = {secondMoment(half_axis_a.x, half_axis_a.x, half_axis_b.x, half_axis_b.x),
                    secondMoment(half_axis_a.x, half_axis_a.y, half_axis_b.x, half_axis_b.y),
                    secondMoment(half_axis_a.y, half_axis_a.y, half_axis_b.y, half_axis_b.y)};
    return p;
  }

 private:
  /// (a0 a1 + b0 b1) / 3, clamped to 1e30 so that enormous boxes have a finite covariance.
  static GLINT_HD constexpr float secondMoment(float a0, float a1, float b0, float b1) {
    const double moment = (double{a0} * double{a1} + double{b0} * double{b1}) / 3;
    return static_cast<float>(moment > 1e30 ? 1e30 : moment < -1e30 ? -1e30 : moment);
  }
};

}  // namespace glint
