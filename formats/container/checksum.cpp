#include "glint/formats/container/checksum.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace glint::formats {
namespace {

constexpr std::size_t kGroup = 12;  // bytes that are mixed at a time

struct State {
  std::uint32_t a, b, c;

  /// Adds the next bytes, at most a group; missing ones count as 0.
  void add(std::span<const std::byte> bytes) {
    std::uint32_t words[3] = {};
    std::memcpy(words, bytes.data(), std::min(bytes.size(), kGroup));
    a += words[0];
    b += words[1];
    c += words[2];
  }

  void mix() {
    a -= c, a ^= std::rotl(c, 4), c += b;
    b -= a, b ^= std::rotl(a, 6), a += c;
    c -= b, c ^= std::rotl(b, 8), b += a;
    a -= c, a ^= std::rotl(c, 16), c += b;
    b -= a, b ^= std::rotl(a, 19), a += c;
    c -= b, c ^= std::rotl(b, 4), b += a;
  }

  std::uint32_t finish() {
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

}  // namespace

std::uint32_t hdf5Checksum(std::span<const std::byte> bytes) {
  const std::uint32_t start = 0xdeadbeef + static_cast<std::uint32_t>(bytes.size());
  State state{start, start, start};
  if (bytes.empty()) return state.c;
  for (; bytes.size() > kGroup; bytes = bytes.subspan(kGroup)) {
    state.add(bytes);
    state.mix();
  }
  state.add(bytes);
  return state.finish();
}

}  // namespace glint::formats
