#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

#include "glint/math/device.h"

namespace glint {

/// Number of set bits.
inline GLINT_HD int setBits(std::uint64_t bits) {
#if defined(__CUDA_ARCH__)
  return __popcll(bits);
#else
  return std::popcount(bits);
#endif
}

/// One bit of a mask: whether it is set, and the number of set bits below it. Computed without branches, which processors could
/// not predict.
struct BitRank {
  GLINT_HD BitRank(std::uint64_t word, unsigned bit) {
    const std::uint64_t up_to = word << (~bit & 63u);
    kept = static_cast<std::uint64_t>(static_cast<std::int64_t>(up_to) >> 63);
    below = static_cast<std::uint64_t>(setBits(up_to)) + kept;
  }
  std::uint64_t kept;   ///< all ones if the bit is set, else 0
  std::uint64_t below;  ///< the number of set bits below it
};

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

/// x if all bits of `kept` are set, 0 if none is.
inline GLINT_HD float keepIf(std::uint64_t kept, float x) {
  std::uint32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  bits &= static_cast<std::uint32_t>(kept);
  std::memcpy(&x, &bits, sizeof bits);
  return x;
}

}  // namespace glint
