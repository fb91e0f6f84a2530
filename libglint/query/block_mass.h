#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "glint/model/device.h"
#include "glint/query/avx2.h"
#include "glint/query/float4.h"
#include "glint/query/half.h"

namespace glint {

/// Masses of blocks in one byte: bits 6 to 13 of a half-precision number, which is 0 to 1.9375 with four bits of mantissa.
/// All are whole multiples of 2^-18, so that sums up to 64 are exact.
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

  /// Masses 16 g to 16 g + 15; 0 where there are fewer.
  GLINT_HD Float16 group(int g) const {
    const std::uint8_t* codes = codes_ + kGroup * g;
    const std::size_t readable = readable_ - static_cast<std::size_t>(kGroup * g);
    constexpr int kHalf = kGroup / 2;
    std::uint64_t halves[2] = {};
    if (readable >= sizeof halves)
      std::memcpy(halves, codes, sizeof halves);
    else
      for (std::size_t k = 0; k < readable; ++k) halves[k / kHalf] |= std::uint64_t{codes[k]} << 8 * (k % kHalf);
    Float16 masses;
    for (int half = 0; half < 2; ++half) {
      const int left = count_ - kGroup * g - half * kHalf;
      const std::uint64_t kept = left >= kHalf ? halves[half]
                                 : left > 0    ? halves[half] & ((std::uint64_t{1} << 8 * left) - 1)
                                               : 0;
      masses.v[2 * half] = Float4::ofMassCodes(static_cast<std::uint32_t>(kept));
      masses.v[2 * half + 1] = Float4::ofMassCodes(static_cast<std::uint32_t>(kept >> 32));
    }
    return masses;
  }

  /// sums[g] = sum of group(g), exactly.
  GLINT_HD void sumGroups(float* sums) const {
    int g = 0;
#ifdef GLINT_AVX2
    if (hasAvx2()) {
      sumWholeGroups(sums);
      g = count_ / kGroup;
    }
#endif
    for (; kGroup * g < count_; ++g) sums[g] = group(g).sum();
  }

 private:
  static constexpr int kGroup = 16;

#ifdef GLINT_AVX2
  GLINT_AVX2 void sumWholeGroups(float* sums) const {
    for (int g = 0; kGroup * (g + 1) <= count_; ++g) {
      const __m128i codes = _mm_loadu_si128(reinterpret_cast<const __m128i*>(codes_ + kGroup * g));
      const __m256i halves = _mm256_slli_epi16(_mm256_cvtepu8_epi16(codes), 6);
      const __m256 eight =
          _mm256_add_ps(_mm256_cvtph_ps(_mm256_castsi256_si128(halves)), _mm256_cvtph_ps(_mm256_extracti128_si256(halves, 1)));
      sums[g] = (lowFour(eight) + highFour(eight)).sum();
    }
  }
#endif

  const std::uint8_t* codes_;
  int count_;
  std::size_t readable_;
};

}  // namespace glint
