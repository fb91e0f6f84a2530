// Replays a corpus and random mutations of it, for compilers without libFuzzer.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "support/hdf5_bytes.h"

bool opensAsset(const std::uint8_t* data, std::size_t size);

namespace {

using glint::test::Bytes;

const std::uint8_t* dataOf(const Bytes& bytes) { return reinterpret_cast<const std::uint8_t*>(bytes.data()); }

/// One to eight changes: flipped bits, set bytes, large numbers, moved pieces, or a cut. Most hit the metadata at the front.
Bytes mutate(Bytes bytes, std::mt19937& random) {
  const auto below = [&](std::size_t n) { return n == 0 ? 0 : random() % n; };
  for (std::size_t k = 1 + below(8); k > 0; --k) {
    if (bytes.empty()) return bytes;
    const std::size_t at = below(3) == 0 ? below(bytes.size()) : below(std::min<std::size_t>(bytes.size(), 8192));
    switch (below(6)) {
      case 0:
        bytes[at] ^= static_cast<std::byte>(1u << below(8));
        break;
      case 1:
        bytes[at] = static_cast<std::byte>(random());
        break;
      case 2:
        for (std::size_t b = at; b < std::min(at + 8, bytes.size()); ++b) bytes[b] = std::byte{0xff};
        break;
      case 3: {
        const std::size_t from = below(bytes.size());
        for (std::size_t b = 0; b < 16 && at + b < bytes.size() && from + b < bytes.size(); ++b)
          bytes[at + b] = bytes[from + b];
        break;
      }
      case 4:
        for (std::size_t b = at; b < std::min(at + 4, bytes.size()); ++b) bytes[b] = std::byte{0};
        break;
      default:
        if (below(8) == 0) bytes.resize(at);
    }
  }
  return bytes;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: glint-fuzz-open SECONDS FILE...\n");
    return 1;
  }
  std::vector<Bytes> corpus;
  for (int k = 2; k < argc; ++k) {
    const Bytes& seed = corpus.emplace_back(glint::test::readBytes(argv[k]));
    if (opensAsset(dataOf(seed), seed.size())) continue;
    std::fprintf(stderr, "%s does not open: mutations of it would test nothing\n", argv[k]);
    return 1;
  }
  std::mt19937 random(1);
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(std::atof(argv[1]));
  std::size_t runs = 0, opened = 0;
  for (; std::chrono::steady_clock::now() < end; ++runs) {
    const Bytes& seed = corpus[random() % corpus.size()];
    Bytes bytes = mutate(seed, random);
    // Checksums stop nearly every change: most are renewed, so that what lies behind them is reached.
    if (random() % 4 != 0) {
      if (random() % 2 == 0) glint::test::renewHashes(bytes);
      glint::test::renewChecksums(bytes, glint::test::checksummedRanges(seed));
    }
    opened += opensAsset(dataOf(bytes), bytes.size()) ? 1 : 0;
  }
  std::printf("%zu mutations of %zu files, %zu of them opened\n", runs, corpus.size(), opened);
  return 0;
}
