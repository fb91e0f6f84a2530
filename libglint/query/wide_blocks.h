#pragma once

#include "glint/model/ndf_pyramid.h"
#include "glint/query/wide.h"

#ifdef GLINT_WIDE

namespace glint {

// Blocks of pixels of half precision, [16][16], all >= 0. In a file they may be anything: what is not is taken as 0, or as a
// large number.
GLINT_WIDE inline __m256 loadPixelsWide(const std::uint16_t* p) { return _mm256_max_ps(loadEight(p), _mm256_setzero_ps()); }

/// Weighted sum of the pixels of some blocks by how much of their columns and rows is covered, to the bit that of
/// PyramidNdf::BlockCover::sum.
/// @param blocks, weights     [count]
/// @param columns, rows       [16]; columns that are not covered are 0
/// @param first_row, end_row  rows that are covered
GLINT_WIDE inline float sumCoveredPixels(const std::uint16_t* const* blocks, const float* weights, int count,
                                         const float* columns, const float* rows, int first_row, int end_row) {
  constexpr int kHalf = kBlockSize / 2;
  __m256 left = _mm256_setzero_ps(), right = left;
  for (int k = 0; k < count; ++k) {
    __m256 even_left = _mm256_setzero_ps(), even_right = even_left, odd_left = even_left, odd_right = even_left;
    int y = first_row;
    for (; y + 2 <= end_row; y += 2) {
      const std::uint16_t *even = blocks[k] + y * kBlockSize, *odd = even + kBlockSize;
      const __m256 even_part = _mm256_set1_ps(rows[y]), odd_part = _mm256_set1_ps(rows[y + 1]);
      even_left = _mm256_add_ps(even_left, _mm256_mul_ps(even_part, loadPixelsWide(even)));
      even_right = _mm256_add_ps(even_right, _mm256_mul_ps(even_part, loadPixelsWide(even + kHalf)));
      odd_left = _mm256_add_ps(odd_left, _mm256_mul_ps(odd_part, loadPixelsWide(odd)));
      odd_right = _mm256_add_ps(odd_right, _mm256_mul_ps(odd_part, loadPixelsWide(odd + kHalf)));
    }
    if (y < end_row) {
      const std::uint16_t* even = blocks[k] + y * kBlockSize;
      const __m256 part = _mm256_set1_ps(rows[y]);
      even_left = _mm256_add_ps(even_left, _mm256_mul_ps(part, loadPixelsWide(even)));
      even_right = _mm256_add_ps(even_right, _mm256_mul_ps(part, loadPixelsWide(even + kHalf)));
    }
    const __m256 weight = _mm256_set1_ps(weights[k]);
    left = _mm256_add_ps(left, _mm256_mul_ps(weight, _mm256_add_ps(even_left, odd_left)));
    right = _mm256_add_ps(right, _mm256_mul_ps(weight, _mm256_add_ps(even_right, odd_right)));
  }
  left = _mm256_mul_ps(loadEight(columns), left);
  right = _mm256_mul_ps(loadEight(columns + kHalf), right);
  return ((lowFour(left) + highFour(left)) + (lowFour(right) + highFour(right))).sum();
}

/// Sums of the rows of a block: 2^112 times those of sumRows.
GLINT_WIDE inline Float16 sumRowsWide(const std::uint16_t* pixels) {
  Float4 rows[kBlockSize];
  for (int y = 0; y < kBlockSize; ++y) {
    const __m256 left = loadPixelsWide(pixels + y * kBlockSize), right = loadPixelsWide(pixels + y * kBlockSize + 8);
    rows[y] = (lowFour(left) + highFour(left)) + (lowFour(right) + highFour(right));
  }
  Float16 sums;
  for (int k = 0; k < 4; ++k) sums.v[k] = sumsOf(rows[4 * k], rows[4 * k + 1], rows[4 * k + 2], rows[4 * k + 3]);
  return sums;
}

}  // namespace glint

#endif
