#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/gaussian.h"
#include "glint/model/map_slopes.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// A distribution of normals whose slopes are normally distributed: an anisotropic Beckmann lobe around any mean normal.
///
/// With slopes s(h) = -h / h.z, the density per unit projected area is P(s(h)) / h.z^4, P being the normal density of slopes.
/// It integrates to 1 over the disk.
class SlopeLobe {
 public:
  /// @param slopes   mean and covariance of slopes
  /// @param sigma_r  intrinsic roughness of the facets, disk units. It is carried to slopes at the mean normal n: with the
  ///                 Jacobian J = ds/dh = -(I + m m^T) / n.z of slopes m, it adds sigma_r^2 J J^T to the covariance
  GLINT_HD SlopeLobe(const MapSlopes& slopes, float sigma_r) : mean_(slopes.mean) {
    const double mx = mean_.x, my = mean_.y, square = mx * mx + my * my;
    const double variance = double{sigma_r} * double{sigma_r} * (1 + square), twice = 2 + square;
    const double xx = std::max(0.0, double{slopes.covariance.xx}) + variance * (1 + twice * mx * mx) + kSmallest;
    const double yy = std::max(0.0, double{slopes.covariance.yy}) + variance * (1 + twice * my * my) + kSmallest;
    const double xy = double{slopes.covariance.xy} + variance * twice * mx * my;
    const double determinant = std::max(xx * yy - xy * xy, kSmallest * std::max(xx, yy));
    inverse_ = {static_cast<float>(yy / determinant), static_cast<float>(-xy / determinant),
                static_cast<float>(xx / determinant)};
    peak_ = static_cast<float>(0.5 / (double{kPi} * std::sqrt(determinant)));
    sigma_y_ = static_cast<float>(std::sqrt(yy));
    x_by_y_ = static_cast<float>(xy / yy);
    sigma_x_given_y_ = static_cast<float>(std::sqrt(determinant / yy));
  }

  /// Density towards h, >= 0; 0 outside the disk.
  GLINT_HD float density(Vec2 h) const {
    const float z2 = 1 - dot(h, h);
    if (!(z2 > 0)) return 0;
    const float scale = -1 / std::sqrt(z2);
    const float dx = scale * h.x - mean_.x, dy = scale * h.y - mean_.y;
    const float power = inverse_.xx * dx * dx + 2 * inverse_.xy * dx * dy + inverse_.yy * dy * dy;
    return finitePositive(peak_ * std::exp(-0.5f * power) / (z2 * z2));
  }

  /// Mass in a box of the disk, in [0, 1], to about 1e-4 (3e-3 for boxes much larger than a lobe that is narrow along a diagonal).
  ///
  /// For a given slope q along v, slopes along u are normally distributed, and the box allows at most two intervals of them.
  /// This is integrated over q by Gauss-Legendre panels that end where the corners of the box are.
  GLINT_HD float mass(const Box2& range) const {
    const Box2 box = insideSquare(range);
    if (!(box.width() > 0 && box.height() > 0)) return 0;
    float ends[kMostEnds];
    const int count = panelEnds(box, ends);
    double sum = 0;
    for (int k = 0; k + 1 < count; ++k) sum += integral(box, ends[k], ends[k + 1]);
    return std::min(1.0f, finitePositive(static_cast<float>(sum)));
  }

  /// Half vector with probability density `density`: slopes from the quantiles of xi.
  GLINT_HD HalfVectorSample sample(Vec2 xi) const {
    xi = clampUnit(xi);
    const float y = normalQuantile(xi.y) * sigma_y_;
    const float p = mean_.x + x_by_y_ * y + normalQuantile(xi.x) * sigma_x_given_y_, q = mean_.y + y;
    const float scale = -1 / std::sqrt(1 + p * p + q * q);
    const Vec2 h = {scale * p, scale * q};
    return drawnAt(h, density(h));
  }

 private:
  static constexpr double kSmallest = 1e-12;  ///< variance of a perfect mirror, so that its lobe has a width
  static constexpr float kPanel = 1.5f;       ///< longest panel, in deviations of what varies along it
  static constexpr int kMostPanels = 128;     ///< between two corners

  /// Slope along v at a point of the disk; infinite outside it.
  static GLINT_HD float slopeY(float x, float y) {
    const float z2 = 1 - x * x - y * y;
    if (y == 0) return 0;
    return z2 > 0 ? -y / std::sqrt(z2) : y > 0 ? -kInfinite : kInfinite;
  }

  static constexpr int kEdgeEnds = 7;
  static constexpr int kMostEnds = 6 + 2 * kEdgeEnds;

  /// Slopes q, in order, at which panels end: where the box has corners or turns, cut to the reach of the lobe. Between them also
  /// where the lower and the upper edge of the box cross the lobe, since slopes along u change fast there.
  GLINT_HD int panelEnds(const Box2& box, float (&ends)[kMostEnds]) const {
    const float reach_low = mean_.y - kLobeReach * sigma_y_, reach_high = mean_.y + kLobeReach * sigma_y_;
    float low = kInfinite, high = -kInfinite;
    int count = 0;
    const auto add = [&](float q) {
      int k = count++;
      for (; k > 0 && ends[k - 1] > q; --k) ends[k] = ends[k - 1];
      ends[k] = q;
    };
    const auto addCorner = [&](float x, float y) {
      const float q = std::clamp(slopeY(x, y), reach_low, reach_high);
      low = std::min(low, q), high = std::max(high, q);
      add(q);
    };
    for (const float y : {box.low.y, box.high.y}) {
      addCorner(box.low.x, y);
      addCorner(box.high.x, y);
      if (box.low.x < 0 && box.high.x > 0) addCorner(0, y);
    }
    for (const float y : {box.low.y, box.high.y}) {
      if (y == 0 || !(std::fabs(y) < 1)) continue;
      const float upright = -y / std::sqrt(1 - y * y);  // q where p is 0
      const auto along = [&](float p) { return upright * std::sqrt(1 + p * p); };
      const float middle = mean_.x + x_by_y_ * (along(mean_.x) - mean_.y);
      for (const float deviations : {-5.0f, -2.5f, -1.0f, 0.0f, 1.0f, 2.5f, 5.0f}) {
        const float q = along(middle + deviations * sigma_x_given_y_);
        if (q > low && q < high) add(q);
      }
    }
    return count;
  }

  /// Gauss-Legendre points on [-1, 1], and their weights.
  struct Rule {
    int count;
    float node[5], weight[5];
  };

  /// The rule for a panel of this length, in units of the longest.
  static GLINT_HD Rule ruleFor(float length) {
    if (length < 0.1f) return {2, {-0.5773502691896258f, 0.5773502691896258f}, {1, 1}};
    if (length < 0.5f) {
      return {
          3, {-0.7745966692414834f, 0, 0.7745966692414834f}, {0.5555555555555556f, 0.8888888888888889f, 0.5555555555555556f}};
    }
    return {5,
            {-0.9061798459386640f, -0.5384693101056831f, 0, 0.5384693101056831f, 0.9061798459386640f},
            {0.2369268850561891f, 0.4786286704993665f, 0.5688888888888889f, 0.4786286704993665f, 0.2369268850561891f}};
  }

  GLINT_HD double integral(const Box2& box, float low, float high) const {
    if (!(high > low)) return 0;
    // Where the lobe is narrow along a diagonal, intervals of p move past it within a short way along q.
    const float turn = std::fabs(x_by_y_) * sigma_y_;
    const float longest = kPanel * sigma_y_ * std::min(1.0f, sigma_x_given_y_ / std::max(turn, 1e-20f));
    // One panel where damaged moments leave no number: fmax takes the other one.
    const int panels =
        static_cast<int>(std::fmin(std::fmax(std::ceil((high - low) / longest), 1.0f), static_cast<float>(kMostPanels)));
    const float half = 0.5f * (high - low) / static_cast<float>(panels);
    const Rule rule = ruleFor(2 * half / longest);
    double sum = 0;
    for (int k = 0; k < panels; ++k) {
      const float middle = low + half * static_cast<float>(2 * k + 1);
      for (int n = 0; n < rule.count; ++n) {
        const float q = middle + half * rule.node[n], z = (q - mean_.y) / sigma_y_;
        sum += double{rule.weight[n] * std::exp(-0.5f * z * z) * shareAt(box, q)};
      }
    }
    constexpr double kNormalisation = 0.39894228040143268;
    return kNormalisation * double{half} / double{sigma_y_} * sum;
  }

  /// Share of the slopes along u, given the slope q along v, whose normals are in the box.
  GLINT_HD float shareAt(const Box2& box, float q) const {
    const float s2 = 1 + q * q, s = std::sqrt(s2);
    const auto slope = [&](float x) {
      return -s * (std::fabs(x) < 1 ? x / std::sqrt(1 - x * x) : std::copysign(kInfinite, x));
    };
    const float left = slope(box.high.x), right = slope(box.low.x);
    // Lengths |p| for which -q / sqrt(1 + p^2 + q^2) is in the box: a normal that leans on is nearer to the rim.
    const float near = q < 0 ? box.low.y : -box.high.y, far = q < 0 ? box.high.y : -box.low.y;
    if (!(far > 0) && q != 0) return 0;
    const auto lengthAt = [&](float y) { return q * q / (y * y) - s2; };
    const float most2 = near > 0 ? lengthAt(near) : kInfinite, least2 = far > 0 ? std::max(0.0f, lengthAt(far)) : 0;
    if (!(most2 > least2)) return 0;
    const float most = std::sqrt(most2), least = std::sqrt(least2);
    const float mean = mean_.x + x_by_y_ * (q - mean_.y);
    const auto between = [&](float low, float high) {
      low = std::max(low, left), high = std::min(high, right);
      return high > low ? gaussianMass(low, high, mean, sigma_x_given_y_) : 0.0f;
    };
    return least > 0 ? between(-most, -least) + between(least, most) : between(-most, most);
  }

  static constexpr float kInfinite = 1e18f;  ///< its square is finite

  Vec2 mean_;
  Covariance inverse_;
  float peak_;     ///< density of slopes at their mean
  float sigma_y_;  ///< deviation of slopes along v
  float x_by_y_;   ///< change of the mean slope along u with the slope along v
  float sigma_x_given_y_;
};

}  // namespace glint
