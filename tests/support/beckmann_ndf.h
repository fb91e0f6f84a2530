#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>

#include "glint/model/map_slopes.h"
#include "glint/query/ndf_model.h"

namespace glint::test {

/// The NDF of a surface with normally distributed slopes: the known answer for masking, furnaces and sampling. The same for
/// every footprint. All of it lies inside the disk.
class BeckmannNdf {
 public:
  explicit BeckmannNdf(const MapSlopes& slopes) : slopes_(slopes) {
    const Covariance& c = slopes.covariance;
    determinant_ = double{c.xx} * c.yy - double{c.xy} * c.xy;
  }

  float density(const Footprint&, Vec2 h) const { return static_cast<float>(exactDensity(h.x, h.y)); }

  /// By quadrature on a lattice of 64 x 64 points: for smooth densities.
  float mean(const Footprint&, const Box2& range) const {
    if (!(range.width() > 0 && range.height() > 0)) return 0;
    constexpr int kPoints = 64;
    double sum = 0;
    for (int j = 0; j < kPoints; ++j)
      for (int i = 0; i < kPoints; ++i)
        sum += exactDensity(range.low.x + double{range.width()} * (i + 0.5) / kPoints,
                            range.low.y + double{range.height()} * (j + 0.5) / kPoints);
    return static_cast<float>(sum / (kPoints * kPoints));
  }

  HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    const double r = std::sqrt(-2 * std::log1p(-double{xi.x})), angle = 2 * std::numbers::pi * xi.y;
    const double a = r * std::cos(angle), b = r * std::sin(angle), lower = std::sqrt(double{slopes_.covariance.xx});
    const double p1 = slopes_.mean.x + lower * a;
    const double q1 = slopes_.mean.y + slopes_.covariance.xy / lower * a + std::sqrt(determinant_) / lower * b;
    const double scale = -1 / std::sqrt(1 + p1 * p1 + q1 * q1);
    const Vec2 h = {static_cast<float>(scale * p1), static_cast<float>(scale * q1)};
    return {h, density(p, h)};
  }

 private:
  double exactDensity(double x, double y) const {
    const double square = 1 - x * x - y * y;
    if (!(square > 0)) return 0;
    const double scale = -1 / std::sqrt(square), p = scale * x - slopes_.mean.x, q = scale * y - slopes_.mean.y;
    const Covariance& c = slopes_.covariance;
    const double exponent = (c.yy * p * p - 2 * c.xy * p * q + c.xx * q * q) / determinant_;
    return std::exp(-0.5 * exponent) / (2 * std::numbers::pi * std::sqrt(determinant_) * square * square);
  }

  MapSlopes slopes_;
  double determinant_;
};

static_assert(NdfModel<BeckmannNdf>);

}  // namespace glint::test
