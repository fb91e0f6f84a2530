// Vectors of four, lane by lane against scalar code. Built for SSE4.1, for SSE2 alone, and without either: all must pass.
#include "glint/math/float4.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

namespace glint::float4_test {
namespace {

struct Lanes {
  float v[4];
};
Lanes lanesOf(Float4 a) {
  Lanes out;
  a.store(out.v);
  return out;
}

constexpr float kInfinity = std::numeric_limits<float>::infinity();
const float kNumbers[] = {0,      -0.0f,   1,    -1,    0.5f,    -0.5f,    2.75f,     -2.75f,     1e-30f,   -1e-30f,
                          8.5e6f, -8.5e6f, 3e9f, -3e9f, 1.5e20f, -1.5e20f, kInfinity, -kInfinity, 65504.0f, -65504.0f};

/// Calls test(a, b, x, y) with four numbers of each kind in vectors.
template <class Test>
void forRandomLanes(Test&& test) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(-100, 100);
  for (int round = 0; round < 2000; ++round) {
    float a[4], b[4];
    for (float* p : {a, b})
      for (int k = 0; k < 4; ++k) p[k] = random() % 4 == 0 ? kNumbers[random() % std::size(kNumbers)] : unit(random);
    test(Float4::load(a), Float4::load(b), a, b);
  }
}

void expectSameBits(float found, float expected, int lane) {
  if (std::isnan(expected)) {
    ASSERT_TRUE(std::isnan(found)) << lane;
    return;
  }
  ASSERT_EQ(std::bit_cast<std::uint32_t>(found), std::bit_cast<std::uint32_t>(expected))
      << lane << ": " << found << " " << expected;
}
template <class Expected>
void expectLanes(Float4 found, Expected&& expected) {
  for (int k = 0; k < 4; ++k) expectSameBits(lanesOf(found).v[k], expected(k), k);
}

TEST(Float4, Arithmetic) {
  forRandomLanes([](Float4 a, Float4 b, const float* x, const float* y) {
    expectLanes(a + b, [&](int k) { return x[k] + y[k]; });
    expectLanes(a - b, [&](int k) { return x[k] - y[k]; });
    expectLanes(a * b, [&](int k) { return x[k] * y[k]; });
    expectLanes(a / b, [&](int k) { return x[k] / y[k]; });
    expectLanes(floorOf(a), [&](int k) { return std::floor(x[k]); });
    expectLanes(minOf(a, b), [&](int k) { return x[k] < y[k] ? x[k] : y[k]; });
    expectLanes(whereLess(a, b, a, b), [&](int k) { return x[k] < y[k] ? x[k] : y[k]; });
    expectLanes(whereLess(a, b, a), [&](int k) { return x[k] < y[k] ? x[k] : 0.0f; });
    expectSameBits(a.sum(), (x[0] + x[2]) + (x[1] + x[3]), 0);
    unsigned not_above = 0;
    for (int k = 0; k < 4; ++k) not_above |= (x[k] <= 0.5f ? 1u : 0u) << k;
    ASSERT_EQ(a.notAbove(0.5f), not_above);
    for (int k = 0; k < 4; ++k) ASSERT_EQ(lanesOf(a.positive()).v[k], x[k] > 0 ? x[k] : 0.0f);
  });
  expectLanes(Float4::all(std::nanf("")).positive(), [](int) { return 0.0f; });
  expectLanes(floorOf(Float4::all(std::nanf(""))), [](int) { return std::nanf(""); });
}

TEST(Float4, Lanes) {
  const Float4 a = Float4::of(1, 2, 3, 4), b = Float4::of(5, 6, 7, 8);
  const auto expect = [](Float4 found, float w, float x, float y, float z) {
    const float expected[] = {w, x, y, z};
    expectLanes(found, [&](int k) { return expected[k]; });
  };
  const float pairs[] = {1, 2, 3, 4};
  expect(Float4::ofPairs(pairs, pairs + 2), 1, 2, 3, 4);
  expect(interleaveLow(a, b), 1, 5, 2, 6);
  expect(interleaveHigh(a, b), 3, 7, 4, 8);
  expect(a.lanes0101(), 1, 2, 1, 2);
  expect(a.lanes2233(), 3, 3, 4, 4);
  expect(a.last(), 4, 4, 4, 4);
  EXPECT_EQ(a.lastLane(), 4);
  expect(b.shiftedBehind(a), 4, 5, 6, 7);
  expect(a.runningSums(), 1, 3, 6, 10);
  expect(sumsOf(a, b, a + b, b - a), 10, 26, 36, 16);
  const std::uint32_t numbers[] = {7, 9, 7, 0xffffffffu};
  expect(whereEqual(numbers, 7, a), 1, 0, 3, 0);
  std::uint32_t indices[4];
  storeIndices(Float4::of(0, 3, 70000, 5), 12345, Float4::of(7, 0, 1, 99), indices);
  const std::uint32_t expected[] = {7, 3 * 12345, 70000u * 12345 + 1, 5 * 12345 + 99};
  for (int k = 0; k < 4; ++k) EXPECT_EQ(indices[k], expected[k]);
}

TEST(Float4, Integers) {
  std::mt19937 random(2);
  for (int round = 0; round < 2000; ++round) {
    std::int8_t bytes[4];
    std::int32_t c[4], d[4];
    for (int k = 0; k < 4; ++k) {
      bytes[k] = static_cast<std::int8_t>(random());
      c[k] = static_cast<std::int32_t>(random()), d[k] = static_cast<std::int32_t>(random());
    }
    expectLanes(Float4::load(bytes), [&](int k) { return static_cast<float>(bytes[k]); });
    expectLanes(Float4::loadLow(bytes), [&](int k) { return static_cast<float>(lowHalf(bytes[k])); });
    expectLanes(Float4::loadHigh(bytes), [&](int k) { return static_cast<float>(highHalf(bytes[k])); });
    expectLanes(Float4::load(c), [&](int k) { return static_cast<float>(c[k]); });
    for (const int mask : {0, -1}) {
      expectLanes(Float4::difference(c, d, mask), [&](int k) { return differenceOf(c[k], mask != 0 ? d[k] : 0); });
    }
    const auto codes = static_cast<std::uint32_t>(random());
    expectLanes(Float4::ofMassCodes(codes),
                [&](int k) { return halfToFloat(static_cast<std::uint16_t>((codes >> (8 * k) & 255u) << 6)); });
  }
}

/// All bits that a file may have.
TEST(Float4, HalfPrecisionNumbers) {
  for (std::uint32_t first = 0; first < 0x10000; first += 4) {
    std::uint16_t halves[4];
    for (int k = 0; k < 4; ++k) halves[k] = static_cast<std::uint16_t>(first + static_cast<std::uint32_t>(k));
    expectLanes(Float4::load(halves), [&](int k) { return halfToFloat(halves[k]); });
    expectLanes(Float4::loadPositive(halves), [&](int k) { return positiveHalfToFloat(halves[k]); });
    expectLanes(Float4::ofPositive(halves[3], halves[2], halves[1], halves[0]),
                [&](int k) { return positiveHalfToFloat(halves[3 - k]); });
  }
}

}  // namespace
}  // namespace glint::float4_test
