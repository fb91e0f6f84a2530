#include "common/memory.h"

#include <gtest/gtest.h>

#include <limits>
#include <new>

#include "common/signals.h"

namespace glint::apps::memory_test {
namespace {

TEST(Memory, TextsAreRoundedUp) {
  EXPECT_EQ(memoryText(1), "1 bytes");
  EXPECT_EQ(memoryText(1023), "1023 bytes");
  EXPECT_EQ(memoryText(1024), "1.00 KB");
  EXPECT_EQ(memoryText(1025), "1.01 KB");
  EXPECT_EQ(memoryText(12.34 * 1024 * 1024), "12.4 MB");
  EXPECT_EQ(memoryText(123.4 * 1024 * 1024), "124 MB");
  EXPECT_EQ(memoryText(0x1p52), "4096 TB");
}

TEST(Memory, AllocationsThatMayFailAreNoReasonOfALaterError) {
  volatile std::size_t too_much = std::numeric_limits<std::size_t>::max() / 4;
  void* memory = ::operator new(too_much, std::nothrow);
  EXPECT_EQ(memory, nullptr);
  ::operator delete(memory);
  EXPECT_FALSE(memoryRanOut());
}

}  // namespace
}  // namespace glint::apps::memory_test
