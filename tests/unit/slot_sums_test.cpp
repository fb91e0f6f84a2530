#include "glint/query/detail/bin_map/slot_sums.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <vector>

namespace glint::slot_sums_test {
namespace {

/// What of a list of texels counts: ranges of columns and rows may be empty, one number, reach beyond the cell, or hold all.
struct Case {
  TexelCode code;
  IndexRange columns, rows;
  RangeEnds column_ends, row_ends;
  SlotFields bins;
  std::vector<std::uint32_t> texels;

  TexelParts parts() const {
    return {{0, code.column_bits, columns, column_ends}, {code.column_bits, code.row_bits, rows, row_ends}};
  }
};

Case randomCase(std::mt19937& random) {
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  const auto range = [&](int bits) {
    const int low = below((1 << bits) + 2) - 1;
    return IndexRange{low, low + below(4) * (1 << bits) / 3 - (below(20) == 0 ? 1 : 0)};
  };
  Case c;
  c.code = {below(15), below(15), 0};
  const int side_bits = below(4), position_bits = c.code.column_bits + c.code.row_bits;
  c.code.subbin_bits = std::min(side_bits + below(3), (32 - position_bits) / 2);
  c.columns = range(c.code.column_bits);
  c.rows = range(c.code.row_bits);
  // Multiples of 2^-5: sums are exact.
  c.column_ends = {0.03125f * static_cast<float>(below(33)), 0.25f};
  c.row_ends = {0.5f, 0.03125f * static_cast<float>(below(33))};
  const int shift = std::min(position_bits + c.code.subbin_bits - std::min(side_bits, c.code.subbin_bits), 31);
  c.bins = {shift, std::min(shift + c.code.subbin_bits, 31), (1u << side_bits) - 1, static_cast<std::uint32_t>(below(10) - 5),
            static_cast<std::uint32_t>(below(10) - 5)};
  c.texels.resize(static_cast<std::size_t>(below(10) == 0 ? below(2000) : below(70)));
  for (std::uint32_t& texel : c.texels) texel = static_cast<std::uint32_t>(random());
  return c;
}

double partOf(int value, const IndexRange& range, const RangeEnds& ends) {
  if (value < range.low || value > range.high) return 0;
  return value == range.low ? ends.low : value == range.high ? ends.high : 1;
}

/// What a texel counts, field by field.
template <unsigned kCut>
double partOf(const Case& c, std::uint32_t texel) {
  double part = 1;
  if ((kCut & TexelFilter::kColumn) != 0) part *= partOf(static_cast<int>(c.code.column(texel)), c.columns, c.column_ends);
  if ((kCut & TexelFilter::kRow) != 0) part *= partOf(static_cast<int>(c.code.row(texel)), c.rows, c.row_ends);
  return part;
}

using Areas = std::array<double, SlotSums::kSlots>;

/// All texels by bin, then all in slot 7.
template <unsigned kCut>
Areas expectedAreas(const Case& c) {
  Areas areas = {};
  for (const std::uint32_t texel : c.texels) {
    const int x = static_cast<int>((texel >> c.bins.shift_x & c.bins.mask) + c.bins.first_x);
    const int y = static_cast<int>((texel >> c.bins.shift_y & c.bins.mask) + c.bins.first_y);
    if (x >= 0 && x < 5 && y >= 0 && y < 5) areas[static_cast<std::size_t>(5 * y + x)] += partOf<kCut>(c, texel);
    areas[7] += partOf<kCut>(c, texel);
  }
  return areas;
}

template <class Texels, unsigned kCut>
Areas areasBy(const Case& c) {
  const typename Texels::Parts parts(c.parts());
  SlotSums sums;
  const std::size_t half = c.texels.size() / 2;  // two lists
  sums.addBins<Texels, kCut>(c.texels.data(), half, parts, c.bins);
  sums.addBins<Texels, kCut>(c.texels.data() + half, c.texels.size() - half, parts, c.bins);
  sums.addBin<Texels, kCut>(c.texels.data(), c.texels.size(), parts, 7);
  Areas areas = {};
  sums.addTo(areas.data());
  return areas;
}

template <class Texels>
void expectAreas() {
  std::mt19937 random(5);
  for (int k = 0; k < 5000 && !testing::Test::HasFailure(); ++k) {
    const Case c = randomCase(random);
    SCOPED_TRACE(k);
    EXPECT_EQ((areasBy<Texels, 0>(c)), expectedAreas<0>(c));
    EXPECT_EQ((areasBy<Texels, 1>(c)), expectedAreas<1>(c));
    EXPECT_EQ((areasBy<Texels, 2>(c)), expectedAreas<2>(c));
    EXPECT_EQ((areasBy<Texels, 3>(c)), expectedAreas<3>(c));
  }
}

/// Moments of all texels' sub-bins, field by field.
template <unsigned kCut>
SubbinMoments expectedMoments(const Case& c) {
  SubbinMoments moments;
  const double middle = 0.5 * ((1 << c.code.subbin_bits) - 1);
  for (const std::uint32_t texel : c.texels) {
    const double w = partOf<kCut>(c, texel), x = c.code.subbinX(texel) - middle, y = c.code.subbinY(texel) - middle;
    moments.add(w, {1, x, y, x * x, x * y, y * y});
  }
  return moments;
}

template <class Texels>
void expectMoments() {
  std::mt19937 random(7);
  for (int k = 0; k < 3000 && !testing::Test::HasFailure(); ++k) {
    Case c = randomCase(random);
    if (c.code.column_bits + c.code.row_bits + 2 * c.code.subbin_bits > 31) continue;  // shifts of a whole word
    if (c.texels.size() > 500) c.texels.resize(500);                                   // as many as are summed at once
    SCOPED_TRACE(k);
    const typename Texels::Parts parts(c.parts());
    const auto n = static_cast<int>(c.texels.size());
    const SubbinMoments sums = Texels::template moments<3>(c.texels.data(), n, parts, SubbinFields(c.code));
    const SubbinMoments expected = expectedMoments<3>(c);
    constexpr double kRounding = 1e-5;  // of float sums
    const double side = 1 << c.code.subbin_bits, tolerance = kRounding * expected.weight;
    EXPECT_NEAR(sums.weight, expected.weight, tolerance);
    EXPECT_NEAR(sums.x, expected.x, tolerance * side);
    EXPECT_NEAR(sums.y, expected.y, tolerance * side);
    EXPECT_NEAR(sums.xx, expected.xx, tolerance * side * side);
    EXPECT_NEAR(sums.xy, expected.xy, tolerance * side * side);
    EXPECT_NEAR(sums.yy, expected.yy, tolerance * side * side);
  }
}

/// Lobes of all texels at a half vector, by their formula in double precision.
double expectedLobes(const Case& c, const SubbinLobe& lobe) {
  const double middle = 0.5 * ((1 << c.code.subbin_bits) - 1), end = std::exp(-12.5);
  double sum = 0;
  for (const std::uint32_t texel : c.texels) {
    const double x = c.code.subbinX(texel) - middle - double{lobe.x}, y = c.code.subbinY(texel) - middle - double{lobe.y};
    sum += partOf<3>(c, texel) * std::max(0.0, std::exp(-double{lobe.exponent} * (x * x + y * y)) - end);
  }
  return sum;
}

template <class Texels>
void expectLobes() {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> unit;
  for (int k = 0; k < 3000 && !testing::Test::HasFailure(); ++k) {
    Case c = randomCase(random);
    if (c.code.column_bits + c.code.row_bits + 2 * c.code.subbin_bits > 31) continue;  // shifts of a whole word
    if (c.texels.size() > 500) c.texels.resize(500);
    SCOPED_TRACE(k);
    const float side = static_cast<float>(1 << c.code.subbin_bits), deviation = side * (0.1f + 2 * unit(random));
    const SubbinLobe lobe = {4 * side * (unit(random) - 0.5f), 4 * side * (unit(random) - 0.5f),
                             0.5f / (deviation * deviation)};
    const float sum = Texels::template lobes<3>(c.texels.data(), static_cast<int>(c.texels.size()),
                                                typename Texels::Parts(c.parts()), SubbinFields(c.code), lobe);
    constexpr double kDecay = 1e-4, kEnds = 1e-9;  // decayOf; lobes end where they are 3.7e-6
    const double expected = expectedLobes(c, lobe);
    EXPECT_NEAR(sum, expected, kDecay * expected + kEnds * static_cast<double>(c.texels.size()));
  }
}

TEST(SubbinLobes, AddUpTexelByTexel) { expectLobes<SingleTexels>(); }

TEST(SubbinMoments, AddUpTexelByTexel) { expectMoments<SingleTexels>(); }

TEST(SlotSums, AddUpTexelByTexel) { expectAreas<SingleTexels>(); }

#ifdef GLINT_AVX2
TEST(SlotSums, AddUpEightTexelsAtATime) {
  if (!hasAvx2()) GTEST_SKIP() << "no AVX2";
  expectAreas<Avx2Texels>();
}

TEST(SubbinLobes, AddUpEightTexelsAtATime) {
  if (!hasAvx2()) GTEST_SKIP() << "no AVX2";
  expectLobes<Avx2Texels>();
}

TEST(SubbinMoments, AddUpEightTexelsAtATime) {
  if (!hasAvx2()) GTEST_SKIP() << "no AVX2";
  expectMoments<Avx2Texels>();
}

TEST(SubbinMoments, AreTheSameToTheBitByEightAndByOne) {
  if (!hasAvx2()) GTEST_SKIP() << "no AVX2";
  std::mt19937 random(8);
  std::uniform_real_distribution<float> end;
  for (int k = 0; k < 2000; ++k) {
    Case c = randomCase(random);
    c.column_ends = {end(random), end(random)};
    const auto n = static_cast<int>(std::min<std::size_t>(c.texels.size(), 500));
    const SubbinFields fields(c.code);
    const SubbinMoments one = SingleTexels::moments<3>(c.texels.data(), n, c.parts(), fields);
    const SubbinMoments eight = Avx2Texels::moments<3>(c.texels.data(), n, Avx2Texels::Parts(c.parts()), fields);
    EXPECT_EQ((std::array{one.weight, one.x, one.y, one.xx, one.xy, one.yy}),
              (std::array{eight.weight, eight.x, eight.y, eight.xx, eight.xy, eight.yy}))
        << k;
  }
}

/// Ends of any size, whose sums are rounded.
TEST(SlotSums, AreTheSameToTheBitByEightAndByOne) {
  if (!hasAvx2()) GTEST_SKIP() << "no AVX2";
  std::mt19937 random(6);
  std::uniform_real_distribution<float> end;
  for (int k = 0; k < 2000; ++k) {
    Case c = randomCase(random);
    c.column_ends = {end(random), end(random)};
    c.row_ends = {end(random), end(random)};
    EXPECT_EQ((areasBy<Avx2Texels, 3>(c)), (areasBy<SingleTexels, 3>(c))) << k;
  }
}
#endif

}  // namespace
}  // namespace glint::slot_sums_test
