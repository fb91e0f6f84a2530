#include "measure/place_errors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "glint/formats/asset_writer.h"
#include "support/sample_assets.h"
#include "support/temp_folder.h"
#include "support/test_maps.h"

namespace glint::apps::place_errors_test {
namespace {

constexpr int kEdge = 48;
constexpr int kPlaces = 24;
constexpr float kRadius = 0.5f, kSigmaR = 0.05f, kFootprint = 0.8f;

test::OwnedMap randomMap(float radius, unsigned seed) {
  return {kEdge, kEdge, test::randomNormals(kEdge, kEdge, radius, seed)};
}

/// Errors of one map's texels as a model of another map.
class PlaceErrorsTest : public testing::Test {
 protected:
  /// @param number  of the choice of places
  static PlaceErrors errorsOf(const test::OwnedMap& model, const test::OwnedMap& map, int places = kPlaces,
                              unsigned number = 0) {
    const test::TempFolder folder;
    formats::writeAsset((folder / "model.glint").string(), model.map(), test::sampleProvenance());
    api::NdfOptions options;
    options.sigma_r = kSigmaR;
    const api::OpenedNdf ndf = api::OpenedNdf::open(folder / "model.glint", options);
    std::mt19937 random(number);
    std::uniform_real_distribution<float> uv(0, 1);
    std::vector<Footprint> footprints;
    for (int k = 0; k < places; ++k) footprints.push_back(Footprint::isotropic({uv(random), uv(random)}, kFootprint));
    PlaceTruth truth(map.map(), footprints, footprints.size(), kSigmaR, 0);
    constexpr double kUnlimited_s = 1e9;
    return PlaceSample(truth, ndf).ask(places, kUnlimited_s);
  }
};

TEST_F(PlaceErrorsTest, OfTheTexelsThemselvesAreNone) {
  constexpr double kRounding = 1e-3;  // of sums of floats
  const test::OwnedMap map = randomMap(kRadius, 1);
  const PlaceErrors errors = errorsOf(map, map);
  EXPECT_LT(errors.seen, kRounding);
  EXPECT_LT(errors.bias, kRounding);
  EXPECT_EQ(errors.places, kPlaces);
}

TEST_F(PlaceErrorsTest, OfOtherTexelsOfTheSameDistributionAreNoBias) {
  const PlaceErrors errors = errorsOf(randomMap(kRadius, 2), randomMap(kRadius, 1));
  EXPECT_GT(errors.seen, 0.3);
  EXPECT_LT(errors.bias, errors.seen / 4);
}

TEST_F(PlaceErrorsTest, OfAnotherDistributionAreBias) {
  const PlaceErrors same = errorsOf(randomMap(kRadius, 2), randomMap(kRadius, 1));
  constexpr double kMostOfIt = 0.4;  // the rest is that texels are others
  const PlaceErrors other = errorsOf(randomMap(kRadius / 2, 2), randomMap(kRadius, 1));
  EXPECT_GT(other.bias, kMostOfIt * other.seen);
  EXPECT_LE(other.bias, other.seen);
  EXPECT_GT(other.bias, 3 * same.bias);
}

TEST_F(PlaceErrorsTest, DeviateBetweenChoicesOfPlacesAsTheySay) {
  constexpr int kChoices = 12, kFew = 8;
  constexpr double kOfFewChoices =
      2.5;  // factor between the deviation of 12 numbers and the true one in all but one of 1000 cases
  const test::OwnedMap model = randomMap(kRadius, 2), map = randomMap(kRadius, 1);
  double sum = 0, sum2 = 0, said = 0;
  for (unsigned k = 0; k < kChoices; ++k) {
    const PlaceErrors errors = errorsOf(model, map, kFew, k + 1);
    sum += errors.seen, sum2 += errors.seen * errors.seen, said += errors.deviation / kChoices;
  }
  const double deviation = std::sqrt((sum2 - sum * sum / kChoices) / (kChoices - 1));
  EXPECT_LT(deviation, kOfFewChoices * said);
  EXPECT_GT(deviation, said / kOfFewChoices);
}

}  // namespace
}  // namespace glint::apps::place_errors_test
