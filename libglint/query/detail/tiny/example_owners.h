#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/math/bits.h"
#include "glint/query/detail/tiny/cell_examples.h"

namespace glint {

/// The examples near a footprint, and which of them is seen at each of some points (its owner).
class NearExamples {
 public:
  /// Most examples that are looked at. TinyExample::kMostExpected keeps their number below, but for rare cells with many examples.
  static constexpr int kMost = 96;
  static constexpr int kMostPoints = 128;
  static constexpr int kNone = 255;

  /// Collects the examples whose bounding boxes meet a box around a point.
  /// @param half_x, half_y  of the box, texels
  GLINT_HD NearExamples(const CellExamples& cells, const PlanePoint& point, float size, float reach, float half_x,
                        float half_y) {
    const float far_x = half_x + reach * size, far_y = half_y + reach * size;
    const auto cellOf = [&](float x) { return static_cast<int>(std::floor(x / size)); };
    const int last_x = cellOf(point.offset.x + far_x), last_y = cellOf(point.offset.y + far_y);
    for (int j = cellOf(point.offset.y - far_y); j <= last_y; ++j) {
      for (int i = cellOf(point.offset.x - far_x); i <= last_x; ++i) {
        const std::uint64_t key = cells.key(neighbour(point.cell_x, i), neighbour(point.cell_y, j));
        const Vec2 corner = {static_cast<float>(i) * size, static_cast<float>(j) * size};
        const int count = cells.count(key);
        for (int k = 0; k < count && count_ < kMost; ++k) {
          PlacedExample& placed = examples_[count_];
          placed.centre = corner + cells.centre(key, k);
          const float dx = std::fabs(placed.centre.x - point.offset.x), dy = std::fabs(placed.centre.y - point.offset.y);
          if (dx > far_x || dy > far_y) continue;
          cells.transform(key, k, placed);
          if (dx <= half_x + placed.half_extent.x && dy <= half_y + placed.half_extent.y) ++count_;
        }
      }
    }
  }

  /// The cell some cells on; sums wrap.
  static GLINT_HD std::int64_t neighbour(std::int64_t cell, int away) {
    return static_cast<std::int64_t>(static_cast<std::uint64_t>(cell) + static_cast<std::uint64_t>(std::int64_t{away}));
  }

  GLINT_HD int count() const { return count_; }
  GLINT_HD const PlacedExample& operator[](int k) const { return examples_[k]; }

  /// Finds the owner of each point; kNone where no example covers it.
  /// @param points  row by row, texels from the corner of the same cell as the point of the constructor; at most kMostPoints
  GLINT_HD void findOwners(const Vec2* points, int point_count, float size, TinyOverlap rule, std::uint8_t* owners) const {
    const float half = 0.5f * size;
    if (point_count == 0) return;
    float best[kMostPoints];
    std::uint64_t covered[2][kMostPoints];
    int row_ends[kMostPoints], rows = 0;
    Box2 all = {{1e30f, 1e30f}, {-1e30f, -1e30f}};
    for (int p = 0; p < point_count; ++p) {
      owners[p] = kNone, best[p] = 0, covered[0][p] = covered[1][p] = 0;
      all.low = {std::min(all.low.x, points[p].x), std::min(all.low.y, points[p].y)};
      all.high = {std::max(all.high.x, points[p].x), std::max(all.high.y, points[p].y)};
      if (p > 0 && points[p].y != points[p - 1].y) row_ends[rows++] = p;
    }
    row_ends[rows++] = point_count;
    for (int e = 0; e < count_; ++e) {
      const PlacedExample& placed = examples_[e];
      const Vec2 low = placed.centre - placed.half_extent, high = placed.centre + placed.half_extent;
      if (low.x > all.high.x || high.x < all.low.x || low.y > all.high.y || high.y < all.low.y) continue;
      int p = 0;
      for (int row = 0; row < rows; p = row_ends[row++]) {
        const float dy = points[p].y - placed.centre.y;
        if (!(std::fabs(dy) < placed.half_extent.y)) continue;
        for (int k = p; k < row_ends[row]; ++k) {
          const Vec2 d = {points[k].x - placed.centre.x, dy}, x = placed.inverse * d;
          if (!(x.x >= -half && x.x < half && x.y >= -half && x.y < half)) continue;
          covered[e >> 6][k] |= std::uint64_t{1} << (e & 63);
          const float distance = dot(d, d);
          if (owners[k] != kNone && distance >= best[k]) continue;
          owners[k] = static_cast<std::uint8_t>(e), best[k] = distance;
        }
      }
    }
    if (rule == TinyOverlap::nearest) return;
    for (int p = 0; p < point_count; ++p)
      if (owners[p] != kNone) owners[p] = ownerOfQuarter(points[p], covered[0][p], covered[1][p], owners[p]);
  }

 private:
  template <class Visitor>
  static GLINT_HD void forEachBit(std::uint64_t low, std::uint64_t high, Visitor&& visitor) {
    for (; low != 0; low &= low - 1) visitor(lowestBit(low));
    for (; high != 0; high &= high - 1) visitor(64 + lowestBit(high));
  }

  /// The owner of the quarter that holds a point, of the common part of the boxes of all examples that cover the point.
  GLINT_HD std::uint8_t ownerOfQuarter(Vec2 point, std::uint64_t low, std::uint64_t high, std::uint8_t nearest) const {
    if (high == 0 && (low & (low - 1)) == 0) return nearest;
    if (low == 0 && (high & (high - 1)) == 0) return nearest;
    Box2 box = {{-1e30f, -1e30f}, {1e30f, 1e30f}};
    forEachBit(low, high, [&](int e) {
      const PlacedExample& placed = examples_[e];
      const Vec2 a = placed.centre - placed.half_extent, b = placed.centre + placed.half_extent;
      box = {{std::max(box.low.x, a.x), std::max(box.low.y, a.y)}, {std::min(box.high.x, b.x), std::min(box.high.y, b.y)}};
    });
    const auto quarter = [](float x, float begin, float end) {
      const float middle = 0.5f * (begin + end);
      return x < middle ? 0.5f * (begin + middle) : 0.5f * (middle + end);
    };
    const Vec2 middle = {quarter(point.x, box.low.x, box.high.x), quarter(point.y, box.low.y, box.high.y)};
    float best = 1e30f;
    forEachBit(low, high, [&](int e) {
      const Vec2 d = middle - examples_[e].centre;
      if (!(dot(d, d) < best)) return;
      best = dot(d, d);
      nearest = static_cast<std::uint8_t>(e);
    });
    return nearest;
  }

  union {  // not set before examples are found
    PlacedExample examples_[kMost];
  };
  int count_ = 0;
};

}  // namespace glint
