#pragma once

#include <cstdint>
#include <cstring>
#include <limits>

#include "glint/math/device.h"

namespace glint {

/// Magnitude of the largest half-precision number, 65504.
inline constexpr std::uint16_t kLargestHalf = 0x7bff;

/// Value of an IEEE 754 half-precision number: exact for every finite number. Infinities and NaNs, which a file may have,
/// become the largest number of their sign.
inline GLINT_HD float halfToFloat(std::uint16_t half) {
  const std::uint32_t bits = half & 0x7fffu, magnitude = (bits < kLargestHalf ? bits : kLargestHalf) << 13;
  float value;
  std::memcpy(&value, &magnitude, sizeof value);
  value *= 0x1p112f;  // moves the exponent's bias from 15 to 127, subnormals included
  return half & 0x8000u ? -value : value;
}

/// halfToFloat that keeps infinities and NaNs, for checks of files. Queries use halfToFloat, so that answers are finite.
inline GLINT_HD float ieeeHalfToFloat(std::uint16_t half) {
  if ((half & 0x7c00u) != 0x7c00u) return halfToFloat(half);
  if (half & 0x3ffu) return std::numeric_limits<float>::quiet_NaN();
  return half & 0x8000u ? -std::numeric_limits<float>::infinity() : std::numeric_limits<float>::infinity();
}

/// halfToFloat of a number that cannot be negative, such as a density: negative numbers, which a file may have, become 0.
inline GLINT_HD float positiveHalfToFloat(std::uint16_t half) { return half & 0x8000u ? 0.0f : halfToFloat(half); }

/// Nearest half-precision number, ties to even; magnitudes above 65504 become 65504.
inline GLINT_HD std::uint16_t floatToHalf(float value) {
  std::uint32_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  const std::uint32_t sign = bits >> 16 & 0x8000u;
  bits &= 0x7fffffffu;
  float magnitude;
  std::memcpy(&magnitude, &bits, sizeof bits);
  const float shifted = magnitude + 0.5f;  // aligns a subnormal's last place with that of 0.5
  std::uint32_t subnormal;
  std::memcpy(&subnormal, &shifted, sizeof subnormal);
  subnormal -= 0x3f000000u;
  std::uint32_t normal = (bits + 0xfffu + (bits >> 13 & 1u) - (112u << 23)) >> 13;
  normal = normal > kLargestHalf ? kLargestHalf : normal;
  return static_cast<std::uint16_t>(sign | (bits < (113u << 23) ? subnormal : normal));
}

}  // namespace glint
