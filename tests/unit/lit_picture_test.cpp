#include "measure/lit_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "measure/grey_flip.h"
#include "measure/workload.h"
#include "support/test_maps.h"

namespace glint::apps {
namespace {

constexpr int kEdge = 64, kSize = 24;

test::OwnedMap someMap() { return {kEdge, kEdge, test::randomNormals(kEdge, kEdge, 0.2f, 7)}; }

TEST(NormalSearch, SumsAsReference) {
  const test::OwnedMap map = someMap();
  const Reference reference(map.map(), kBenchSigmaR);
  const NormalSearch search(map.map(), kBenchSigmaR);
  // Sums of as many floats in another order, of lobes that are cut at kLobeReach; relative to the peak of one lobe.
  const double tolerance = 1e-6 * double{gaussianDensity({}, kBenchSigmaR)};
  int lit = 0;
  for (const float sigma : {0.5f, 2.0f, 20.0f, 150.0f}) {  // the widest reaches many copies of the map
    for (int k = 0; k < 50; ++k) {
      const Vec2 uv = {0.02f * static_cast<float>(k), 0.37f};
      Footprint footprint = Footprint::gaussian(uv, {sigma * sigma, 0.3f * sigma * sigma, 2 * sigma * sigma});
      const Vec2 half = map.map().normals[static_cast<std::size_t>(k * 53)] + Vec2{0.004f, 0};
      const float expected = reference.density(footprint, half);
      lit += expected > 0;
      EXPECT_NEAR(search.density(footprint, half), expected, tolerance) << sigma << ", " << k;
    }
  }
  EXPECT_GT(lit, 100);
}

TEST(LitPicture, HasTheFootprintThatIsAskedInTheMiddle) {
  const test::OwnedMap map = someMap();
  for (const lit::Shape shape : {lit::Shape::quad, lit::Shape::sphere}) {
    for (const float sigma : {2.0f, 32.0f}) {
      const std::vector<LitPixel> pixels = litPixels(map.map(), shape, sigma, kSize);
      ASSERT_EQ(pixels.size(), std::size_t{kSize} * kSize);
      const Covariance& c = pixels[kSize * kSize / 2 + kSize / 2].footprint.covariance;
      // The middle is the corner of four pixels: half a pixel away, footprints differ by a few percent.
      EXPECT_NEAR(std::pow(c.xx * c.yy - c.xy * c.xy, 0.25f), sigma, 0.05f * sigma);
      EXPECT_GT(std::count_if(pixels.begin(), pixels.end(), [](const LitPixel& p) { return p.response > 0; }),
                kSize * kSize / 4);
      EXPECT_EQ(pixels[0].response, 0) << "the corner shows no surface";
    }
  }
}

TEST(LitPicture, MiddleOfThePlaneMirrorsTheLight) {
  const test::OwnedMap map = someMap();
  const std::vector<LitPixel> pixels = litPixels(map.map(), lit::Shape::quad, 4, kSize);
  const Vec2 half = pixels[kSize * kSize / 2 + kSize / 2].half;
  EXPECT_LT(std::hypot(half.x, half.y), 0.05f);
}

TEST(GreyFlip, IsZeroForEqualPictures) {
  std::vector<float> picture(kSize * kSize);
  for (std::size_t k = 0; k < picture.size(); ++k) picture[k] = static_cast<float>(k % 7) / 7;
  EXPECT_EQ(greyFlip(picture, picture, kSize, kSize), 0);
}

TEST(GreyFlip, OfEvenPicturesIsTheDifferenceOfLightness) {
  const std::vector<float> black(kSize * kSize, 0.0f), white(kSize * kSize, 1.0f), grey(kSize * kSize, 0.184187f);  // L* 50
  // Without features, by hand: |L*|^0.7 against the compression at 0.4 of 203.3^0.7.
  constexpr double kTolerance = 1e-4;  // of the luminance of L* 50
  const double most = std::pow(203.3016546, 0.7);
  EXPECT_NEAR(greyFlip(black, white, kSize, kSize), 0.95 + 0.05 * (std::pow(100, 0.7) - 0.4 * most) / (0.6 * most), kTolerance);
  EXPECT_NEAR(greyFlip(black, grey, kSize, kSize), 0.95 * std::pow(50, 0.7) / (0.4 * most), kTolerance);
}

TEST(GreyFlip, IsThatOfFlipEvaluator) {
  std::vector<float> truth, image;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      truth.push_back(static_cast<float>((x * x + 3 * y) % 11) / 11);
      image.push_back(static_cast<float>((x * y + 2 * x) % 13) / 13);
    }
  }
  constexpr double kOfFlipEvaluator = 0.311934;  // version 1.7, of the same pictures in sRGB
  constexpr double kTolerance = 1e-4;            // it computes in float
  EXPECT_NEAR(greyFlip(truth, image, kSize, kSize), kOfFlipEvaluator, kTolerance);
}

TEST(GreyFlip, AMovedEdgeCountsMoreThanADimmerSurface) {
  std::vector<float> edge(kSize * kSize), moved = edge, even(kSize * kSize, 0.5f), dimmer(kSize * kSize, 0.45f);
  for (std::size_t k = 0; k < edge.size(); ++k) {
    edge[k] = k % kSize < kSize / 2 ? 1.0f : 0.0f;
    moved[k] = k % kSize < kSize / 2 + 2 ? 1.0f : 0.0f;
  }
  EXPECT_GT(greyFlip(edge, moved, kSize, kSize), greyFlip(even, dimmer, kSize, kSize));
}

}  // namespace
}  // namespace glint::apps
