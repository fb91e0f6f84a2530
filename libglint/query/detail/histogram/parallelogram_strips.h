#pragma once

#include <algorithm>
#include <cmath>

#include "glint/query/detail/histogram/parallelogram_sums.h"
#include "glint/query/detail/histogram/rectangle_sums.h"

namespace glint {

/// The plan by which ParallelogramStrips cuts a parallelogram into strips.
struct StripPlan {
  int rows = 0;          ///< height of the strips, texels; 0: no strips are good enough
  int snap = 0;          ///< ends of strips are moved to points of the table with this stride, texels; 0: they are not moved
  double misplaced = 0;  ///< largest share of the parallelogram that strips may count in a wrong place
};

/// Plans strips of one height: the highest strips that misplace at most a given share of a parallelogram.
///
/// A strip replaces each slanted side by its mean position. In a strip of height h, a side that runs over r texels along u and
/// its mean enclose an area of at most 8/27 r h (r h / 4 without a corner). Over all strips this is 32/27 h (|ax| + |bx|). Half
/// of it is misplaced: each texel too much is one texel missing elsewhere. Moving the ends to points `snap` apart moves an area
/// of 1/2 snap * height on each side. This counts twice, because shares are then relative to a changed area.
/// @param ax, ay, bx, by  half axes, texels
GLINT_HD inline StripPlan planStrips(const HistogramSat& sat, double ax, double ay, double bx, double by, double tolerance) {
  const double area = 4 * std::fabs(ax * by - ay * bx), height = 2 * (std::fabs(ay) + std::fabs(by));
  const double per_row = 16.0 / 27 * (std::fabs(ax) + std::fabs(bx)) / area;
  for (const int snap : {sat.coarse_stride, sat.stride, 0}) {
    const double snapped = snap * height / area;
    if (snapped > 0.5 * tolerance) continue;
    const int unit = std::max(snap, sat.stride);
    const int rows = static_cast<int>(std::min((tolerance - snapped) / per_row, height + unit)) / unit * unit;
    if (rows > 0) return {rows, snap, snapped + rows * per_row};
  }
  return {};
}

/// Adds a parallelogram of texels to a sum over bins as strips: rectangles between rows of the fine table. Each strip begins
/// and ends at the mean position of the parallelogram's sides in these rows. So slanted sides become steps, and each strip has
/// the right area.
///
/// Strips end at the same rows of the map wherever the parallelogram lies, so that results change smoothly as it moves.
/// O(height / plan.rows) rectangles; without plan.snap, O(height * stride) texels as well.
template <class Sum>
class ParallelogramStrips {
 public:
  GLINT_HD ParallelogramStrips(const HistogramSat& sat, Sum& sum, const StripPlan& plan) : sum_(sat, sum), plan_(plan) {}

  /// @param edges  in texels of the endless plane
  /// @return area that was added, texels^2
  GLINT_HD double add(const ParallelogramEdges& edges, double weight) {
    double area = 0;
    // A ring of strips: each waits there while the memory fetches its counters.
    Strip waiting[kAhead];
    int count = 0;
    const auto addWaiting = [&](int k) {
      const Strip& s = waiting[k % kAhead];
      if (!(s.left < s.right)) return;
      sum_.add(s.left, s.right, s.low, s.high, weight);
      area += (s.right - s.left) * (s.high - s.low);
    };
    for (double y = edges.low(); y < edges.high(); ++count) {
      if (count >= kAhead) addWaiting(count);
      Strip& s = waiting[count % kAhead];
      s = strip(edges, y);
      sum_.prefetchWithin(s.left, s.right, s.low, s.high);
      y = s.high;
    }
    for (int k = std::max(0, count - kAhead); k < count; ++k) addWaiting(k);
    return area;
  }

 private:
  static constexpr int kAhead = 4;
  struct Strip {
    double left, right, low, high;
  };

  /// The strip from row y up.
  GLINT_HD Strip strip(const ParallelogramEdges& edges, double y) const {
    const double end = std::min<double>(sum_.slabOf(static_cast<int>(std::floor(y)), plan_.rows).end, edges.high());
    const double left = meanX(edges, 1, y, end), right = meanX(edges, -1, y, end);
    if (plan_.snap == 0) return {left, right, y, end};
    return {sum_.nearestPointX(left, plan_.snap), sum_.nearestPointX(right, plan_.snap), y, end};
  }

  /// Mean, over the rows from low to high, of the position where the parallelogram begins (sign 1) or ends (sign -1).
  static GLINT_HD double meanX(const ParallelogramEdges& edges, double sign, double low, double high) {
    double sum = 0;
    for (const ParallelogramEdges::Edge& edge : edges) {
      const double from = std::max(edge.low, low), to = std::min(edge.high, high);
      if (edge.sign == sign && to > from) sum += (to - from) * (edge.x + (0.5 * (from + to) - edge.low) * edge.slope);
    }
    return sum / (high - low);
  }

  RectangleSums<Sum> sum_;
  StripPlan plan_;
};

}  // namespace glint
