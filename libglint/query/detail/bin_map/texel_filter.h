#pragma once

#include <cstdint>

#include "glint/math/avx2.h"
#include "glint/math/bits.h"
#include "glint/model/bin_map.h"

namespace glint {

/// Whole numbers from low to high, both included.
struct IndexRange {
  int low = 0, high = 0;
};

/// Finds the texels of a list whose fields (column, row and sub-bin) are in given ranges. Tests eight texels at a time where the
/// processor has AVX2.
class TexelFilter {
 public:
  static constexpr int kMostAtOnce = 64;

  /// @param columns, rows         columns and rows in the cell
  /// @param subbins_x, subbins_y  columns and rows of sub-bins in the block
  GLINT_HD TexelFilter(const TexelCode& code, IndexRange columns, IndexRange rows, IndexRange subbins_x, IndexRange subbins_y) {
    const int position_bits = code.column_bits + code.row_bits;
    set(fields_[0], 0, code.column_bits, columns);
    set(fields_[1], code.column_bits, code.row_bits, rows);
    set(fields_[2], position_bits, code.subbin_bits, subbins_x);
    set(fields_[3], position_bits + code.subbin_bits, code.subbin_bits, subbins_y);
  }

  /// Fields of a code: sets of them are joined by |.
  static constexpr unsigned kColumn = 1, kRow = 2, kPosition = kColumn | kRow, kSubbin = 12;

  /// Bit k, for k < count: whether texel k has the fields kFields in range.
  /// @param count  at most kMostAtOnce
  template <unsigned kFields>
  GLINT_HD std::uint64_t matches(const std::uint32_t* texels, int count) const {
#ifdef GLINT_AVX2
    if (count >= 8 && hasAvx2()) return matchesAvx2<kFields>(texels, count);
#endif
    std::uint64_t bits = 0;
    for (int k = 0; k < count; ++k) bits |= one<kFields>(texels[k]) << k;
    return bits;
  }

  /// Calls visitor(texel) for the texels that have the fields kFields in range.
  template <unsigned kFields, class Visitor>
  GLINT_HD void forEach(const std::uint32_t* texels, std::uint64_t count, Visitor&& visitor) const {
    for (std::uint64_t k = 0; k < count; k += kMostAtOnce) {
      const int some = static_cast<int>(count - k < kMostAtOnce ? count - k : kMostAtOnce);
      for (std::uint64_t bits = matches<kFields>(texels + k, some); bits != 0; bits &= bits - 1)
        visitor(texels[k + static_cast<std::uint64_t>(lowestBit(bits))]);
    }
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

  /// Tests ranges by subtraction: a field is out of range if one of its two differences is negative and so has the highest bit.
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

#ifdef GLINT_AVX2
  template <unsigned kFields>
  GLINT_AVX2 std::uint64_t matchesAvx2(const std::uint32_t* texels, int count) const {
    std::uint64_t bits = 0;
    int k = 0;
    for (; k + 8 <= count; k += 8) bits |= eight<kFields>(texels + k) << k;
    // The last group of eight overlaps the group before it: bits that are set already do not change.
    return k < count ? bits | eight<kFields>(texels + count - 8) << (count - 8) : bits;
  }

  template <unsigned kFields>
  GLINT_AVX2 std::uint64_t eight(const std::uint32_t* texels) const {
    const __m256i loaded = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(texels));
    __m256i outside = _mm256_setzero_si256();
    for (int k = 0; k < 4; ++k) {
      if ((kFields >> k & 1) == 0) continue;
      const Field& f = fields_[k];
      const __m256i value =
          _mm256_and_si256(_mm256_srl_epi32(loaded, _mm_cvtsi32_si128(f.shift)), _mm256_set1_epi32(static_cast<int>(f.mask)));
      outside = _mm256_or_si256(outside, _mm256_or_si256(_mm256_sub_epi32(value, _mm256_set1_epi32(f.low)),
                                                         _mm256_sub_epi32(_mm256_set1_epi32(f.high), value)));
    }
    return static_cast<std::uint64_t>(~_mm256_movemask_ps(_mm256_castsi256_ps(outside)) & 255);
  }
#endif

  Field fields_[4];
};

}  // namespace glint
