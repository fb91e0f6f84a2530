#include "glint/bake/common/slopes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace glint::bake::slopes_test {
namespace {

TEST(NormalFromSlopes, StaysInsideTheDiskHoweverSteep) {
  for (const float slope : {600.0f, 5e3f, 1e10f, 3e38f}) {
    for (const Vec2 s : {Vec2{slope, 0}, {0, -slope}, {slope, slope}}) {
      const Vec2 n = normalFromSlopes(s.x, s.y);
      EXPECT_LT(dot(n, n), 1) << slope;
      EXPECT_NEAR(std::hypot(n.x, n.y), kRimRadius, 1e-6) << slope;
      EXPECT_LE(n.x * s.x, 0);
      EXPECT_LE(n.y * s.y, 0);
    }
  }
}

TEST(NormalFromSlopes, IsExactBelowTheRim) {
  const Vec2 n = normalFromSlopes(500, 0);
  EXPECT_NEAR(n.x, -500 / std::sqrt(1 + 500.0 * 500.0), 1e-7);
}

TEST(NormalsFromHeights, CountsCliffs) {
  std::vector<float> heights(8 * 8);
  heights[3 * 8 + 3] = std::numeric_limits<float>::max();
  heights[3 * 8 + 5] = std::numeric_limits<float>::lowest();
  std::size_t cliffs = 0;
  const auto normals = normalsFromHeights(8, 8, heights, Boundary::wrap, &cliffs);
  EXPECT_EQ(cliffs, 7u);                    // four around each, of which one is the same
  EXPECT_GT(normals[3 * 8 + 4].x, 0.999f);  // falls from one to the other
  for (const Vec2 n : normals) ASSERT_LT(dot(n, n), 1);
}

TEST(NormalsFromHeights, ClampedBordersHaveOneSidedSlopes) {
  std::vector<float> ramp;
  for (int j = 0; j < 5; ++j)
    for (int i = 0; i < 6; ++i) ramp.push_back(0.5f * static_cast<float>(i) - 0.25f * static_cast<float>(j));
  const Vec2 wanted = normalFromSlopes(0.5f, -0.25f);
  for (const Vec2 n : normalsFromHeights(6, 5, ramp, Boundary::clamp)) ASSERT_EQ(n, wanted);
  EXPECT_NE(normalsFromHeights(6, 5, ramp, Boundary::wrap)[0], wanted);
}

TEST(NormalsFromHeights, ClampedLinesAreFlatAcross) {
  const std::vector<float> heights = {1, 2, 4};
  for (const Vec2 n : normalsFromHeights(3, 1, heights, Boundary::clamp)) EXPECT_EQ(n.y, 0);
  for (const Vec2 n : normalsFromHeights(1, 3, heights, Boundary::clamp)) EXPECT_EQ(n.x, 0);
}

TEST(SeamRoughness, ComparesTheSeamWithTheRoughestPlaceInside) {
  std::vector<float> heights;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 32; ++i) heights.push_back(static_cast<float>(i));
  const Vec2 seam = seamRoughness(32, 4, heights);
  EXPECT_FLOAT_EQ(seam.x, 31);
  EXPECT_EQ(seam.y, 0);
}

}  // namespace
}  // namespace glint::bake::slopes_test
