#include "glint/query/detail/bin_map/texel_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace glint::texel_filter_test {
namespace {

/// A code, ranges for its fields, and texels; many of the ranges are empty, one number, or hold all.
struct Case {
  TexelCode code;
  IndexRange ranges[4];
  std::vector<std::uint32_t> texels;
};

Case randomCase(std::mt19937& random) {
  const auto below = [&](int n) { return static_cast<int>(random() % static_cast<unsigned>(n)); };
  Case c;
  c.code.column_bits = below(12);
  c.code.row_bits = below(12);
  c.code.subbin_bits = 1 + below(std::min(8, (32 - c.code.column_bits - c.code.row_bits) / 2));
  const int bits[4] = {c.code.column_bits, c.code.row_bits, c.code.subbin_bits, c.code.subbin_bits};
  for (int k = 0; k < 4; ++k) {
    const int low = below((1 << bits[k]) + 2) - 1;
    c.ranges[k] = {low, low + below(4) * (1 << bits[k]) / 3};
  }
  c.texels.resize(static_cast<std::size_t>(below(TexelFilter::kMostAtOnce + 1)));
  for (std::uint32_t& texel : c.texels) texel = static_cast<std::uint32_t>(random());
  return c;
}

int field(const TexelCode& code, int k, std::uint32_t texel) {
  return static_cast<int>(k == 0   ? code.column(texel)
                          : k == 1 ? code.row(texel)
                          : k == 2 ? code.subbinX(texel)
                                   : code.subbinY(texel));
}

template <unsigned kFields>
void expectMatches(const Case& c) {
  const TexelFilter filter(c.code, c.ranges[0], c.ranges[1], c.ranges[2], c.ranges[3]);
  const std::uint64_t bits = filter.matches<kFields>(c.texels.data(), static_cast<int>(c.texels.size()));
  std::uint64_t expected = 0;
  for (std::size_t t = 0; t < c.texels.size(); ++t) {
    bool inside = true;
    for (int k = 0; k < 4; ++k) {
      const int value = field(c.code, k, c.texels[t]);
      if ((kFields >> k & 1) != 0) inside = inside && value >= c.ranges[k].low && value <= c.ranges[k].high;
    }
    expected |= std::uint64_t{inside} << t;
  }
  EXPECT_EQ(bits, expected);
}

TEST(TexelFilter, MatchesAreThoseOfEachFieldInTurn) {
  std::mt19937 random(3);
  for (int k = 0; k < 2000; ++k) {
    const Case c = randomCase(random);
    expectMatches<TexelFilter::kColumn>(c);
    expectMatches<TexelFilter::kRow>(c);
    expectMatches<TexelFilter::kPosition>(c);
    expectMatches<TexelFilter::kSubbin>(c);
    expectMatches<TexelFilter::kPosition | TexelFilter::kSubbin>(c);
    if (HasFailure()) FAIL() << "case " << k;
  }
}

TEST(TexelFilter, VisitsTheTexelsThatMatchInOrder) {
  std::mt19937 random(4);
  for (int k = 0; k < 500; ++k) {
    Case c = randomCase(random);
    const std::vector<std::uint32_t> once = c.texels;
    for (int n = 0; n < k % 3; ++n) c.texels.insert(c.texels.end(), once.begin(), once.end());  // more than match at once
    const TexelFilter filter(c.code, c.ranges[0], c.ranges[1], c.ranges[2], c.ranges[3]);
    std::vector<std::uint32_t> visited, expected;
    filter.forEach<TexelFilter::kPosition>(c.texels.data(), c.texels.size(), [&](std::uint32_t t) { visited.push_back(t); });
    for (const std::uint32_t texel : c.texels)
      if (filter.matches<TexelFilter::kPosition>(&texel, 1) != 0) expected.push_back(texel);
    EXPECT_EQ(visited, expected) << k;
  }
}

}  // namespace
}  // namespace glint::texel_filter_test
