#include "glint/math/half.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "unit/compress_reference.h"

namespace glint::half_test {
namespace {

constexpr int kFiniteHalves = 0x7c00;  // bit patterns below this are the finite magnitudes, in order
constexpr float kGreatest = 65504;

TEST(Half, EveryFiniteNumberHasItsExactValue) {
  for (int magnitude = 0; magnitude < kFiniteHalves; ++magnitude) {
    for (const int sign : {0, 0x8000}) {
      const auto bits = static_cast<std::uint16_t>(sign | magnitude);
      ASSERT_EQ(halfToFloat(bits), test::decodeHalf(bits)) << bits;
    }
  }
  EXPECT_TRUE(std::signbit(halfToFloat(0x8000)));
}

TEST(Half, EveryFiniteNumberSurvivesTheRoundTrip) {
  for (int magnitude = 0; magnitude < kFiniteHalves; ++magnitude) {
    for (const int sign : {0, 0x8000}) {
      const auto bits = static_cast<std::uint16_t>(sign | magnitude);
      ASSERT_EQ(floatToHalf(halfToFloat(bits)), bits);
    }
  }
}

TEST(Half, WhatIsNotFiniteBecomesTheLargestNumber) {
  for (int magnitude = kFiniteHalves; magnitude < 0x8000; ++magnitude) {
    const float value = halfToFloat(static_cast<std::uint16_t>(magnitude));
    ASSERT_EQ(value, kGreatest);
    ASSERT_EQ(halfToFloat(static_cast<std::uint16_t>(0x8000 | magnitude)), -kGreatest);
  }
  EXPECT_EQ(floatToHalf(kGreatest), kLargestHalf);
  EXPECT_EQ(floatToHalf(std::numeric_limits<float>::infinity()), 0x7bff);
  EXPECT_EQ(floatToHalf(std::numeric_limits<float>::max()), 0x7bff);
  EXPECT_TRUE(std::isfinite(halfToFloat(floatToHalf(std::numeric_limits<float>::quiet_NaN()))));
}

TEST(Half, ChecksSeeInfinitiesAndNans) {
  for (const int sign : {0, 0x8000}) {
    for (int magnitude = 0; magnitude < kFiniteHalves; ++magnitude)
      ASSERT_EQ(ieeeHalfToFloat(static_cast<std::uint16_t>(sign | magnitude)),
                halfToFloat(static_cast<std::uint16_t>(sign | magnitude)));
    const float infinity = ieeeHalfToFloat(static_cast<std::uint16_t>(sign | kFiniteHalves));
    EXPECT_TRUE(std::isinf(infinity));
    EXPECT_EQ(std::signbit(infinity), sign != 0);
    for (int magnitude = kFiniteHalves + 1; magnitude < 0x8000; ++magnitude)
      ASSERT_TRUE(std::isnan(ieeeHalfToFloat(static_cast<std::uint16_t>(sign | magnitude))));
  }
}

TEST(Half, NegativeNumbersBecome0WhereNoneCanBe) {
  for (int magnitude = 0; magnitude < 0x8000; ++magnitude) {
    const auto bits = static_cast<std::uint16_t>(magnitude);
    ASSERT_EQ(positiveHalfToFloat(bits), halfToFloat(bits));
    ASSERT_EQ(positiveHalfToFloat(static_cast<std::uint16_t>(0x8000 | magnitude)), 0);
  }
}

/// The pattern nearest to a value in [0, 65504], even in a tie, by search over all numbers.
int nearestHalf(double value) {
  int low = 0, high = kFiniteHalves - 1;
  while (high - low > 1) {
    const int middle = (low + high) / 2;
    (test::decodeHalf(static_cast<std::uint16_t>(middle)) <= value ? low : high) = middle;
  }
  const double below = value - test::decodeHalf(static_cast<std::uint16_t>(low));
  const double above = test::decodeHalf(static_cast<std::uint16_t>(high)) - value;
  if (below == above) return low % 2 == 0 ? low : high;
  return below < above ? low : high;
}

TEST(Half, RoundsToTheNearestAndTiesToEven) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> exponent(-27, 15.99f);
  for (int k = 0; k < 200000; ++k) {
    const float value = std::min(std::exp2(exponent(random)), float{kGreatest});
    ASSERT_EQ(floatToHalf(value), nearestHalf(value)) << value;
    ASSERT_EQ(floatToHalf(-value), 0x8000 | nearestHalf(value)) << value;
  }
  for (int low = 0; low + 1 < kFiniteHalves; ++low) {  // every tie, and the floats beside it
    const auto below = static_cast<std::uint16_t>(low), above = static_cast<std::uint16_t>(low + 1);
    const auto tie = static_cast<float>((test::decodeHalf(below) + test::decodeHalf(above)) / 2);
    ASSERT_EQ(floatToHalf(tie), low % 2 == 0 ? below : above);
    ASSERT_EQ(floatToHalf(std::nextafter(tie, 0.0f)), below);
    ASSERT_EQ(floatToHalf(std::nextafter(tie, 1e6f)), above);
  }
}

}  // namespace
}  // namespace glint::half_test
