#pragma once

#include <cmath>

#include "glint/model/device.h"
#include "glint/model/vec.h"

namespace glint {

inline constexpr float kPi = 3.14159265358979324f;
inline constexpr float kInvSqrt2 = 0.70710678118654752f;

/// A facet's lobe is cut off this many standard deviations away: exp(-5.5^2 / 2) = 2.7e-7 of its peak.
inline constexpr float kLobeReach = 5.5f;

/// Mass of a normal distribution of mean `mean` and deviation `sigma` in [low, high].
inline GLINT_HD float gaussianMass(float low, float high, float mean, float sigma) {
  const float scale = kInvSqrt2 / sigma;
  return 0.5f * (std::erf((high - mean) * scale) - std::erf((low - mean) * scale));
}

/// Isotropic 2D normal density at offset `d` from its mean.
inline GLINT_HD float gaussianDensity(Vec2 d, float sigma) {
  const float inverse_variance = 1 / (sigma * sigma);
  return std::exp(-0.5f * inverse_variance * dot(d, d)) * inverse_variance * (0.5f / kPi);
}

/// Mass of the lobe of a facet (isotropic normal distribution around `normal`) inside a box of the disk.
inline GLINT_HD float lobeMass(const Box2& box, Vec2 normal, float sigma) {
  return gaussianMass(box.low.x, box.high.x, normal.x, sigma) * gaussianMass(box.low.y, box.high.y, normal.y, sigma);
}

/// Whether the lobe of any normal within `reach` of `box` can matter: false means that it is farther away on some axis.
inline GLINT_HD bool near(const Box2& box, Vec2 low, Vec2 high, float reach) {
  return low.x <= box.high.x + reach && high.x >= box.low.x - reach && low.y <= box.high.y + reach &&
         high.y >= box.low.y - reach;
}

}  // namespace glint
