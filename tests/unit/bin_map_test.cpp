#include "glint/bake/bin_map/bin_map.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <random>
#include <tuple>
#include <vector>

#include "glint/bake/bin_map/bin_map_image.h"
#include "glint/model/error.h"
#include "glint/query/bin_map_ndf.h"
#include "glint/query/reference.h"
#include "support/bin_weights.h"
#include "support/test_maps.h"

namespace glint::bin_map_test {
namespace {

using test::expectWeights;
using test::kWeightTolerance;

/// Normals are kept to 1/2^p of a bin, p at least 5 here: 1.2 deviations / 2^6 at most, at a slope of the lobe of 1.
constexpr double kLobeTolerance = 0.02;
/// Acceptance: median error of the density on noise, on a map of 8 bits, and of all densities together.
constexpr double kNoiseTolerance = 0.015, kByteTolerance = 0.05, kEnergyTolerance = 0.005;

class OwnedBinMap {
 public:
  OwnedBinMap(const test::OwnedMap& map, float alpha, int leaf_size = 8)
      : data_(bake::buildBinMap(map.map(), {alpha, leaf_size})), ndf_(data_.view()) {}
  const bake::BinMapData& data() const { return data_; }
  const BinMapNdf& ndf() const { return ndf_; }

 private:
  bake::BinMapData data_;
  BinMapNdf ndf_;
};

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  float unit() { return static_cast<float>(engine_() >> 8) * 0x1p-24f; }
  float between(float low, float high) { return low + (high - low) * unit(); }
  Vec2 direction(float length) {
    const float a = 2 * kPi * unit();
    return {length * std::cos(a), length * std::sin(a)};
  }
  std::size_t below(std::size_t n) { return engine_() % n; }

 private:
  std::mt19937 engine_;
};

Footprint randomBox(Random& random, float longest) {
  const float a = longest * std::exp2(-8 * random.unit()), b = longest * std::exp2(-8 * random.unit());
  const Vec2 centre = {random.unit(), random.unit()};
  if (random.unit() < 0.3f) return Footprint::box(centre, {a, 0}, {0, b});
  if (random.unit() < 0.2f) return Footprint::box(centre, {0, a}, {-b, 0});
  Vec2 u = random.direction(a), v = random.direction(b);
  while (std::abs(u.x * v.y - u.y * v.x) < 0.05f * a * b) v = random.direction(b);
  return Footprint::box(centre, u, v);
}

// Map sizes, roughness, cells: powers of two and not, lists with and without grids.
class BinMapWeights : public testing::TestWithParam<std::tuple<int, int, float, int>> {};

TEST_P(BinMapWeights, EqualBruteForceOnRandomParallelograms) {
  const auto [width, height, alpha, leaf_size] = GetParam();
  const test::OwnedMap map(width, height, test::randomNormals(width, height, 0.9f, 3));
  const OwnedBinMap bins(map, alpha, leaf_size);
  Random random(11);
  for (int k = 0; k < 60; ++k) {
    const Footprint p = randomBox(random, 0.4f * static_cast<float>(std::min(width, height)));
    expectWeights(map.map(), bins.ndf(), p, map.normals()[random.below(map.normals().size())]);
    if (HasFailure()) FAIL() << "query " << k;
  }
}

TEST_P(BinMapWeights, EqualBruteForceForFootprintsLargerThanTheMap) {
  const auto [width, height, alpha, leaf_size] = GetParam();
  if (width * height > 5000) GTEST_SKIP() << "brute force would take long";
  const test::OwnedMap map(width, height, test::randomNormals(width, height, 0.9f, 3));
  const OwnedBinMap bins(map, alpha, leaf_size);
  Random random(12);
  for (int k = 0; k < 20; ++k) {
    const Footprint p = randomBox(random, 0.9f * static_cast<float>(std::min(width, height)));
    expectWeights(map.map(), bins.ndf(), p, map.normals()[random.below(map.normals().size())]);
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, BinMapWeights,
                         testing::Values(std::tuple{64, 64, 0.16f, 8}, std::tuple{64, 64, 0.01f, 8},
                                         std::tuple{64, 64, 0.5f, 1}, std::tuple{50, 37, 0.3f, 2}, std::tuple{7, 300, 0.2f, 1},
                                         std::tuple{300, 7, 0.2f, 4}, std::tuple{1, 1, 0.1f, 8},
                                         std::tuple{256, 256, 0.16f, 16}, std::tuple{256, 200, 0.4f, 1}));

TEST(BinMapNdf, WeightsAreRightAtTheBorderOfTheSquare) {
  std::vector<Vec2> normals(64 * 64);
  Random random(5);
  for (Vec2& n : normals) n = random.direction(random.between(0.97f, 0.9999f));
  const test::OwnedMap map(64, 64, normals);
  for (const float alpha : {0.02f, 0.16f, 0.8f}) {
    const OwnedBinMap bins(map, alpha);
    for (int k = 0; k < 40; ++k) {
      expectWeights(map.map(), bins.ndf(), randomBox(random, 20), random.direction(random.between(0.9f, 1.0f)));
      if (HasFailure()) FAIL() << "query " << k;
    }
    expectWeights(map.map(), bins.ndf(), Footprint::box({0.5f, 0.5f}, {20, 0}, {0, 20}), {1, 0});
    expectWeights(map.map(), bins.ndf(), Footprint::box({0.5f, 0.5f}, {20, 0}, {0, 20}), {-1, 1});
    EXPECT_EQ(bins.ndf().weights(Footprint::box({0, 0}, {2, 0}, {0, 2}), {1.5f, 0}).count, 0);
  }
}

TEST(BinMapNdf, WeightsOfBrokenFilesAreOfBinsAroundTheHalfVector) {
  std::vector<Vec2> normals(64 * 64);
  Random random(8);
  for (Vec2& n : normals) n = random.direction(random.between(0.9f, 0.9999f));
  const test::OwnedMap map(64, 64, normals);
  bake::BinMapData data = bake::buildBinMap(map.map(), {0.02f});
  for (std::uint32_t& texel : data.texels) texel = static_cast<std::uint32_t>(random.below(std::size_t{1} << 32));
  const BinMapNdf ndf(data.view());
  const int across = data.view().bins_per_axis;
  const auto binAt = [&](float x) {
    return std::min(static_cast<int>((x + 1) * 0.5f * static_cast<float>(across)), across - 1);
  };
  int found = 0;
  for (int k = 0; k < 400; ++k) {
    const Vec2 h = random.direction(random.between(0.97f, 1.0f));
    const float side = k % 2 == 0 ? 4.0f : 32.0f;
    const BinWeights weights = ndf.weights(Footprint::box({random.unit(), random.unit()}, {side, 0}, {0, side}), h);
    found += weights.count;
    for (int b = 0; b < weights.count; ++b) {
      ASSERT_LE(std::abs(static_cast<int>(weights.bins[b]) % across - binAt(h.x)), 2) << k;
      ASSERT_LE(std::abs(static_cast<int>(weights.bins[b]) / across - binAt(h.y)), 2) << k;
    }
  }
  EXPECT_GT(found, 100);
}

TEST(BinMapNdf, TinyBoxesSeeTheTexelsTheyTouch) {
  const test::OwnedMap map(32, 32, test::randomNormals(32, 32, 0.9f, 3));
  const OwnedBinMap bins(map, 0.1f);
  Random random(6);
  for (const float side : {0.002f, 0.02f, 0.3f}) {
    for (int k = 0; k < 40; ++k) {
      const Vec2 centre = {random.unit(), random.unit()};
      const Vec2 h = map.map().at(static_cast<int>(centre.x * 32), static_cast<int>(centre.y * 32));
      expectWeights(map.map(), bins.ndf(), Footprint::box(centre, {side, 0}, {0, side}), h);
      expectWeights(map.map(), bins.ndf(), Footprint::box(centre, {side, side}, {-side, 0.5f * side}), h);
    }
  }
}

TEST(BinMap, ConstantMapIsOneBin) {
  const test::OwnedMap map(96, 64, std::vector<Vec2>(96 * 64, Vec2{0.3f, -0.2f}));
  for (const float alpha : {0.0025f, 0.16f}) {
    const OwnedBinMap bins(map, alpha);
    EXPECT_EQ(bins.data().view().blockCount(), 1u);
    Random random(3);
    for (int k = 0; k < 20; ++k) {
      const BinWeights weights = bins.ndf().weights(randomBox(random, 300), {0.3f, -0.2f});
      ASSERT_EQ(weights.count, 1);
      EXPECT_NEAR(weights.weights[0], 1, kWeightTolerance);
    }
    // A facet's lobe, wherever one looks: its normal is kept to a fraction of a bin.
    const Reference reference(map.map(), bins.ndf().sigma());
    for (const float side : {1.0f, 10.0f, 60.0f}) {
      const Footprint p = Footprint::box({0.4f, 0.7f}, {side, 0}, {0, side});
      for (const float d : {0.0f, 0.5f, 1.0f}) {
        const Vec2 h = {0.3f + d * bins.ndf().sigma(), -0.2f};
        const float expected = reference.density(p, h);
        EXPECT_NEAR(bins.ndf().density(p, h), expected, 0.02f * expected) << side << " " << d;
      }
    }
  }
}

TEST(BinMap, OneTexelMapAnswersItsLobe) {
  const test::OwnedMap map(1, 1, {{0.1f, 0.2f}});
  const OwnedBinMap bins(map, 0.05f);
  const Reference reference(map.map(), bins.ndf().sigma());
  for (const Footprint& p : {Footprint::box({0.3f, 0.9f}, {5, 1}, {0, 3}), Footprint::box({0.5f, 0.5f}, {0.2f, 0}, {0, 0.2f}),
                             Footprint::isotropic({0, 0}, 3)}) {
    const float expected = reference.density(p, {0.11f, 0.2f});
    EXPECT_NEAR(bins.ndf().density(p, {0.11f, 0.2f}), expected, kLobeTolerance * expected);
  }
}

TEST(BinMap, TinyMapsKeepNormalsAsFineAsCodesCan) {
  // One normal, to 1/512 of a bin: 0.0024 deviations along each axis, and relative slopes of a lobe of up to 3 a deviation.
  constexpr double kFinest = 0.012;
  Random random(9);
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {5, 3}, {16, 16}, {256, 1}}) {
    const test::OwnedMap map(width, height, test::randomNormals(width, height, 0.9f, 3));
    for (const float alpha : {0.0005f, 0.002f, 0.01f, 0.1f, 0.5f}) {
      const OwnedBinMap bins(map, alpha);
      for (int k = 0; k < 40; ++k) {
        const int i = static_cast<int>(random.below(static_cast<std::size_t>(width)));
        const int j = static_cast<int>(random.below(static_cast<std::size_t>(height)));
        const Vec2 centre = {(static_cast<float>(i) + 0.5f) / static_cast<float>(width),
                             (static_cast<float>(j) + 0.5f) / static_cast<float>(height)};
        const Footprint p = Footprint::box(centre, {0.4f, 0}, {0, 0.4f});
        const Vec2 h = map.map().at(i, j) + random.direction(bins.ndf().sigma() * random.between(0, 3));
        const float expected = Reference(map.map(), bins.ndf().sigma()).density(p, h);
        EXPECT_NEAR(bins.ndf().density(p, h), expected, kFinest * expected) << width << ' ' << height << ' ' << alpha;
      }
    }
  }
}

TEST(BinMap, BadOptionsAreUsageErrors) {
  const test::OwnedMap map(8, 8, test::randomNormals(8, 8, 0.9f, 3));
  for (const float alpha : {0.0f, -0.1f, 1e-5f, 1.01f, 1e30f, std::nanf("")}) {
    try {
      bake::buildBinMap(map.map(), {alpha, 8});
      FAIL() << alpha;
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::usage);
    }
  }
  EXPECT_THROW(bake::buildBinMap(map.map(), {0.1f, 0}), Error);
  for (const float alpha_max : {0.05f, 1.5f, -1.0f, std::nanf("")})
    EXPECT_THROW(bake::buildBinMap(map.map(), {0.1f, 8, alpha_max}), Error) << alpha_max;
  EXPECT_THROW(bake::buildBinMap(map.map(), {0.001f, 8, 0.1f}), Error);  // a hundredfold
}

TEST(BinMap, NormalsOutsideTheDiskAreNamedFromTheTop) {
  std::vector<Vec2> normals(16 * 16);
  normals[3 * 16 + 5] = {0.9f, 0.9f};
  normals[4 * 16 + 5] = {std::nanf(""), 0};
  NormalMap map;
  map.width = map.height = 16;
  map.normals = normals;
  try {
    bake::buildBinMap(map, {0.1f, 8});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::invalid_input);
    EXPECT_NE(std::string(error.what()).find("2 normals"), std::string::npos) << error.what();
    EXPECT_NE(std::string(error.what()).find("column 5, row 11 from the top"), std::string::npos) << error.what();
  }
}

TEST(BinMap, MapsTooLargeForTheirCodesAreUnsupported) {
  EXPECT_EQ(texelCode(16384, 16384).subbin_bits, 2);
  EXPECT_EQ(texelCode(1 << 20, 256).subbin_bits, 2);
  EXPECT_LT(texelCode(16385, 16384).subbin_bits, 0);
  EXPECT_LT(texelCode(1 << 20, 1 << 20).subbin_bits, 0);
  const std::vector<Vec2> row(1);
  NormalMap map;
  map.width = 16385;
  map.height = 16384;
  map.normals = row;  // refused by its size alone
  try {
    bake::buildBinMap(map, {0.1f, 8});
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::unsupported);
  }
}

TEST(BinMap, CoordinatesMayNeedMoreThanSixteenBits) {
  constexpr int kWidth = 1 << 18;
  const test::OwnedMap map(kWidth, 4, test::randomNormals(kWidth, 4, 0.9f, 3));
  const OwnedBinMap bins(map, 0.2f);
  Random random(4);
  for (int k = 0; k < 20; ++k) {
    const Vec2 centre = {random.between(0.9f, 1.0f), random.unit()};
    const Footprint p = Footprint::box(centre, {random.between(1, 40), 0.1f}, {0, 1.5f});
    expectWeights(map.map(), bins.ndf(), p, map.normals()[random.below(map.normals().size())]);
  }
}

TEST(BinMap, ResolutionsAreThoseOfThePaper) {
  // Table 4 of Atanasov 2021.
  EXPECT_EQ(bake::binsPerAxis(0.0025f), 942);
  EXPECT_EQ(bake::binsPerAxis(0.01f), 235);
  EXPECT_EQ(bake::binsPerAxis(0.04f), 59);
  EXPECT_EQ(bake::binsPerAxis(0.16f), 15);
}

TEST(BinMap, DoesNotDependOnThreads) {
  const test::OwnedMap map(200, 150, test::roughSurface(200, 150, 0.3f));
  std::vector<bake::BinMapData> built;
  for (const std::size_t threads : {1, 2, 7}) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    built.push_back(bake::buildBinMap(map.map(), {0.02f, 4}));
  }
  for (const bake::BinMapData& other : built) {
    EXPECT_EQ(other.texels, built[0].texels);
    EXPECT_EQ(other.texel_classes, built[0].texel_classes);
    EXPECT_EQ(other.cell_starts.offsets, built[0].cell_starts.offsets);
    EXPECT_EQ(other.block_moments, built[0].block_moments);
    EXPECT_EQ(other.nodes, built[0].nodes);
  }
}

TEST(BinMap, CompactCountsAreExactForAnySteps) {
  for (const std::uint64_t step : {1ull, 1000ull, 70000ull, 1ull << 33}) {
    std::vector<std::uint64_t> values;
    for (std::uint64_t k = 0; k < 500; ++k) values.push_back(k * step + (step > 3 ? k % 3 : 0));
    const bake::CompactCountsData data = bake::compactCounts(values);
    const CompactCounts counts = data.view();
    ASSERT_EQ(counts.size(), values.size());
    for (std::size_t k = 0; k < values.size(); ++k) EXPECT_EQ(counts[k], values[k]);
  }
}

std::vector<Vec2> eightBits(std::vector<Vec2> normals) {
  for (Vec2& n : normals) n = {std::round((n.x + 1) * 127.5f) / 127.5f - 1, std::round((n.y + 1) * 127.5f) / 127.5f - 1};
  return normals;
}

struct DensityErrors {
  double median = 0, energy = 0;
};

/// Errors at normals of the footprint, as a renderer asks where there is a glint.
DensityErrors densityErrors(const test::OwnedMap& map, const BinMapNdf& ndf, float side, bool turned, int count) {
  const Reference reference(map.map(), ndf.sigma());
  Random random(21);
  std::vector<double> errors;
  double sum = 0, truth_sum = 0;
  for (int k = 0; k < count; ++k) {
    const Vec2 a = turned ? random.direction(0.5f * side) : Vec2{0.5f * side, 0};
    const Vec2 centre = {random.unit(), random.unit()};
    const Vec2 h = map.map().at(static_cast<int>(centre.x * static_cast<float>(map.map().width)),
                                static_cast<int>(centre.y * static_cast<float>(map.map().height))) +
                   random.direction(2 * ndf.sigma() * random.unit());
    const Footprint p = Footprint::box(centre, a, {-a.y, a.x});
    const double truth = reference.density(p, h), value = ndf.density(p, h);
    errors.push_back(std::abs(value / truth - 1));
    sum += value, truth_sum += truth;
  }
  std::nth_element(errors.begin(), errors.begin() + count / 2, errors.end());
  return {errors[static_cast<std::size_t>(count / 2)], sum / truth_sum - 1};
}

TEST(BinMapNdf, DensityIsThatOfReference) {
  const auto rough = test::roughSurface(256, 256, 0.3f);
  const test::OwnedMap noise(256, 256, rough), bytes(256, 256, eightBits(rough)),
      independent(256, 256, test::randomNormals(256, 256, 0.8f, 4));
  for (const auto& [map, tolerance] :
       {std::pair{&noise, kNoiseTolerance}, {&bytes, kByteTolerance}, {&independent, kNoiseTolerance}}) {
    for (const float alpha : {0.01f, 0.04f, 0.16f}) {
      const OwnedBinMap bins(*map, alpha);
      for (const float side : {4.0f, 16.0f, 64.0f, 200.0f}) {
        const DensityErrors errors = densityErrors(*map, bins.ndf(), side, side < 100, side < 50 ? 200 : side < 100 ? 60 : 10);
        EXPECT_LT(errors.median, tolerance) << alpha << " " << side;
        EXPECT_LT(std::abs(errors.energy), kEnergyTolerance) << alpha << " " << side;
      }
    }
  }
}

TEST(BinMapNdf, MergedBinsKeepTheError) {
  // Footprints with thousands of texels of a bin: its mean and covariance stand for them.
  const test::OwnedMap map(512, 512, test::roughSurface(512, 512, 0.3f));
  const OwnedBinMap bins(map, 0.16f);
  const DensityErrors errors = densityErrors(map, bins.ndf(), 300, true, 10);
  EXPECT_LT(errors.median, kNoiseTolerance);
  EXPECT_LT(std::abs(errors.energy), kEnergyTolerance);
}

TEST(BinMapNdf, PublishedDensitiesAreOfTheCentresOfBins) {
  const test::OwnedMap map(64, 50, test::randomNormals(64, 50, 0.8f, 3));
  const OwnedBinMap bins(map, 0.16f);
  const BinMapNdf published(bins.data().view(), 0.16f, BinEstimator::published);
  const int across = published.map().bins_per_axis;
  const float variance = published.sigma() * published.sigma(), bin = 2.0f / static_cast<float>(across);
  Random random(13);
  for (int k = 0; k < 60; ++k) {
    const Footprint p = randomBox(random, 25);
    const Vec2 h = map.normals()[random.below(map.normals().size())];
    const auto columnOf = [&](float x) { return static_cast<int>((x + 1) / bin); };
    double expected = 0;
    for (const auto& [number, weight] : test::bruteWeights(map.map(), across, p)) {
      const int column = static_cast<int>(number) % across, row = static_cast<int>(number) / across;
      const int dx = std::abs(column - columnOf(h.x)), dy = std::abs(row - columnOf(h.y));
      if (dx > 2 || dy > 2 || dx * dy == 4) continue;  // 21 bins: 5 x 5 without the corners
      const Vec2 centre = {-1 + (static_cast<float>(column) + 0.5f) * bin, -1 + (static_cast<float>(row) + 0.5f) * bin};
      expected += weight * FacetLobe::density({variance, 0, variance}, h - centre);
    }
    EXPECT_NEAR(published.density(p, h), expected, 1e-4 * expected + 1e-5);
    EXPECT_EQ(published.mean(p, {h, h + Vec2{0.1f, 0.1f}}), bins.ndf().mean(p, {h, h + Vec2{0.1f, 0.1f}}));
    const HalfVectorSample s = published.sample(p, {random.unit(), random.unit()});
    if (s.pdf > 0) {
      EXPECT_EQ(s.pdf, bins.ndf().density(p, s.h));
    }
  }
}

TEST(BinMapNdf, ImagesAreMeansOverPixels) {
  constexpr int kResolution = 40;
  const test::OwnedMap map(128, 100, test::roughSurface(128, 100, 0.3f));
  for (const float alpha : {0.02f, 0.16f, 0.5f}) {
    const OwnedBinMap bins(map, alpha);
    for (const float side : {3.0f, 70.0f}) {
      const Footprint p = Footprint::box({0.3f, 0.9f}, {side, 0.2f * side}, {-0.1f, side});
      const std::vector<float> image = bake::binMapImage(bins.ndf(), p, kResolution);
      double most = 0, total = 0;
      for (const float x : image) most = std::max(most, double{x}), total += double{x};
      constexpr int kEvery = 3;  // means are slow
      for (int y = 0; y < kResolution; y += kEvery) {
        for (int x = 0; x < kResolution; x += kEvery) {
          const float pixel = 2.0f / kResolution;
          const Vec2 low = {-1 + static_cast<float>(x) * pixel, -1 + static_cast<float>(y) * pixel};
          EXPECT_NEAR(image[rowMajorIndex(x, y, kResolution)], bins.ndf().mean(p, {low, low + Vec2{pixel, pixel}}),
                      1e-5 * most);
        }
      }
      EXPECT_NEAR(total / (kResolution * kResolution), bins.ndf().mean(p, {{-1, -1}, {1, 1}}), 1e-4) << alpha << " " << side;
      EXPECT_EQ(image, bake::binMapImage(bins.ndf(), p, kResolution));
    }
  }
}

/// 512 x 512 maps on which the normals inside a footprint are not those of the whole map.
std::vector<Vec2> teeth(int size) {
  bake::SynthOptions p = bake::defaultSynthOptions(bake::SynthKind::sawtooth);
  p.width = p.height = size;
  p.feature_texels = 0.5f * static_cast<float>(size);
  p.slope = 0.08f;
  return bake::synthNormals(p);
}
std::vector<Vec2> smoothAndRough(int size) {
  std::vector<Vec2> smooth = test::roughSurface(size, size, 0.05f);
  const std::vector<Vec2> rough = test::roughSurface(size, size, 0.35f);
  for (std::size_t k = 0; k < smooth.size(); ++k)
    if (2 * (k % static_cast<std::size_t>(size)) >= static_cast<std::size_t>(size)) smooth[k] = rough[k];
  return smooth;
}
std::vector<Vec2> ramp(int size) {
  std::vector<Vec2> normals = test::roughSurface(size, size, 0.01f);
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const Vec2 at = test::pixelCentre(k, size);
    normals[k] = normals[k] + Vec2{0.15f * at.x, 0.1f * at.y};
  }
  return normals;
}

TEST(BinMapNdf, MergedBinsAreOfTheTexelsInTheFootprint) {
  constexpr int kSize = 512;
  for (const auto& normals : {teeth(kSize), smoothAndRough(kSize), ramp(kSize)}) {
    const test::OwnedMap map(kSize, kSize, normals);
    for (const float alpha : {0.04f, 0.11f, 0.22f, 0.5f}) {
      const OwnedBinMap bins(map, alpha);
      for (const float side : {40.0f, 80.0f, 160.0f}) {
        for (const bool turned : {false, true})
          EXPECT_LT(densityErrors(map, bins.ndf(), side, turned, 15).median, kNoiseTolerance)
              << alpha << " " << side << (turned ? " turned" : "");
      }
    }
  }
}

TEST(BinMapNdf, MergedBinsAreExactWhereFootprintsCoverTheMapSeveralTimes) {
  // Whole lists are not read: what is stored of the block stands for them.
  constexpr int kSize = 128;
  const test::OwnedMap map(kSize, kSize, smoothAndRough(kSize));
  const OwnedBinMap bins(map, 0.3f);
  const Footprint once = Footprint::box({0.5f, 0.5f}, {0.5f * kSize, 0}, {0, 0.5f * kSize});
  const Footprint often = Footprint::box({0.5f, 0.5f}, {1.5f * kSize, 0}, {0, 1.5f * kSize});
  constexpr float kStoredTolerance = 2e-3f;  // moments are stored in half precision
  for (const Vec2 h : {Vec2{0, 0}, {0.05f, 0.1f}, {-0.2f, 0.1f}})
    EXPECT_NEAR(bins.ndf().density(often, h), bins.ndf().density(once, h), kStoredTolerance * bins.ndf().density(once, h));
}

TEST(BinMapNdf, ConvergesToReferenceAsBinsShrink) {
  // The same lobe over finer and finer bins: what remains is the rounding of normals, which halves with the bins.
  const test::OwnedMap map(256, 256, test::roughSurface(256, 256, 0.3f));
  constexpr double kRounding = 1e-4;  // single precision, and lobes that end at five deviations
  double last = 1;
  for (const float finer : {1.0f, 4.0f, 16.0f}) {
    const bake::BinMapData data = bake::buildBinMap(map.map(), {0.16f / finer, 8});
    const BinMapNdf ndf(data.view(), 0.16f);
    const double error = densityErrors(map, ndf, 6, true, 200).median;
    EXPECT_LT(error, std::max(0.5 * last, kRounding)) << finer;
    last = error;
  }
  EXPECT_LT(last, 1e-3);
}

TEST(BinMapNdf, OneMapAnswersARangeOfRoughnesses) {
  const float low = 0.01f, high = 0.16f;
  const test::OwnedMap map(512, 512, test::roughSurface(512, 512, 0.3f));
  const bake::BinMapData data = bake::buildBinMap(map.map(), {low, 8, high});
  EXPECT_EQ(std::tuple(data.alpha_min, data.alpha_max), std::tuple(low, high));
  EXPECT_FLOAT_EQ(data.alpha, bake::binAlpha(low, high, texelCode(512, 512).subbin_bits));
  EXPECT_FLOAT_EQ(BinMapNdf(data.view()).sigma(), low * kInvSqrt2);
  for (const float alpha : {low, 0.02f, 0.08f, high}) {
    const BinMapNdf ndf(data.view(), alpha);
    for (const float side : {4.0f, 16.0f, 24.0f, 64.0f, 300.0f}) {
      const DensityErrors errors = densityErrors(map, ndf, side, side < 100, side < 50 ? 200 : side < 100 ? 60 : 10);
      EXPECT_LT(errors.median, kNoiseTolerance) << alpha << " " << side;
      EXPECT_LT(std::abs(errors.energy), kEnergyTolerance) << alpha << " " << side;
    }
    Random random(5);
    double drawn = 0;
    constexpr int kSamples = 4000;
    const Footprint p = Footprint::box({0.3f, 0.2f}, {10, 3}, {-3, 10});
    const Box2 range = {{-0.05f, -0.05f}, {0.1f, 0.1f}};
    for (int k = 0; k < kSamples; ++k) {
      const HalfVectorSample s = ndf.sample(p, {random.unit(), random.unit()});
      drawn += s.h.x > range.low.x && s.h.x < range.high.x && s.h.y > range.low.y && s.h.y < range.high.y;
    }
    const double share = ndf.mean(p, range) * range.area();
    EXPECT_NEAR(drawn / kSamples, share, 5 * std::sqrt(share * (1 - share) / kSamples)) << alpha;
  }
}

TEST(BinMap, BinsOfARangeKeepNormalsFineEnough) {
  EXPECT_FLOAT_EQ(bake::binAlpha(0.01f, 0.16f, 8), 0.02f);
  EXPECT_FLOAT_EQ(bake::binAlpha(0.01f, 0.16f, 5), 0.02f);  // 2K^2
  EXPECT_FLOAT_EQ(bake::binAlpha(0.01f, 0.16f, 2), 0.01f);  // 16K^2
  EXPECT_EQ(bake::binAlpha(0.03f, 0.03f, 8), 0.03f);
}

TEST(BinMapNdf, DensityIsContinuous) {
  // Lobes are smooth over a deviation; a step of 1/200 of it, or of a texel, must not show. Three sizes: texel by texel,
  // blended, merged.
  const test::OwnedMap map(512, 512, test::roughSurface(512, 512, 0.2f));
  const OwnedBinMap bins(map, 0.1f);
  const float step = bins.ndf().sigma() / 200;
  for (const float side : {20.0f, 90.0f, 130.0f, 300.0f}) {
    float last = 0, peak = 0, worst = 0;
    for (int k = 0; k < 200; ++k) {
      const float value = bins.ndf().density(Footprint::box({0.4f, 0.3f}, {0.5f * side, 2}, {-2, 0.5f * side}),
                                             {-0.05f + static_cast<float>(k) * step, 0.03f});
      if (k > 0) worst = std::max(worst, std::abs(value - last));
      peak = std::max(peak, value);
      last = value;
    }
    EXPECT_LT(worst, 0.01f * peak) << side;  // steepest slope of a lobe: 0.6 of its peak in a deviation
    const float area_step = 1.0f / 4096;
    for (int k = 0; k < 60; ++k) {
      const float value =
          bins.ndf().density(Footprint::box({0.4f + static_cast<float>(k) * area_step / 8, 0.3f},
                                            {0.5f * side * (1 + area_step * static_cast<float>(k)), 2}, {-2, 0.5f * side}),
                             {0.01f, 0.03f});
      // An eighth of a texel moves less than 2 / side of the footprint.
      if (k > 0) {
        EXPECT_LT(std::abs(value - last), 1.5f / side * peak + 1e-3f * peak) << side << " " << k;
      }
      last = value;
    }
  }
}

TEST(BinMapNdf, IntegratesToOne) {
  const test::OwnedMap map(128, 128, test::roughSurface(128, 128, 0.3f));
  const OwnedBinMap bins(map, 0.1f);
  const OwnedBinMap rough(map, 0.16f);
  for (const BinMapNdf* ndf : {&bins.ndf(), &rough.ndf()}) {
    for (const float side : {0.7f, 5.0f, 60.0f, 150.0f}) {
      const Footprint p = Footprint::box({0.2f, 0.8f}, {side, 0.3f}, {-0.1f, side});
      constexpr int kResolution = 40;  // pixels of 0.7 deviations: sums of Gaussians are exact to 1e-9
      double sum = 0;
      for (std::size_t k = 0; k < kResolution * kResolution; ++k) sum += ndf->density(p, test::pixelCentre(k, kResolution));
      EXPECT_NEAR(sum * 4 / (kResolution * kResolution), 1, 1e-3) << side;
      EXPECT_NEAR(ndf->mean(p, {{-1, -1}, {1, 1}}), 0.25, 1e-4) << side;
    }
  }
}

TEST(BinMapNdf, MeanIsTheAverageOfTheDensity) {
  const test::OwnedMap map(256, 256, test::roughSurface(256, 256, 0.3f));
  const OwnedBinMap bins(map, 0.1f);
  Random random(8);
  for (const float side : {10.0f, 200.0f}) {
    for (int k = 0; k < 10; ++k) {
      const Footprint p = Footprint::box({random.unit(), random.unit()}, {0.5f * side, 0}, {1, 0.5f * side});
      const Vec2 low = {random.between(-0.3f, 0.1f), random.between(-0.3f, 0.1f)};
      const Box2 range = {low, low + Vec2{random.between(0.01f, 0.3f), random.between(0.01f, 0.3f)}};
      constexpr int kSteps = 16;
      double sum = 0;
      for (int y = 0; y < kSteps; ++y)
        for (int x = 0; x < kSteps; ++x)
          sum += bins.ndf().density(p, range.low + Vec2{(static_cast<float>(x) + 0.5f) / kSteps * range.width(),
                                                        (static_cast<float>(y) + 0.5f) / kSteps * range.height()});
      const double expected = sum / (kSteps * kSteps);
      EXPECT_NEAR(bins.ndf().mean(p, range), expected, 2e-3 * expected + 1e-3);
    }
    EXPECT_EQ(bins.ndf().mean(Footprint::isotropic({0, 0}, side), {{0.1f, 0}, {0.1f, 1}}), 0);
  }
}

TEST(BinMapNdf, DegenerateFootprintsAreGaussiansOfTheirMoments) {
  const test::OwnedMap map(64, 64, test::roughSurface(64, 64, 0.3f));
  const OwnedBinMap bins(map, 0.1f);
  const Vec2 h = {0.05f, 0};
  const auto density = [&](const Footprint& p) { return bins.ndf().density(p, h); };
  // No area: the narrowest Gaussian, the box of the same moments, 2 sqrt(3) deviations wide.
  const float half = std::sqrt(3.0f) * kMinSigmaTexels;
  EXPECT_FLOAT_EQ(density(Footprint::box({0.4f, 0.4f}, {0, 0}, {0, 0})),
                  density(Footprint::box({0.4f, 0.4f}, {half, 0}, {0, half})));
  EXPECT_FLOAT_EQ(density(Footprint::isotropic({0.4f, 0.4f}, 5)),
                  density(Footprint::box({0.4f, 0.4f}, {5 * std::sqrt(3.0f), 0}, {0, 5 * std::sqrt(3.0f)})));
  const float line = density(Footprint::box({0.4f, 0.4f}, {10, 5}, {10, 5}));
  EXPECT_TRUE(std::isfinite(line) && line >= 0);
  for (const float bad : {INFINITY, NAN, 1e30f, -1e30f}) {
    for (const Footprint& p :
         {Footprint::box({0.4f, 0.4f}, {bad, 0}, {0, 3}), Footprint::box({bad, bad}, {3, 0}, {0, 3}),
          Footprint::gaussian({0.4f, 0.4f}, {bad, 0, bad}), Footprint::box({0, 0}, {bad, bad}, {bad, -bad})}) {
      EXPECT_TRUE(std::isfinite(density(p)) && density(p) >= 0);
      EXPECT_LE(bins.ndf().weights(p, h).count, BinWeights::kMost);
    }
    EXPECT_EQ(bins.ndf().density(Footprint::isotropic({0, 0}, 4), {bad, 0}), 0);
  }
}

TEST(BinMapNdf, SamplesFollowTheDensity) {
  const test::OwnedMap map(128, 128, test::roughSurface(128, 128, 0.3f));
  Random random(17);
  for (const float alpha : {0.1f, 0.02f}) {
    const OwnedBinMap bins(map, alpha);
    for (const Footprint& p : {Footprint::box({0.02f, 0.6f}, {9, 2}, {-3, 12}), Footprint::isotropic({0.5f, 0.5f}, 20)}) {
      constexpr int kCells = 24, kSamples = 12000;
      std::vector<double> counts(kCells * kCells);
      for (int k = 0; k < kSamples; ++k) {
        const HalfVectorSample s = bins.ndf().sample(p, {random.unit(), random.unit()});
        if (std::abs(s.h.x) >= 1 || std::abs(s.h.y) >= 1) continue;
        if (k < 100) {
          EXPECT_FLOAT_EQ(s.pdf, bins.ndf().density(p, s.h));
        }
        ++counts[static_cast<std::size_t>((s.h.y + 1) * kCells / 2) * kCells +
                 static_cast<std::size_t>((s.h.x + 1) * kCells / 2)];
      }
      double chi_squared = 0;
      int cells = 0;
      for (std::size_t k = 0; k < counts.size(); ++k) {
        const Vec2 low = test::pixelCentre(k, kCells) - Vec2{1.0f / kCells, 1.0f / kCells};
        const double expected =
            kSamples * bins.ndf().mean(p, {low, low + Vec2{2.0f / kCells, 2.0f / kCells}}) * 4 / (kCells * kCells);
        if (expected < 10) continue;
        chi_squared += (counts[k] - expected) * (counts[k] - expected) / expected;
        ++cells;
      }
      ASSERT_GT(cells, 8);
      // Five deviations of chi-squared: one failure in millions.
      EXPECT_LT(chi_squared, cells + 5 * std::sqrt(2.0 * cells)) << alpha << " cells " << cells;
    }
  }
}

}  // namespace
}  // namespace glint::bin_map_test
