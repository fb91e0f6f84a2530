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

}  // namespace glint
