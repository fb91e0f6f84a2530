#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/gaussian.h"
#include "glint/model/footprint.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// A normal distribution on the disk: the normals of one element of a surface, and the roughness of its facets.
class NormalLobe {
 public:
  NormalLobe() = default;
  /// @param sigma  deviation along every axis, > 0
  GLINT_HD NormalLobe(Vec2 mean, float sigma)
      : mean_(mean), spread_{sigma * sigma, 0, sigma * sigma}, inverse_{1 / (sigma * sigma), 0, 1 / (sigma * sigma)} {
    peak_ = 0.5f / kPi * inverse_.xx;
  }
  /// @param covariance  positive definite
  GLINT_HD NormalLobe(Vec2 mean, const Covariance& covariance) : mean_(mean), spread_(covariance) {
    const float determinant = covariance.xx * covariance.yy - covariance.xy * covariance.xy, scale = 1 / determinant;
    inverse_ = {scale * covariance.yy, -scale * covariance.xy, scale * covariance.xx};
    peak_ = 0.5f / (kPi * std::sqrt(determinant));
  }

  GLINT_HD float density(Vec2 h) const {
    const Vec2 d = h - mean_;
    const float power = inverse_.xx * d.x * d.x + 2 * inverse_.xy * d.x * d.y + inverse_.yy * d.y * d.y;
    return power < kLobeReach * kLobeReach ? peak_ * std::exp(-0.5f * power) : 0.0f;
  }

  /// Mass in a box. For a given y the distribution along x is normal; this is summed over y by midpoints.
  GLINT_HD float mass(const Box2& box) const {
    const float sigma_y = std::sqrt(spread_.yy);
    if (spread_.xy == 0)
      return gaussianMass(box.low.x, box.high.x, mean_.x, std::sqrt(spread_.xx)) *
             gaussianMass(box.low.y, box.high.y, mean_.y, sigma_y);
    const float low = std::max(box.low.y, mean_.y - kLobeReach * sigma_y);
    const float high = std::min(box.high.y, mean_.y + kLobeReach * sigma_y);
    if (!(high > low)) return 0;
    const float x_by_y = spread_.xy / spread_.yy;
    const float sigma_x = std::sqrt(std::max(spread_.xx - x_by_y * spread_.xy, 1e-12f * spread_.xx));
    const float step = std::min(0.25f * sigma_y, 0.5f * sigma_x / std::max(std::fabs(x_by_y), 1e-6f));
    const int count = static_cast<int>(std::clamp(std::ceil((high - low) / step), 4.0f, 256.0f));
    const float part = (high - low) / static_cast<float>(count);
    float sum = 0;
    for (int k = 0; k < count; ++k) {
      const float begin = low + part * static_cast<float>(k);
      const float x = mean_.x + x_by_y * (begin + 0.5f * part - mean_.y);
      sum += gaussianMass(begin, begin + part, mean_.y, sigma_y) * gaussianMass(box.low.x, box.high.x, x, sigma_x);
    }
    return sum;
  }

  /// A half vector in proportion to the density.
  GLINT_HD Vec2 sample(Vec2 xi) const {
    const float sigma_y = std::sqrt(spread_.yy), y = normalQuantile(xi.y) * sigma_y;
    const float x_by_y = spread_.xy / spread_.yy;
    const float sigma_x = std::sqrt(std::max(spread_.xx - x_by_y * spread_.xy, 0.0f));
    return mean_ + Vec2{x_by_y * y + normalQuantile(xi.x) * sigma_x, y};
  }

 private:
  Vec2 mean_;
  Covariance spread_;  ///< on the disk
  Covariance inverse_;
  float peak_ = 0;
};

}  // namespace glint
