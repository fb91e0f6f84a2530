#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/map_slopes.h"

namespace glint {

/// Mean and covariance of a mixture of distributions of slopes, from the moments of each.
///
/// Sums are of slopes relative to an origin that is near them. So a narrow distribution far from level keeps the digits of its
/// covariance.
class MomentMixture {
 public:
  /// @param origin  a slope near those that are added, such as the first mean
  GLINT_HD explicit MomentMixture(Vec2 origin) : origin_(origin) {}

  /// Adds a distribution. @param weight  >= 0, not normalised
  GLINT_HD void add(float weight, const MapSlopes& slopes) {
    const float x = slopes.mean.x - origin_.x, y = slopes.mean.y - origin_.y;
    const float wx = weight * x, wy = weight * y;
    weight_ += weight;
    mean_.x += wx;
    mean_.y += wy;
    square_.xx += weight * slopes.covariance.xx + wx * x;
    square_.xy += weight * slopes.covariance.xy + wx * y;
    square_.yy += weight * slopes.covariance.yy + wy * y;
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
