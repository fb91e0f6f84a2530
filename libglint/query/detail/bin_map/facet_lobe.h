#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/gaussian.h"
#include "glint/model/footprint.h"

namespace glint {

/// The lobe of a facet: a Gaussian minus its value at kReach deviations, so that it ends there without a step, scaled to
/// integrate to 1.
struct FacetLobe {
  static constexpr float kReach = 5;            ///< deviations
  static constexpr float kEnd = 3.7266532e-6f;  ///< exp(-kReach^2 / 2)

  /// @param c  covariance, not singular
  /// @param d  offset from the centre
  static GLINT_HD float density(const Covariance& c, Vec2 d) {
    const float determinant = c.xx * c.yy - c.xy * c.xy;
    const float squared = (c.yy * d.x * d.x - 2 * c.xy * d.x * d.y + c.xx * d.y * d.y) / determinant;
    if (!(squared < kReach * kReach)) return 0;
    return (std::exp(-0.5f * squared) - kEnd) / (2 * kPi * kMass * std::sqrt(determinant));
  }

  /// Radius, in deviations, inside which a round lobe has the share u of its mass.
  static GLINT_HD float radius(float u) {
    // With t = radius^2 / 2, the share is (1 - exp(-t) - kEnd t) / kMass, concave: Newton from the left converges.
    const float wanted = u * kMass, last = 0.5f * kReach * kReach;
    float t = -std::log1p(-std::min(wanted, 1 - kEnd));
    for (int k = 0; k < 6; ++k) {
      const float tail = std::exp(-t);
      t = std::min(t + (wanted - 1 + tail + kEnd * t) / std::max(tail - kEnd, 1e-6f), last);
    }
    return std::sqrt(2 * std::max(t, 0.0f));
  }

  /// What the integral of exp(-r^2 / 2) - kEnd is of that of exp(-r^2 / 2).
  static constexpr float kMass = 1 - kEnd * (1 + 0.5f * kReach * kReach);
};

}  // namespace glint
