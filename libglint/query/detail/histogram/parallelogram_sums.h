#pragma once

#include <algorithm>
#include <cmath>

#include "glint/query/detail/histogram/rectangle_sums.h"

namespace glint {

/// The sides of a parallelogram.
class ParallelogramEdges {
 public:
  struct Edge {
    double x, low, high;  ///< x at the low end
    double slope, sign;   ///< sign: 1 or -1, added to the area on the right of the edge
  };

  /// @param x, y    centre
  /// @param ax, ay  one half axis; b: the other
  GLINT_HD ParallelogramEdges(double x, double y, double ax, double ay, double bx, double by) {
    const double turn = ax * by - ay * bx > 0 ? 1 : -1;  // counter-clockwise
    const double sx[4] = {-1, 1, 1, -1}, sy[4] = {-turn, -turn, turn, turn};
    double corner_x[4], corner_y[4];
    for (int k = 0; k < 4; ++k) {
      corner_x[k] = x + sx[k] * ax + sy[k] * bx;
      corner_y[k] = y + sx[k] * ay + sy[k] * by;
    }
    for (int k = 0; k < 4; ++k) set(edges_[k], corner_x[k], corner_y[k], corner_x[(k + 1) & 3], corner_y[(k + 1) & 3]);
    low_ = std::min({corner_y[0], corner_y[1], corner_y[2], corner_y[3]});
    high_ = std::max({corner_y[0], corner_y[1], corner_y[2], corner_y[3]});
  }

  GLINT_HD const Edge* begin() const { return edges_; }
  GLINT_HD const Edge* end() const { return edges_ + 4; }
  GLINT_HD double low() const { return low_; }
  GLINT_HD double high() const { return high_; }

 private:
  static GLINT_HD void set(Edge& edge, double x0, double y0, double x1, double y1) {
    edge.sign = y1 < y0 ? 1 : -1;
    edge.x = y1 < y0 ? x1 : x0;
    edge.low = std::min(y0, y1);
    edge.high = std::max(y0, y1);
    edge.slope = y0 == y1 ? 0 : (x1 - x0) / (y1 - y0);
  }

  Edge edges_[4];
  double low_, high_;
};

/// Adds a parallelogram of texels to a sum over bins, each texel by its covered area: exact, whatever the angle.
///
/// In each row the parallelogram is the area on the right of its descending edges minus the area on the right of its ascending
/// edges. Texels that an edge crosses get their part of the area in closed form. The other texels of a row form a run of whole
/// texels. The runs of the rows in one slab (between two rows of the fine table) are cut to columns of the fine table, so that
/// together they are one rectangle. Texels left over at the ends of runs are added or subtracted.
/// O(length of the edges * stride) texels and O(height / stride) rectangles.
template <class Sum>
class ParallelogramSums {
 public:
  GLINT_HD ParallelogramSums(const HistogramSat& sat, Sum& sum)
      : sum_(sat, sum), stride_(sat.stride), slab_span_(sat.stride * std::max(1, kSlabTexels / sat.stride)) {}

  /// @param edges  in texels of the endless plane
  GLINT_HD void add(const ParallelogramEdges& edges, double weight) {
    weight_ = weight;
    const int end = static_cast<int>(std::ceil(edges.high()));
    for (int j = static_cast<int>(std::floor(edges.low())); j < end;) {
      const Slab slab = sum_.slabOf(j, slab_span_);
      const int slab_end = std::min(slab.end, end);
      for (run_count_ = 0; j < slab_end; ++j) addEdges(edges, j);
      addRuns(slab);
    }
    flush();
  }

 private:
  using Slab = typename RectangleSums<Sum>::Slab;
  struct Run {
    int row, begin, end;
  };

  /// Adds the texels of row j that edges cross. Texels between edges are kept as a run if they are wholly covered, and else
  /// added.
  GLINT_DEVICE_CALL GLINT_HD void addEdges(const ParallelogramEdges& edges, int j) {
    const int row = sum_.rowOf(j);
    int ends[4], count = 0;
    double shares[4];  // right of ends[k], an edge adds shares[k] to every texel of the row
    for (const ParallelogramEdges::Edge& edge : edges) {
      const double low = std::max<double>(edge.low, j), high = std::min<double>(edge.high, j + 1);
      if (!(high > low)) continue;
      const double at_low = edge.x + (low - edge.low) * edge.slope, at_high = edge.x + (high - edge.low) * edge.slope;
      shares[count] = edge.sign * (high - low);
      ends[count] = addEdge(row, std::min(at_low, at_high), std::max(at_low, at_high), shares[count]);
      ++count;
    }
    if (count == 2) {
      const int left = shares[0] > 0 ? 0 : 1;
      if (shares[left] >= 1 && ends[left] <= ends[1 - left]) {
        runs_[run_count_++] = {row, ends[left], ends[1 - left]};
        return;
      }
    }
    addShares(row, ends, shares, count);
  }

  /// Adds the texels of a row that an edge crosses, between columns left and right. Returns the first texel that lies wholly on
  /// the right of the edge.
  GLINT_HD int addEdge(int row, double left, double right, double share) {
    const int first = static_cast<int>(std::floor(left)), last = std::max(static_cast<int>(std::ceil(right)), first);
    if (last - first == 1) {
      sum_.addTexels(row, first, last, [&](int i) { return weight_ * share * (i + 1 - 0.5 * (left + right)); });
      return last;
    }
    const double scale = weight_ * share / (right - left);
    sum_.addTexels(row, first, last,
                   [&](int i) { return scale * (coveredBefore(i + 1 - left) - coveredBefore(i + 1 - right)); });
    return last;
  }

  /// Integral of clamp(t, 0, 1).
  static GLINT_HD double coveredBefore(double t) { return t <= 0 ? 0 : t < 1 ? 0.5 * t * t : t - 0.5; }

  /// Adds the texels between the ends of edges, where earlier edges contribute a constant share.
  GLINT_HD void addShares(int row, const int* ends, const double* shares, int count) {
    for (int k = 0; k < count; ++k) {
      // Texels between one end and the next, in order, get the shares of all edges that ended before.
      int next = ends[k];
      double total = 0;
      bool last = true, first_of_equals = true;
      for (int e = 0; e < count; ++e) {
        if (ends[e] <= ends[k]) total += shares[e];
        if (ends[e] == ends[k] && e < k) first_of_equals = false;
        if (ends[e] > ends[k] && (last || ends[e] < next)) {
          next = ends[e];
          last = false;
        }
      }
      if (!last && first_of_equals) sum_.addRow(row, ends[k], next, weight_ * total);
    }
  }

  /// Adds the runs of the rows of one slab. If every row has a run, they become a rectangle between points of the fine table.
  GLINT_HD void addRuns(const Slab& slab) {
    if (run_count_ < slab.end - slab.begin) {
      for (int k = 0; k < run_count_; ++k) sum_.addRow(runs_[k].row, runs_[k].begin, runs_[k].end, weight_);
      return;
    }
    const Run& middle = runs_[run_count_ / 2];
    const int left = static_cast<int>(sum_.nearestPointX(middle.begin, stride_));
    const int right = std::max(left, static_cast<int>(sum_.nearestPointX(middle.end, stride_)));
    for (int k = 0; k < run_count_; ++k) {
      addBetween(runs_[k].row, runs_[k].begin, left, weight_);
      addBetween(runs_[k].row, right, runs_[k].end, weight_);
    }
    if (left == left_ && right == right_ && slab.begin == end_) {
      end_ = slab.end;
      return;
    }
    flush();
    left_ = left;
    right_ = right;
    begin_ = slab.begin;
    end_ = slab.end;
  }

  GLINT_HD void addBetween(int row, int from, int to, double weight) {
    if (from < to)
      sum_.addRow(row, from, to, weight);
    else if (to < from)
      sum_.addRow(row, to, from, -weight);
  }

  /// Adds the rectangle of the slabs so far.
  GLINT_HD void flush() {
    if (left_ < right_ && begin_ < end_) sum_.add(left_, right_, begin_, end_, weight_);
    begin_ = end_ = 0;
  }

  /// The height of slabs. Higher slabs leave more texels at the ends of runs, lower slabs make more rectangles.
  static constexpr int kSlabTexels = 16;

  RectangleSums<Sum> sum_;
  int stride_, slab_span_;
  double weight_ = 1;
  Run runs_[HistogramSat::kMaxStride];
  int run_count_ = 0;
  int left_ = 0, right_ = 0, begin_ = 0, end_ = 0;
};

}  // namespace glint
