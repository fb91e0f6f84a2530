#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

#include "glint/math/float4.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/query/detail/pyramid/avx2_blocks.h"
#include "glint/query/detail/pyramid/block_rows.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"

namespace glint {

/// Covered parts of the rows and columns of a block under a box of pixels.
class BlockCover {
 public:
  GLINT_HD void set(const BlockBox& box) {
    constexpr float kFull = kBlockSize;
    whole_ = box.x0 <= 0 && box.y0 <= 0 && box.x1 >= kFull && box.y1 >= kFull;
    for (int k = 0; k < kBlockSize; ++k) {
      columns[k] = covered(box.x0, box.x1, k);
      rows[k] = covered(box.y0, box.y1, k);
    }
    first_row = static_cast<int>(box.y0);
    end_row = std::min(static_cast<int>(std::ceil(box.y1)), int{kBlockSize});
    first_column = static_cast<int>(box.x0) / 4 * 4;
    end_column = std::min(static_cast<int>(std::ceil(box.x1)), int{kBlockSize});
  }
  int first_row, end_row, first_column, end_column;  ///< the first column is a multiple of 4
  float columns[kBlockSize], rows[kBlockSize];       ///< covered parts, 0 to 1
  GLINT_HD bool isWhole() const { return whole_; }

  /// Weighted sum of the covered pixels of some blocks.
  template <class Pixel>
  GLINT_HD float sum(const Pixel* const* blocks, const float* weights, int count) const {
#ifdef GLINT_AVX2
    if constexpr (std::is_same_v<Pixel, std::uint16_t>)
      if (hasAvx2()) return sumCoveredPixels(blocks, weights, count, columns, rows, first_row, end_row);
#endif
    return sumByFour(blocks, weights, count);
  }
  /// `sum` with vectors of four.
  template <class Pixel>
  GLINT_HD float sumByFour(const Pixel* const* blocks, const float* weights, int count) const {
    Float4 sums[kBlockSize / 4] = {Float4::zero(), Float4::zero(), Float4::zero(), Float4::zero()};
    for (int x = first_column; x < end_column; x += 4) {
      Float4 sum = Float4::zero();
      for (int k = 0; k < count; ++k) {
        // Two sums, so that an addition need not wait for the previous one.
        Float4 even = Float4::zero(), odd = Float4::zero();
        const auto row = [&](int y) { return Float4::all(rows[y]) * loadPixels(blocks[k] + y * kBlockSize + x); };
        int y = first_row;
        for (; y + 2 <= end_row; y += 2) even = even + row(y), odd = odd + row(y + 1);
        if (y < end_row) even = even + row(y);
        sum = sum + Float4::all(weights[k]) * (even + odd);
      }
      sums[x / 4] = Float4::load(columns + x) * sum;
    }
    return ((sums[0] + sums[1]) + (sums[2] + sums[3])).sum();
  }

 private:
  static GLINT_HD float covered(float low, float high, int k) {
    return std::max(0.0f, std::min(high, static_cast<float>(k + 1)) - std::max(low, static_cast<float>(k)));
  }
  bool whole_;
};

}  // namespace glint
