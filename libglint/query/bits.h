#pragma once

#include <bit>
#include <cstdint>

#include "glint/model/device.h"

namespace glint {

/// Number of set bits.
inline GLINT_HD int setBits(std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return __popcll(bits);
#else
  return std::popcount(bits);
#endif
}

/// Index of the lowest set bit; `bits` is not 0.
inline GLINT_HD int lowestBit(std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return __ffsll(static_cast<long long>(bits)) - 1;
#else
  return std::countr_zero(bits);
#endif
}

/// Index of set bit number k, counted from the lowest; at least k + 1 are set.
inline GLINT_HD int selectBit(std::uint64_t bits, int k) {
  int at = 0;
  for (int width = 32; width > 0; width /= 2) {
    const int below = setBits(bits & ((std::uint64_t{1} << width) - 1)), skip = k >= below ? width : 0;
    k -= skip > 0 ? below : 0;
    bits >>= skip;
    at += skip;
  }
  return at;
}

}  // namespace glint
