#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/math/hash.h"
#include "glint/model/tiny_example.h"
#include "glint/query/detail/tiny/normal_turn.h"

namespace glint {

/// A position on a plane without end: a cell, and texels from its lower left corner.
struct PlanePoint {
  std::int64_t cell_x = 0, cell_y = 0;
  Vec2 offset;
};

/// A copy of the example on the plane.
struct PlacedExample {
  Vec2 centre;     ///< texels, from the corner of some cell
  Matrix2 matrix;  ///< from the example to the plane
  Matrix2 inverse;
  Vec2 half_extent;  ///< of the bounding box
  float heights = 1;

  /// Position in the example, in texels from its middle, of a point of the plane.
  GLINT_HD Vec2 local(Vec2 point) const { return inverse * (point - centre); }
};

/// The noise that places examples: the examples of each cell, drawn from a hash of the cell's number, so that any cell is known
/// without its neighbours. Numbers of examples follow Poisson's distribution and centres are even, as of points without order.
class CellExamples {
 public:
  static constexpr int kMostPerCell = 24;

  GLINT_HD explicit CellExamples(const TinyExample& example)
      : transforms_(example.transforms),
        seed_(static_cast<std::uint64_t>(example.seed)),
        size_(static_cast<float>(example.size())) {
    double term = std::exp(-double{example.density}), sum = term;
    for (int k = 0; k < kMostPerCell; ++k) {
      thresholds_[k] = static_cast<std::uint32_t>(std::min(sum, 1.0) * 4294967295.0);
      term *= double{example.density} / (k + 1);
      sum += term;
    }
  }

  GLINT_HD std::uint64_t key(std::int64_t cell_x, std::int64_t cell_y) const {
    return mixBits(mixBits(mixBits(seed_ + kCounterStep) + static_cast<std::uint64_t>(cell_x) * kCounterStep) +
                   static_cast<std::uint64_t>(cell_y) * kCounterStep);
  }
  GLINT_HD int count(std::uint64_t key) const {
    const auto bits = static_cast<std::uint32_t>(mixBits(key) >> 32);
    int count = 0;
    while (count < kMostPerCell && bits > thresholds_[count]) ++count;
    return count;
  }
  /// Centre of example k of a cell, texels from its corner.
  GLINT_HD Vec2 centre(std::uint64_t key, int k) const {
    const std::uint64_t bits = numbers(key, k, 0);
    return {size_ * unit(bits, 0), size_ * unit(bits, 1)};
  }
  /// Sets the transform of example k of a cell.
  GLINT_HD void transform(std::uint64_t key, int k, PlacedExample& placed) const {
    const std::uint64_t a = numbers(key, k, 1), b = numbers(key, k, 2);
    const TinyTransforms& t = transforms_;
    TransformParts parts;
    parts.scale = drawn(t.scale, unit(a, 0)), parts.stretch = drawn(t.stretch, unit(a, 1)),
    parts.shear = drawn(t.shear, unit(a, 2));
    parts.angle_rad = drawn(t.rotation_rad, unit(b, 0));
    placed.heights = drawn(t.heights, unit(b, 1));
    parts.mirrored = unit(b, 2) < t.mirror;
    placed.matrix = transformMatrix(parts);
    placed.inverse = placed.matrix.inverse();
    const Matrix2& m = placed.matrix;
    placed.half_extent = {0.5f * size_ * (std::fabs(m.xx) + std::fabs(m.xy)),
                          0.5f * size_ * (std::fabs(m.yx) + std::fabs(m.yy))};
  }

 private:
  static GLINT_HD std::uint64_t numbers(std::uint64_t key, int k, int stream) {
    return mixBits(key + kCounterStep * static_cast<std::uint64_t>(3 * k + stream + 1));
  }
  /// One of three numbers in [0, 1), of 21 bits.
  static GLINT_HD float unit(std::uint64_t bits, int k) {
    return static_cast<float>(bits >> (21 * k + 1) & 0x1fffff) * 0x1p-21f;
  }
  static GLINT_HD float drawn(const TinyRange& range, float xi) { return range.low + xi * (range.high - range.low); }

  TinyTransforms transforms_;
  std::uint64_t seed_;
  float size_;
  std::uint32_t thresholds_[kMostPerCell];  ///< of Poisson's distribution, times 2^32
};

}  // namespace glint
