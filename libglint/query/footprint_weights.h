#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/footprint.h"
#include "glint/model/normal_map.h"

namespace glint {

/// Footprints thinner than this are widened to it: texel centres sample a narrower Gaussian too coarsely to hold any weight.
inline constexpr float kMinSigmaTexels = 0.25f;
/// Boxes thinner than this (texels) are answered as Gaussians.
inline constexpr float kMinBoxThickness = 1e-3f;
/// Gaussian footprints are summed out to this many standard deviations: exp(-6^2 / 2) = 1.5e-8.
inline constexpr float kFootprintReach = 6.0f;

/// Index of texel i of an endless row of maps of n texels.
inline GLINT_HD int wrapIndex(int i, int n) {
  const int r = i % n;
  return r < 0 ? r + n : r;
}

/// Brings a coordinate of a footprint's centre into [0, 1); what is not finite becomes 0.
inline GLINT_HD float wrapUnit(float u) {
  const float wrapped = u - std::floor(u);
  return wrapped >= 0 ? std::min(wrapped, float{kBelowOne}) : 0.0f;  // close below 0 it is rounded to 1
}

/// A covariance of positive definite form, texels^2. Double: in float that of a long footprint would lose its width.
struct UsableCovariance {
  double xx, xy, yy;
  GLINT_HD double determinant() const { return xx * yy - xy * xy; }
};

/// Covariance of a footprint, made usable: shortened to the sides of the map along u and v (a longer one sees the map evenly,
/// to 5e-9), widened to kMinSigmaTexels; what is not finite becomes the narrowest one.
inline GLINT_HD UsableCovariance usableCovariance(Covariance c, int width, int height) {
  constexpr float kLowest = kMinSigmaTexels * kMinSigmaTexels;
  if (!(std::isfinite(c.xx) && std::isfinite(c.xy) && std::isfinite(c.yy))) return {kLowest, 0, kLowest};
  const double xx = std::max(0.0, double{c.xx}), yy = std::max(0.0, double{c.yy});
  const double sx = std::min(1.0, width / std::sqrt(std::max(xx, 1.0)));
  const double sy = std::min(1.0, height / std::sqrt(std::max(yy, 1.0)));
  const double limit = std::sqrt(xx * yy);
  const double xy = std::clamp(double{c.xy}, -limit, limit);
  const double a = xx * sx * sx, b = xy * sx * sy, d = yy * sy * sy;
  const double smallest = 0.5 * (a + d) - std::sqrt(0.25 * (a - d) * (a - d) + b * b);
  const double shift = std::max(0.0, kLowest - smallest);
  return {a + shift, b, d + shift};
}

/// A convex polygon of few corners.
struct SmallPolygon {
  Vec2 corners[12];
  int count = 0;

  /// Twice the area, positive if the corners go round counterclockwise.
  GLINT_HD float twiceSignedArea() const {
    float twice = 0;
    for (int k = 0; k < count; ++k) {
      const Vec2 p = corners[k], q = corners[(k + 1) % count];
      twice += p.x * q.y - p.y * q.x;
    }
    return twice;
  }
};

/// The part of a convex polygon that lies in the square [-1, 1]^2. `points` holds `count` <= 4 corners.
inline GLINT_HD SmallPolygon clipToUnitBox(const Vec2* points, int count) {
  SmallPolygon polygon;
  polygon.count = count;
  Vec2* a = polygon.corners;
  Vec2 b[12];
  for (int k = 0; k < count; ++k) a[k] = points[k];
  for (int side = 0; side < 4 && polygon.count > 0; ++side) {
    const float sign = side & 1 ? -1.0f : 1.0f;
    const bool along_y = side >= 2;
    const auto inside = [&](Vec2 p) { return 1 - sign * (along_y ? p.y : p.x); };  // >= 0 inside
    int kept = 0;
    for (int k = 0; k < polygon.count; ++k) {
      const Vec2 p = a[k], q = a[(k + 1) % polygon.count];
      const float dp = inside(p), dq = inside(q);
      if (dp >= 0) b[kept++] = p;
      if ((dp >= 0) != (dq >= 0)) b[kept++] = p + (dp / (dp - dq)) * (q - p);
    }
    for (int k = 0; k < kept; ++k) a[k] = b[k];
    polygon.count = kept;
  }
  return polygon;
}

/// Area of the part of a convex polygon that lies in the square [-1, 1]^2. `points` holds `count` <= 4 corners.
GLINT_DEVICE_CALL inline GLINT_HD float areaInsideUnitBox(const Vec2* points, int count) {
  return 0.5f * std::fabs(clipToUnitBox(points, count).twiceSignedArea());
}

/// A footprint made ready for sums over texels.
///
/// Texel (i, j) of the endless plane is the square [i, i+1] x [j, j+1]; the cell (i, j) of a smooth surface is the square
/// between the centres of texels (i, j) and (i+1, j+1), halved along its diagonal. A Gaussian weighs texels at their centres
/// and triangles at their centroids; a box weighs both by the covered area. Weights are relative: divide by their sum.
///
/// Sizes are made usable first, so that every footprint has an answer: see `usableCovariance` for Gaussians; boxes are
/// shortened to four times the map along u and v, and boxes without area or finite size are answered as the Gaussian of the
/// same moments.
class FootprintWeights {
 public:
  GLINT_HD FootprintWeights(const Footprint& p, int width, int height) {
    centre_ = {wrapUnit(p.centre.x) * static_cast<float>(width), wrapUnit(p.centre.y) * static_cast<float>(height)};
    is_box_ =
        p.kind == Footprint::Kind::box && setBox(p, {2.0f * static_cast<float>(width), 2.0f * static_cast<float>(height)});
    if (!is_box_) setGaussian(usableCovariance(p.covariance, width, height));
  }

  /// Half-open range of texels that can have weight.
  int column_begin = 0, column_end = 0, row_begin = 0, row_end = 0;

  GLINT_DEVICE_CALL GLINT_HD float texel(int i, int j) const {
    const Vec2 d = Vec2{static_cast<float>(i) + 0.5f, static_cast<float>(j) + 0.5f} - centre_;
    if (!is_box_) return gaussian(d);
    const Vec2 corners[4] = {local({d.x - 0.5f, d.y - 0.5f}), local({d.x + 0.5f, d.y - 0.5f}), local({d.x + 0.5f, d.y + 0.5f}),
                             local({d.x - 0.5f, d.y + 0.5f})};
    return areaInsideUnitBox(corners, 4);
  }

  /// Weight of the lower right (half 0) or upper left (half 1) triangle of a cell.
  GLINT_DEVICE_CALL GLINT_HD float triangle(int i, int j, int half) const {
    const Vec2 d = Vec2{static_cast<float>(i) + 0.5f, static_cast<float>(j) + 0.5f} - centre_;
    const float third = 1.0f / 3;
    if (!is_box_) return 0.5f * gaussian(d + (half == 0 ? Vec2{2 * third, third} : Vec2{third, 2 * third}));
    const Vec2 other = half == 0 ? Vec2{d.x + 1, d.y} : Vec2{d.x, d.y + 1};
    const Vec2 corners[3] = {local(d), local(other), local({d.x + 1, d.y + 1})};
    return areaInsideUnitBox(corners, 3);
  }

  GLINT_HD bool isBox() const { return is_box_; }
  GLINT_HD Vec2 centre() const { return centre_; }

  /// A Gaussian along one line of texel space, y = const: where it peaks, its deviation, and the integral over the line
  /// relative to that over the line through the centre.
  struct Line {
    float mean, sigma, share;
  };
  GLINT_HD Line gaussianLine(float y) const {
    const float dy = y - centre_.y;
    return {centre_.x + slant_ * dy, 1 / std::sqrt(across_), std::exp(-0.5f * along_ * dy * dy)};
  }

  /// The parallelogram of a box, or its part inside a rectangle of texel space, in the frame where it is [-1, 1]^2.
  GLINT_HD SmallPolygon localShape(const Box2* clip) const {
    const Vec2 whole[4] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    if (!clip) return clipToUnitBox(whole, 4);
    const Vec2 corners[4] = {local(clip->low - centre_), local(Vec2{clip->high.x, clip->low.y} - centre_),
                             local(clip->high - centre_), local(Vec2{clip->low.x, clip->high.y} - centre_)};
    return clipToUnitBox(corners, 4);
  }
  /// Back from that frame to texel space.
  GLINT_HD Vec2 fromLocal(Vec2 s) const {
    const float det = row_x_.x * row_y_.y - row_x_.y * row_y_.x;
    return centre_ + (1 / det) * Vec2{row_y_.y * s.x - row_x_.y * s.y, row_x_.x * s.y - row_y_.x * s.x};
  }

  /// Whether the sum of all texel weights has a closed form, that of `closedFormTotal`, to float precision.
  GLINT_HD bool hasClosedFormTotal() const { return is_box_ || min_sigma_ >= 1; }
  /// Sum of `texel`, as of `triangle`, over the endless plane.
  GLINT_HD float closedFormTotal() const { return is_box_ ? 4.0f : 2 * 3.14159265358979f * root_determinant_; }

 private:
  GLINT_HD bool setBox(const Footprint& p, Vec2 longest) {
    const Vec2 reach = {std::fabs(p.axis_a.x) + std::fabs(p.axis_b.x), std::fabs(p.axis_a.y) + std::fabs(p.axis_b.y)};
    if (!(std::isfinite(reach.x) && std::isfinite(reach.y))) return false;
    const float sx = reach.x > longest.x ? longest.x / reach.x : 1;
    const float sy = reach.y > longest.y ? longest.y / reach.y : 1;
    const Vec2 a = {sx * p.axis_a.x, sy * p.axis_a.y}, b = {sx * p.axis_b.x, sy * p.axis_b.y};
    const float det = a.x * b.y - a.y * b.x;
    const float thickness = std::fabs(det) / std::max(std::sqrt(dot(a, a)), std::sqrt(dot(b, b)));
    if (!(thickness > kMinBoxThickness)) return false;
    row_x_ = {b.y / det, -b.x / det};
    row_y_ = {-a.y / det, a.x / det};
    setRange({sx * reach.x, sy * reach.y});
    return true;
  }

  GLINT_HD void setGaussian(const UsableCovariance& c) {
    const double determinant = c.determinant(), mean = 0.5 * (c.xx + c.yy);
    const double largest = mean + std::sqrt(std::max(0.0, mean * mean - determinant));
    slant_ = static_cast<float>(c.xy / c.yy);
    across_ = static_cast<float>(c.yy / determinant);
    along_ = static_cast<float>(1 / c.yy);
    root_determinant_ = static_cast<float>(std::sqrt(determinant));
    min_sigma_ = static_cast<float>(std::sqrt(determinant / largest));
    setRange({kFootprintReach * static_cast<float>(std::sqrt(c.xx)), kFootprintReach * static_cast<float>(std::sqrt(c.yy))});
  }

  GLINT_HD void setRange(Vec2 reach) {
    // One texel more on the low side: the triangles of a cell belong to the texel at its lower left corner.
    column_begin = static_cast<int>(std::floor(centre_.x - reach.x)) - 1;
    column_end = static_cast<int>(std::floor(centre_.x + reach.x)) + 1;
    row_begin = static_cast<int>(std::floor(centre_.y - reach.y)) - 1;
    row_end = static_cast<int>(std::floor(centre_.y + reach.y)) + 1;
  }

  GLINT_HD float gaussian(Vec2 d) const {
    const float x = d.x - slant_ * d.y;
    return std::exp(-0.5f * (across_ * x * x + along_ * d.y * d.y));
  }
  /// Into the frame where the parallelogram is [-1, 1]^2.
  GLINT_HD Vec2 local(Vec2 d) const { return {dot(row_x_, d), dot(row_y_, d)}; }

  Vec2 centre_;
  bool is_box_ = false;
  // A Gaussian: exp(-(across (x - slant y)^2 + along y^2) / 2). Nothing cancels that is long and thin.
  float slant_ = 0, across_ = 0, along_ = 0;
  float root_determinant_ = 0;  ///< of the covariance
  float min_sigma_ = 0;
  Vec2 row_x_, row_y_;
};

}  // namespace glint
