#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/gaussian.h"
#include "glint/math/vec.h"

namespace glint {

/// The GTR distribution of normals (Burley 2012), which Atanasov 2021 draw metallic flakes from (Fig. 1: gamma 1.5, alpha
/// .002).
///
///   D(h) = c / (alpha^2 cos^2 + sin^2)^gamma,  gamma 2 is GGX
///
/// per unit projected area, as every density here; over slopes r = tan it is c (1 + r^2)^(gamma - 2) / (alpha^2 + r^2)^gamma.
struct GtrDistribution {
  float gamma = 2;     ///< exponent, kLeastGamma to kMostGamma
  float alpha = 0.1f;  ///< roughness, kLeastAlpha to kMostAlpha

  static constexpr float kLeastGamma = 0.1f, kMostGamma = 4, kLeastAlpha = 1e-4f, kMostAlpha = 0.999f;

  /// The constant c, with which D integrates to 1 over the disk.
  GLINT_HD double scale() const {
    const double a2 = double{alpha} * double{alpha}, g = double{gamma} - 1;
    const double mass = std::fabs(g) < 1e-4 ? -std::log(a2) : (std::pow(a2, -g) - 1) / g;
    return (1 - a2) / (3.14159265358979323846 * mass);
  }

  /// D towards a half vector of the disk; 0 outside.
  GLINT_HD float density(Vec2 h) const {
    const double sine2 = dot(h, h);
    if (!(sine2 < 1)) return 0;
    const double a2 = double{alpha} * double{alpha};
    return static_cast<float>(scale() / std::pow(a2 + (1 - a2) * sine2, double{gamma}));
  }

  /// Density of the slopes r, for each unit of area of the plane of slopes.
  GLINT_HD double slopeDensity(double r) const {
    const double a2 = double{alpha} * double{alpha}, r2 = r * r;
    return scale() * std::pow(1 + r2, double{gamma} - 2) / std::pow(a2 + r2, double{gamma});
  }
};

/// Shadowing and masking of a surface whose normals follow a GTR distribution: G_x of Atanasov 2021, section 6, where Smith's
/// term is that of the flakes' distribution (Dimov 2015). Has what SmithMasking has, and takes its place in BasicBinMapBrdf.
///
/// GTR slopes have so long a tail that their variance is infinite: a normal distribution of the same variance, which
/// SmithMasking takes, shadows far more than flakes do. The area that facets turn towards w is A(w) = cos + sin T(cot), with
/// T(m) = E[max(0, q - m)] over slopes q along the azimuth. T is computed once, by quadrature, at kNodes values of m that are
/// even in log(1 + m / alpha); between these its logarithm is a cubic: within 2e-3 of the quadrature.
///
/// Directions are unit vectors with w.z > 0. Allocates nothing; 520 bytes.
class GtrMasking {
 public:
  /// @param flakes  parameters out of range are clamped; NaN counts as the smallest
  GLINT_HD explicit GtrMasking(GtrDistribution flakes) : flakes_(inRange(flakes)) {
    for (int k = 0; k < kNodes; ++k) {
      const double m = double{flakes_.alpha} * std::expm1(kStep * k);
      logs_[k] = static_cast<float>(std::log(excess(m) * (m + double{flakes_.alpha})));
    }
  }

  GLINT_HD const GtrDistribution& flakes() const { return flakes_; }

  /// Facet area that faces w, projected along w, over the area of the surface: cos / G1, in [w.z, ...), finite.
  GLINT_HD float projectedArea(Vec3 w) const {
    const float sine = std::sqrt(w.x * w.x + w.y * w.y);
    return sine > 0 ? w.z + sine * meanExcess(w.z / sine) : w.z;
  }

  /// Facet area that is hidden from w over the area that is seen, >= 0.
  GLINT_HD float lambda(Vec3 w) const { return projectedArea(w) / w.z - 1; }

  /// Share of the facets facing w that w sees, in (0, 1].
  GLINT_HD float g1(Vec3 w) const { return w.z / projectedArea(w); }

  /// Share of facets that both directions see, with heights correlated: 1 / (1 + Lambda(i) + Lambda(o)).
  GLINT_HD float g2(Vec3 wi, Vec3 wo) const { return 4 * wi.z * wo.z * visibility(wi, wo); }

  /// g2 / (4 wi.z wo.z), without a division by a cosine.
  GLINT_HD float visibility(Vec3 wi, Vec3 wo) const {
    return 0.25f / (projectedArea(wi) * wo.z + projectedArea(wo) * wi.z - wi.z * wo.z);
  }

  /// T(m) by quadrature, exact to 1e-5 of it: E[max(0, q - m)] is the integral of 2 y p(r) (y - m atan(y / m)) dy over the
  /// slopes r^2 = m^2 + y^2, summed over even steps of log y.
  GLINT_HD double excess(double m) const {
    constexpr double kLogStep = 0.05, kLeast = 1e-5, kMost = 1e7;
    const double first = std::log(kLeast * double{flakes_.alpha});
    const int count = static_cast<int>((std::log(kMost) - first) / kLogStep);
    double sum = 0;
    for (int k = 0; k <= count; ++k) {
      const double y = std::exp(first + kLogStep * k), turned = y / std::max(m, 1e-300);
      // y - m atan(y / m), which loses its digits where y is small.
      const double rise =
          turned < 0.01 ? m * turned * turned * turned * (1.0 / 3 - turned * turned / 5) : y - m * std::atan2(y, m);
      sum += 2 * y * y * flakes_.slopeDensity(std::sqrt(m * m + y * y)) * rise;
    }
    return kLogStep * sum;
  }

 private:
  static constexpr int kNodes = 128;
  static constexpr double kStep = 0.18;  ///< of log(1 + m / alpha); the last node is beyond 1e5

  static GLINT_HD GtrDistribution inRange(GtrDistribution g) {
    using G = GtrDistribution;
    const auto clamped = [](float x, float low, float high) { return x > low ? std::min(x, high) : low; };
    return {clamped(g.gamma, float{G::kLeastGamma}, float{G::kMostGamma}),
            clamped(g.alpha, float{G::kLeastAlpha}, float{G::kMostAlpha})};
  }

  GLINT_HD float meanExcess(float m) const {
    const float place = std::min(std::log1p(m / flakes_.alpha) / static_cast<float>(kStep), static_cast<float>(kNodes - 1));
    const int k = std::min(static_cast<int>(place), kNodes - 2);
    const float t = place - static_cast<float>(k);
    // Catmull and Rom's cubic; before the first node and beyond the last one the course is that of a parabola and of a line.
    const float low = logs_[k], high = logs_[k + 1];
    const float after = k + 2 < kNodes ? logs_[k + 2] : 2 * high - low;
    const float before = k > 0 ? logs_[k - 1] : 3 * (low - high) + after;
    const float rise = high - low, at_low = 0.5f * (high - before), at_high = 0.5f * (after - low);
    const float log = low + t * (at_low + t * (3 * rise - 2 * at_low - at_high + t * (at_low + at_high - 2 * rise)));
    return std::exp(log) / (m + flakes_.alpha);
  }

  GtrDistribution flakes_;
  float logs_[kNodes];  ///< logarithm of T(m) (m + alpha)
};

}  // namespace glint
