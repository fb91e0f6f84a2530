#pragma once

#include <bit>
#include <cstdint>

#include "glint/math/device.h"

namespace glint {

/// The state of the hash lookup3 (Bob Jenkins, 2006), of 32 bits: HDF5's checksum, and the cells of MaterialX and OSL. The caller adds
/// three words of the key, mixes where more follow, and finishes after the last. Sums wrap.
struct Lookup3 {
  std::uint32_t a, b, c;

  /// The state for a key; `seed` counts its bytes, or its words as the user of the hash has it.
  GLINT_HD explicit constexpr Lookup3(std::uint32_t seed) : a(0xdeadbeefu + seed), b(a), c(a) {}

  GLINT_HD constexpr void add(std::uint32_t x, std::uint32_t y, std::uint32_t z) { a += x, b += y, c += z; }

  GLINT_HD constexpr void mix() {
    a -= c, a ^= std::rotl(c, 4), c += b;
    b -= a, b ^= std::rotl(a, 6), a += c;
    c -= b, c ^= std::rotl(b, 8), b += a;
    a -= c, a ^= std::rotl(c, 16), c += b;
    b -= a, b ^= std::rotl(a, 19), a += c;
    c -= b, c ^= std::rotl(b, 4), b += a;
  }

  /// The hash. Ends the use of the state.
  GLINT_HD constexpr std::uint32_t finish() {
    c ^= b, c -= std::rotl(b, 14);
    a ^= c, a -= std::rotl(c, 11);
    b ^= a, b -= std::rotl(a, 25);
    c ^= b, c -= std::rotl(b, 16);
    a ^= c, a -= std::rotl(c, 4);
    b ^= a, b -= std::rotl(a, 14);
    c ^= b, c -= std::rotl(b, 24);
    return c;
  }
};

}  // namespace glint
