// Replays a corpus and random changes of it, for compilers without libFuzzer.

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string_view>
#include <vector>

#include "fuzz/mutator.h"
#include "fuzz/opens_asset.h"

namespace {

using glint::test::Bytes;

bool opens(const Bytes& bytes) { return opensAsset(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()); }

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::fprintf(stderr, "usage: glint-fuzz-open SECONDS FILE...   (files that end in .glint have to open)\n");
    return 1;
  }
  std::vector<Bytes> corpus;
  for (int k = 2; k < argc; ++k) {
    const Bytes& seed = corpus.emplace_back(glint::test::readBytes(argv[k]));
    if (opens(seed) || !std::string_view(argv[k]).ends_with(".glint")) continue;
    std::fprintf(stderr, "%s does not open: changes of it would test nothing\n", argv[k]);
    return 1;
  }
  std::mt19937 random(1);
  const auto end = std::chrono::steady_clock::now() + std::chrono::duration<double>(std::atof(argv[1]));
  std::size_t runs = 0, opened = 0;
  for (; std::chrono::steady_clock::now() < end; ++runs)
    opened += opens(glint::test::mutate(corpus[random() % corpus.size()], random)) ? 1 : 0;
  std::printf("%zu files, %zu changes of them, %zu of which opened\n", corpus.size(), runs, opened);
  return 0;
}
