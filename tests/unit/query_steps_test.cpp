// The steps that a density of a pyramid is made of.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <random>
#include <vector>

#include "glint/math/bits.h"
#include "glint/math/float4.h"
#include "glint/query/detail/compressed/column_layout.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"

namespace glint::query_steps_test {
namespace {

TEST(LevelPlace, IsTheLogarithmToBase4) {
  constexpr double kError = 2e-7;  // that of log2Of
  for (double octaves = 0; octaves <= 30; octaves += 0.001) {
    const auto ratio = static_cast<float>(std::exp2(octaves));
    const LevelPlace place = SliceChooser::levelPlace(ratio, Interpolation::trilinear);
    ASSERT_GE(place.t, 0);
    ASSERT_LE(place.t, 1);
    ASSERT_NEAR(place.first + double{place.t}, 0.5 * std::log2(double{ratio}), kError) << ratio;
  }
}

TEST(LevelPlace, PowersOf4AreLevels) {
  for (int level = 0; level < kMaxPyramidLevels; ++level) {
    const float ratio = std::exp2(2.0f * static_cast<float>(level));
    EXPECT_EQ(SliceChooser::levelPlace(ratio, Interpolation::trilinear).first, level);
    EXPECT_EQ(SliceChooser::levelPlace(ratio, Interpolation::trilinear).t, 0);
    if (level == 0) continue;
    EXPECT_EQ(SliceChooser::levelPlace(std::nextafter(ratio, 0.0f), Interpolation::trilinear).first,
              level - 1);  // and t does not exceed 1
    EXPECT_NEAR(SliceChooser::levelPlace(std::nextafter(ratio, 0.0f), Interpolation::trilinear).t, 1, 1e-6);
  }
}

TEST(BitRank, CountsTheBitsBelow) {
  std::mt19937_64 random(3);
  for (int run = 0; run < 100; ++run) {
    const std::uint64_t word = run == 0 ? 0 : run == 1 ? ~std::uint64_t{0} : random() & random();
    for (unsigned bit = 0; bit < 64; ++bit) {
      const BitRank rank(word, bit);
      const bool set = word >> bit & 1;
      ASSERT_EQ(rank.kept, set ? ~std::uint64_t{0} : 0);
      if (set) {
        ASSERT_EQ(rank.below, static_cast<std::uint64_t>(std::popcount(word & ((std::uint64_t{1} << bit) - 1))));
      }
      ASSERT_EQ(keepIf(rank.kept, 0.75f), set ? 0.75f : 0.0f);
    }
  }
}

void expectDifferences(const std::int32_t (&a)[4], const std::int32_t (&b)[4]) {
  for (const bool masked : {false, true}) {
    float lanes[4];
    Float4::difference(a, b, masked ? 0 : -1).store(lanes);
    for (int k = 0; k < 4; ++k) {
      const double exact = static_cast<double>(a[k]) - (masked ? 0.0 : static_cast<double>(b[k]));
      EXPECT_EQ(lanes[k], static_cast<float>(exact)) << k;
    }
  }
}

TEST(Float4, DifferencesAreRoundedOnce) { expectDifferences({1 << 30, 16777217, -5, 0}, {(1 << 30) - 1, 1, 7, -1}); }

/// Columns whose values are their numbers.
struct Numbers {
  float one(int k) const { return static_cast<float>(k); }
  Float4 four(int k) const { return Float4::of(one(k), one(k + 1), one(k + 2), one(k + 3)); }
};

/// What products read, in groups of four: columns at their places, and zeros up to whole groups.
TEST(ColumnLayout, FillsTheGroupsThatProductsRead) {
  const std::vector<float> scales(kMaxColumns, 2.0f);
  for (int columns = 1; columns <= 40; ++columns) {
    for (int narrow = 0; narrow <= columns; ++narrow) {
      NdfCluster cluster;
      cluster.columns = static_cast<std::uint16_t>(columns);
      cluster.narrow_columns = static_cast<std::uint16_t>(narrow);
      const ColumnLayout layout(cluster);
      float projection[ColumnLayout::kMost];
      std::fill(std::begin(projection), std::end(projection), std::numeric_limits<float>::quiet_NaN());
      layout.arrange(scales.data(), Numbers{}, projection);
      const auto expectGroups = [&](int at, int first, int count, int read) {
        for (int k = 0; k < (read + 3) / 4 * 4; ++k)
          ASSERT_EQ(projection[at + k], k < count ? 2.0f * static_cast<float>(first + k) : 0.0f)
              << columns << ' ' << narrow << ' ' << at + k;
      };
      expectGroups(0, 0, layout.wide, layout.wide);
      if (narrow == 0) continue;
      expectGroups(layout.low(), layout.wide, layout.half, layout.half);
      expectGroups(layout.high(), layout.wide + layout.half, narrow - layout.half, layout.half);
    }
  }
}

}  // namespace
}  // namespace glint::query_steps_test
