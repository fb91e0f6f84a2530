#include "glint/bake/common/seen_error.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace glint::bake::seen_error_test {
namespace {

constexpr int kResolution = 256, kCell = 4;
constexpr std::size_t kPixels = std::size_t{kResolution} * kResolution;
constexpr double kFloatError = 1e-5;

/// An image that is 0 but for the cell of these numbers.
std::vector<float> cellImage(int column, int row, float density) {
  std::vector<float> image(kPixels, 0.0f);
  for (int y = 0; y < kCell; ++y)
    for (int x = 0; x < kCell; ++x)
      image[static_cast<std::size_t>(row * kCell + y) * kResolution + column * kCell + x] = density;
  return image;
}

TEST(SeenError, CellsAreA64thOfTheDisk) {
  EXPECT_EQ(seenCellPixels(256), 4);
  EXPECT_EQ(seenCellPixels(64), 1);
  EXPECT_EQ(seenCellPixels(32), 1);
  EXPECT_EQ(seenCellPixels(1024), 16);
  EXPECT_EQ(seenCellPixels(2048), 16);
  EXPECT_EQ(seenCellPixels(400), 4);  // a power of two, so that blocks have whole cells
}

TEST(SeenError, IsRelativeToTheLightOfEachDirection) {
  // A bright and a dim cell; each is 20 % too bright at every place.
  SeenError error(kResolution);
  for (int place = 0; place < 3; ++place) {
    std::vector<float> truth = cellImage(31, 32, 1000);
    const std::vector<float> dim = cellImage(40, 32, 0.01f);
    for (std::size_t k = 0; k < kPixels; ++k) truth[k] += dim[k];
    std::vector<float> image = truth;
    for (float& pixel : image) pixel *= 1.2f;
    error.add(image.data(), truth.data());
  }
  const SeenSummary summary = error.summary();
  EXPECT_NEAR(summary.seen, 0.2, kFloatError);
  EXPECT_NEAR(summary.worst, 0.2, kFloatError);
  EXPECT_NEAR(summary.bias, 0.2, kFloatError);
}

TEST(SeenError, CountsLostDimLightAsMuchAsALostPeak) {
  SeenError error(kResolution);
  std::vector<float> truth = cellImage(31, 32, 1000);
  const std::vector<float> image = truth, dim = cellImage(40, 32, 0.01f);
  for (std::size_t k = 0; k < kPixels; ++k) truth[k] += dim[k];
  error.add(image.data(), truth.data());
  EXPECT_NEAR(error.summary().seen, std::sqrt(0.5), kFloatError);  // one of two lit cells is lost
  EXPECT_NEAR(error.summary().worst, 1, kFloatError);
  EXPECT_NEAR(error.summary().bias, 1, kFloatError);
  EXPECT_NEAR(error.errors()[32 * 64 + 40], 1, kFloatError);
  EXPECT_EQ(error.errors()[32 * 64 + 31], 0);
}

TEST(SeenError, ErrorsThatCancelOverPlacesHaveNoBias) {
  SeenError error(kResolution);
  const std::vector<float> truth = cellImage(5, 6, 2);
  for (const float density : {1.0f, 3.0f}) {
    const std::vector<float> image = cellImage(5, 6, density);
    error.add(image.data(), truth.data());
  }
  EXPECT_NEAR(error.summary().seen, 0.5, kFloatError);
  EXPECT_NEAR(error.summary().bias, 0, kFloatError);
}

TEST(SeenError, DarkErrorsAreRelativeToTheDarkestSeen) {
  SeenError error(kResolution);
  const std::vector<float> truth(kPixels, 0.0f), image = cellImage(5, 6, 0.003f);
  error.add(image.data(), truth.data());
  EXPECT_NEAR(error.summary().seen, 3, 3 * kFloatError);
  SeenError below(kResolution);
  const std::vector<float> faint = cellImage(5, 6, 0.0009f);
  below.add(faint.data(), truth.data());
  EXPECT_EQ(below.summary().seen, 0);  // no cell is lit
}

TEST(SeenError, IsTheDefinitionOnRandomImages) {
  std::mt19937 random(1);
  std::exponential_distribution<float> density(1);
  constexpr int kSmall = 64, kPlaces = 5;  // cells of one pixel
  SeenError error(kSmall);
  std::vector<double> error2(kSmall * kSmall, 0.0), truth2 = error2, difference = error2, sum = error2;
  for (int place = 0; place < kPlaces; ++place) {
    std::vector<float> truth(kSmall * kSmall), image(kSmall * kSmall);
    for (std::size_t k = 0; k < truth.size(); ++k) {
      truth[k] = density(random), image[k] = density(random);
      const double d = double{image[k]} - truth[k];
      error2[k] += d * d, truth2[k] += double{truth[k]} * truth[k], difference[k] += d, sum[k] += truth[k];
    }
    error.add(image.data(), truth.data());
  }
  double squares = 0, worst = 0, bias = 0;
  for (std::size_t k = 0; k < error2.size(); ++k) {
    squares += error2[k] / truth2[k];
    worst = std::max(worst, std::sqrt(error2[k] / truth2[k]));
    bias = std::max(bias, std::abs(difference[k]) / sum[k]);
  }
  EXPECT_NEAR(error.summary().seen, std::sqrt(squares / (kSmall * kSmall)), 1e-9);
  EXPECT_NEAR(error.summary().worst, worst, 1e-9);
  EXPECT_NEAR(error.summary().bias, bias, 1e-9);
}

/// Each place lights one cell of many. Eight places alone do not tell that other places light the same cells.
TEST(SeenError, RelatesToTheLightOfAllPlacesThatAreKnown) {
  constexpr int kSide = 64, kPlaces = 400;
  constexpr float kTooBright = 1.1f;
  std::vector<std::vector<float>> truths;
  for (int k = 0; k < kPlaces; ++k) {
    std::vector<float> image(kSide * kSide);
    image[static_cast<std::size_t>(k * 37 % 40)] = 5;
    truths.push_back(image);
  }
  SeenError all(kSide), few(kSide), alone(kSide);
  for (int k = 0; k < kPlaces; ++k) {
    std::vector<float> image = truths[static_cast<std::size_t>(k)];
    for (float& d : image) d *= kTooBright;
    const float* truth = truths[static_cast<std::size_t>(k)].data();
    all.add(image.data(), truth);
    if (k < 80) {
      few.add(image.data(), truth);
    } else {
      few.addTruth(truth);
    }
  }
  EXPECT_NEAR(all.summary().seen, 0.1, 1e-5);
  EXPECT_NEAR(few.summary().seen, 0.1, 0.005);
  EXPECT_NEAR(few.summary().bias, 0.1, 0.005);
  // A model that puts the light of a place elsewhere: against its own place alone the error is that of light where there is none.
  std::vector<float> wrong(kSide * kSide);
  wrong[3] = 5;
  SeenError known(kSide);
  alone.add(wrong.data(), truths[0].data());
  known.add(wrong.data(), truths[0].data());
  for (int k = 1; k < kPlaces; ++k) known.addTruth(truths[static_cast<std::size_t>(k)].data());
  EXPECT_GT(alone.summary().worst, 1000);
  EXPECT_LT(known.summary().worst, 10);
}

}  // namespace
}  // namespace glint::bake::seen_error_test
