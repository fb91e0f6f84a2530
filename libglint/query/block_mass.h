#pragma once

#include <algorithm>
#include <cstdint>

#include "glint/model/device.h"
#include "glint/query/half.h"

namespace glint {

/// Masses of blocks in one byte: bits 6 to 13 of a half-precision number, which is 0 to 1.9375 with four bits of mantissa.
inline GLINT_HD float blockMass(std::uint8_t code) { return halfToFloat(static_cast<std::uint16_t>(code << 6)); }

/// The same as an integer, in units of 2^-18: sums are exact.
inline GLINT_HD std::uint32_t blockMassUnits(std::uint8_t code) {
  const std::uint32_t exponent = code >> 4, mantissa = code & 15u;
  return exponent > 0 ? (16 + mantissa) << (exponent - 1) : mantissa;
}

/// The smallest code whose mass is not below `mass` (at most 1.9375).
inline GLINT_HD std::uint8_t blockMassCode(float mass) {
  if (!(mass > 0)) return 0;
  int code = std::min(floatToHalf(std::min(mass, 2.0f)) >> 6, 255);
  while (code < 255 && blockMass(static_cast<std::uint8_t>(code)) < mass) ++code;
  return static_cast<std::uint8_t>(code);
}

}  // namespace glint
