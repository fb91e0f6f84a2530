#include "glint/formats/container/checksum.h"

#include <algorithm>
#include <cstring>

#include "glint/math/lookup3.h"

namespace glint::formats {
namespace {

constexpr std::size_t kGroup = 12;  // bytes that are mixed at a time

/// Adds the next bytes, at most a group; missing ones count as 0.
void add(Lookup3& state, std::span<const std::byte> bytes) {
  std::uint32_t words[3] = {};
  std::memcpy(words, bytes.data(), std::min(bytes.size(), kGroup));
  state.add(words[0], words[1], words[2]);
}

}  // namespace

std::uint32_t hdf5Checksum(std::span<const std::byte> bytes) {
  Lookup3 state(static_cast<std::uint32_t>(bytes.size()));
  if (bytes.empty()) return state.c;
  for (; bytes.size() > kGroup; bytes = bytes.subspan(kGroup)) {
    add(state, bytes);
    state.mix();
  }
  add(state, bytes);
  return state.finish();
}

}  // namespace glint::formats
