// Masses of blocks in one byte: rounding, and groups of sixteen.
#include "glint/query/detail/pyramid/block_mass.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace glint::block_mass_test {
namespace {

TEST(BlockMass, CodesAreTheSmallestNotBelow) {
  std::mt19937 random(1);
  for (int k = 0; k < 10000; ++k) {
    const float mass = std::ldexp(static_cast<float>(random() % 1024) / 1024, -static_cast<int>(random() % 20));
    const std::uint8_t code = blockMassCode(mass);
    EXPECT_GE(blockMass(code), mass);
    EXPECT_TRUE(code == 0 || blockMass(static_cast<std::uint8_t>(code - 1)) < mass) << mass;
  }
  EXPECT_EQ(blockMassCode(0), 0);
  EXPECT_EQ(blockMassCode(1.9375f), 255);
}

TEST(BlockMasses, GroupsReadNothingBehindTheLast) {
  std::mt19937 random(1);
  for (int count = 0; count <= 70; ++count) {
    for (const int behind : {0, 1, 20}) {
      std::vector<std::uint8_t> codes(static_cast<std::size_t>(count + behind));
      for (auto& code : codes) code = static_cast<std::uint8_t>(random());
      const BlockMasses masses(codes.data(), count, codes.size());
      const int groups = (count + 15) / 16;
      std::vector<float> sums(static_cast<std::size_t>(groups));
      masses.sumGroups(sums.data());
      for (int g = 0; g < groups; ++g) {
        float lanes[16];
        masses.group(g).store(lanes);
        double sum = 0;
        for (int k = 0; k < 16; ++k) {
          const int at = 16 * g + k;
          ASSERT_EQ(lanes[k], at < count ? masses[at] : 0.0f) << at << " of " << count;
          sum += double{lanes[k]};
        }
        ASSERT_EQ(double{sums[static_cast<std::size_t>(g)]}, sum) << g << " of " << count;
      }
    }
  }
}

}  // namespace
}  // namespace glint::block_mass_test
