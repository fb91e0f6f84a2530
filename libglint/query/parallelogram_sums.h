#pragma once

#include <algorithm>
#include <cmath>

#include "glint/query/histogram_sums.h"

namespace glint {

/// Adds a parallelogram of texels to a sum over bins, each texel by its covered area: exact, whatever the angle.
///
/// A row of texels sees the area on the right of the edges that go down less that on the right of those that go up. The texels that
/// an edge crosses get their part of that area in closed form; the rest of a row is a run of whole texels. Runs of the rows between
/// two points of the fine table are cut to points as well, so that they make a rectangle, and the texels left over at their ends
/// are added or taken off. O(length of the edges * stride) texels and O(height / stride) rectangles.
template <class Sum>
class ParallelogramSums {
 public:
  GLINT_HD ParallelogramSums(const HistogramSat& sat, Sum& sum) : sum_(sat, sum) {}

  /// @param x, y    centre, texels of the endless plane
  /// @param ax, ay  one half axis, texels; b: the other
  GLINT_HD void add(double x, double y, double ax, double ay, double bx, double by, double weight) {
    const double turn = ax * by - ay * bx > 0 ? 1 : -1;  // counter-clockwise
    const double sx[4] = {-1, 1, 1, -1}, sy[4] = {-turn, -turn, turn, turn};
    double low = y, high = y;
    for (int k = 0; k < 4; ++k) {
      corner_x_[k] = x + sx[k] * ax + sy[k] * bx;
      corner_y_[k] = y + sx[k] * ay + sy[k] * by;
      low = std::min(low, corner_y_[k]);
      high = std::max(high, corner_y_[k]);
    }
    weight_ = weight;
    const int end = static_cast<int>(std::ceil(high));
    for (int j = static_cast<int>(std::floor(low)); j < end;) {
      const RectangleSlab slab = sum_.slabOf(j);
      const int slab_end = std::min(slab.end, end);
      for (run_count_ = 0; j < slab_end; ++j) addEdges(j);
      addRuns(slab);
    }
    flush();
  }

 private:
  using RectangleSlab = typename RectangleSums<Sum>::Slab;
  struct Run {
    int row;
    double begin, end;
  };

  /// Adds the texels of row j that edges cross, and what lies between them: as a run for later where it is whole.
  GLINT_HD void addEdges(int j) {
    double ends[4], shares[4];  // right of ends[k], an edge adds shares[k] to every texel of the row
    int count = 0;
    for (int k = 0; k < 4; ++k) {
      double x0 = corner_x_[k], y0 = corner_y_[k], x1 = corner_x_[(k + 1) & 3], y1 = corner_y_[(k + 1) & 3];
      const double sign = y1 < y0 ? 1 : -1;
      if (y1 < y0) {
        std::swap(x0, x1);
        std::swap(y0, y1);
      }
      const double low = std::max<double>(y0, j), high = std::min<double>(y1, j + 1);
      if (!(high > low)) continue;
      const double slope = (x1 - x0) / (y1 - y0), at_low = x0 + (low - y0) * slope, at_high = x0 + (high - y0) * slope;
      ends[count] = addEdge(j, std::min(at_low, at_high), std::max(at_low, at_high), sign * (high - low));
      shares[count++] = sign * (high - low);
    }
    if (count == 2) {
      const int left = shares[0] > 0 ? 0 : 1;
      if (shares[left] >= 1 && ends[left] <= ends[1 - left] && run_count_ < HistogramSat::kMaxStride) {
        runs_[run_count_++] = {j, ends[left], ends[1 - left]};
        return;
      }
    }
    addShares(j, ends, shares, count);
  }

  /// Texels of row j that an edge crosses between columns left and right. Returns the first texel that lies wholly on its right.
  GLINT_HD double addEdge(int j, double left, double right, double share) {
    const int first = static_cast<int>(std::floor(left)), last = std::max(static_cast<int>(std::ceil(right)), first);
    const double extent = right - left;
    for (int i = first; i < last; ++i) {
      const double covered = extent > 1e-6 ? (coveredBefore(i + 1 - left) - coveredBefore(i + 1 - right)) / extent
                                           : std::clamp(i + 1 - 0.5 * (left + right), 0.0, 1.0);
      sum_.addTexel(i, j, weight_ * share * covered);
    }
    return last;
  }

  /// Integral of clamp(t, 0, 1).
  static GLINT_HD double coveredBefore(double t) { return t <= 0 ? 0 : t < 1 ? 0.5 * t * t : t - 0.5; }

  /// What edges add to the texels on their right, which ends where all have been passed.
  GLINT_HD void addShares(int j, const double* ends, const double* shares, int count) {
    for (int k = 0; k < count; ++k) {
      // Between each end and the next one in order, the shares of all edges that end before.
      double next = ends[k], total = 0;
      bool last = true, first_of_equals = true;
      for (int e = 0; e < count; ++e) {
        if (ends[e] <= ends[k]) total += shares[e];
        if (ends[e] == ends[k] && e < k) first_of_equals = false;
        if (ends[e] > ends[k] && (last || ends[e] < next)) {
          next = ends[e];
          last = false;
        }
      }
      if (!last && first_of_equals) sum_.addRow(j, ends[k], next, weight_ * total);
    }
  }

  /// The runs of the rows of one slab: as a rectangle where all rows have one, cut to points of the fine table.
  GLINT_HD void addRuns(const RectangleSlab& slab) {
    if (run_count_ < slab.end - slab.begin) {
      for (int k = 0; k < run_count_; ++k) sum_.addRow(runs_[k].row, runs_[k].begin, runs_[k].end, weight_);
      return;
    }
    const Run& middle = runs_[run_count_ / 2];
    const double left = sum_.nearestPointX(middle.begin), right = std::max(left, sum_.nearestPointX(middle.end));
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

  GLINT_HD void addBetween(int j, double from, double to, double weight) {
    if (from < to)
      sum_.addRow(j, from, to, weight);
    else if (to < from)
      sum_.addRow(j, to, from, -weight);
  }

  /// Adds the rectangle of slabs seen so far.
  GLINT_HD void flush() {
    if (left_ < right_ && begin_ < end_) sum_.add(left_, right_, begin_, end_, weight_);
    begin_ = end_ = 0;
  }

  RectangleSums<Sum> sum_;
  double corner_x_[4], corner_y_[4];
  double weight_ = 1;
  Run runs_[HistogramSat::kMaxStride];
  int run_count_ = 0;
  double left_ = 0, right_ = 0;
  int begin_ = 0, end_ = 0;
};

}  // namespace glint
