#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "glint/math/gaussian.h"
#include "glint/math/rgb.h"
#include "glint/math/tangents.h"
#include "glint/math/vec.h"

namespace glint {

/// A lobe of radiance on the sphere: L(w) = amplitude exp(sharpness (w . axis - 1)).
struct SphericalGaussian {
  Vec3 axis = {0, 0, 1};  ///< unit vector, tangent frame of the shading point
  float sharpness = 1;    ///< lambda, > 0; the deviation per axis is about 1 / sqrt(lambda) radians
  Rgb amplitude;          ///< radiance along the axis
};

/// A view of the lobes that light a scene together. The lobes must outlive the view.
struct SphericalGaussians {
  const SphericalGaussian* lobes = nullptr;
  std::size_t count = 0;
};

/// Whether a lobe is valid: finite, sharpness in (0, 1e10), axis a unit vector to 1e-3. Other lobes give no light.
inline GLINT_HD bool isUsable(const SphericalGaussian& g) {
  const float length2 = dot(g.axis, g.axis);
  return g.sharpness > 0 && g.sharpness < 1e10f && length2 > 0.998f && length2 < 1.002f;
}

/// Value of a lobe of amplitude 1.
inline GLINT_HD float valueOf(const SphericalGaussian& g, Vec3 w) {
  const Vec3 d = w - g.axis;  // 1 - w . axis = |d|^2 / 2, which keeps its digits in narrow lobes
  return std::exp(-0.5f * g.sharpness * dot(d, d));
}

/// Integral of a lobe of amplitude 1 over the sphere: 2 pi (1 - exp(-2 lambda)) / lambda.
inline GLINT_HD float integralOf(const SphericalGaussian& g) { return -2 * kPi * std::expm1(-2 * g.sharpness) / g.sharpness; }

/// Radiance of all lobes along a direction.
inline GLINT_HD Rgb radianceAlong(const SphericalGaussians& lights, Vec3 w) {
  Rgb sum;
  for (std::size_t k = 0; k < lights.count; ++k)
    if (isUsable(lights.lobes[k])) sum = sum + valueOf(lights.lobes[k], w) * lights.lobes[k].amplitude;
  return sum;
}

/// Angle from the axis at which a lobe falls to epsilon: its compact-epsilon support (Deng 2022, Eq. 8; their epsilon is 0.3).
/// @param amplitude  A; with 1, epsilon is a share of the peak and the angle does not depend on the unit of radiance
/// @return radians, in [0, pi]: 0 where the peak is below epsilon, pi where the whole sphere is above it
inline GLINT_HD float compactSupport(float amplitude, float sharpness, float epsilon = 0.3f) {
  const float cosine = std::log(epsilon / amplitude) / sharpness + 1;
  return cosine == cosine ? std::acos(std::clamp(cosine, -1.0f, 1.0f)) : 0.0f;
}

/// Side of the square of the disk over which Deng 2022 average for a lobe, disk units. Their Eq. 9 gives Q, and they use Q / 2
/// of 256 pixels that span 2 disk units: 2 theta / pi.
inline GLINT_HD float supportSide(float support_angle) { return 2 * support_angle / kPi; }

/// The direction at a point p of Lambert's equal-area map of the sphere around an axis: |p| = 2 sin(angle / 2). On this map a
/// spherical Gaussian is exactly a normal distribution of deviation 1 / sqrt(lambda), cut off at |p| = 2.
inline GLINT_HD Vec3 directionAt(const SphericalGaussian& g, const Tangents& frame, Vec2 p) {
  const float r2 = std::min(dot(p, p), 4.0f), scale = std::sqrt(1 - 0.25f * r2);
  return (scale * p.x) * frame.s + (scale * p.y) * frame.t + (1 - 0.5f * r2) * g.axis;
}

/// Draws a direction in proportion to a lobe.
/// @param xi  in [0, 1)^2
inline GLINT_HD Vec3 sampleDirection(const SphericalGaussian& g, Vec2 xi) {
  const float r2 = -2 / g.sharpness * std::log1p(xi.x * std::expm1(-2 * g.sharpness));
  const float r = std::sqrt(std::clamp(r2, 0.0f, 4.0f)), angle = 2 * kPi * xi.y;
  return directionAt(g, tangentsOf(g.axis), {r * std::cos(angle), r * std::sin(angle)});
}

}  // namespace glint
