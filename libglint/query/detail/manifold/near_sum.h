#pragma once

#include <algorithm>
#include <cstddef>

#include "glint/math/avx2.h"
#include "glint/math/bits.h"
#include "glint/model/near_normals.h"
#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/common/texel_choice.h"
#include "glint/query/detail/manifold/near_loads.h"
#include "glint/query/detail/manifold/near_lobes.h"

namespace glint {

/// A surface whose normals are asked for.
struct NearSurface {
  NearNormals map;
  float sigma_r = 0;
  Surface surface = Surface::flat;
  Boundary boundary = Boundary::wrap;
  float reach2 = 0;  ///< squared radius of the ball in which facets count, deviations, for footprints with a closed-form total

  GLINT_HD TexelGrid grid() const { return {map.width, map.height, surface, boundary}; }
};

/// Triangles or facets that wait until enough of them are there to fill all lanes.
template <int kNumbers>
struct Pending {
  static constexpr int kFull = 64;
  int count = 0;
  // A leaf adds eight at most, and the last lanes are loaded with the others.
  alignas(32) float weight[kFull + 16];
  alignas(32) float number[std::size_t{kNumbers}][kFull + 16];
};

/// Adds weight times value of the first `count` that wait, lane by lane. A value that is NaN, of a broken normal, counts as 0.
template <class V, class Lobe>
GLINT_LANE void addBatches(const Lobe& lobe, bool smooth, const Pending<Lobe::kNumbers>& pending, int count, float* sums) {
  V sum = V::load(sums);
  for (int k = 0; k < count; k += V::kCount) {
    V numbers[Lobe::kNumbers];
    for (int q = 0; q < Lobe::kNumbers; ++q) numbers[q] = V::load(pending.number[q] + k);
    const V value = smooth ? lobe.triangle(numbers) : lobe.facet(numbers[0], numbers[1]);
    sum = sum + V::load(pending.weight + k) * upperOf(V::all(0), value);
  }
  sum.store(sums);
}
/// addBatches as a function that is not inlined: for Lanes8 in code for processors with AVX2, else for every processor.
template <class V>
struct PendingSum {
  template <class Lobe>
  GLINT_DEVICE_CALL static GLINT_HD void add(const Lobe& lobe, bool smooth, const Pending<Lobe::kNumbers>& pending, int count,
                                             float* sums) {
    addBatches<V>(lobe, smooth, pending, count, sums);
  }
};
#ifdef GLINT_AVX2
template <>
struct PendingSum<Lanes8> {
  template <class Lobe>
  [[gnu::noinline]] GLINT_AVX2 static void add(const Lobe& lobe, bool smooth, const Pending<Lobe::kNumbers>& pending, int count,
                                               float* sums) {
    addBatches<Lanes8>(lobe, smooth, pending, count, sums);
  }
};
#endif

/// Sum over the texels of a footprint near a half vector, or near a box of half vectors.
///
/// A facet counts by its weight in the footprint and by its lobe: both are Gaussians, one of position and one of the normal. So the sum
/// visits only facets inside a ball of the four-dimensional space of position and normal, whose radius is given in deviations.
/// A node of the min-max pyramid is skipped if its distance from the centre and the half vector in this space exceeds the radius.
/// Nodes are tested in strips of eight; a node that is kept has 8x8 nodes three levels below.
/// @tparam V  Lanes1, Lanes4x2, or Lanes8 in functions that are marked GLINT_AVX2
template <class V, class Lobe>
class NearSum {
 public:
  /// @param reach2  squared radius of the ball, deviations
  GLINT_LANE NearSum(const NearSurface& surface, const FootprintWeights& weights, const Lobe& lobe, float reach2)
      : s_(surface), w_(weights), lobe_(lobe), reach2_(reach2) {
    inverse_sigma_ = 1 / s_.sigma_r;
    smooth_ = s_.surface == Surface::smooth;
    if (!w_.isBox()) {
      white_ = w_.whitening();
      const float reach = std::sqrt(reach2_);
      row_reach_ = reach / white_.along;
      column_reach_ =
          reach * std::sqrt(1 / (white_.across * white_.across) + white_.slant * white_.slant / (white_.along * white_.along));
    }
  }

  /// Sum of weight times density (or mass) of the facets.
  GLINT_LANE double sum() {
    int first_x = w_.column_begin, last_x = w_.column_end, first_y = w_.row_begin, last_y = w_.row_end;
    if (!w_.isBox()) {  // one texel more on the low side: triangles of a cell reach into the next texel
      const Vec2 c = w_.centre();
      first_x = std::max(first_x, toInt(c.x - column_reach_) - 1), last_x = std::min(last_x, toInt(c.x + column_reach_) + 1);
      first_y = std::max(first_y, toInt(c.y - row_reach_) - 1), last_y = std::min(last_y, toInt(c.y + row_reach_) + 1);
    }
    const int width = s_.map.width, height = s_.map.height;
    const bool wrap = s_.boundary == Boundary::wrap;
    last_column_ = width, last_row_ = height;
    if (!wrap) {
      first_x = std::max(first_x, 0), first_y = std::max(first_y, 0);
      last_column_ = last_x = std::min(last_x, width - (smooth_ ? 1 : 0));
      last_row_ = last_y = std::min(last_y, height - (smooth_ ? 1 : 0));
    }
    for (int y = floorTo(first_y, height); y < last_y; y += height) {
      // Long footprints meet few copies of the map in each row of copies.
      const auto columns = w_.columnsIn(std::max(first_y, y), std::min(last_y, y + height));
      const int begin = std::max(first_x, columns.begin), end = std::min(last_x, columns.end);
      for (int x = floorTo(begin, width); x < end; x += width) {
        offset_x_ = x, offset_y_ = y;
        if (w_.isBox() || insidePeriod(x, y))
          window(std::max(begin - x, 0), std::min(end - x, width), std::max(first_y - y, 0), std::min(last_y - y, height));
        visitLeaves();  // of this copy of the map
      }
    }
    evaluate(true);
    return total_;
  }

 private:
  struct Node {
    int level, i, j;
  };
  static constexpr int kStep = 3;  ///< levels between the nodes that are tested: each has 8x8 nodes below

  GLINT_LANE static int toInt(float x) { return static_cast<int>(std::floor(std::clamp(x, -1e9f, 1e9f))); }

  /// Squared distance from the footprint's centre to a rectangle, in its deviations; a lower bound if the Gaussian is slanted.
  /// @param dx,dy  from the centre of the footprint to the centre of the rectangle
  template <class T>
  GLINT_LANE T squaredPosition(const T& dx, const T& dy, float half_x, float half_y) const {
    const T zero = T::all(0);
    const T a = T::all(white_.across) *
                upperOf(magnitudeOf(dx - T::all(white_.slant) * dy) - T::all(half_x + std::fabs(white_.slant) * half_y), zero);
    const T b = T::all(white_.along) * upperOf(magnitudeOf(dy) - T::all(half_y), zero);
    return a * a + b * b;
  }
  GLINT_LANE bool insidePeriod(int x, int y) const {
    const float half_x = 0.5f * static_cast<float>(s_.map.width), half_y = 0.5f * static_cast<float>(s_.map.height);
    const Vec2 c = w_.centre();
    return squaredPosition(Lanes1{static_cast<float>(x) + half_x - c.x}, Lanes1{static_cast<float>(y) + half_y - c.y},
                           half_x + 1, half_y + 1)
               .v < reach2_;
  }

  /// Visits the texels of a window of the map.
  GLINT_LANE void window(int column_begin, int column_end, int row_begin, int row_end) {
    if (column_begin >= column_end || row_begin >= row_end) return;
    // Each node pushes 8x8 nodes at most, and there are seven levels at most.
    Node stack[81 + 64 * 6];
    int count = 0;
    const int extent = std::max(column_end - column_begin, row_end - row_begin);
    int top = 0;
    while (top + kStep < s_.map.bounds_level_count && (16 << top) < extent) top += kStep;
    const bool bounded = s_.map.bounds_level_count > 0;
    // The nodes of the top level, as the nodes below a node.
    scan(top, column_begin >> (top + 1), (column_end - 1) >> (top + 1), row_begin >> (top + 1), (row_end - 1) >> (top + 1),
         bounded, stack, count);
    while (count > 0) {
      const Node node = stack[--count];
      const int shift = node.level + 1, level = node.level - kStep, down = level + 1;
      scan(level, std::max(node.i << shift, column_begin) >> down, (std::min((node.i + 1) << shift, column_end) - 1) >> down,
           std::max(node.j << shift, row_begin) >> down, (std::min((node.j + 1) << shift, row_end) - 1) >> down, bounded, stack,
           count);
    }
  }

  /// Tests the nodes [i0, i1] x [j0, j1] of a level. Visits the texels of nodes of level 0, puts others on the stack.
  GLINT_LANE void scan(int level, int i0, int i1, int j0, int j1, bool bounded, Node* stack, int& count) {
    const float size = static_cast<float>(2 << level);
    const float half = 0.5f * size - (smooth_ ? 1.0f / 3 : 0.5f), middle = 0.5f * (smooth_ ? size + 1 : size);
    const Vec2 c = w_.centre();
    alignas(32) constexpr float kLane[8] = {0, 1, 2, 3, 4, 5, 6, 7};
    const NearBoundsLevel& nodes = s_.map.bounds[level];
    const std::size_t node_bytes = boundsBytes(s_.map.type);
    if (bounded)
      for (int j = j0; j <= j1; ++j) {
        const char* row = static_cast<const char*>(nodes.nodes) + node_bytes * rowMajorIndex(i0, j, nodes.columns);
        for (int i = i0; i <= i1; i += 4) prefetch(row + node_bytes * static_cast<std::size_t>(i - i0));
        prefetch(row + node_bytes * static_cast<std::size_t>(i1 - i0));
      }
    for (int j = j0; j <= j1; ++j) {
      const float dy = static_cast<float>(offset_y_) + static_cast<float>(j) * size + middle - c.y;
      for (int i = i0; i <= i1; i += V::kCount) {
        const int lanes = std::min(i1 + 1 - i, int{V::kCount});
        const float dx = static_cast<float>(offset_x_) + static_cast<float>(i) * size + middle - c.x;
        V far = V::all(0);
        if (!w_.isBox()) far = squaredPosition(V::all(dx) + V::all(size) * V::load(kLane), V::all(dy), half, half);
        if (bounded) far = far + squaredNormal(level, i, j, lanes);
        unsigned kept = bitsOf(less(far, V::all(reach2_))) & ((1u << lanes) - 1);
        for (; kept != 0; kept &= kept - 1) {
          const int k = lowestBit(kept);
          if (w_.isBox() && w_.misses(offset_x_ + static_cast<double>(static_cast<float>(i + k) * size + middle),
                                      offset_y_ + static_cast<double>(static_cast<float>(j) * size + middle),
                                      0.5 * double{size} + 1, 0.5 * double{size} + 1))
            continue;
          if (level > 0)
            stack[count++] = {level, i + k, j};
          else
            queue(2 * (i + k), 2 * j);
        }
      }
    }
  }

  /// Squared distance in deviations of the bounds of nodes i to i + lanes - 1 of row j from the lobe.
  GLINT_LANE V squaredNormal(int level, int i, int j, int lanes) const {
    const NearBoundsLevel& bounds = s_.map.bounds[level];
    const std::size_t first = rowMajorIndex(i, j, bounds.columns);
    NodeBounds<V> n;
    const bool all = first + V::kCount <= bounds.size();
    if (all && !s_.map.coded()) {
      loadNodes(static_cast<const NormalBounds*>(bounds.nodes) + first, n);
    } else {
      NormalBounds copy[V::kCount] = {};
      if (all)
        decodeNodes(static_cast<const CodeBounds*>(bounds.nodes) + first, V::kCount, s_.map.step, copy);
      else
        for (int k = 0; k < lanes; ++k) copy[k] = s_.map.node(level, first + static_cast<std::size_t>(k));
      loadNodes(copy, n);
    }
    const V zero = V::all(0);
    const V x = upperOf(zero, upperOf(n.low_x - V::all(lobe_.high().x), V::all(lobe_.low().x) - n.high_x));
    const V y = upperOf(zero, upperOf(n.low_y - V::all(lobe_.high().y), V::all(lobe_.low().y) - n.high_y));
    return (x * x + y * y) * V::all(inverse_sigma_ * inverse_sigma_);
  }

  /// Leaves wait, so that the memory brings their normals meanwhile.
  GLINT_LANE void queue(int i, int j) {
    const int height = s_.map.height, width = s_.map.width;
    for (int y = j; y < j + (smooth_ ? 3 : 2); ++y)
      prefetch(static_cast<const char*>(s_.map.texels) +
               normalBytes(s_.map.type) * rowMajorIndex(i, y < height ? y : y - height, width));
    leaves_[leaf_count_++] = {0, i, j};
    if (leaf_count_ == kLeaves) visitLeaves();
  }
  GLINT_LANE void visitLeaves() {
    for (int k = 0; k < leaf_count_; ++k) {
      if (smooth_)
        triangles(leaves_[k].i, leaves_[k].j);
      else
        facets(leaves_[k].i, leaves_[k].j);
      if (pending_.count >= Waiting::kFull || (k + 1 == leaf_count_ && pending_.count >= 8)) evaluate(false);
    }
    leaf_count_ = 0;
  }

  GLINT_LANE Vec2 relative(int i, int j) const {
    const Vec2 n = s_.map.at(i, j);
    return {(n.x - lobe_.origin().x) * inverse_sigma_, (n.y - lobe_.origin().y) * inverse_sigma_};
  }

  GLINT_LANE void facets(int i, int j) {
    for (int k = 0; k < 4; ++k) {
      const int x = i + (k & 1), y = j + (k >> 1);
      if (x >= last_column_ || y >= last_row_) continue;
      const Vec2 n = relative(x, y);
      const float dx = static_cast<float>(offset_x_ + x) + 0.5f - w_.centre().x,
                  dy = static_cast<float>(offset_y_ + y) + 0.5f - w_.centre().y;
      const float position = w_.isBox() ? 0.0f : squaredPosition(Lanes1{dx}, Lanes1{dy}, 0, 0).v;
      if (!(position + lobe_.squaredDistance(Lanes1{n.x}, Lanes1{n.y}).v < reach2_)) continue;
      const float weight = w_.isBox() ? w_.texel(offset_x_ + x, offset_y_ + y) : decayOf(Lanes1{0.5f * position}).v;
      const int at = pending_.count++;
      pending_.weight[at] = weight;
      pending_.number[0][at] = n.x;
      pending_.number[1][at] = n.y;
    }
  }

  GLINT_LANE void triangles(int i, int j) {
    const int width = s_.map.width, height = s_.map.height;
    const unsigned columns = i + 1 < last_column_ ? 0xffu : i < last_column_ ? 0x33u : 0u;
    const unsigned rows = j + 1 < last_row_ ? 0xffu : j < last_row_ ? 0x0fu : 0u;
    // Three rows of three normals; readers load four.
    const Vec2* row[3];
    Vec2 copy[3][4];
    if (i + 3 < width && j + 2 < height) {
      for (int y = 0; y < 3; ++y) {
        const std::size_t first = rowMajorIndex(i, j + y, width);
        if (s_.map.coded()) decodeFour(s_.map.codes() + first, s_.map.step, copy[y]);
        row[y] = s_.map.coded() ? copy[y] : s_.map.normals() + first;
      }
    } else {
      for (int y = 0; y < 3; ++y) {
        for (int x = 0; x < 4; ++x) copy[y][x] = s_.map.at((i + x) % width, (j + y) % height);
        row[y] = copy[y];
      }
    }
    constexpr float kThird = 1.0f / 3;
    alignas(32) constexpr float kX[8] = {2 * kThird, kThird, 1 + 2 * kThird, 1 + kThird,
                                         2 * kThird, kThird, 1 + 2 * kThird, 1 + kThird};
    alignas(32) constexpr float kY[8] = {kThird,     2 * kThird,     kThird,     2 * kThird,
                                         1 + kThird, 1 + 2 * kThird, 1 + kThird, 1 + 2 * kThird};
    const float dx = static_cast<float>(offset_x_ + i) + 0.5f - w_.centre().x,
                dy = static_cast<float>(offset_y_ + j) + 0.5f - w_.centre().y;
    for (int first = 0; first < 8; first += V::kCount) {
      const V position =
          w_.isBox() ? V::all(0) : squaredPosition(V::all(dx) + V::load(kX + first), V::all(dy) + V::load(kY + first), 0, 0);
      Corners<V> c;
      loadCorners(row, first, lobe_.origin(), inverse_sigma_, c);
      alignas(32) float numbers[Lobe::kNumbers][V::kCount], weight[V::kCount];
      V far = V::all(0);
      unsigned whole = 0;
      lobe_.prepare(c, far, whole, numbers);
      unsigned kept = bitsOf(less(position + far, V::all(reach2_)));
      kept &= (columns & rows) >> first;
      if (kept == 0) continue;
      (V::all(0.5f) * decayOf(V::all(0.5f) * position)).store(weight);
      for (; kept != 0; kept &= kept - 1) {
        const int k = lowestBit(kept), lane = first + k;
        const float w =
            w_.isBox() ? w_.triangle(offset_x_ + i + (lane >> 1 & 1), offset_y_ + j + (lane >> 2), lane & 1) : weight[k];
        if (whole >> k & 1u) {  // inside the box of half vectors with its lobe
          total_ += double{w};
          continue;
        }
        const int at = pending_.count++;
        pending_.weight[at] = w;
        for (int q = 0; q < Lobe::kNumbers; ++q) pending_.number[q][at] = numbers[q][k];
      }
    }
  }

  /// Adds what waits. Unless it is the last time, keeps what does not fill all lanes.
  GLINT_LANE void evaluate(bool last) {
    if (last)  // lanes beyond the end hold a triangle that is a point, and no weight
      for (int k = 0; k < V::kCount; ++k) {
        pending_.weight[pending_.count + k] = 0;
        for (int q = 0; q < Lobe::kNumbers; ++q) pending_.number[q][pending_.count + k] = 0;
      }
    const int end = last ? pending_.count + V::kCount - 1 : pending_.count, done = end - end % V::kCount;
    float sums[V::kCount] = {};
    PendingSum<V>::add(lobe_, smooth_, pending_, done, sums);
    for (const float lane : sums) total_ += double{lane};
    const int rest = std::max(pending_.count - done, 0);
    for (int k = 0; k < rest; ++k) {
      pending_.weight[k] = pending_.weight[done + k];
      for (int q = 0; q < Lobe::kNumbers; ++q) pending_.number[q][k] = pending_.number[q][done + k];
    }
    pending_.count = rest;
  }

  const NearSurface& s_;
  const FootprintWeights& w_;
  const Lobe lobe_;
  float reach2_;
  FootprintWeights::Whitening white_{};
  float inverse_sigma_ = 0, row_reach_ = 0, column_reach_ = 0;
  bool smooth_ = false;
  int offset_x_ = 0, offset_y_ = 0, last_column_ = 0, last_row_ = 0;
  static constexpr int kLeaves = 32;
  Node leaves_[kLeaves];  ///< the level does not count
  int leaf_count_ = 0;
  using Waiting = Pending<Lobe::kNumbers>;
  Waiting pending_;
  double total_ = 0;
};

/// Sum over the facets near a lobe, in lanes of eight where the compiler has vectors. The sum has the same bits with and without AVX2.
#ifdef GLINT_AVX2
template <class Lobe>
GLINT_AVX2 GLINT_FLATTEN double nearSumAvx2(const NearSurface& surface, const FootprintWeights& weights, const Lobe& lobe,
                                            float reach2) {
  return NearSum<Lanes8, Lobe>(surface, weights, lobe, reach2).sum();
}
#endif
/// nearSum without AVX2.
template <class Lobe>
GLINT_FLATTEN GLINT_HD double nearSumAny(const NearSurface& surface, const FootprintWeights& weights, const Lobe& lobe,
                                         float reach2) {
#ifdef GLINT_LANES
  return NearSum<Lanes4x2, Lobe>(surface, weights, lobe, reach2).sum();
#else
  return NearSum<Lanes1, Lobe>(surface, weights, lobe, reach2).sum();
#endif
}
template <class Lobe>
GLINT_HD double nearSum(const NearSurface& surface, const FootprintWeights& weights, const Lobe& lobe, float reach2) {
#ifdef GLINT_AVX2
  if (hasAvx2()) return nearSumAvx2(surface, weights, lobe, reach2);
#endif
  return nearSumAny(surface, weights, lobe, reach2);
}

}  // namespace glint
