#pragma once

#include <algorithm>
#include <cstdint>

#include "glint/math/float4.h"
#include "glint/model/ndf_pyramid.h"

namespace glint {

/// Values of columns at one pixel of a block axis: differences of two rows of inclusive prefix sums [16][count].
struct PrefixAxis {
  GLINT_HD PrefixAxis(const std::int32_t* prefix, int columns, int pixel)
      : inner(pixel > 0 ? -1 : 0), count(columns), at(prefix + pixel * columns), before(at - (columns & inner)) {}
  GLINT_HD float one(int k) const { return differenceOf(at[k], inner != 0 ? before[k] : 0); }
  GLINT_HD Float4 four(int k) const { return Float4::difference(at + k, before + k, inner); }
  /// Writes the values of all columns.
  GLINT_HD void store(float* values) const {
    if (count < 4) {
      for (int k = 0; k < count; ++k) values[k] = one(k);
      return;
    }
    int k = 0;
    for (; k + 4 <= count; k += 4) four(k).store(values + k);
    if (k < count) four(count - 4).store(values + count - 4);
  }

  int inner;  ///< -1, or 0 at pixel 0, which has no row before it
  int count;
  const std::int32_t *at, *before;
};

/// sums[k] = sum of column k over the positions from `low` to `high` of one block axis. Pixels at the ends count by the part
/// that is covered.
/// @param prefix  inclusive prefix sums [16][columns]
inline GLINT_HD void sumAlongAxis(const std::int32_t* prefix, int columns, float low, float high, float* sums) {
  const int l = std::min(static_cast<int>(low), kBlockSize - 1), h = std::min(static_cast<int>(high), kBlockSize - 1);
  const float fl = low - static_cast<float>(l), fh = high - static_cast<float>(h);
  // The sum up to a position inside a pixel is (1 - f) * prefix before the pixel + f * prefix after it.
  const std::int32_t* l0 = l > 0 ? prefix + (l - 1) * columns : nullptr;
  const std::int32_t* h0 = h > 0 ? prefix + (h - 1) * columns : nullptr;
  const std::int32_t* l1 = prefix + l * columns;
  const std::int32_t* h1 = prefix + h * columns;
  for (int k = 0; k < columns; ++k) {
    const float before = (l0 ? (1 - fl) * static_cast<float>(l0[k]) : 0.0f) + (fl > 0 ? fl * static_cast<float>(l1[k]) : 0.0f);
    const float after = (h0 ? (1 - fh) * static_cast<float>(h0[k]) : 0.0f) + fh * static_cast<float>(h1[k]);
    sums[k] = after - before;
  }
}

/// values[k][t] = column k at pixel t of a block axis.
/// @param prefix  inclusive prefix sums [16][columns]
inline GLINT_HD void valuesOfAxis(const std::int32_t* prefix, int columns, float* values) {
  for (int k = 0; k < columns; ++k) {
    float before = 0;
    for (int t = 0; t < kBlockSize; ++t) {
      const auto sum = static_cast<float>(prefix[t * columns + k]);
      values[k * kBlockSize + t] = sum - before;
      before = sum;
    }
  }
}

/// pixels[y][x] = max(0, sum over k of in_rows[k][y] * column k at pixel x).
/// @param along_x  valuesOfAxis of x, [columns][16]
/// @param in_rows  weights of the columns in each row of the block, [columns][16]
inline GLINT_HD void combineRows(const float* along_x, const float* in_rows, int columns, float* pixels) {
  for (int y = 0; y < kBlockSize; ++y) {
    Float4 sums[4] = {Float4::zero(), Float4::zero(), Float4::zero(), Float4::zero()};
    for (int k = 0; k < columns; ++k) {
      const Float4 w = Float4::all(in_rows[k * kBlockSize + y]);
      for (int x = 0; x < 4; ++x) sums[x] = sums[x] + w * Float4::load(along_x + k * kBlockSize + 4 * x);
    }
    for (int x = 0; x < 4; ++x) sums[x].positive().store(pixels + y * kBlockSize + 4 * x);
  }
}

}  // namespace glint
