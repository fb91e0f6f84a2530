#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/model/histogram_sat.h"
#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/histogram/bin_counts.h"

namespace glint {

/// Adds rectangles of texels to a sum over bins. Each texel counts by its covered area.
///
/// Each side of a rectangle is moved to the nearest point of the fine table (HistogramSat::sums), which counts the new
/// rectangle with one difference of four points. The strips between old and new sides are then added or subtracted: texel by
/// texel, or where they are long from row_sums and column_sums. The counters of the fine table are modulo 2^16. So rectangles
/// of several times 2^16 texels take their middle from the coarse table, whose counters are modulo 2^32, and only the frame
/// around the middle from the fine table, in pieces of less than 2^16 texels.
template <class Sum>
class RectangleSums {
 public:
  GLINT_HD RectangleSums(const HistogramSat& sat, Sum& sum) : sat_(sat), sum_(sum) {}

  /// Adds the rectangle [x0, x1] x [y0, y1] of the endless plane, in texels. Any finite size: where it is larger than the map,
  /// whole periods are counted at once.
  GLINT_HD void add(double x0, double x1, double y0, double y1, double weight) {
    forEachPiece(y0, y1, sat_.height, [&](double b0, double b1, double times_y) {
      forEachPiece(x0, x1, sat_.width,
                   [&](double a0, double a1, double times_x) { addInside(a0, a1, b0, b1, weight * times_x * times_y); });
    });
  }

  /// Prefetches the counters that `add` needs, if the rectangle does not cross a border of the map.
  GLINT_HD void prefetchWithin(double x0, double x1, double y0, double y1) const {
    const double x = std::floor(x0 / sat_.width) * sat_.width, y = std::floor(y0 / sat_.height) * sat_.height;
    if (x0 < x1 && x1 - x <= sat_.width && y1 - y <= sat_.height) prefetchInside(x0 - x, x1 - x, y0 - y, y1 - y);
  }

  /// Row of the map that row j of the endless plane repeats.
  GLINT_HD int rowOf(int j) const { return wrapIndex(j, sat_.height); }

  /// Adds the texels from `from` to before `to` of a row of the endless plane.
  GLINT_DEVICE_CALL GLINT_HD void addRow(int row, int from, int to, double weight) {
    if (to - from > kDifferenceCost) {
      return forEachPiece(from, to, sat_.width, [&](double a, double b, double times) {
        addRun<false>(row, static_cast<int>(a), static_cast<int>(b), weight * times);
      });
    }
    for (int column = wrapIndex(from, sat_.width), count = to - from; count > 0; column = 0) {
      const int part = std::min(count, sat_.width - column);
      addRunTexels<false>(row, column, column + part, weight);
      count -= part;
    }
  }

  /// Adds the texels from `from` to before `to` of a row of the endless plane, each times weight(texel).
  template <class Weight>
  GLINT_HD void addTexels(int row, int from, int to, Weight&& weight) {
    constexpr int kSize = HistogramSat::kTileSize;
    const std::uint16_t* texels = sat_.texels.data() + sat_.texelIndex(0, row);
    for (int i = from, column = wrapIndex(from, sat_.width); i < to; ++i) {
      sum_.addTexel(texels[column / kSize * (kSize * kSize) + column % kSize], column & 3, areaUnits(weight(i)));
      if (++column == sat_.width) column = 0;
    }
  }

  /// Position of the nearest point along u of a table with this stride, in texels of the endless plane.
  GLINT_HD double nearestPointX(double x, int stride) const {
    const double period = std::floor(x / sat_.width) * sat_.width;
    return period + texelOf(nearest(x - period, stride, sat_.width), stride, sat_.width);
  }

  /// Rows between two points of the fine table.
  struct Slab {
    int begin, end;
  };
  /// The slab that contains row j.
  /// @param span  height of slabs: a multiple of the stride of the fine table
  GLINT_HD Slab slabOf(int j, int span) const {
    const int row = wrapIndex(j, sat_.height), begin = row / span * span;
    return {j - row + begin, j - row + std::min(begin + span, sat_.height)};
  }

 private:
  /// Rectangles of fewer texels are summed texel by texel.
  static constexpr double kFewTexels = 96;
  /// Cost of a difference of two points of row_sums, as a number of texels that cost as much.
  static constexpr int kDifferenceCost = 96;
  static constexpr std::int64_t kFineLimit = 65536;
  /// Rectangles of less than this many times kFineLimit are added in pieces. In larger rectangles the shorter side times the
  /// largest stride could exceed kFineLimit, and pieces would not fit.
  static constexpr int kMostPieces = 3;
  static constexpr int kCacheLine = 32;  // counters

  static GLINT_HD std::int64_t areaUnits(double area) { return static_cast<std::int64_t>(area * kAreaUnits); }

  /// Splits [low, high] into whole periods and at most two parts of a period. Calls visitor(begin, end, times) with
  /// 0 <= begin < end <= size.
  template <class Visitor>
  static GLINT_HD void forEachPiece(double low, double high, int size, Visitor&& visitor) {
    const double length = high - low, periods = std::floor(length / size);
    if (periods > 0) visitor(0.0, static_cast<double>(size), periods);
    const double begin = std::max(0.0, low - std::floor(low / size) * size), end = begin + (length - periods * size);
    if (begin < std::min<double>(end, size)) visitor(begin, std::min<double>(end, size), 1.0);
    if (end > size) visitor(0.0, end - size, 1.0);
  }

  static GLINT_HD int texelOf(int point, int stride, int size) {
    return static_cast<int>(std::min<std::int64_t>(std::int64_t{point} * stride, size));
  }
  /// The point of a table that is nearest to x, 0 <= x <= size.
  static GLINT_HD int nearest(double x, int stride, int size) {
    const int low = static_cast<int>(x) / stride, last = (size + stride - 1) / stride;
    if (low >= last) return last;
    return x - texelOf(low, stride, size) <= texelOf(low + 1, stride, size) - x ? low : low + 1;
  }

  /// A rectangle whose corners are points of the fine table: the nearest to a rectangle of the map.
  struct Points {
    int a0, a1, b0, b1;
  };
  GLINT_HD Points nearestPoints(double x0, double x1, double y0, double y1) const {
    return {nearest(x0, sat_.stride, sat_.width), nearest(x1, sat_.stride, sat_.width), nearest(y0, sat_.stride, sat_.height),
            nearest(y1, sat_.stride, sat_.height)};
  }

  /// Adds a rectangle that lies inside the map.
  GLINT_DEVICE_CALL GLINT_HD void addInside(double x0, double x1, double y0, double y1, double weight) {
    if ((std::ceil(x1) - std::floor(x0)) * (std::ceil(y1) - std::floor(y0)) <= kFewTexels) {
      return forEachCovered(y0, y1, [&](int j, double covered) { addLine<false>(j, x0, x1, weight * covered); });
    }
    prefetchInside(x0, x1, y0, y1);
    const auto [a0, a1, b0, b1] = nearestPoints(x0, x1, y0, y1);
    const double left = texelOf(a0, sat_.stride, sat_.width), right = texelOf(a1, sat_.stride, sat_.width);
    const double bottom = texelOf(b0, sat_.stride, sat_.height), top = texelOf(b1, sat_.stride, sat_.height);
    addStrip<true>(x0, left, y0, y1, weight);
    addStrip<true>(right, x1, y0, y1, weight);
    addStrip<false>(y0, bottom, left, right, weight);
    addStrip<false>(top, y1, left, right, weight);
    addPoints(a0, a1, b0, b1, weight);
  }

  /// Calls visitor(texel, covered part) for the texels between low and high.
  template <class Visitor>
  static GLINT_HD void forEachCovered(double low, double high, Visitor&& visitor) {
    for (int k = static_cast<int>(low); k < high; ++k) visitor(k, std::min(high, k + 1.0) - std::max(low, double(k)));
  }

  /// Adds the columns (or rows) from `from` to `to`, cut at [low, high]. Subtracts them if `from` > `to`.
  template <bool kColumns>
  GLINT_HD void addStrip(double from, double to, double low, double high, double weight) {
    if (!(high > low)) return;
    const double sign = from <= to ? weight : -weight;
    forEachCovered(std::min(from, to), std::max(from, to),
                   [&](int line, double covered) { addLine<kColumns>(line, low, high, sign * covered); });
  }

  /// Adds one column (or row) from low to high. Texels at the ends count by their covered part.
  template <bool kColumn>
  GLINT_DEVICE_CALL GLINT_HD void addLine(int line, double low, double high, double weight) {
    const int first = static_cast<int>(std::ceil(low)), last = static_cast<int>(high);
    if (first > last) return addRunTexels<kColumn>(line, last, first, weight * (high - low));
    if (low < first) addRunTexels<kColumn>(line, first - 1, first, weight * (first - low));
    addRun<kColumn>(line, first, last, weight);
    if (last < high) addRunTexels<kColumn>(line, last, last + 1, weight * (high - last));
  }

  /// Adds whole texels from `from` to before `to` of a column (or row).
  template <bool kColumn>
  GLINT_DEVICE_CALL GLINT_HD void addRun(int line, int from, int to, double weight) {
    const int stride = sat_.line_stride, size = kColumn ? sat_.height : sat_.width;
    const int first = nearest(from, stride, size), last = nearest(to, stride, size);
    const int begin = texelOf(first, stride, size), end = texelOf(last, stride, size);
    const int ends = std::abs(from - begin) + std::abs(to - end);
    if (first >= last || ends + kDifferenceCost > to - from) return addRunTexels<kColumn>(line, from, to, weight);
    const int points = kColumn ? sat_.pointsY(stride) : sat_.pointsX(stride);
    const std::uint16_t* sums =
        (kColumn ? sat_.column_sums : sat_.row_sums).data() + rowMajorIndex(0, line, points * sat_.rowLength());
    const int step = static_cast<int>(kFineLimit - 1) / stride;
    for (int k = first; k < last; k += step) {
      const int next = std::min(k + step, last);
      sum_.addDifference(sums + rowMajorIndex(0, next, sat_.rowLength()), sums + rowMajorIndex(0, k, sat_.rowLength()), weight);
    }
    addRunTexels<kColumn>(line, std::min(from, begin), std::max(from, begin), from < begin ? weight : -weight);
    addRunTexels<kColumn>(line, std::min(to, end), std::max(to, end), end < to ? weight : -weight);
  }

  template <bool kColumn>
  GLINT_HD void addRunTexels(int line, int from, int to, double weight) {
    constexpr int kSize = HistogramSat::kTileSize;
    constexpr int kStep = kColumn ? kSize : 1;
    const std::size_t tile_step = rowMajorIndex(0, kSize * kSize, kColumn ? sat_.tileColumns() : 1);
    const std::uint16_t* tile = sat_.texels.data() + (kColumn ? sat_.texelIndex(line, 0) : sat_.texelIndex(0, line)) +
                                static_cast<std::size_t>(from / kSize) * tile_step;
    const std::int64_t area = areaUnits(weight);
    int k = from;
    for (; k < to && k % kSize != 0; ++k) sum_.addTexel(tile[k % kSize * kStep], k & 3, area);
    if (k > from && k % kSize == 0) tile += tile_step;
    for (; k + kSize <= to; k += kSize, tile += tile_step)
      for (int e = 0; e < kSize; ++e) sum_.addTexel(tile[e * kStep], e & 3, area);
    for (; k < to; ++k) sum_.addTexel(tile[k % kSize * kStep], k & 3, area);
  }

  /// The largest rectangle of the coarse table inside a rectangle of the fine table, in points of either table; empty if
  /// c0 >= c1 or d0 >= d1.
  struct Inner {
    int c0, c1, d0, d1;
    int a0, a1, b0, b1;
  };
  GLINT_HD Inner innerOf(int a0, int a1, int b0, int b1) const {
    const int last_a = sat_.pointsX(sat_.stride) - 1, last_b = sat_.pointsY(sat_.stride) - 1;
    const int ratio = sat_.coarse_stride / sat_.stride;
    Inner inner;
    inner.c0 = (a0 + ratio - 1) / ratio;
    inner.c1 = a1 == last_a ? sat_.pointsX(sat_.coarse_stride) - 1 : a1 / ratio;
    inner.d0 = (b0 + ratio - 1) / ratio;
    inner.d1 = b1 == last_b ? sat_.pointsY(sat_.coarse_stride) - 1 : b1 / ratio;
    inner.a0 = std::min(inner.c0 * ratio, last_a), inner.a1 = std::min(inner.c1 * ratio, last_a);
    inner.b0 = std::min(inner.d0 * ratio, last_b), inner.b1 = std::min(inner.d1 * ratio, last_b);
    return inner;
  }

  /// Adds the rectangle between points (a0, b0) and (a1, b1) of the fine table.
  GLINT_DEVICE_CALL GLINT_HD void addPoints(int a0, int a1, int b0, int b1, double weight) {
    if (a0 >= a1 || b0 >= b1) return;
    const std::int64_t all = texels(a0, a1, b0, b1);
    if (all < kMostPieces * kFineLimit) return addPieces(a0, a1, b0, b1, weight);
    if (a0 == 0 && b0 == 0 && a1 == sat_.pointsX(sat_.stride) - 1 && b1 == sat_.pointsY(sat_.stride) - 1)
      return sum_.addMap(weight);  // the whole map may have 2^32 texels, which a counter cannot hold
    const Inner inner = innerOf(a0, a1, b0, b1);
    if (inner.c0 >= inner.c1 || inner.d0 >= inner.d1) return addPieces(a0, a1, b0, b1, weight);
    sum_.addCorners(coarsePoint(inner.c1, inner.d1), coarsePoint(inner.c0, inner.d1), coarsePoint(inner.c1, inner.d0),
                    coarsePoint(inner.c0, inner.d0), weight);
    const std::int64_t frame = all - texels(inner.a0, inner.a1, inner.b0, inner.b1);
    if (frame == 0) return;
    if (frame < kFineLimit) {
      const std::uint16_t* outer_corners[4] = {finePoint(a1, b1), finePoint(a0, b1), finePoint(a1, b0), finePoint(a0, b0)};
      const std::uint16_t* inner_corners[4] = {finePoint(inner.a1, inner.b1), finePoint(inner.a0, inner.b1),
                                               finePoint(inner.a1, inner.b0), finePoint(inner.a0, inner.b0)};
      return sum_.addFrame(outer_corners, inner_corners, weight);
    }
    addPieces(a0, inner.a0, b0, b1, weight);
    addPieces(inner.a1, a1, b0, b1, weight);
    addPieces(inner.a0, inner.a1, b0, inner.b0, weight);
    addPieces(inner.a0, inner.a1, inner.b1, b1, weight);
  }

  /// Adds a rectangle whose shorter side times the stride is below kFineLimit, in pieces of less than 2^16 texels.
  GLINT_HD void addPieces(int a0, int a1, int b0, int b1, double weight) {
    if (a0 >= a1 || b0 >= b1) return;
    const bool along_a = a1 - a0 >= b1 - b0;
    const std::int64_t thickness = std::int64_t{along_a ? b1 - b0 : a1 - a0} * sat_.stride;
    const int step = static_cast<int>(std::max<std::int64_t>(1, (kFineLimit - 1) / (thickness * sat_.stride)));
    for (int k = along_a ? a0 : b0, end = along_a ? a1 : b1; k < end; k += step) {
      const int next = std::min(k + step, end);
      along_a ? addFine(k, next, b0, b1, weight) : addFine(a0, a1, k, next, weight);
    }
  }

  GLINT_HD void addFine(int a0, int a1, int b0, int b1, double weight) {
    const auto at = [&](int a, int b) { return finePoint(a, b); };
    sum_.addCorners(at(a1, b1), at(a0, b1), at(a1, b0), at(a0, b0), weight);
  }

  GLINT_HD std::int64_t texels(int a0, int a1, int b0, int b1) const {
    const int stride = sat_.stride;
    return std::int64_t{texelOf(a1, stride, sat_.width) - texelOf(a0, stride, sat_.width)} *
           (texelOf(b1, stride, sat_.height) - texelOf(b0, stride, sat_.height));
  }

  template <class Counter>
  GLINT_HD const Counter* point(const Counter* table, int points, int a, int b) const {
    return table + rowMajorIndex(a, b, points) * static_cast<std::size_t>(sat_.rowLength());
  }
  GLINT_HD const std::uint16_t* finePoint(int a, int b) const {
    return point(sat_.sums.data(), sat_.pointsX(sat_.stride), a, b);
  }
  GLINT_HD const std::uint32_t* coarsePoint(int c, int d) const {
    return point(sat_.coarse_sums.data(), sat_.pointsX(sat_.coarse_stride), c, d);
  }

  /// Prefetches the counters that a rectangle of the map needs.
  GLINT_HD void prefetchInside(double x0, double x1, double y0, double y1) const {
    const auto [a0, a1, b0, b1] = nearestPoints(x0, x1, y0, y1);
    const double left = texelOf(a0, sat_.stride, sat_.width), right = texelOf(a1, sat_.stride, sat_.width);
    if (y0 != texelOf(b0, sat_.stride, sat_.height)) prefetchLine<false>(y0, left, right);
    if (x0 != left) prefetchLine<true>(x0, y0, y1);
    if (x1 != right) prefetchLine<true>(x1, y0, y1);
    if (y1 != texelOf(b1, sat_.stride, sat_.height)) prefetchLine<false>(y1, left, right);
    prefetchPoints(a0, a1, b0, b1);
  }

  /// Prefetches the corners in the fine table.
  GLINT_HD void prefetchPoints(int a0, int a1, int b0, int b1) const {
    if (a0 >= a1 || b0 >= b1) return;
    prefetchCorners(a0, a1, b0, b1);
    if (texels(a0, a1, b0, b1) < kMostPieces * kFineLimit) return;
    const Inner inner = innerOf(a0, a1, b0, b1);
    if (inner.c0 < inner.c1 && inner.d0 < inner.d1) prefetchCorners(inner.a0, inner.a1, inner.b0, inner.b1);
  }
  GLINT_HD void prefetchCorners(int a0, int a1, int b0, int b1) const {
    for (const std::uint16_t* row : {finePoint(a0, b0), finePoint(a1, b0), finePoint(a0, b1), finePoint(a1, b1)})
      for (int k = 0; k < sat_.rowLength(); k += kCacheLine) prefetch(row + k);
  }

  /// Prefetches the texels of a short strip: column (or row) `line` from low to high.
  template <bool kColumn>
  GLINT_HD void prefetchLine(double line, double low, double high) const {
    if (high - low > 2 * sat_.line_stride) return;
    constexpr int kSize = HistogramSat::kTileSize;
    const int at = std::min(static_cast<int>(line), (kColumn ? sat_.width : sat_.height) - 1);
    const int end = static_cast<int>(high);
    for (int k = static_cast<int>(low); k < end; k += kSize) {
      const std::uint16_t* texel = sat_.texels.data() + (kColumn ? sat_.texelIndex(at, k) : sat_.texelIndex(k, at));
      prefetch(texel);
      if (kColumn) prefetch(texel + kCacheLine);
    }
  }

  const HistogramSat& sat_;
  Sum& sum_;
};

}  // namespace glint
