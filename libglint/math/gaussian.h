#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/device.h"
#include "glint/math/vec.h"

namespace glint {

inline constexpr float kPi = 3.14159265358979324f;
inline constexpr float kInvSqrt2 = 0.70710678118654752f;

/// Lobes of facets end at this many standard deviations, where they are exp(-5.5^2 / 2) = 2.7e-7 of their peak.
inline constexpr float kLobeReach = 5.5f;

/// Mass of a normal distribution of mean `mean` and deviation `sigma` in [low, high].
inline GLINT_HD float gaussianMass(float low, float high, float mean, float sigma) {
  const float scale = kInvSqrt2 / sigma;
  return 0.5f * (std::erf((high - mean) * scale) - std::erf((low - mean) * scale));
}

/// Quantile of the standard normal distribution, for u in (0, 1); numbers closer to 0 than 2^-25 count as 2^-25. Monotone;
/// relative error below 1e-6 (M. Giles 2012, "Approximating the erfinv function", single precision).
inline GLINT_HD float normalQuantile(float u) {
  const float low = std::max(u, 0x1p-25f);
  const float x = 2 * low - 1;
  float w = -std::log(4 * low * (1 - low));
  float p;
  if (w < 5) {
    constexpr float kCentral[9] = {2.81022636e-08f, 3.43273939e-07f, -3.5233877e-06f, -4.39150654e-06f, 0.00021858087f,
                                   -0.00125372503f, -0.00417768164f, 0.246640727f,    1.50140941f};
    w -= 2.5f;
    p = kCentral[0];
    for (int k = 1; k < 9; ++k) p = kCentral[k] + p * w;
  } else {
    constexpr float kTail[9] = {-0.000200214257f, 0.000100950558f, 0.00134934322f, -0.00367342844f, 0.00573950773f,
                                -0.0076224613f,   0.00943887047f,  1.00167406f,    2.83297682f};
    w = std::sqrt(w) - 3;
    p = kTail[0];
    for (int k = 1; k < 9; ++k) p = kTail[k] + p * w;
  }
  return 1.41421356f * p * x;
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

/// Whether the lobe around a normal can reach `box`: false where the normal is farther than `reach` from it along an axis.
inline GLINT_HD bool near(const Box2& box, Vec2 low, Vec2 high, float reach) {
  return low.x <= box.high.x + reach && high.x >= box.low.x - reach && low.y <= box.high.y + reach &&
         high.y >= box.low.y - reach;
}

}  // namespace glint
