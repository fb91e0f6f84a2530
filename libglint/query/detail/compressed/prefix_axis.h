#pragma once

#include <algorithm>
#include <cstdint>

#include "glint/math/float4.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/query/detail/pyramid/box_edge.h"

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

/// The prefix sums of one block axis whose weighted sum is the sum between two edges. Sums up to pixel 0 are 0 and are left out.
struct WeightedPrefixes {
  GLINT_HD WeightedPrefixes(const BoxEdge& low, const BoxEdge& high) {
    for (int k = 0; k < BoxEdge::kTaps; ++k) {
      add(high.pixels[k], high.parts[k]);
      add(low.pixels[k], -low.parts[k]);
    }
  }
  GLINT_HD void add(int below, float part) {
    if (below == 0 || part == 0) return;
    pixels[count] = below - 1;
    parts[count++] = part;
  }

  int count = 0;
  int pixels[2 * BoxEdge::kTaps];  ///< the last pixel of each sum
  float parts[2 * BoxEdge::kTaps];
};

/// sums[k] = sum of column k between two edges on one block axis.
/// @param prefix  inclusive prefix sums [16][columns]
inline GLINT_HD void sumAlongAxis(const std::int32_t* prefix, int columns, const BoxEdge& low, const BoxEdge& high,
                                  float* sums) {
  const WeightedPrefixes terms(low, high);
  std::fill(sums, sums + columns, 0.0f);
  for (int t = 0; t < terms.count; ++t) {
    const std::int32_t* row = prefix + terms.pixels[t] * columns;
    for (int k = 0; k < columns; ++k) sums[k] += terms.parts[t] * static_cast<float>(row[k]);
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

/// pixels[y][x] = sum over k of in_rows[k][y] * column k at pixel x.
/// @param along_x  valuesOfAxis of x, [columns][16]
/// @param in_rows  weights of the columns in each row of the block, [columns][16]
inline GLINT_HD void combineRows(const float* along_x, const float* in_rows, int columns, float* pixels) {
  for (int y = 0; y < kBlockSize; ++y) {
    Float4 sums[4] = {Float4::zero(), Float4::zero(), Float4::zero(), Float4::zero()};
    for (int k = 0; k < columns; ++k) {
      const Float4 w = Float4::all(in_rows[k * kBlockSize + y]);
      for (int x = 0; x < 4; ++x) sums[x] = sums[x] + w * Float4::load(along_x + k * kBlockSize + 4 * x);
    }
    for (int x = 0; x < 4; ++x) sums[x].store(pixels + y * kBlockSize + 4 * x);
  }
}

}  // namespace glint
