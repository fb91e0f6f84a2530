#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/tiny_example.h"
#include "glint/query/detail/common/footprint_weights.h"

namespace glint {

/// A Gaussian footprint over a lattice of squares: weights at the middles of the squares that lie within kReach deviations.
///
/// Together the squares have the variance of the footprint: the weights leave out the variance inside a square.
class GaussianLattice {
 public:
  static constexpr double kReach = double{TinyExample::kFootprintReach};

  /// @param c        covariance of the footprint, texels^2
  /// @param spacing  side of a square, texels
  /// @param inside   variance along an axis that each square adds, texels^2
  GLINT_HD GaussianLattice(const UsableCovariance& c, double spacing, double inside) {
    const double per_square = 1 / (spacing * spacing);
    double xx = (c.xx - inside) * per_square, yy = (c.yy - inside) * per_square;
    const double xy = c.xy * per_square, half = 0.5 * (xx - yy);
    const double smallest = 0.5 * (xx + yy) - std::sqrt(half * half + xy * xy);
    constexpr double kLeast = kMinSigmaTexels * kMinSigmaTexels;  // narrower ones could miss all middles
    const double shift = std::max(0.0, kLeast - smallest);
    xx += shift, yy += shift;
    const double determinant = std::max(xx * yy - xy * xy, kLeast * 0.5 * (xx + yy));
    slant_ = xy / yy;
    across_ = static_cast<float>(yy / determinant);
    along_ = static_cast<float>(1 / yy);
    sigma_x_ = std::sqrt(determinant / yy), sigma_y_ = std::sqrt(yy);
    extent_x_ = std::sqrt(xx);
    total_ = static_cast<float>(6.283185307179586 * std::sqrt(determinant));
  }

  /// About the sum of the weights of all squares.
  GLINT_HD float total() const { return total_; }

  /// About how many squares are visited, at most.
  GLINT_HD double squares() const {
    const double rows = 2 * kReach * sigma_y_ + 1;
    return 1 + 1.5707963 * kReach * sigma_x_ * rows + rows;
  }
  GLINT_HD double extentX() const { return kReach * extent_x_; }
  GLINT_HD double extentY() const { return kReach * sigma_y_; }

  /// Calls visitor(i, j, weight) for each square, rows upwards. Weights are relative.
  /// @param x, y  centre of the footprint, in squares
  template <class Visitor>
  GLINT_HD void forEach(double x, double y, Visitor&& visitor) const {
    constexpr int kFar = 1 << 30;
    forEachInside(x, y, -kFar, kFar, visitor);
  }

  /// The same of the squares whose i and j are from `low` to `high`: however large the footprint is, no others are visited.
  template <class Visitor>
  GLINT_HD void forEachInside(double x, double y, int low, int high, Visitor&& visitor) const {
    const auto above = [&](double k) { return static_cast<int>(std::clamp(std::ceil(k), double(low), high + 1.0)); };
    const auto below = [&](double k) { return static_cast<int>(std::clamp(std::floor(k), low - 1.0, double(high))); };
    const double reach = kReach * sigma_y_;
    const float fall = std::exp(-across_);
    const int last = below(y + reach - 0.5);
    for (int j = above(y - reach - 0.5); j <= last; ++j) {
      const double dy = j + 0.5 - y, t = dy / sigma_y_, wide = sigma_x_ * std::sqrt(std::max(0.0, kReach * kReach - t * t));
      const double middle = x + slant_ * dy - 0.5;
      const int begin = above(middle - wide), end = below(middle + wide);
      if (begin > end) continue;
      // Along a row each weight is the one before times a ratio, and ratios fall by one factor.
      const auto first = static_cast<float>(begin - middle), fy = static_cast<float>(dy);
      float weight = std::exp(-0.5f * (across_ * first * first + along_ * fy * fy));
      float ratio = std::exp(-across_ * (first + 0.5f));
      for (int i = begin; i <= end; ++i) {
        visitor(i, j, weight);
        weight *= ratio, ratio *= fall;
      }
    }
  }

 private:
  double slant_, sigma_x_, sigma_y_, extent_x_;  // sigma_x_: of x at a given y
  float across_, along_, total_;
};

}  // namespace glint
