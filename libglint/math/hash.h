#pragma once

#include <cstdint>

#include "glint/math/device.h"

namespace glint {

/// Step of a counter whose values mixBits turns into random bits: 2^64 over the golden ratio. Sums and products wrap.
inline constexpr std::uint64_t kCounterStep = 0x9e3779b97f4a7c15u;

/// 64 random bits: the finaliser of SplitMix64. Every bit of the result depends on every bit of z; the same on every processor.
GLINT_HD constexpr std::uint64_t mixBits(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

}  // namespace glint
