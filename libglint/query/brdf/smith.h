#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/gaussian.h"
#include "glint/model/map_slopes.h"

namespace glint {

/// Shadowing and masking of a surface whose slopes are normally distributed (Smith; for a mean of 0 the Lambda of Beckmann, of
/// any anisotropy).
///
/// Everything follows from the area that facets turn towards a direction w, projected along it, for each unit of the surface:
/// A(w) = E[max(0, w . (-p, -q, 1))] over slopes (p, q). The product is a normal variable, and A is finite down to the horizon:
/// G1 = w.z / A, Lambda = A / w.z - 1. Where facets lean away so far that A < w.z (only with a mean slope that is not 0) A
/// counts as w.z, so that nothing is made brighter than unshadowed. Directions are unit vectors with w.z > 0.
class SmithMasking {
 public:
  /// @param slopes   of the map: api::OpenedNdf::slopes of any asset, or PyramidShape::slopes
  /// @param sigma_r  intrinsic roughness of the facets: adds sigma_r^2 to both variances, which is exact for level facets
  GLINT_HD SmithMasking(const MapSlopes& slopes, float sigma_r) : mean_(slopes.mean), covariance_(slopes.covariance) {
    covariance_.xx += sigma_r * sigma_r;
    covariance_.yy += sigma_r * sigma_r;
  }

  /// Facet area that faces w, projected along w, over the area of the surface: cos / G1, in [w.z, ...), finite.
  GLINT_HD float projectedArea(Vec3 w) const {
    const float mean = w.z - w.x * mean_.x - w.y * mean_.y;
    const float variance = w.x * w.x * covariance_.xx + 2 * w.x * w.y * covariance_.xy + w.y * w.y * covariance_.yy;
    const float sigma = std::sqrt(std::max(variance, float{kSmallestVariance}));
    const float a = mean / sigma;
    const float area = 0.5f * mean * (1 + std::erf(kInvSqrt2 * a)) + kInvSqrt2Pi * sigma * std::exp(-0.5f * a * a);
    return std::max(area, w.z);
  }

  /// Facet area that is hidden from w over the area that is seen, >= 0.
  GLINT_HD float lambda(Vec3 w) const { return projectedArea(w) / w.z - 1; }

  /// Share of the facets facing w that w sees, in (0, 1].
  GLINT_HD float g1(Vec3 w) const { return w.z / projectedArea(w); }

  /// Share of facets that both directions see, with heights correlated: 1 / (1 + Lambda(i) + Lambda(o)) (Heitz 2014, Eq. 99).
  /// At most the smaller G1.
  GLINT_HD float g2(Vec3 wi, Vec3 wo) const { return 4 * wi.z * wo.z * visibility(wi, wo); }

  /// g2 / (4 wi.z wo.z), without a division by a cosine.
  GLINT_HD float visibility(Vec3 wi, Vec3 wo) const {
    return 0.25f / (projectedArea(wi) * wo.z + projectedArea(wo) * wi.z - wi.z * wo.z);
  }

 private:
  static constexpr float kInvSqrt2Pi = 0.398942280401432678f;
  static constexpr float kSmallestVariance = 1e-12f;  ///< a flat surface without roughness still divides by its deviation

  Vec2 mean_;
  Covariance covariance_;
};

}  // namespace glint
