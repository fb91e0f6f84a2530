#pragma once

#include <cstdint>

#include "glint/model/bin_map.h"

#if defined(__SSE2__) && !defined(__CUDACC__) && !defined(__CUDA__)
#include <emmintrin.h>
#define GLINT_TEXEL_FILTER_SSE2
#endif

namespace glint {

/// Whole numbers from low to high, both included.
struct IndexRange {
  int low = 0, high = 0;
};

/// Finds the texels of a list whose columns, rows and places are in ranges. The same with SSE2 and without.
class TexelFilter {
 public:
  static constexpr int kMostAtOnce = 64;

  /// @param columns, rows  in the cell
  /// @param places_x, places_y  in the block
  GLINT_HD TexelFilter(const TexelCode& code, IndexRange columns, IndexRange rows, IndexRange places_x, IndexRange places_y) {
    const int position_bits = code.column_bits + code.row_bits;
    set(fields_[0], 0, code.column_bits, columns);
    set(fields_[1], code.column_bits, code.row_bits, rows);
    set(fields_[2], position_bits, code.place_bits, places_x);
    set(fields_[3], position_bits + code.place_bits, code.place_bits, places_y);
  }

  /// Fields of a code, to be joined by |.
  static constexpr unsigned kColumn = 1, kRow = 2, kPosition = kColumn | kRow, kPlace = 12;

  /// Bit k: texel k of `count`, at most kMostAtOnce, has the fields kFields in range.
  template <unsigned kFields>
  GLINT_HD std::uint64_t matches(const std::uint32_t* texels, int count) const {
    std::uint64_t bits = 0;
    int k = 0;
#ifdef GLINT_TEXEL_FILTER_SSE2
    for (; k + 4 <= count; k += 4) bits |= four<kFields>(texels + k) << k;
    // The last four again: bits that are already there do not change.
    if (count >= 4) return k < count ? bits | four<kFields>(texels + count - 4) << (count - 4) : bits;
#endif
    for (; k < count; ++k) bits |= one<kFields>(texels[k]) << k;
    return bits;
  }

  /// What of the texels at the two ends of a range counts; those between count as 1.
  struct Ends {
    float low = 1, high = 1;  ///< the same where the range is one number
  };

  /// Sum over texels of what their column counts, their row, or the product of both: those of kFields.
  template <unsigned kFields>
  GLINT_HD double sum(const std::uint32_t* texels, std::uint64_t count, const Ends& columns, const Ends& rows) const {
    double total = 0;
    for (std::uint64_t k = 0; k < count; k += kMostAtOnce) {
      const int some = static_cast<int>(count - k < kMostAtOnce ? count - k : kMostAtOnce);
      total += double{sumOfSome<kFields>(texels + k, some, columns, rows)};
    }
    return total;
  }

 private:
  struct Field {
    int shift;
    std::uint32_t mask;
    int low, high;
  };

  static GLINT_HD void set(Field& field, int shift, int bits, IndexRange range) {
    field = {bits == 0 ? 0 : shift, (1u << bits) - 1, range.low, range.high};
  }

  /// Negative differences have the highest bit.
  template <unsigned kFields>
  GLINT_HD std::uint64_t one(std::uint32_t texel) const {
    int outside = 0;
    for (int k = 0; k < 4; ++k) {
      if ((kFields >> k & 1) == 0) continue;
      const auto value = static_cast<int>(texel >> fields_[k].shift & fields_[k].mask);
      outside |= (value - fields_[k].low) | (fields_[k].high - value);
    }
    return outside < 0 ? 0 : 1;
  }

  static GLINT_HD float part(const Field& f, const Ends& ends, std::uint32_t texel) {
    const auto value = static_cast<int>(texel >> f.shift & f.mask);
    if (value < f.low || value > f.high) return 0;
    return value == f.low ? ends.low : value == f.high ? ends.high : 1;
  }

  /// In four sums, those of texels 4 k + i.
  template <unsigned kFields>
  GLINT_HD float sumOfSome(const std::uint32_t* texels, int count, const Ends& columns, const Ends& rows) const {
    constexpr bool kColumns = (kFields & kColumn) != 0, kRows = (kFields & kRow) != 0;
    float sums[4] = {};
    int k = 0;
#ifdef GLINT_TEXEL_FILTER_SSE2
    __m128 four = _mm_setzero_ps();
    for (; k + 4 <= count; k += 4) {
      const __m128i loaded = _mm_loadu_si128(reinterpret_cast<const __m128i*>(texels + k));
      __m128 product = _mm_set1_ps(1);
      if constexpr (kColumns) product = _mm_mul_ps(product, parts(fields_[0], columns, loaded));
      if constexpr (kRows) product = _mm_mul_ps(product, parts(fields_[1], rows, loaded));
      four = _mm_add_ps(four, product);
    }
    _mm_storeu_ps(sums, four);
#endif
    for (; k < count; ++k)
      sums[k % 4] += (kColumns ? part(fields_[0], columns, texels[k]) : 1) * (kRows ? part(fields_[1], rows, texels[k]) : 1);
    return (sums[0] + sums[1]) + (sums[2] + sums[3]);
  }

#ifdef GLINT_TEXEL_FILTER_SSE2
  template <unsigned kFields>
  std::uint64_t four(const std::uint32_t* texels) const {
    const __m128i loaded = _mm_loadu_si128(reinterpret_cast<const __m128i*>(texels));
    __m128i outside = _mm_setzero_si128();
    for (int k = 0; k < 4; ++k) {
      if ((kFields >> k & 1) == 0) continue;
      const Field& f = fields_[k];
      const __m128i value =
          _mm_and_si128(_mm_srl_epi32(loaded, _mm_cvtsi32_si128(f.shift)), _mm_set1_epi32(static_cast<int>(f.mask)));
      outside = _mm_or_si128(outside, _mm_or_si128(_mm_sub_epi32(value, _mm_set1_epi32(f.low)),  //
                                                   _mm_sub_epi32(_mm_set1_epi32(f.high), value)));
    }
    return static_cast<std::uint64_t>(~_mm_movemask_ps(_mm_castsi128_ps(outside)) & 15);
  }

  static __m128 parts(const Field& f, const Ends& ends, __m128i texels) {
    const __m128i value =
        _mm_and_si128(_mm_srl_epi32(texels, _mm_cvtsi32_si128(f.shift)), _mm_set1_epi32(static_cast<int>(f.mask)));
    const __m128i low = _mm_set1_epi32(f.low), high = _mm_set1_epi32(f.high);
    const __m128i between = _mm_and_si128(_mm_cmpgt_epi32(value, low), _mm_cmplt_epi32(value, high));
    const __m128 at_low = _mm_and_ps(_mm_castsi128_ps(_mm_cmpeq_epi32(value, low)), _mm_set1_ps(ends.low));
    const __m128i above = _mm_andnot_si128(_mm_cmpeq_epi32(low, high), _mm_cmpeq_epi32(value, high));
    const __m128 at_high = _mm_and_ps(_mm_castsi128_ps(above), _mm_set1_ps(ends.high));
    return _mm_or_ps(_mm_and_ps(_mm_castsi128_ps(between), _mm_set1_ps(1)), _mm_or_ps(at_low, at_high));
  }
#endif

  Field fields_[4];
};

}  // namespace glint
