#include "measure/place_light.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "glint/bake/common/reference_image.h"
#include "glint/bake/common/seen_error.h"
#include "measure/light_blur.h"
#include "support/test_maps.h"

namespace glint::apps::place_light_test {
namespace {

constexpr int kEdge = 64, kResolution = 128, kCellPixels = 2;
constexpr float kSigmaR = 0.03f, kSigma = 2;
constexpr float kLargeSigma = 12;  // footprints whose texels are added up in squares
constexpr double kBright = 0.1;    // cells of more light, in which no end of a lobe counts
constexpr double kSeen2 = 1e-6;    // square of the least light that errors relate to

std::vector<Footprint> randomFootprints(int count, float sigma) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> uv(0, 1);
  std::vector<Footprint> footprints;
  for (int k = 0; k < count; ++k) footprints.push_back(Footprint::isotropic({uv(random), uv(random)}, sigma));
  return footprints;
}

/// Unrelated texels, whose half vectors are within a radius.
test::OwnedMap randomMap(float radius) { return {kEdge, kEdge, test::randomNormals(kEdge, kEdge, radius, 3)}; }

/// Mean square density of each cell over exact images.
std::vector<double> exactLight(const NormalMap& map, const std::vector<Footprint>& footprints, double light_deg) {
  const int cells = kResolution / kCellPixels;
  std::vector<double> light(static_cast<std::size_t>(cells) * cells, 0.0);
  const double share = 1.0 / (kCellPixels * kCellPixels * static_cast<double>(footprints.size()));
  for (const Footprint& footprint : footprints) {
    std::vector<float> image = bake::referenceImage(map, kSigmaR, Surface::flat, Boundary::wrap, footprint, kResolution);
    blurByLight(image, kResolution, light_deg);
    for (int y = 0; y < kResolution; ++y)
      for (int x = 0; x < kResolution; ++x) {
        const double density = image[static_cast<std::size_t>(y) * kResolution + x];
        light[static_cast<std::size_t>(y / kCellPixels) * cells + x / kCellPixels] += share * density * density;
      }
  }
  return light;
}

class PlaceLightOfSize : public testing::TestWithParam<float> {};
INSTANTIATE_TEST_SUITE_P(, PlaceLightOfSize, testing::Values(kSigma, kLargeSigma));

TEST_P(PlaceLightOfSize, IsThatOfExactImages) {
  // Profiles are tabulated for 256 places in a pixel, and boxes of lights are sums in steps of a quarter of a pixel.
  constexpr double kTabulated = 0.02;
  constexpr double kInSquares = 0.1;  // normals of a square have one lobe, which counts where light fades
  const double most = GetParam() > kSigma ? kInSquares : kTabulated;
  ASSERT_EQ(bake::seenCellPixels(kResolution), kCellPixels);
  const test::OwnedMap map = randomMap(0.4f);
  const std::vector<Footprint> footprints = randomFootprints(20, GetParam());
  for (const double light_deg : {0.0, 20.0}) {
    const std::vector<double> exact = exactLight(map.map(), footprints, light_deg);
    const PlaceLight light = placeLight(map.map(), footprints, kSigmaR, light_deg, kResolution);
    int bright = 0;
    double sum2 = 0;  // of relative differences
    for (std::size_t cell = 0; cell < exact.size(); ++cell) {
      if (exact[cell] < kBright) continue;
      ++bright, sum2 += std::pow(light.squares[cell] / 20 / exact[cell] - 1, 2);
      EXPECT_NEAR(light.squares[cell] / 20, exact[cell], most * exact[cell]) << light_deg << " degrees, cell " << cell;
      EXPECT_TRUE(light.lit[cell]);
    }
    EXPECT_GT(bright, 100);
    EXPECT_LT(std::sqrt(sum2 / bright), kTabulated) << light_deg << " degrees";
  }
}

TEST_P(PlaceLightOfSize, OfAFlatMapIsThatOfOneLobeToItsEnd) {
  constexpr double kTabulated = 0.1;  // of 256 places in a pixel: most where a lobe is steepest
  const test::OwnedMap map = {kEdge, kEdge, std::vector<Vec2>(static_cast<std::size_t>(kEdge) * kEdge, Vec2{})};
  const std::vector<Footprint> footprints = randomFootprints(3, GetParam());
  const std::vector<double> exact = exactLight(map.map(), footprints, 0);
  const PlaceLight light = placeLight(map.map(), footprints, kSigmaR, 0, kResolution);
  int seen = 0;
  for (std::size_t cell = 0; cell < exact.size(); ++cell) {
    if (exact[cell] < kSeen2) continue;
    ++seen;
    EXPECT_NEAR(light.squares[cell] / 3, exact[cell], kTabulated * exact[cell]) << "cell " << cell;
  }
  EXPECT_GT(seen, 60);
}

TEST(PlaceLight, OfUnrelatedTexelsIsTheLeast) {
  // Of the mean over all bright cells, from 400 places that overlap.
  constexpr double kOfPlaces = 0.1;
  const test::OwnedMap map = randomMap(0.4f);
  const std::vector<double> exact = exactLight(map.map(), randomFootprints(400, kSigma), 0);
  const std::vector<double> least = leastLight(map.map(), kSigma, kSigmaR, 0, kResolution);
  double sum = 0, of_least = 0;
  for (std::size_t cell = 0; cell < exact.size(); ++cell)
    if (exact[cell] > kBright) sum += exact[cell], of_least += least[cell];
  EXPECT_NEAR(of_least, sum, kOfPlaces * sum);
}

TEST(PlaceLight, OfOneTexelIsNotMissed) {
  // One texel of a flat map is tilted, and no footprint is near it.
  constexpr Vec2 kTilted = {33.0f / 64, 33.0f / 64};  // middle of a cell
  constexpr double kQuantised = 0.05;                 // profiles are tabulated
  std::vector<Vec2> normals(static_cast<std::size_t>(kEdge) * kEdge, Vec2{});
  normals[0] = kTilted;
  const test::OwnedMap map = {kEdge, kEdge, std::move(normals)};
  const std::vector<Footprint> far_away = {Footprint::isotropic({0.5f, 0.5f}, kSigma)};
  const auto brightest = [](const std::vector<double>& light) {
    const int cells = kResolution / kCellPixels, x = cells * 3 / 4;
    return light[static_cast<std::size_t>(x) * cells + x];
  };
  EXPECT_EQ(brightest(placeLight(map.map(), far_away, kSigmaR, 0, kResolution).squares), 0);
  // Over places at all texels, and at middles between them.
  std::vector<Footprint> everywhere;
  constexpr int kSteps = 2 * kEdge;
  const auto at = [](int step) { return (static_cast<float>(step) + 0.25f) / kSteps; };
  for (int j = 0; j < kSteps; ++j)
    for (int i = 0; i < kSteps; ++i) everywhere.push_back(Footprint::isotropic({at(i), at(j)}, kSigma));
  const double truth =
      brightest(placeLight(map.map(), everywhere, kSigmaR, 0, kResolution).squares) / (double{kSteps} * kSteps);
  EXPECT_GT(truth, 0);
  EXPECT_NEAR(brightest(leastLight(map.map(), kSigma, kSigmaR, 0, kResolution)), truth, kQuantised * truth);
}

TEST(PlaceLight, AsksFewerPlacesWhereFootprintsAreLarge) {
  constexpr std::size_t kLeast = 96;
  const std::size_t small = lightPlaces(2, kSigmaR, 0, kResolution, kLeast),
                    large = lightPlaces(200, kSigmaR, 0, kResolution, kLeast);
  EXPECT_GT(small, kLeast);
  EXPECT_EQ(large, kLeast);
}

}  // namespace
}  // namespace glint::apps::place_light_test
