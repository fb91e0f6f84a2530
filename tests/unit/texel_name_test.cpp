#include "glint/model/texel_name.h"

#include <gtest/gtest.h>

namespace glint::texel_name_test {
namespace {

TEST(TexelName, CountsRowsFromTheTop) {
  EXPECT_EQ(texelName(4, 3, 0), "column 0, row 2 from the top");  // arrays hold the bottom row first
  EXPECT_EQ(texelName(4, 3, 2 * 4 + 1), "column 1, row 0 from the top");
}

TEST(TexelTally, RemembersTheFirstFromTheTop) {
  TexelTally tally(4, 3);
  for (const std::size_t texel : {3, 10, 9, 4}) tally.add(texel);
  EXPECT_EQ(tally.count(), 4u);
  EXPECT_EQ(tally.first(), 9u);
  EXPECT_EQ(tally.firstName(), "column 1, row 0 from the top");
}

}  // namespace
}  // namespace glint::texel_name_test
