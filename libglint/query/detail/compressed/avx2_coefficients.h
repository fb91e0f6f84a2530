#pragma once

#include "glint/math/avx2.h"
#include "glint/query/detail/compressed/coefficient_rows.h"

#ifdef GLINT_AVX2

namespace glint {

GLINT_AVX2 inline void storeEight(float* to, __m256 v) { _mm256_storeu_ps(to, v); }

/// CoefficientRows with vectors of eight. Functions of the same name return the same bits and read no further.
template <class Coefficient>
struct Avx2Coefficients {
  using Rows = CoefficientRows<Coefficient>;
  using Row = typename Rows::Row;

  GLINT_AVX2 static Float4 dots(const float* projection, const ColumnLayout& layout, const Row (&rows)[4]) {
    __m256 first = _mm256_setzero_ps(), second = first;
    for (int k = 0; k < layout.wide; k += 4) {
      const __m256 p = twice(projection + k);
      first = _mm256_add_ps(first, _mm256_mul_ps(p, loadTwo(rows[0] + k, rows[1] + k)));
      second = _mm256_add_ps(second, _mm256_mul_ps(p, loadTwo(rows[2] + k, rows[3] + k)));
    }
    if constexpr (Rows::kHasNarrow) {
      for (int j = 0; j < layout.half; j += 4) {
        const int k = layout.wide + j;
        const __m256i a = bytesOf(rows[0] + k, rows[1] + k), b = bytesOf(rows[2] + k, rows[3] + k);
        const __m256 low = twice(projection + layout.low() + j), high = twice(projection + layout.high() + j);
        first = _mm256_add_ps(_mm256_add_ps(first, _mm256_mul_ps(low, lowHalves(a))), _mm256_mul_ps(high, highHalves(a)));
        second = _mm256_add_ps(_mm256_add_ps(second, _mm256_mul_ps(low, lowHalves(b))), _mm256_mul_ps(high, highHalves(b)));
      }
    }
    return sumsOf(lowFour(first), highFour(first), lowFour(second), highFour(second));
  }

  GLINT_AVX2 static void scale(const float* scales, const ColumnLayout& layout, Row row, float* scaled) {
    int k = 0;
    for (; k + 8 <= layout.wide; k += 8) storeEight(scaled + k, _mm256_mul_ps(loadEight(scales + k), loadEight(row + k)));
    for (; k < layout.wide; ++k) scaled[k] = scales[k] * Rows::value(row[k]);
    if constexpr (Rows::kHasNarrow) {
      const Row bytes = row + layout.wide;
      const int low = layout.wide, high = layout.wide + layout.half, high_columns = layout.columns - high;
      int j = 0;
      for (; j + 8 <= high_columns; j += 8) {
        const __m256i eight = integersOf(bytes + j);
        storeEight(scaled + low + j, _mm256_mul_ps(loadEight(scales + low + j), lowHalves(eight)));
        storeEight(scaled + high + j, _mm256_mul_ps(loadEight(scales + high + j), highHalves(eight)));
      }
      Rows::scaleNarrow(scales, layout, bytes, j, scaled);
    }
  }

 private:
  /// Four floats, in lanes 0 to 3 and again in lanes 4 to 7.
  GLINT_AVX2 static __m256 twice(const float* p) { return _mm256_broadcast_ps(reinterpret_cast<const __m128*>(p)); }

  /// Four bytes of row `a` in lanes 0 to 3, four bytes of row `b` in lanes 4 to 7.
  GLINT_AVX2 static __m256i bytesOf(const std::int8_t* a, const std::int8_t* b) {
    return _mm256_cvtepi8_epi32(_mm_unpacklo_epi32(_mm_loadu_si32(a), _mm_loadu_si32(b)));
  }
  /// Four coefficients of row `a` in lanes 0 to 3, four coefficients of row `b` in lanes 4 to 7.
  GLINT_AVX2 static __m256 loadTwo(const std::int8_t* a, const std::int8_t* b) { return _mm256_cvtepi32_ps(bytesOf(a, b)); }
  GLINT_AVX2 static __m256 loadTwo(const std::uint16_t* a, const std::uint16_t* b) {
    return floatsOf(_mm_unpacklo_epi64(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(a)),
                                       _mm_loadl_epi64(reinterpret_cast<const __m128i*>(b))));
  }
  GLINT_AVX2 static __m256 loadTwo(const float* a, const float* b) {
    return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(a)), _mm_loadu_ps(b), 1);
  }
  /// Numbers of four bits in the low halves and in the high halves of eight bytes.
  GLINT_AVX2 static __m256 lowHalves(__m256i bytes) {
    return _mm256_cvtepi32_ps(_mm256_srai_epi32(_mm256_slli_epi32(bytes, 28), 28));
  }
  GLINT_AVX2 static __m256 highHalves(__m256i bytes) { return _mm256_cvtepi32_ps(_mm256_srai_epi32(bytes, 4)); }
};

}  // namespace glint

#endif
