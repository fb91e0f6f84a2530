#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/footprint.h"
#include "glint/model/normal_map.h"
#include "glint/query/detail/common/period_frame.h"

namespace glint {

/// Gaussians are widened to this deviation. Narrower ones could fall between texel centres and have no weight at all.
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

/// The largest multiple of `step` that is not above `value`: where the copy of a map begins that holds a texel of the endless plane.
inline GLINT_HD int floorTo(int value, int step) { return value - wrapIndex(value, step); }

/// Wraps a coordinate of a footprint's centre into [0, 1); numbers that are not finite become 0.
inline GLINT_HD float wrapUnit(float u) {
  const float wrapped = u - std::floor(u);
  return wrapped >= 0 ? std::min(wrapped, float{kBelowOne}) : 0.0f;  // numbers just below 0 are rounded to 1
}

/// A positive definite covariance, texels^2. In double, because in float a long footprint would lose its width.
struct UsableCovariance {
  double xx, xy, yy;
  /// The determinant, at least that of the narrowest footprint of the same length: the difference of products may have no
  /// digits left.
  GLINT_HD double determinant() const {
    return std::max(xx * yy - xy * xy, double{kMinSigmaTexels} * double{kMinSigmaTexels} * 0.5 * (xx + yy));
  }
};

/// Deviations along the principal axes of a covariance, texels, and the unit vector along the longer axis.
struct PrincipalAxes {
  double longest, shortest;
  double x, y;  ///< of the longer axis; x >= 0
};

/// Decomposition of a covariance. No digits cancel where the axes are nearly along u and v.
inline GLINT_HD PrincipalAxes principalAxes(const UsableCovariance& c) {
  const double mean = 0.5 * (c.xx + c.yy), half = 0.5 * (c.xx - c.yy), split = std::sqrt(half * half + c.xy * c.xy);
  const double high = mean + split, longest = std::sqrt(high), shortest = std::sqrt(c.determinant() / high);
  if (split == 0) return {longest, shortest, 1, 0};
  // Cosine and sine of half the angle whose cosine is half / split and whose sine is c.xy / split.
  const double larger = std::sqrt(0.5 * (1 + std::fabs(half) / split)), smaller = 0.5 * std::fabs(c.xy) / (split * larger);
  const double sine = half >= 0 ? smaller : larger;
  return {longest, shortest, half >= 0 ? larger : smaller, c.xy < 0 ? -sine : sine};
}

/// Principal axes as vectors whose lengths are the deviations, texels: the longer one first, or the one along u if both are
/// along u and v.
inline GLINT_HD AxisPair deviationsOf(const UsableCovariance& c) {
  if (c.xy == 0) return {{std::sqrt(c.xx), 0}, {0, std::sqrt(c.yy)}};
  const PrincipalAxes axes = principalAxes(c);
  return {{axes.longest * axes.x, axes.longest * axes.y}, {-axes.shortest * axes.y, axes.shortest * axes.x}};
}

/// Makes a covariance positive definite: widens it to kMinSigmaTexels; one that is not finite becomes the narrowest.
inline GLINT_HD UsableCovariance positiveCovariance(double xx, double xy, double yy) {
  constexpr double kLowest = kMinSigmaTexels * kMinSigmaTexels;
  if (!(std::isfinite(xx) && std::isfinite(xy) && std::isfinite(yy))) return {kLowest, 0, kLowest};
  const double a = std::max(0.0, xx), d = std::max(0.0, yy), limit = std::sqrt(a * d);
  const double b = std::clamp(xy, -limit, limit);
  const double smallest = 0.5 * (a + d) - std::sqrt(0.25 * (a - d) * (a - d) + b * b);
  const double shift = std::max(0.0, kLowest - smallest);
  return {a + shift, b, d + shift};
}

inline GLINT_HD UsableCovariance positiveCovariance(const Covariance& c) { return positiveCovariance(c.xx, c.xy, c.yy); }

/// `positiveCovariance`, and on a periodic map shortened where the footprint is longer than the map: along the line on which it
/// winds round the map, to a deviation of one turn (PeriodFrame). Direction and width stay. The footprint weighs the map as
/// evenly as before, to 5e-9.
GLINT_DEVICE_CALL inline GLINT_HD UsableCovariance usableCovariance(Covariance covariance, int width, int height) {
  const UsableCovariance c = positiveCovariance(covariance);
  const double w = width, h = height;
  if (c.xx <= w * w && c.yy <= h * h) return c;
  const AxisPair sigma = deviationsOf(c).scaled(1 / w, 1 / h);
  const PeriodFrame frame(sigma);
  if (frame.across_variance >= PeriodFrame::kEven) return {w * w, 0, h * h};
  if (frame.turns_variance < PeriodFrame::kEven) return c;
  // One turn along the line, and the part of the footprint across it.
  const double wide = std::hypot(PeriodFrame::dot(frame.across, sigma.a), PeriodFrame::dot(frame.across, sigma.b));
  double s[2], t[2];
  frame.vector(wide, 0, s);
  frame.vector(0, 1, t);
  return positiveCovariance(w * w * (s[0] * s[0] + t[0] * t[0]), w * h * (s[0] * s[1] + t[0] * t[1]),
                            h * h * (s[1] * s[1] + t[1] * t[1]));
}

/// Whether a Gaussian weighs a periodic map evenly, to 5e-9: along no wave of the map has it less than a turn's variance.
inline GLINT_HD bool weighsEvenly(const UsableCovariance& c, int width, int height) {
  constexpr double kRounding = 1e-6;
  const double w = width, h = height, xx = c.xx / (w * w), xy = c.xy / (w * h), yy = c.yy / (h * h);
  return 0.5 * (xx + yy) - std::sqrt(0.25 * (xx - yy) * (xx - yy) + xy * xy) >= 1 - kRounding;
}

/// Half axes of a box, texels.
inline GLINT_HD AxisPair halfAxes(const Footprint& box) { return {{box.axis_a.x, box.axis_a.y}, {box.axis_b.x, box.axis_b.y}}; }

/// Whether a box is finite and thicker than kMinBoxThickness.
inline GLINT_HD bool hasArea(const AxisPair& half) {
  const double longest = std::max(std::hypot(half.a[0], half.a[1]), std::hypot(half.b[0], half.b[1]));
  const double area = std::fabs(half.cross());
  return std::isfinite(area) && area > double{kMinBoxThickness} * longest;
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

/// The part of a convex polygon that lies in the square [-1, 1]^2. `points` holds `count` <= 4 corners. Corners of the input
/// and of the result are relative to `origin`, so that tiny polygons far from the middle of the square keep their area.
inline GLINT_HD SmallPolygon clipToUnitBox(const Vec2* points, int count, Vec2 origin = {}) {
  SmallPolygon polygon;
  polygon.count = count;
  Vec2* a = polygon.corners;
  Vec2 b[12];
  for (int k = 0; k < count; ++k) a[k] = points[k];
  for (int side = 0; side < 4 && polygon.count > 0; ++side) {
    const float sign = side & 1 ? -1.0f : 1.0f;
    const bool along_y = side >= 2;
    const float limit = 1 - sign * (along_y ? origin.y : origin.x);
    const auto inside = [&](Vec2 p) { return limit - sign * (along_y ? p.y : p.x); };  // >= 0 inside
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

/// A footprint prepared for sums over texels.
///
/// Texel (i, j) of the endless plane is the square [i, i+1] x [j, j+1]; the cell (i, j) of a smooth surface is the square
/// between the centres of texels (i, j) and (i+1, j+1), halved along its diagonal. A Gaussian weighs texels at their centres
/// and triangles at their centroids; a box weighs both by the covered area. Weights are relative: divide by their sum.
///
/// Every footprint has an answer, because sizes are made usable first: see `usableCovariance` for Gaussians and `shortenedBox`
/// for boxes. Boxes without area or of infinite size are answered as the Gaussian of the same moments. With Boundary::wrap a
/// Gaussian that weighs the map evenly is a box over the whole map, so that each texel is summed once. With Boundary::clamp nothing
/// is shortened.
class FootprintWeights {
 public:
  GLINT_HD FootprintWeights(const Footprint& p, int width, int height, Boundary boundary = Boundary::wrap) {
    centre_x_ = wrapUnit(p.centre.x) * static_cast<float>(width);
    centre_y_ = wrapUnit(p.centre.y) * static_cast<float>(height);
    is_box_ = p.kind == Footprint::Kind::box && setBox(p, width, height, boundary);
    if (is_box_) return;
    const bool wrap = boundary == Boundary::wrap;
    const UsableCovariance c = wrap ? usableCovariance(p.covariance, width, height) : positiveCovariance(p.covariance);
    wrap&& weighsEvenly(c, width, height) ? setWholeMap(width, height) : setGaussian(c);
  }

  /// Half-open range of texels that can have weight.
  int column_begin = 0, column_end = 0, row_begin = 0, row_end = 0;

  /// Columns [begin, end).
  struct Columns {
    int begin, end;
  };
  /// Columns of the texels that can have weight in rows [row, end_row).
  GLINT_HD Columns columnsIn(int row, int end_row) const {
    // One row and one column more on each side, because triangles of a cell reach into the next texel.
    const double low = row - 1 - centre_y_, high = end_row + 1 - centre_y_;
    double left = -kFarTexels, right = kFarTexels;
    for (int k = 0; k < (is_box_ ? 2 : 1); ++k) {
      left = std::max(left, std::min(slant_[k] * low, slant_[k] * high) - half_width_[k]);
      right = std::min(right, std::max(slant_[k] * low, slant_[k] * high) + half_width_[k]);
    }
    return {std::max(column_begin, toIndex(std::floor(centre_x_ + left) - 1)),
            std::min(column_end, toIndex(std::floor(centre_x_ + right) + 2))};
  }

  GLINT_DEVICE_CALL GLINT_HD float texel(int i, int j) const {
    if (!is_box_) return gaussian(i + 0.5 - centre_x_, j + 0.5 - centre_y_);
    const Vec2 middle = local(i + 0.5 - centre_x_, j + 0.5 - centre_y_);
    const float x = std::fabs(middle.x), y = std::fabs(middle.y);
    if (x - half_texel_.x >= 1 || y - half_texel_.y >= 1) return 0;
    if (x + half_texel_.x <= 1 && y + half_texel_.y <= 1) return 1;
    const Vec2 right = 0.5f * columnStep(), up = 0.5f * rowStep();
    const Vec2 corners[4] = {Vec2{} - right - up, right - up, right + up, up - right};
    return areaOf(clipToUnitBox(corners, 4, middle));
  }

  /// Weight of the lower right (half 0) or upper left (half 1) triangle of a cell.
  GLINT_DEVICE_CALL GLINT_HD float triangle(int i, int j, int half) const {
    const double dx = i + 0.5 - centre_x_, dy = j + 0.5 - centre_y_, third = 1.0 / 3;
    if (!is_box_) return 0.5f * (half == 0 ? gaussian(dx + 2 * third, dy + third) : gaussian(dx + third, dy + 2 * third));
    const Vec2 right = columnStep(), up = rowStep();
    const Vec2 corners[3] = {{}, half == 0 ? right : up, right + up};
    return areaOf(clipToUnitBox(corners, 3, local(dx, dy)));
  }

  GLINT_HD bool isBox() const { return is_box_; }
  /// A Gaussian is exp(-(a^2 + b^2) / 2) with a = across (x - slant y), b = along y, from its centre.
  struct Whitening {
    float slant, across, along;
  };
  GLINT_HD Whitening whitening() const { return {static_cast<float>(slant_[0]), std::sqrt(across_), std::sqrt(along_)}; }
  /// Whether a box surely misses a rectangle with the given centre and half sides, texels.
  GLINT_HD bool misses(double x, double y, double half_x, double half_y) const {
    const Vec2 middle = local(x - centre_x_, y - centre_y_), right = columnStep(), up = rowStep();
    const auto sx = static_cast<float>(half_x), sy = static_cast<float>(half_y);
    return std::fabs(middle.x) - std::fabs(right.x) * sx - std::fabs(up.x) * sy >= 1 ||
           std::fabs(middle.y) - std::fabs(right.y) * sx - std::fabs(up.y) * sy >= 1;
  }
  GLINT_HD Vec2 centre() const { return {static_cast<float>(centre_x_), static_cast<float>(centre_y_)}; }

  /// A Gaussian along one line y = const of texel space: position of its peak, its deviation, and its integral over the line
  /// relative to the integral over the line through the centre.
  struct Line {
    float mean, sigma, share;
  };
  GLINT_HD Line gaussianLine(float y) const {
    const auto dy = static_cast<float>(double{y} - centre_y_);
    return {static_cast<float>(centre_x_ + slant_[0] * double{dy}), 1 / std::sqrt(across_), std::exp(-0.5f * along_ * dy * dy)};
  }

  /// The parallelogram of a box, or its part inside a rectangle of texel space. Corners are in the frame where the
  /// parallelogram is [-1, 1]^2.
  GLINT_HD SmallPolygon localShape(const Box2* clip) const {
    const Vec2 whole[4] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    if (!clip) return clipToUnitBox(whole, 4);
    const auto corner = [&](float x, float y) { return local(double{x} - centre_x_, double{y} - centre_y_); };
    const Vec2 corners[4] = {corner(clip->low.x, clip->low.y), corner(clip->high.x, clip->low.y),
                             corner(clip->high.x, clip->high.y), corner(clip->low.x, clip->high.y)};
    return clipToUnitBox(corners, 4);
  }
  /// Position in texel space (x and y) of a point of the frame where the parallelogram is [-1, 1]^2.
  GLINT_HD void fromLocal(Vec2 s, double& x, double& y) const {
    const double det = row_x_[0] * row_y_[1] - row_x_[1] * row_y_[0];
    x = centre_x_ + (row_y_[1] * double{s.x} - row_x_[1] * double{s.y}) / det;
    y = centre_y_ + (row_x_[0] * double{s.y} - row_y_[0] * double{s.x}) / det;
  }

  /// Whether closedFormTotal equals the sum of all texel weights to float precision.
  GLINT_HD bool hasClosedFormTotal() const { return is_box_ || min_sigma_ >= 1; }
  /// Sum of `texel` over the endless plane, which is also the sum of `triangle`.
  GLINT_HD double closedFormTotal() const { return is_box_ ? 4 * scale_ : 2 * 3.14159265358979 * double{root_determinant_}; }

 private:
  /// A coordinate beyond all texels that are summed.
  static constexpr double kFarTexels = 1 << 30;

  GLINT_HD bool setBox(const Footprint& p, int width, int height, Boundary boundary) {
    AxisPair half = halfAxes(p);
    if (!hasArea(half)) return false;
    if (boundary == Boundary::wrap) half = shortenedBox(half, width, height);
    const double ax = half.a[0], ay = half.a[1], bx = half.b[0], by = half.b[1], det = half.cross();
    row_x_[0] = by / det, row_x_[1] = -bx / det;
    row_y_[0] = -ay / det, row_y_[1] = ax / det;
    half_texel_ =
        0.5f * Vec2{std::fabs(columnStep().x) + std::fabs(rowStep().x), std::fabs(columnStep().y) + std::fabs(rowStep().y)};
    scale_ = std::fabs(det);
    const double sides[2][2] = {{by, bx}, {ay, ax}};
    for (int k = 0; k < 2; ++k) {
      slant_[k] = sides[k][0] == 0 ? 0 : sides[k][1] / sides[k][0];
      half_width_[k] = sides[k][0] == 0 ? kFarTexels : std::fabs(det / sides[k][0]);
    }
    setRange(std::fabs(ax) + std::fabs(bx), std::fabs(ay) + std::fabs(by));
    return true;
  }

  GLINT_HD void setWholeMap(int width, int height) {
    const float half_width = 0.5f * static_cast<float>(width), half_height = 0.5f * static_cast<float>(height);
    centre_x_ = half_width, centre_y_ = half_height;
    is_box_ = setBox(Footprint::box({0.5f, 0.5f}, {half_width, 0}, {0, half_height}), width, height, Boundary::clamp);
  }

  GLINT_HD void setGaussian(const UsableCovariance& c) {
    const double determinant = c.determinant(), mean = 0.5 * (c.xx + c.yy);
    const double largest = mean + std::sqrt(std::max(0.0, mean * mean - determinant));
    slant_[0] = c.xy / c.yy;
    half_width_[0] = double{kFootprintReach + 1} * std::sqrt(determinant / c.yy);
    across_ = static_cast<float>(c.yy / determinant);
    along_ = static_cast<float>(1 / c.yy);
    root_determinant_ = static_cast<float>(std::sqrt(determinant));
    min_sigma_ = static_cast<float>(std::sqrt(determinant / largest));
    setRange(double{kFootprintReach} * std::sqrt(c.xx), double{kFootprintReach} * std::sqrt(c.yy));
  }

  GLINT_HD void setRange(double reach_x, double reach_y) {
    // One texel more on the low side: the triangles of a cell belong to the texel at its lower left corner.
    column_begin = toIndex(std::floor(centre_x_ - reach_x) - 1);
    column_end = toIndex(std::floor(centre_x_ + reach_x) + 1);
    row_begin = toIndex(std::floor(centre_y_ - reach_y) - 1);
    row_end = toIndex(std::floor(centre_y_ + reach_y) + 1);
  }
  static GLINT_HD int toIndex(double x) { return static_cast<int>(std::clamp(x, -kFarTexels, double{kFarTexels})); }

  GLINT_HD float gaussian(double dx, double dy) const {
    const auto x = static_cast<float>(dx - slant_[0] * dy), y = static_cast<float>(dy);
    return std::exp(-0.5f * (across_ * x * x + along_ * y * y));
  }
  /// Position in the frame where the parallelogram is [-1, 1]^2.
  GLINT_HD Vec2 local(double dx, double dy) const {
    return {static_cast<float>(row_x_[0] * dx + row_x_[1] * dy), static_cast<float>(row_y_[0] * dx + row_y_[1] * dy)};
  }
  /// Steps in that frame for one texel along x and along y.
  GLINT_HD Vec2 columnStep() const { return {static_cast<float>(row_x_[0]), static_cast<float>(row_y_[0])}; }
  GLINT_HD Vec2 rowStep() const { return {static_cast<float>(row_x_[1]), static_cast<float>(row_y_[1])}; }
  /// Area, in texels, of a polygon that is given in that frame.
  GLINT_HD float areaOf(const SmallPolygon& polygon) const {
    return static_cast<float>(scale_ * (0.5 * double{std::fabs(polygon.twiceSignedArea())}));
  }

  double centre_x_ = 0, centre_y_ = 0;
  bool is_box_ = false;
  // A Gaussian is exp(-(across (x - slant y)^2 + along y^2) / 2). In this form no digits cancel for long thin Gaussians.
  float across_ = 0, along_ = 0;
  float root_determinant_ = 0;  ///< square root of the determinant of the covariance
  float min_sigma_ = 0;
  // Lines y = const can meet the footprint within a half width of slant * y, for each pair of sides of a box.
  double slant_[2] = {}, half_width_[2] = {};
  double row_x_[2] = {}, row_y_[2] = {};
  Vec2 half_texel_;   ///< half size of a texel's bounding box in the frame of the parallelogram
  double scale_ = 0;  ///< area, in texels, of a unit square of that frame
};

}  // namespace glint
