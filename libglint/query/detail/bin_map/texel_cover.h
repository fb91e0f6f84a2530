#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/model/footprint.h"
#include "glint/query/detail/common/footprint_weights.h"

namespace glint {

/// Area of the part of the unit square [0, 1]^2 where |r0 . p + o0| <= 1 and |r1 . p + o1| <= 1, for rows (x, y) of a frame.
inline GLINT_HD double areaInFrame(const double (&rows)[2][2], const double (&offsets)[2]) {
  double ax[12] = {0, 1, 1, 0}, ay[12] = {0, 0, 1, 1}, bx[12], by[12];
  int count = 4;
  for (int side = 0; side < 4 && count > 0; ++side) {
    const double sign = side & 1 ? -1 : 1;
    const double* row = rows[side >> 1];
    const auto inside = [&](double x, double y) { return 1 - sign * (row[0] * x + row[1] * y + offsets[side >> 1]); };
    int kept = 0;
    for (int k = 0; k < count; ++k) {
      const int next = k + 1 < count ? k + 1 : 0;
      const double dp = inside(ax[k], ay[k]), dq = inside(ax[next], ay[next]);
      if (dp >= 0) bx[kept] = ax[k], by[kept++] = ay[k];
      if ((dp >= 0) != (dq >= 0)) {
        const double t = dp / (dp - dq);
        bx[kept] = ax[k] + t * (ax[next] - ax[k]);
        by[kept++] = ay[k] + t * (ay[next] - ay[k]);
      }
    }
    for (int k = 0; k < kept; ++k) ax[k] = bx[k], ay[k] = by[k];
    count = kept;
  }
  double twice = 0;
  for (int k = 0; k < count; ++k) {
    const int next = k + 1 < count ? k + 1 : 0;
    twice += ax[k] * ay[next] - ay[k] * ax[next];
  }
  return 0.5 * std::fabs(twice);
}

/// A range of coordinates; empty if low > high.
struct CoverSpan {
  double low = 0;
  double high = 0;
};

/// A parallelogram on the periodic plane of a map, prepared for exact overlaps with texels.
///
/// Coordinates of the footprint count texels from the corner of its bounding box, which is texel (originX, originY) of the map.
/// Texel (i, j) of the map has the coordinates (i - originX + m width, j - originY + n height) for all integers m and n.
///
/// A box footprint is its own parallelogram; `shortenedBox` shortens very long boxes. A Gaussian becomes the parallelogram
/// along its principal axes with the same second moments, or the parallelogram of `woundBox` where it is longer than the map. A
/// box without area or of infinite size becomes the Gaussian of its moments first (as in FootprintWeights).
class TexelCover {
 public:
  GLINT_DEVICE_CALL GLINT_HD TexelCover(const Footprint& p, int width, int height) : width_(width), height_(height) {
    AxisPair half = halfAxes(p);
    half = p.kind == Footprint::Kind::box && hasArea(half)
               ? shortenedBox(half, width, height)
               : woundBox(deviationsOf(positiveCovariance(p.covariance)), width, height);
    const double axes[2][2] = {{half.a[0], half.a[1]}, {half.b[0], half.b[1]}};
    const double det = axes[0][0] * axes[1][1] - axes[0][1] * axes[1][0];
    area_ = 4 * std::fabs(det);
    rows_[0][0] = axes[1][1] / det, rows_[0][1] = -axes[1][0] / det;
    rows_[1][0] = -axes[0][1] / det, rows_[1][1] = axes[0][0] / det;
    aligned_ = (axes[0][1] == 0 && axes[1][0] == 0) || (axes[0][0] == 0 && axes[1][1] == 0);
    const double reach[2] = {std::fabs(axes[0][0]) + std::fabs(axes[1][0]), std::fabs(axes[0][1]) + std::fabs(axes[1][1])};
    bound(double{wrapUnit(p.centre.x)} * width, reach[0], width, origin_x_, columns_, low_[0], high_[0]);
    bound(double{wrapUnit(p.centre.y)} * height, reach[1], height, origin_y_, rows_count_, low_[1], high_[1]);
    centre_[0] = 0.5 * (low_[0] + high_[0]);
    centre_[1] = 0.5 * (low_[1] + high_[1]);
    for (int k = 0; k < 2; ++k) {
      half_texel_[k] = 0.5 * (std::fabs(rows_[k][0]) + std::fabs(rows_[k][1]));
      reach_[k] = rows_[k][0] == 0 ? 0 : 1 / std::fabs(rows_[k][0]);
      slant_[k] = rows_[k][0] == 0 ? 0 : rows_[k][1] / rows_[k][0];
    }
  }

  GLINT_HD int width() const { return width_; }
  GLINT_HD int height() const { return height_; }
  GLINT_HD int originX() const { return origin_x_; }
  GLINT_HD int originY() const { return origin_y_; }
  /// Texels of the bounding box along u and v.
  GLINT_HD int columns() const { return columns_; }
  GLINT_HD int rows() const { return rows_count_; }
  /// Whether no texel is seen twice: the bounding box is not larger than the map.
  GLINT_HD bool fits() const { return columns_ <= width_ && rows_count_ <= height_; }
  /// Whether the sides are parallel to the axes. Then `low` and `high` alone describe the parallelogram.
  GLINT_HD bool aligned() const { return aligned_; }
  /// Area, texels^2: the sum of `texel` over the endless plane.
  GLINT_HD double area() const { return area_; }
  GLINT_HD double lowX() const { return low_[0]; }
  GLINT_HD double highX() const { return high_[0]; }
  GLINT_HD double lowY() const { return low_[1]; }
  GLINT_HD double highY() const { return high_[1]; }

  /// Point of the parallelogram for (s, t) in [0, 1)^2, uniform.
  GLINT_HD void point(double s, double t, double& x, double& y) const {
    const double det = rows_[0][0] * rows_[1][1] - rows_[0][1] * rows_[1][0];
    const double a = 2 * s - 1, b = 2 * t - 1;
    x = centre_[0] + (rows_[1][1] * a - rows_[0][1] * b) / det;
    y = centre_[1] + (rows_[0][0] * b - rows_[1][0] * a) / det;
  }

  /// Covered area of the texel [x, x + 1] x [y, y + 1], 0 to 1.
  GLINT_DEVICE_CALL GLINT_HD double texel(int x, int y) const {
    if (x < 0 || y < 0 || x >= columns_ || y >= rows_count_) return 0;
    if (aligned_) return overlap(x, low_[0], high_[0]) * overlap(y, low_[1], high_[1]);
    const double dx = x - centre_[0], dy = y - centre_[1];
    double offsets[2];
    bool whole = true;
    for (int k = 0; k < 2; ++k) {
      offsets[k] = rows_[k][0] * dx + rows_[k][1] * dy;
      const double middle = std::fabs(offsets[k] + 0.5 * (rows_[k][0] + rows_[k][1]));
      if (middle - half_texel_[k] >= 1) return 0;
      whole = whole && middle + half_texel_[k] <= 1;
    }
    return whole ? 1 : areaInFrame(rows_, offsets);
  }

  /// Bounds of the parallelogram between rows y0 < y1. Every point of the parallelogram between the rows is inside `outer`.
  /// Every point between the rows and inside `inner` is in the parallelogram.
  GLINT_DEVICE_CALL GLINT_HD void spans(double y0, double y1, CoverSpan& outer, CoverSpan& inner) const {
    outer = inner = {low_[0], high_[0]};
    for (int k = 0; k < 2; ++k) {
      if (reach_[k] == 0) {  // this pair of sides bounds y alone
        const double s0 = rows_[k][1] * (centre_[1] - y0), s1 = rows_[k][1] * (centre_[1] - y1);
        if (std::fabs(s0) > 1 || std::fabs(s1) > 1) inner = {1, 0};
        if ((s0 > 1 && s1 > 1) || (s0 < -1 && s1 < -1)) outer = {1, 0};
        continue;
      }
      const double m0 = centre_[0] + slant_[k] * (centre_[1] - y0), m1 = centre_[0] + slant_[k] * (centre_[1] - y1);
      const double left = std::min(m0, m1), right = std::max(m0, m1);
      outer = {std::max(outer.low, left - reach_[k]), std::min(outer.high, right + reach_[k])};
      inner = {std::max(inner.low, right - reach_[k]), std::min(inner.high, left + reach_[k])};
    }
  }

  /// Covered width of the first and the last column, and height of the first and the last row, of boxes along the axes.
  GLINT_HD double firstColumn() const { return overlap(0, low_[0], high_[0]); }
  GLINT_HD double lastColumn() const { return overlap(columns_ - 1, low_[0], high_[0]); }
  GLINT_HD double firstRow() const { return overlap(0, low_[1], high_[1]); }
  GLINT_HD double lastRow() const { return overlap(rows_count_ - 1, low_[1], high_[1]); }

 private:
  static GLINT_HD double overlap(int x, double low, double high) {
    return std::max(0.0, std::min(x + 1.0, high) - std::max(double(x), low));
  }

  /// Bounding box along one axis, and the parallelogram in it.
  static GLINT_HD void bound(double centre, double reach, int size, int& origin, int& count, double& low, double& high) {
    const double begin = std::floor(centre - reach);
    low = centre - reach - begin;
    high = centre + reach - begin;
    count = static_cast<int>(std::ceil(high));
    const double wrapped = begin - std::floor(begin / size) * size;
    origin = static_cast<int>(wrapped);
    origin = origin >= size ? 0 : origin;
  }

  int width_, height_;
  int origin_x_ = 0, origin_y_ = 0, columns_ = 0, rows_count_ = 0;
  bool aligned_ = false;
  double area_ = 0;
  double low_[2] = {}, high_[2] = {}, centre_[2] = {};
  double rows_[2][2] = {};
  double half_texel_[2] = {};
  double reach_[2] = {}, slant_[2] = {};  // of each pair of sides along u: half width, and shift for a step of -1 along v
};

}  // namespace glint
