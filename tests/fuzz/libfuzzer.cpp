// Entry points of libFuzzer: `make fuzz`.

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "fuzz/mutator.h"
#include "fuzz/opens_asset.h"

namespace {

namespace fs = std::filesystem;
using glint::test::Bytes;

/// Ends the program where an asset among the seeds does not open: changes of it would test nothing.
void requireAssets(const fs::path& folder) {
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".glint") continue;
    const Bytes seed = glint::test::readBytes(entry.path().string());
    if (opensAsset(reinterpret_cast<const std::uint8_t*>(seed.data()), seed.size())) continue;
    std::fprintf(stderr, "%s does not open\n", entry.path().c_str());
    std::exit(1);
  }
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv) {
  for (int k = 1; k < *argc; ++k)
    if ((*argv)[k][0] != '-' && fs::is_directory((*argv)[k])) requireAssets((*argv)[k]);
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  opensAsset(data, size);
  return 0;
}

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned int seed) {
  std::mt19937 random(seed);
  if (random() % 16 == 0) return LLVMFuzzerMutate(data, size, max_size);
  const auto* bytes = reinterpret_cast<const std::byte*>(data);
  const Bytes changed = glint::test::mutate(Bytes(bytes, bytes + size), random);
  const std::size_t changed_size = std::min(changed.size(), max_size);
  std::memcpy(data, changed.data(), changed_size);
  return changed_size;
}
