#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <limits>

#include "common/normal_image.h"
#include "glint/bake/common/counter_random.h"
#include "glint/bake/common/slopes.h"
#include "glint/bake/ingest/ingest.h"
#include "glint/bake/ingest/normal_bounds.h"
#include "glint/bake/synth/synth.h"
#include "glint/model/error.h"

namespace glint::bake::ingest_normals_test {
namespace {

using ::testing::HasSubstr;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// An encoded isotropic map to damage: floats 0..1, three channels.
struct TestMap {
  int width, height;
  std::vector<Vec2> normals;
  std::vector<float> colours;

  explicit TestMap(int w = 40, int h = 30, float alpha = 0.3f) : width(w), height(h) {
    SynthOptions p = defaultSynthOptions(SynthKind::isotropic);
    p.width = w;
    p.height = h;
    p.alpha = alpha;
    normals = synthNormals(p);
    colours = apps::encodeNormals(normals);
  }
  PixelArray floats(int channels = 3) const { return {width, height, channels, std::span<const float>(colours)}; }
  float* texel(int column, int row_from_top) {
    return colours.data() + 3 * (static_cast<std::size_t>(height - 1 - row_from_top) * width + column);
  }
  template <class T>
  std::vector<T> codes() const {
    std::vector<T> out;
    for (const float c : colours) out.push_back(static_cast<T>(std::lround(c * std::numeric_limits<T>::max())));
    return out;
  }
};

IngestOptions plain() {
  IngestOptions p;
  p.name = "map.png";
  p.dequantize = Dequantize::none;
  return p;
}

template <class Action>
Error errorOf(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error was thrown";
  return {ErrorCode::failed, "", "", "", ""};
}

Error refusal(const PixelArray& image, const IngestOptions& p = plain()) {
  const Error error = errorOf([&] { ingestNormals(image, p); });
  EXPECT_EQ(error.code(), ErrorCode::invalid_input);
  EXPECT_EQ(error.path(), "map.png");
  EXPECT_NE(error.remedy(), "");
  return error;
}

TEST(IngestNormals, ReadsFloatsBack) {
  for (const auto& [w, h] : {std::pair{350, 350}, {5, 3}}) {
    const TestMap map(w, h);
    const auto result = ingestNormals(map.floats(), plain());
    constexpr float kEncodingRounding = 3e-7f;  // two roundings of numbers below 1, doubled by decoding
    for (std::size_t t = 0; t < map.normals.size(); ++t) {
      ASSERT_NEAR(result.normals[t].x, map.normals[t].x, kEncodingRounding);
      ASSERT_NEAR(result.normals[t].y, map.normals[t].y, kEncodingRounding);
    }
    EXPECT_EQ(result.report.non_unit, 0u);
  }
}

TEST(IngestNormals, ReadsCodesOfEightAndSixteenBits) {
  const TestMap map;
  const auto codes8 = map.codes<std::uint8_t>();
  const auto codes16 = map.codes<std::uint16_t>();
  const auto from8 = ingestNormals({map.width, map.height, 3, std::span<const std::uint8_t>(codes8)}, plain());
  const auto from16 = ingestNormals({map.width, map.height, 3, std::span<const std::uint16_t>(codes16)}, plain());
  for (std::size_t t = 0; t < map.normals.size(); ++t) {
    ASSERT_NEAR(from8.normals[t].x, map.normals[t].x, 2.0 / 255);  // half a code, and what normalising adds
    ASSERT_NEAR(from16.normals[t].y, map.normals[t].y, 2.0 / 65535);
  }
  EXPECT_EQ(from8.report.non_unit, 0u);
}

TEST(IngestNormals, ReconstructsZOfTwoChannels) {
  const TestMap map;
  std::vector<float> two;
  for (std::size_t t = 0; t < map.normals.size(); ++t) two.insert(two.end(), {map.colours[3 * t], map.colours[3 * t + 1]});
  const auto result = ingestNormals({map.width, map.height, 2, std::span<const float>(two)}, plain());
  EXPECT_NEAR(result.normals[7].x, map.normals[7].x, 1e-6f);
}

TEST(IngestNormals, FindsSignedFloats) {
  const TestMap map;
  std::vector<float> raw;
  for (const float c : map.colours) raw.push_back(2 * c - 1);
  const auto result = ingestNormals({map.width, map.height, 3, std::span<const float>(raw)}, plain());
  EXPECT_EQ(result.report.encoding, Encoding::snorm);
  EXPECT_NEAR(result.normals[7].x, map.normals[7].x, 1e-6f);
}

TEST(IngestNormals, NormalisesVectorsOfAnyLength) {
  const TestMap map;
  std::vector<float> vectors;
  for (const float c : map.colours) vectors.push_back(2 * c - 1);
  IngestOptions p = plain();
  p.encoding = Encoding::snorm;
  for (const float length : {1e-38f, 1e-30f, 1e-20f, 1e15f, 1e30f, 3e38f}) {
    const float direction[3][3] = {{1, 0, 1}, {-1, 1, 1}, {0, 1, 1}};
    for (std::size_t t = 0; t < 3; ++t)
      for (std::size_t c = 0; c < 3; ++c) vectors[3 * t + c] = length * direction[t][c];
    const auto result = ingestNormals({map.width, map.height, 3, std::span<const float>(vectors)}, p);
    EXPECT_NEAR(result.normals[0].x, std::sqrt(0.5f), 1e-6f) << length;
    EXPECT_EQ(result.normals[0].y, 0) << length;
    EXPECT_NEAR(result.normals[1].x, -std::sqrt(1 / 3.0f), 1e-6f) << length;
    EXPECT_NEAR(result.normals[2].y, std::sqrt(0.5f), 1e-6f) << length;
    EXPECT_EQ(result.report.repaired, 0u) << length;
    EXPECT_TRUE(std::isfinite(result.report.slopes.covariance.xx)) << length;
  }
}

TEST(IngestNormals, SignedCodesHaveAnExactZero) {
  std::vector<std::uint8_t> codes = {128, 128, 255, 255, 128, 128 + 2};
  IngestOptions p = plain();
  p.encoding = Encoding::snorm;
  EXPECT_EQ(ingestNormals({2, 1, 3, std::span<const std::uint8_t>(codes)}, p).normals[0], (Vec2{0, 0}));
}

TEST(IngestNormals, DirectxNegatesGreen) {
  const TestMap map;
  IngestOptions p = plain();
  const auto opengl = ingestNormals(map.floats(), p);
  p.convention = Convention::directx;
  const auto directx = ingestNormals(map.floats(), p);
  for (std::size_t t = 0; t < map.normals.size(); ++t) {
    ASSERT_EQ(directx.normals[t], (Vec2{opengl.normals[t].x, -opengl.normals[t].y}));
  }
}

TEST(IngestNormals, NormalisesAndCountsVectorsThatAreNotUnit) {
  TestMap map;
  float* texel = map.texel(3, 7);
  const float before[3] = {2 * texel[0] - 1, 2 * texel[1] - 1, 2 * texel[2] - 1};
  for (int c = 0; c < 3; ++c) texel[c] = 0.5f + 0.4f * before[c];  // length 0.8
  const auto result = ingestNormals(map.floats(), plain());
  EXPECT_EQ(result.report.non_unit, 1u);
  EXPECT_NEAR(result.normals[(map.height - 1 - 7) * map.width + 3].x, before[0], 1e-6f);
}

TEST(IngestNormals, NamesTheFirstTexelThatIsNotFinite) {
  TestMap map;
  map.texel(3, 7)[1] = kNaN;
  map.texel(0, 9)[0] = std::numeric_limits<float>::infinity();
  const Error error = refusal(map.floats());
  EXPECT_EQ(error.object(), "column 3, row 7 from the top");
  EXPECT_THAT(error.what(), HasSubstr("2 texels are not finite"));
  EXPECT_THAT(error.remedy(), HasSubstr("--fix-invalid"));
}

TEST(IngestNormals, RepairsHolesWithTheirNeighboursMean) {
  TestMap map;
  const auto whole = ingestNormals(map.floats(), plain());
  for (int row = 10; row < 13; ++row) {
    for (int column = 20; column < 23; ++column) map.texel(column, row)[0] = kNaN;
  }
  map.texel(0, 0)[2] = 0.2f;  // points down
  IngestOptions p = plain();
  p.fix_invalid = true;
  const auto fixed = ingestNormals(map.floats(), p);
  EXPECT_EQ(fixed.report.repaired, 10u);
  Vec2 mean;
  for (const auto& [i, j] : {std::pair{39, 0}, {1, 0}, {39, 1}, {0, 1}, {1, 1}, {39, 29}, {0, 29}, {1, 29}}) {
    mean = mean + 0.125f * whole.normals[(map.height - 1 - j) * map.width + i];  // wrapped neighbours of the corner
  }
  const Vec2 corner = fixed.normals[(map.height - 1) * map.width];
  EXPECT_NEAR(corner.x, mean.x, 1e-6f);
  EXPECT_NEAR(corner.y, mean.y, 1e-6f);
  for (const Vec2 n : fixed.normals) ASSERT_LT(dot(n, n), 1);
}

TEST(IngestNormals, RepairsOneTexelInAThousandThatPointsDownAndRefusesMore) {
  TestMap map;  // 1200 texels
  map.texel(5, 2)[2] = 0.3f;
  const auto fixed = ingestNormals(map.floats(), plain());
  EXPECT_EQ(fixed.report.downward, 1u);
  EXPECT_EQ(fixed.report.repaired, 1u);
  map.texel(7, 1)[2] = 0.3f;
  const Error error = refusal(map.floats());
  EXPECT_EQ(error.rule(), "normals.upward");
  EXPECT_EQ(error.object(), "column 7, row 1 from the top");
}

TEST(IngestNormals, FillsLargeHolesInLinearTime) {
  // In passes over the whole hole this takes minutes.
  TestMap map(1024, 1024);
  for (int row = 0; row < 1024; ++row)
    for (int column = 0; column < 500; ++column) map.texel(column, row)[0] = kNaN;
  IngestOptions p = plain();
  p.fix_invalid = true;
  EXPECT_EQ(ingestNormals(map.floats(), p).report.repaired, 500u * 1024);
}

TEST(IngestNormals, HolesAtTheBorderOfAClampedMapAreFilledFromInside) {
  TestMap map;
  IngestOptions p = plain();
  const auto whole = ingestNormals(map.floats(), p);
  map.texel(0, 0)[0] = kNaN;
  p.fix_invalid = true;
  p.boundary = Boundary::clamp;
  const auto fixed = ingestNormals(map.floats(), p);
  Vec2 mean;
  const std::size_t corner = (map.height - 1) * map.width;
  for (const std::size_t t : {corner + 1, corner - map.width, corner - map.width + 1})
    mean = mean + (1 / 3.0f) * whole.normals[t];
  EXPECT_NEAR(fixed.normals[corner].x, mean.x, 1e-6f);
  EXPECT_NEAR(fixed.normals[corner].y, mean.y, 1e-6f);
}

TEST(IngestNormals, TexelsWithoutDataAreFilled) {
  TestMap map;
  for (int c = 0; c < 3; ++c) map.texel(3, 7)[c] = 0;
  IngestOptions p = plain();
  p.no_data = 0;
  const auto result = ingestNormals(map.floats(), p);
  EXPECT_EQ(result.report.no_data, 1u);
  EXPECT_EQ(result.report.repaired, 1u);
  EXPECT_EQ(result.report.downward, 0u);
}

TEST(IngestNormals, TakesNamedChannelsAtTheirWord) {
  TestMap map;
  for (std::size_t k = 0; k < map.colours.size(); ++k) map.colours[k] = 0.5f + 0.4f * (2 * map.colours[k] - 1);  // length .8
  EXPECT_EQ(refusal(map.floats()).rule(), "normals.unit");
  IngestOptions p = plain();
  p.trust_channels = true;
  EXPECT_NEAR(ingestNormals(map.floats(), p).normals[7].x, map.normals[7].x, 1e-6f);
}

TEST(IngestNormals, RefusesTwoChannelsOutsideTheDiskUnlessByRounding) {
  std::vector<std::uint8_t> codes = {127, 127, 255, 135, 130, 120, 126, 128};  // (1, 0.06): 0.2 % outside
  const auto result = ingestNormals({2, 2, 2, std::span<const std::uint8_t>(codes)}, plain());
  EXPECT_EQ(result.report.clipped, 1u);
  for (const Vec2 n : result.normals) EXPECT_LT(dot(n, n), 1);
  codes[3] = 200;
  const Error error = refusal({2, 2, 2, std::span<const std::uint8_t>(codes)});
  EXPECT_EQ(error.rule(), "normals.disk");
  EXPECT_EQ(error.object(), "column 1, row 1 from the top");
}

TEST(IngestNormals, RefusesColoursThatWentThroughSrgb) {
  for (const bool encoded : {true, false}) {
    TestMap map(64, 64, 0.2f);
    for (float& c : map.colours) {
      c = encoded ? (c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f)
                  : (c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f));
    }
    EXPECT_EQ(refusal(map.floats()).rule(), "normals.linear") << encoded;
    const auto codes = map.codes<std::uint8_t>();
    EXPECT_EQ(refusal({64, 64, 3, std::span<const std::uint8_t>(codes)}).rule(), "normals.linear") << encoded;
  }
}

TEST(IngestNormals, RefusesAPhotograph) {
  std::vector<float> colours;
  for (std::size_t i = 0; i < 32 * 32 * 3; ++i) colours.push_back(randomPair(1, 9, i).x);
  EXPECT_EQ(refusal({32, 32, 3, std::span<const float>(colours)}).rule(), "normals.unit");
}

TEST(IngestNormals, RefusesOneChannel) {
  const std::vector<float> grey(16, 0.5f);
  const Error error = refusal({4, 4, 1, std::span<const float>(grey)});
  EXPECT_EQ(error.rule(), "normals.channels");
  EXPECT_THAT(error.remedy(), HasSubstr("--kind height"));
}

TEST(IngestNormals, RefusesAConstantMapUnlessItIsMeant) {
  std::vector<float> colours;
  for (int t = 0; t < 16; ++t) colours.insert(colours.end(), {0.5f, 0.5f, 1.0f});
  const PixelArray image{4, 4, 3, std::span<const float>(colours)};
  EXPECT_EQ(refusal(image).rule(), "map.varies");
  IngestOptions p = plain();
  p.allow_constant = true;
  EXPECT_EQ(ingestNormals(image, p).normals[5], (Vec2{0, 0}));
}

TEST(IngestNormals, RefusesPixelsThatDoNotFitTheSize) {
  const std::vector<float> colours(3 * 15, 0.5f);
  EXPECT_EQ(refusal({4, 4, 3, std::span<const float>(colours)}).rule(), "image.shape");
}

TEST(Dequantize, FillsTheCombWithoutMovingTheMean) {
  const TestMap map(256, 256, 0.2f);
  const auto codes = map.codes<std::uint8_t>();
  const PixelArray image{256, 256, 3, std::span<const std::uint8_t>(codes)};
  IngestOptions p = plain();
  const auto raw = ingestNormals(image, p);
  p.dequantize = Dequantize::automatic;
  const auto dithered = ingestNormals(image, p);
  EXPECT_FALSE(raw.report.dequantized);
  EXPECT_TRUE(dithered.report.dequantized);

  // The comb: the share of slopes in the even halves of code steps. Codes put x near (c - 127.5) * 2 / 255.
  const auto onTeeth = [](std::span<const Vec2> normals) {
    double on = 0;
    for (const Vec2 n : normals) {
      const double code = n.x * 127.5 + 127.5;
      on += std::abs(code - std::round(code)) < 0.25 ? 1 : 0;
    }
    return on / static_cast<double>(normals.size());
  };
  EXPECT_GT(onTeeth(raw.normals), 0.7);               // normalising blurs the teeth of tilted normals a little
  EXPECT_NEAR(onTeeth(dithered.normals), 0.5, 0.02);  // no teeth: half of the values; scatter 0.5 / 256

  // 65536 draws of deviation 2/255/sqrt(6): the mean is good to 1.3e-5 (5 deviations: 6e-5).
  EXPECT_NEAR(dithered.report.mean_normal.x, raw.report.mean_normal.x, 6e-5);
  // Independent noise of neighbours adds variance (2/255)^2 / 6 to each and nothing to their product.
  double product = 0;
  for (std::size_t t = 1; t < map.normals.size(); ++t) {
    product += (dithered.normals[t].x - raw.normals[t].x) * (dithered.normals[t - 1].x - raw.normals[t - 1].x);
  }
  const double variance = std::pow(2.0 / 255, 2) / 6;
  EXPECT_LT(std::abs(product / static_cast<double>(map.normals.size())), 5 * variance / 256);
}

TEST(Dequantize, LeavesFloatsAndSixteenBitsAlone) {
  const TestMap map;
  const auto codes = map.codes<std::uint16_t>();
  IngestOptions p = plain();
  p.dequantize = Dequantize::automatic;
  EXPECT_FALSE(ingestNormals(map.floats(), p).report.dequantized);
  EXPECT_FALSE(ingestNormals({map.width, map.height, 3, std::span<const std::uint16_t>(codes)}, p).report.dequantized);
}

TEST(IngestNormals, SameResultForAnyNumberOfThreads) {
  const TestMap map(123, 77);
  const auto codes = map.codes<std::uint8_t>();
  const PixelArray image{123, 77, 3, std::span<const std::uint8_t>(codes)};
  IngestOptions p = plain();
  p.dequantize = Dequantize::tpdf;
  const auto many = ingestNormals(image, p);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const auto single = ingestNormals(image, p);
  EXPECT_EQ(many.normals, single.normals);
  EXPECT_EQ(many.report.mean_tilt_deg, single.report.mean_tilt_deg);
}

TEST(IngestHeights, ScalesToTexels) {
  const std::vector<std::uint16_t> codes = {0, 65535, 13107, 0};
  IngestOptions p = plain();
  p.height_scale = 5;
  const auto result = ingestHeights({2, 2, 1, std::span<const std::uint16_t>(codes)}, p);
  EXPECT_EQ(result.heights, (std::pmr::vector<float>{0, 5, 1, 0}));
}

TEST(IngestHeights, RefusesColoursAndHoles) {
  TestMap map;
  EXPECT_EQ(errorOf([&] { ingestHeights(map.floats(), plain()); }).rule(), "heights.grey");
  std::vector<float> heights(16, 0.0f);
  heights[1] = 1;
  heights[6] = kNaN;
  const PixelArray image{4, 4, 1, std::span<const float>(heights)};
  EXPECT_EQ(errorOf([&] { ingestHeights(image, plain()); }).object(), "column 2, row 2 from the top");
  IngestOptions p = plain();
  p.fix_invalid = true;
  EXPECT_EQ(ingestHeights(image, p).heights[6], 0.125f);
}

TEST(IngestHeights, MapsThatAreConstantBesideTheirHolesAreConstant) {
  std::vector<float> heights(16, 3.0f);
  heights[5] = -9999;
  const PixelArray image{4, 4, 1, std::span<const float>(heights)};
  IngestOptions p = plain();
  p.no_data = -9999;
  EXPECT_EQ(errorOf([&] { ingestHeights(image, p); }).rule(), "map.varies");
  p.allow_constant = true;
  EXPECT_EQ(ingestHeights(image, p).heights[5], 3);
}

TEST(IngestHeights, EveryFiniteHeightMakesNormalsInsideTheDisk) {
  std::vector<float> heights;
  for (std::size_t i = 0; i < 64 * 64; ++i) {
    const Vec2 random = randomPair(7, 1, i);
    heights.push_back((random.x - 0.5f) * std::exp2(254 * random.y - 127));  // all magnitudes that floats have
  }
  IngestOptions p = plain();
  p.refuse_sentinels = false;
  const auto result = ingestHeights({64, 64, 1, std::span<const float>(heights)}, p);
  EXPECT_GT(result.report.cliffs, 1000u);
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp})
    for (const Vec2 n : normalsFromHeights(64, 64, result.heights, boundary)) ASSERT_LT(dot(n, n), 1);
}

TEST(IngestReport, GivesTheMomentsOfTheSlopes) {
  const TestMap map(256, 256, 0.2f);
  const IngestReport report = describeNormals(256, 256, map.normals);
  EXPECT_NEAR(0.5 * (report.slopes.covariance.xx + report.slopes.covariance.yy), 0.02, 2e-5);
  EXPECT_NEAR(report.slopes.covariance.xy, 0, 2e-3);
}

TEST(NormalBounds, HoldTheirBlockAndOneMoreRowAndColumn) {
  for (const auto& [width, height] : {std::pair{16, 16}, {13, 6}, {1, 1}, {5, 1}}) {
    const TestMap map(width, height);
    const auto levels = buildNormalBounds(width, height, map.normals);
    EXPECT_EQ(levels.back().nodes.size(), 1u);
    for (std::size_t level = 0; level < levels.size(); ++level) {
      const int size = 2 << level;
      EXPECT_EQ(levels[level].columns, (width + size - 1) / size);
      for (int row = 0; row < levels[level].rows; ++row) {
        for (int column = 0; column < levels[level].columns; ++column) {
          NormalBounds expected{9, 9, -9, -9};
          for (int j = row * size; j <= std::min((row + 1) * size, height); ++j) {
            for (int i = column * size; i <= std::min((column + 1) * size, width); ++i) {
              const Vec2 n = map.normals[static_cast<std::size_t>(j % height) * width + i % width];
              expected = {std::min(expected.low_x, n.x), std::min(expected.low_y, n.y), std::max(expected.high_x, n.x),
                          std::max(expected.high_y, n.y)};
            }
          }
          const NormalBounds& node = levels[level].nodes[static_cast<std::size_t>(row) * levels[level].columns + column];
          EXPECT_EQ(node.low_x, expected.low_x);
          EXPECT_EQ(node.low_y, expected.low_y);
          EXPECT_EQ(node.high_x, expected.high_x);
          EXPECT_EQ(node.high_y, expected.high_y);
        }
      }
    }
  }
}

}  // namespace
}  // namespace glint::bake::ingest_normals_test
