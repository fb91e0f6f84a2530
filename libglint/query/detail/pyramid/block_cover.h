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

/// How much the rows and columns of a block count in a box.
class BlockCover {
 public:
  GLINT_HD void set(const BlockBox& box) {
    const bool whole_rows = setWeights(box.y0, box.y1, rows, first_row, end_row);
    whole_ = setWeights(box.x0, box.x1, columns, first_column, end_column) && whole_rows;
    first_column = first_column / 4 * 4;
  }
  int first_row, end_row, first_column, end_column;  ///< the first column is a multiple of 4
  float columns[kBlockSize], rows[kBlockSize];       ///< weights: 1 inside, 0 outside, other numbers near edges
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
  /// Writes the weights of the pixels along an axis, and where the first and the last are that are not 0.
  /// @return whether all weights are 1
  static GLINT_HD bool setWeights(const BoxEdge& low, const BoxEdge& high, float (&weights)[kBlockSize], int& first, int& end) {
    // In a box inside one pixel, either edge may be the one that depends on the pixel before or after.
    first = std::min(low.firstAbove(), high.firstAbove());
    end = std::max(low.endBelow(), high.endBelow());
    float steps[kBlockSize + 1] = {};  // steps[k]: weight of pixel k - 1 less that of pixel k
    for (int tap = 0; tap < BoxEdge::kTaps; ++tap) {
      steps[high.pixels[tap]] += high.parts[tap];
      steps[low.pixels[tap]] -= low.parts[tap];
    }
    for (float& weight : weights) weight = 0;
    float weight = 0;
    for (int k = kBlockSize - 1; k >= first; --k) weights[k] = weight += steps[k + 1];
    return first == 0 && end == kBlockSize && low.isWhole() && high.isWhole();
  }
  bool whole_;
};

}  // namespace glint
