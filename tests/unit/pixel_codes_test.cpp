#include "glint/bake/ingest/pixel_codes.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "glint/bake/common/counter_random.h"

namespace glint::bake::pixel_codes_test {
namespace {

constexpr std::array kBoth = {0, 1};

/// 1000 codes of 8 bits, each turned by `scale` into what is stored.
template <class T, class Scale>
std::vector<T> stored(const Scale& scale) {
  std::vector<T> values;
  for (std::size_t i = 0; i < 1000; ++i) values.push_back(static_cast<T>(scale(std::floor(256 * randomPair(1, 2, i).x))));
  return values;
}

template <class T>
PixelCodes find(const std::vector<T>& values) {
  const PixelArray image{static_cast<int>(values.size() / 2), 1, 2, std::span<const T>(values)};
  return findCodes(image, kBoth);
}

TEST(PixelCodes, FindsCodesThatWereScaledToSixteenBits) {
  for (const int factor : {1, 128, 256, 257}) {
    const PixelCodes codes = find(stored<std::uint16_t>([&](double k) { return k * factor; }));
    EXPECT_TRUE(codes.coarse) << factor;
    EXPECT_EQ(codes.step, static_cast<float>(factor));
  }
}

TEST(PixelCodes, FindsCodesThatWereTurnedIntoFloats) {
  const auto expectStep = [](const std::vector<float>& values, float step) {
    EXPECT_TRUE(find(values).coarse) << step;
    EXPECT_FLOAT_EQ(find(values).step, step);
  };
  expectStep(stored<float>([](double k) { return k / 255; }), 1 / 255.0f);
  expectStep(stored<float>([](double k) { return static_cast<float>(k) * (1.0f / 255); }), 1 / 255.0f);
  expectStep(stored<float>([](double k) { return 2 * k / 255 - 1; }), 2 / 255.0f);
  expectStep(stored<float>([](double k) { return k / 128 - 1; }), 1 / 128.0f);
}

TEST(PixelCodes, HeightsOnARulerAreNoCodes) {
  std::vector<float> heights;
  for (int i = 0; i < 256; ++i) heights.push_back(static_cast<float>(i % 64) / 64);  // a sawtooth of slope 1/64
  const std::array first = {0};
  EXPECT_FALSE(findCodes({256, 1, 1, std::span<const float>(heights)}, first).coarse);
}

TEST(PixelCodes, LeavesRealPrecisionAlone) {
  const auto random = [](std::size_t i) { return randomPair(1, 2, i).x; };
  std::vector<std::uint16_t> wide;
  std::vector<float> floats;
  for (std::size_t i = 0; i < 500; ++i) {
    wide.push_back(static_cast<std::uint16_t>(65535 * random(i)));
    floats.push_back(random(i));
  }
  EXPECT_FALSE(find(wide).coarse);
  EXPECT_EQ(find(wide).step, 1);
  EXPECT_FALSE(find(floats).coarse);
  EXPECT_EQ(find(floats).step, 0);
}

TEST(PixelCodes, MasksTellNothing) {
  const std::vector<std::uint16_t> mask = {0, 65535, 0, 65535, 13107, 0};
  EXPECT_FALSE(find(mask).coarse);
}

TEST(PixelCodes, OneOtherValueIsEnough) {
  auto values = stored<std::uint16_t>([](double k) { return k * 257; });
  values[400] = 1000;
  EXPECT_FALSE(find(values).coarse);
}

TEST(NoData, IsComparedInNumbersOfTheFile) {
  const std::vector<float> pixels = {-32768 / 32767.0f, 0.5f};
  PixelArray image{2, 1, 1, std::span<const float>(pixels)};
  image.code_scale = 32767;
  const NoDataTest test(image, -32768);
  EXPECT_TRUE(test(pixels[0]));
  EXPECT_FALSE(test(pixels[1]));
  EXPECT_FALSE(NoDataTest(image, {})(pixels[0]));
}

TEST(NoData, NumbersBeyondFloatsAreInfiniteOnes) {
  const std::vector<float> pixels = {-HUGE_VALF, HUGE_VALF, 3};
  const NoDataTest test({3, 1, 1, std::span<const float>(pixels)}, -1.7976931348623157e308);
  EXPECT_TRUE(test(pixels[0]));
  EXPECT_FALSE(test(pixels[1]));
  EXPECT_FALSE(test(pixels[2]));
}

std::optional<double> sentinelOf(const std::vector<float>& pixels, std::optional<double> no_data = {}) {
  const PixelArray image = {static_cast<int>(pixels.size()), 1, 1, std::span<const float>(pixels)};
  return findSentinel(image, NoDataTest(image, no_data));
}

TEST(Sentinel, IsLookedForBesideTheNumberThatIsNamed) {
  EXPECT_EQ(sentinelOf({1, 3, -9999, 2}, -32768), -9999);
  EXPECT_EQ(sentinelOf({1, 3, -9999, 2}, -9999), std::nullopt);
  EXPECT_EQ(sentinelOf({1, 3, -3.4028235e38f, 2}, -3.40282e+38), std::nullopt);  // a text of six digits
}

TEST(Sentinel, IsFarFromAllHeights) {
  EXPECT_EQ(sentinelOf({1, 3, -9999, 2}), -9999);
  EXPECT_EQ(sentinelOf({1, 3, 2, 9999, 9999}), 9999);
  EXPECT_EQ(sentinelOf({1, 3, -5000, 2}), -5000);  // no usual one, but a thousand times farther
  EXPECT_FALSE(sentinelOf({1, 3, -50, 2}));
  EXPECT_FALSE(sentinelOf({-9999, -5000, 0, 5000}));  // one of many
  EXPECT_FALSE(sentinelOf({0, 65535, 0, 65535}));     // a mask
  EXPECT_FALSE(sentinelOf({2, 2}));
}

}  // namespace
}  // namespace glint::bake::pixel_codes_test
