#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <atomic>
#include <filesystem>
#include <random>
#include <vector>

#include "glint/formats/validate.h"
#include "support/hdf5_bytes.h"
#include "support/source_folder.h"

namespace glint {
namespace {

namespace fs = std::filesystem;

TEST(GoldenFiles, FlippedBitsAreFound) {
  constexpr std::size_t kFlips = 100000;  // of each file
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(test::goldenFolder())) files.push_back(entry.path());
  ASSERT_GE(files.size(), 20u);
  std::atomic<std::size_t> missed = 0;
  tbb::parallel_for(std::size_t{0}, files.size(), [&](std::size_t f) {
    test::Bytes bytes = test::readBytes(files[f].string());
    std::mt19937_64 random(f);
    for (std::size_t k = 0; k < kFlips; ++k) {
      const std::size_t bit = random() % (8 * bytes.size());
      bytes[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
      missed += formats::validateMemory(bytes, "flipped", {.data = false}).valid() ? 1 : 0;
      bytes[bit / 8] ^= static_cast<std::byte>(1u << bit % 8);
    }
  });
  EXPECT_EQ(missed, 0u);
}

}  // namespace
}  // namespace glint
