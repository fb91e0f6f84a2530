#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "glint/math/avx2.h"
#include "glint/math/device.h"
#include "glint/math/float4.h"
#include "glint/math/half.h"

namespace glint {

/// Decodes the mass of a block from one byte: bits 6 to 13 of a half-precision number. Masses are 0 to 1.9375 with four bits of
/// mantissa. All are multiples of 2^-18, so that float sums up to 64 are exact.
inline GLINT_HD float blockMass(std::uint8_t code) { return halfToFloat(static_cast<std::uint16_t>(code << 6)); }

/// The smallest code whose mass is not below `mass` (at most 1.9375).
inline GLINT_HD std::uint8_t blockMassCode(float mass) {
  if (!(mass > 0)) return 0;
  int code = std::min(floatToHalf(std::min(mass, 2.0f)) >> 6, 255);
  while (code < 255 && blockMass(static_cast<std::uint8_t>(code)) < mass) ++code;
  return static_cast<std::uint8_t>(code);
}

/// Masses of the blocks of an image, for chooseOfMany.
class BlockMasses {
 public:
  /// @param readable  bytes that may be read from `codes` on, at least `count`
  GLINT_HD BlockMasses(const std::uint8_t* codes, int count, std::size_t readable)
      : codes_(codes), count_(count), readable_(readable) {}

  GLINT_HD int count() const { return count_; }
  GLINT_HD float operator[](int k) const { return blockMass(codes_[k]); }

  /// Masses 16 g to 16 g + 15; 0 beyond the last mass.
  GLINT_HD Float16 group(int g) const {
#ifdef GLINT_AVX2
    if (hasAvx2()) return groupAvx2(g);
#endif
    const Codes codes = codesOf(g);
    Float16 masses;
    for (int k = 0; k < 4; ++k) masses.v[k] = Float4::ofMassCodes(codes.fours[k]);
    return masses;
  }

  /// sums[g] = sum of group(g), exactly.
  GLINT_HD void sumGroups(float* sums) const {
#ifdef GLINT_AVX2
    if (hasAvx2()) return sumGroupsAvx2(sums);
#endif
    for (int g = 0; kGroup * g < count_; ++g) sums[g] = group(g).sum();
  }

 private:
  static constexpr int kGroup = 16;

  /// Whether all 16 bytes of a group may be read, including bytes after the last code.
  GLINT_HD bool isReadable(int g) const { return readable_ >= static_cast<std::size_t>(kGroup * (g + 1)); }

  /// Codes of a group; 0 after the last code.
  struct Codes {
    std::uint32_t fours[kGroup / 4];
  };
  GLINT_HD Codes codesOf(int g) const {
    Codes codes = {};
    const int left = std::min(count_ - kGroup * g, int{kGroup});
    if (!isReadable(g)) {
      for (int k = 0; k < left; ++k) codes.fours[k / 4] |= std::uint32_t{codes_[kGroup * g + k]} << 8 * (k % 4);
      return codes;
    }
    std::memcpy(codes.fours, codes_ + kGroup * g, sizeof codes.fours);
    for (int k = 0; k < 4; ++k) {
      const int here = left - 4 * k;
      codes.fours[k] &= here >= 4 ? ~0u : here > 0 ? (1u << 8 * here) - 1 : 0u;
    }
    return codes;
  }

#ifdef GLINT_AVX2
  GLINT_AVX2 Float16 groupAvx2(int g) const {
    const auto [low, high] = massesOf(g);
    return {{lowFour(low), highFour(low), lowFour(high), highFour(high)}};
  }
  GLINT_AVX2 void sumGroupsAvx2(float* sums) const {
    for (int g = 0; kGroup * g < count_; ++g) {
      const auto [low, high] = massesOf(g);
      const __m256 eight = _mm256_add_ps(low, high);
      sums[g] = (lowFour(eight) + highFour(eight)).sum();
    }
  }

  struct Eights {
    __m256 low, high;
  };
  GLINT_AVX2 Eights massesOf(int g) const {
    const __m128i numbers = _mm_setr_epi8(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    const __m128i left = _mm_set1_epi8(static_cast<char>(std::min(count_ - kGroup * g, int{kGroup})));
    __m128i codes;
    if (isReadable(g)) {
      codes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(codes_ + kGroup * g));
    } else {
      const Codes last = codesOf(g);
      codes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(last.fours));
    }
    const __m256i halves = _mm256_slli_epi16(_mm256_cvtepu8_epi16(_mm_and_si128(codes, _mm_cmplt_epi8(numbers, left))), 6);
    return {_mm256_cvtph_ps(_mm256_castsi256_si128(halves)), _mm256_cvtph_ps(_mm256_extracti128_si256(halves, 1))};
  }
#endif

  const std::uint8_t* codes_;
  int count_;
  std::size_t readable_;
};

}  // namespace glint
