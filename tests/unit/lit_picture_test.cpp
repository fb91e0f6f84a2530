#include "measure/lit_picture.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>

#include "common/base64.h"
#include "measure/grey_flip.h"
#include "measure/workload.h"
#include "support/test_maps.h"

namespace glint::apps::lit_picture_test {
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

/// A surface with a name, for messages.
struct Surface {
  const char* name;
  std::vector<Vec2> normals;
};

constexpr int kTexels = 256;

std::vector<Surface> sparklingSurfaces() {
  return {{"flakes", test::synthesised(bake::SynthKind::flakes, kTexels, kTexels, 0.2f)},
          {"scratches", test::synthesised(bake::SynthKind::scratches, kTexels, kTexels, 0.2f)},
          {"almost a mirror", test::synthesised(bake::SynthKind::isotropic, kTexels, kTexels, 0.02f)}};
}

/// Calls test(truth, name) for the pictures of sparkling surfaces, from near and far.
template <class Test>
void forSparklingPictures(const Test& test) {
  constexpr int kPixels = 48;
  for (const Surface& surface : sparklingSurfaces()) {
    const test::OwnedMap map(kTexels, kTexels, surface.normals);
    for (const LitTruth& truth : litTruths(map.map(), {0.5f, 2, 8, 32}, kPixels)) {
      const std::string name = std::string(surface.name) + ", " + std::string(sceneName(truth.shape())) + ", " +
                               std::to_string(truth.sigmaTexels()) + " texels";
      test(truth, map.map(), name);
    }
  }
}

TEST(LitPicture, ShowsMostOfTheLight) {
  forSparklingPictures([](const LitTruth& truth, const NormalMap&, const std::string& name) {
    double all = 0, clipped = 0;
    for (const float value : truth.radiance()) {
      all += double{value};
      if (double{value} > truth.white()) clipped += double{value};
    }
    EXPECT_GT(all, 0) << name;
    EXPECT_LE(clipped, all / 3) << name;
  });
}

constexpr double kNoBudget = 1e6;

TEST(LitPicture, FlipIsLargeWhereRmseIs) {
  forSparklingPictures([](const LitTruth& truth, const NormalMap& map, const std::string& name) {
    const NormalSearch search(map, kBenchSigmaR);
    const auto flipOf = [&](float factor) {  // of all radiance; RMSE is |factor - 1|
      const auto density = [&](const Footprint& p, Vec2 h) { return factor * search.density(p, h); };
      return truth.errorsOf(density, true, kNoBudget).at("flip").get<double>();
    };
    const double black = truth.json().at("black_flip");
    EXPECT_EQ(flipOf(0), black) << name;
    EXPECT_EQ(flipOf(1), 0) << name;
    // FLIP grows with the difference of lightness, more than in proportion near 0. Bounds leave room around the measured shares.
    EXPECT_GT(flipOf(0.5f), 0.4 * black) << name;
    EXPECT_LT(flipOf(0.95f), 0.15 * black) << name;
    // Too bright: pixels near white are clipped. A highlight of a ball that is almost a mirror has few others.
    EXPECT_GT(flipOf(2), 0.05 * black) << name;
  });
}

TEST(LitPicture, WhiteOfADarkPictureIsNotZero) {
  EXPECT_GT(screenWhite({}), 0);
  EXPECT_GT(screenWhite(std::vector<float>(4, 0.0f)), 0);
  EXPECT_EQ(screenWhite({0, 8, 1, 1}), 8) << "one pixel has most of the light";
  EXPECT_EQ(screenWhite({1, 2, 1, 1, 1, 1, 1, 1, 1, 1}), 1) << "the brightest pixel has 2 of 11";
}

TEST(LitPicture, ASlowMethodIsGivenUp) {
  const test::OwnedMap map = someMap();
  const NormalSearch search(map.map(), kBenchSigmaR);
  const LitTruth truth(map.map(), search, lit::Shape::quad, 2, kSize);
  const auto density = [&](const Footprint& p, Vec2 h) { return search.density(p, h); };
  const auto given_up = truth.errorsOf(density, true, 0);
  EXPECT_EQ(given_up.at("given_up_s"), 0.0);
  EXPECT_FALSE(given_up.contains("flip") || given_up.contains("rmse") || given_up.contains("picture"));
  EXPECT_FALSE(truth.errorsOf(density, true, kNoBudget).contains("given_up_s"));
}

TEST(LitPicture, IsBase64OfItsPixels) {
  for (const std::string bytes : {"", "a", "ab", "abc", "abcd"}) {
    EXPECT_TRUE(isBase64(base64(bytes), bytes.size())) << bytes;
    EXPECT_FALSE(isBase64(base64(bytes), bytes.size() + 3)) << bytes;
  }
  EXPECT_FALSE(isBase64("***", 2));
  EXPECT_FALSE(isBase64("YW*=", 2));
  EXPECT_FALSE(isBase64("YWIx", 2)) << "of three bytes";
  EXPECT_FALSE(isBase64("YW==", 2)) << "of one byte";
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
}  // namespace glint::apps::lit_picture_test
