#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/footprint.h"
#include "glint/query/brdf/gtr.h"

namespace glint {

/// The GTR lobe of a facet: the distribution of a level facet (GtrDistribution), moved to the facet's normal, as FacetLobe is.
/// It ends at the distance 1 from the normal, where the lobe of a level facet meets the rim of the disk, and integrates to 1.
///
/// Its tail is so long that no facet is out of reach: of gamma 1.5 and alpha .002, .02 of the mass is farther than .1 from the
/// normal. Many facets as one (a mean and a covariance) count as four facets of the same mean and covariance.
class GtrLobe {
 public:
  /// No lobe: `given` is false.
  GtrLobe() = default;
  /// @param of  parameters in range (GtrMasking::inRange)
  GLINT_HD explicit GtrLobe(GtrDistribution of)
      : gamma_(of.gamma),
        width2_(of.alpha * of.alpha),
        steep_(1 / width2_ - 1),
        peak_(static_cast<float>(of.scale() / std::pow(double{of.alpha}, 2 * double{of.gamma}))) {}

  GLINT_HD bool given() const { return gamma_ > 0; }
  GLINT_HD float gamma() const { return gamma_; }
  /// Density at the normal itself.
  GLINT_HD float peak() const { return peak_; }
  /// Factor k of the squared distance in peak (1 + k d^2)^-gamma.
  GLINT_HD float steepness() const { return steep_; }
  /// Square of the distance over which the lobe changes much, at a squared distance from the normal.
  GLINT_HD float squaredWidth(float squared_distance) const { return width2_ + squared_distance; }

  /// Density at an offset from the normal.
  GLINT_HD float density(Vec2 d) const {
    const float squared = dot(d, d);
    return squared < 1 ? peak_ * std::pow(1 + steep_ * squared, -gamma_) : 0.0f;
  }
  /// Density at an offset from the mean normal of facets of this covariance.
  GLINT_HD double density(const Covariance& spread, Vec2 d) const {
    return meanOver(spread, [&](Vec2 moved) { return double{density(d - moved)}; });
  }

  /// Mass within a radius of the normal.
  GLINT_HD double massWithin(double radius) const {
    return radius < 1 ? bent(std::log1p(double{steep_} * radius * radius)) / bent(-std::log(double{width2_})) : 1.0;
  }
  /// Radius within which the lobe has the share u of its mass, at most 1.
  GLINT_HD float radius(float u) const {
    const double wanted = double{u} * bent(-std::log(double{width2_})), g = double{gamma_} - 1;
    const double log = std::fabs(g) < kStraight ? wanted : -std::log1p(-g * wanted) / g;
    return std::min(1.0f, static_cast<float>(std::sqrt(std::max(0.0, std::expm1(log) / double{steep_}))));
  }

  /// Mass in a box, given from the mean normal of facets of this covariance.
  GLINT_HD double mass(const Covariance& spread, const Box2& box) const {
    return meanOver(spread, [&](Vec2 moved) { return mass({box.low - moved, box.high - moved}); });
  }

  /// Mass in a box, given from the normal: within 1e-4, and 3e-3 of it.
  GLINT_HD double mass(const Box2& box) const {
    const Vec2 middle = 0.5f * (box.low + box.high), half = 0.5f * (box.high - box.low);
    if (dot(half, half) < kTiny * squaredWidth(dot(middle, middle))) return double{box.area()} * double{density(middle)};
    if (dot(half, half) < kSmall * squaredWidth(dot(middle, middle))) return massOfSmall(middle, half);
    const double x0 = double{box.low.x}, x1 = double{box.high.x}, y0 = double{box.low.y}, y1 = double{box.high.y};
    return (side(x1, y0, y1) - side(x0, y0, y1) + side(y1, x0, x1) - side(y0, x0, x1)) / (2 * kPi64);
  }

 private:
  static constexpr double kPi64 = 3.14159265358979323846;
  static constexpr double kStraight = 1e-4;  ///< gamma - 1 below which a power counts as a logarithm
  /// Square of half a box's diagonal over the lobe's squared width, for nine points and for one: gamma^2 kTiny / 3 is the error.
  static constexpr float kSmall = 0.1f, kTiny = 5e-4f;

  /// (1 - exp(-(gamma - 1) x)) / (gamma - 1): the integral of the lobe, in x = log(1 + k d^2).
  GLINT_HD double bent(double x) const {
    const double g = double{gamma_} - 1;
    return std::fabs(g) < kStraight ? x : -std::expm1(-g * x) / g;
  }

  /// Mean of f over four points of a covariance.
  template <class F>
  static GLINT_HD double meanOver(const Covariance& spread, F&& f) {
    if (spread.xx == 0 && spread.yy == 0) return f(Vec2{0, 0});
    const float x = std::sqrt(spread.xx), along = x > 0 ? spread.xy / x : 0;
    const float across = std::sqrt(std::max(0.0f, spread.yy - along * along));
    return 0.25 * (f(Vec2{x, along + across}) + f(Vec2{-x, across - along}) + f(Vec2{x, along - across}) +
                   f(Vec2{-x, -along - across}));
  }

  /// Gauss and Legendre's rule of three points along each axis.
  GLINT_HD double massOfSmall(Vec2 middle, Vec2 half) const {
    constexpr float kPlaces[3] = {-0.77459667f, 0, 0.77459667f}, kWeights[3] = {5.0f / 18, 8.0f / 18, 5.0f / 18};
    double sum = 0;
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i)
        sum += double{kWeights[i] * kWeights[j]} * double{density(middle + Vec2{kPlaces[i] * half.x, kPlaces[j] * half.y})};
    return 4 * double{half.x} * double{half.y} * sum;
  }

  /// Integral of massWithin(r) over the angle that a side of a box, x = const, covers as seen from the normal. With
  /// y = |x| sinh(s) the angle has the density 1 / cosh(s), and r = |x| cosh(s).
  GLINT_HD double side(double x, double from, double to) const {
    constexpr double kPlaces[3] = {0.238619186083197, 0.661209386466265, 0.932469514203152};
    constexpr double kWeights[3] = {0.467913934572691, 0.360761573048139, 0.171324492379170};
    constexpr double kPanel = 1.5;
    const double distance = std::fabs(x);
    if (!(distance > 1e-12)) return 0;
    const double begin = std::asinh(from / distance), end = std::asinh(to / distance);
    const int panels = std::max(1, static_cast<int>(std::ceil((end - begin) / kPanel)));
    const double half = 0.5 * (end - begin) / panels;
    double sum = 0;
    const auto add = [&](double s, double weight) {
      const double cosh = std::cosh(s);
      sum += weight * massWithin(distance * cosh) / cosh;
    };
    for (int k = 0; k < panels; ++k) {
      const double middle = begin + (2 * k + 1) * half;
      for (int n = 0; n < 3; ++n) add(middle - kPlaces[n] * half, kWeights[n]), add(middle + kPlaces[n] * half, kWeights[n]);
    }
    return x > 0 ? half * sum : -half * sum;
  }

  float gamma_ = 0;
  float width2_ = 1;  ///< alpha^2
  float steep_ = 0;
  float peak_ = 0;
};

}  // namespace glint
