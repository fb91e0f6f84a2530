#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/map_slopes.h"

namespace glint {

/// Mean and covariance of a mixture of distributions of slopes, from the moments of each.
///
/// Sums are of slopes relative to the first mean. So a narrow distribution far from level keeps the digits of its covariance.
class MomentMixture {
 public:
  /// Adds a distribution. @param weight  >= 0, not normalised
  GLINT_HD void add(float weight, const MapSlopes& slopes) {
    if (!(weight > 0)) return;
    if (weight_ == 0) origin_ = slopes.mean;
    const Vec2 m = slopes.mean - origin_;
    const Covariance& c = slopes.covariance;
    weight_ += weight;
    mean_ = mean_ + weight * m;
    square_.xx += weight * (c.xx + m.x * m.x);
    square_.xy += weight * (c.xy + m.x * m.y);
    square_.yy += weight * (c.yy + m.y * m.y);
  }

  /// Moments of all that was added; zeros if nothing was.
  GLINT_HD MapSlopes moments() const {
    if (!(weight_ > 0)) return {};
    const float scale = 1 / weight_;
    const Vec2 m = scale * mean_;
    const float xx = std::max(0.0f, scale * square_.xx - m.x * m.x), yy = std::max(0.0f, scale * square_.yy - m.y * m.y);
    const float most = std::sqrt(xx * yy), xy = scale * square_.xy - m.x * m.y;
    return {origin_ + m, {xx, std::clamp(xy, -most, most), yy}};
  }

 private:
  Vec2 origin_;
  float weight_ = 0;
  Vec2 mean_;
  Covariance square_;
};

}  // namespace glint
