#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "glint/model/device.h"
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

/// Masses of the first 16 of `count` blocks; 0 where there are fewer.
/// @param readable  bytes that may be read from `codes` on, at least `count`
inline GLINT_HD Float16 loadMasses(const std::uint8_t* codes, int count, std::size_t readable) {
  constexpr int kHalf = 8;
  std::uint64_t halves[2] = {};
  if (readable >= sizeof halves)
    std::memcpy(halves, codes, sizeof halves);
  else
    for (std::size_t k = 0; k < readable; ++k) halves[k / kHalf] |= std::uint64_t{codes[k]} << 8 * (k % kHalf);
  Float16 masses;
  for (int half = 0; half < 2; ++half) {
    const int left = count - half * kHalf;
    const std::uint64_t kept = left >= kHalf ? halves[half]
                               : left > 0    ? halves[half] & ((std::uint64_t{1} << 8 * left) - 1)
                                             : 0;
    masses.v[2 * half] = Float4::ofMassCodes(static_cast<std::uint32_t>(kept));
    masses.v[2 * half + 1] = Float4::ofMassCodes(static_cast<std::uint32_t>(kept >> 32));
  }
  return masses;
}

}  // namespace glint
