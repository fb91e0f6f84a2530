#pragma once

#include "glint/math/avx2.h"
#include "glint/model/ndf_pyramid.h"

#ifdef GLINT_AVX2

namespace glint {

// Operations on blocks of half-precision pixels, [16][16], all >= 0, with vectors of eight.

GLINT_AVX2 inline __m256 loadPixelsAvx2(const std::uint16_t* p) {
  return positiveFloatsOf(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
}

/// Adds `part` times a row of pixels: eight pixels to `left`, eight to `right`.
GLINT_AVX2 inline void addRow(const std::uint16_t* row, float part, __m256& left, __m256& right) {
  left = _mm256_add_ps(left, _mm256_mul_ps(_mm256_set1_ps(part), loadPixelsAvx2(row)));
  right = _mm256_add_ps(right, _mm256_mul_ps(_mm256_set1_ps(part), loadPixelsAvx2(row + kBlockSize / 2)));
}

/// Weighted sum of the pixels of some blocks. Each pixel counts by the covered parts of its column and row. Same bits as
/// BlockCover::sumByFour.
/// @param blocks, weights     [count]
/// @param columns, rows       [16]: covered parts; 0 for columns that are not covered
/// @param first_row, end_row  covered rows: from first_row to before end_row
GLINT_AVX2 inline float sumCoveredPixels(const std::uint16_t* const* blocks, const float* weights, int count,
                                         const float* columns, const float* rows, int first_row, int end_row) {
  __m256 left = _mm256_setzero_ps(), right = left;
  for (int k = 0; k < count; ++k) {
    __m256 even_left = _mm256_setzero_ps(), even_right = even_left, odd_left = even_left, odd_right = even_left;
    const std::uint16_t* block = blocks[k];
    int y = first_row;
    for (; y + 2 <= end_row; y += 2) {
      addRow(block + y * kBlockSize, rows[y], even_left, even_right);
      addRow(block + (y + 1) * kBlockSize, rows[y + 1], odd_left, odd_right);
    }
    if (y < end_row) addRow(block + y * kBlockSize, rows[y], even_left, even_right);
    const __m256 weight = _mm256_set1_ps(weights[k]);
    left = _mm256_add_ps(left, _mm256_mul_ps(weight, _mm256_add_ps(even_left, odd_left)));
    right = _mm256_add_ps(right, _mm256_mul_ps(weight, _mm256_add_ps(even_right, odd_right)));
  }
  left = _mm256_mul_ps(loadEight(columns), left);
  right = _mm256_mul_ps(loadEight(columns + kBlockSize / 2), right);
  return ((lowFour(left) + highFour(left)) + (lowFour(right) + highFour(right))).sum();
}

/// Sum of each row: same bits as sumRows.
GLINT_AVX2 inline Float16 sumRowsAvx2(const std::uint16_t* pixels) {
  Float4 rows[kBlockSize];
  for (int y = 0; y < kBlockSize; ++y) {
    const std::uint16_t* row = pixels + y * kBlockSize;
    const __m256 left = loadPixelsAvx2(row), right = loadPixelsAvx2(row + kBlockSize / 2);
    rows[y] = (lowFour(left) + highFour(left)) + (lowFour(right) + highFour(right));
  }
  Float16 sums;
  for (int k = 0; k < 4; ++k) sums.v[k] = sumsOf(rows[4 * k], rows[4 * k + 1], rows[4 * k + 2], rows[4 * k + 3]);
  return sums;
}

}  // namespace glint

#endif
