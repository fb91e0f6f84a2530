#include "glint/model/json_depth.h"

#include <gtest/gtest.h>

#include <string>

namespace glint::json_depth_test {
namespace {

static_assert(jsonDepth("") == 0);
static_assert(jsonDepth("{}") == 1);
static_assert(jsonDepth(R"({"a": [1, {"b": 2}], "c": []})") == 3);
static_assert(jsonDepth(R"(["[[[", "\"[["])") == 1, "brackets in texts do not count");
static_assert(jsonDepth("[[[") == 3 && jsonDepth("]]][") == 0, "any text is taken");

TEST(JsonDepth, LongTextsAreCountedWhole) {
  const std::string open(100000, '['), closed(100000, ']');
  EXPECT_EQ(jsonDepth(open + closed), 100000);
}

}  // namespace
}  // namespace glint::json_depth_test
