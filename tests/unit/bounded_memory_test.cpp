#include "common/bounded_memory.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "glint/model/error.h"
#include "support/temp_folder.h"

namespace glint::apps::bounded_memory_test {
namespace {

constexpr std::uint64_t kMega = 1 << 20;

std::uint64_t residentBytes() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t total = 0, resident = 0;
  file >> total >> resident;
  return resident * 4096;
}

TEST(BoundedMemory, KeepsSmallArraysInMemory) {
  const test::TempFolder folder;
  BoundedMemory memory(8 * kMega, folder.path().string());
  const std::pmr::vector<std::uint64_t> values(kMega / 2, 7, &memory);
  EXPECT_EQ(memory.filedBytes(), 0u);
}

TEST(BoundedMemory, PutsTheRestIntoFilesThatKeepTheirValues) {
  const test::TempFolder folder;
  BoundedMemory memory(4 * kMega, folder.path().string());
  constexpr std::size_t kCount = 32 * kMega / sizeof(std::uint64_t);
  std::pmr::vector<std::uint64_t> values(kCount, 0, &memory);
  EXPECT_EQ(memory.filedBytes(), 32 * kMega);
  for (std::size_t k = 0; k < kCount; ++k) values[k] = k * k;
  std::this_thread::sleep_for(std::chrono::milliseconds(100));  // pages are given up meanwhile
  std::size_t wrong = 0;
  for (std::size_t k = 0; k < kCount; ++k) wrong += values[k] != k * k;
  EXPECT_EQ(wrong, 0u);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "temporary files have no name";
}

TEST(BoundedMemory, GivesUpPagesOfFiles) {
  const test::TempFolder folder;
  BoundedMemory memory(4 * kMega, folder.path().string());
  const std::uint64_t before = residentBytes();
  const std::pmr::vector<char> values(128 * kMega, 1, &memory);
  // The watcher looks every ms; this is ample under load.
  for (int k = 0; k < 500 && residentBytes() > before + 64 * kMega; ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_LT(residentBytes(), before + 64 * kMega);
  EXPECT_EQ(values.back(), 1);
}

TEST(BoundedMemory, SaysWhereThereIsNoRoom) {
  BoundedMemory memory(kMega, "/nowhere");
  try {
    std::pmr::vector<char> values(8 * kMega, &memory);
    FAIL() << "there is no such folder";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::io);
    EXPECT_EQ(error.path(), "/nowhere");
  }
}

}  // namespace
}  // namespace glint::apps::bounded_memory_test
