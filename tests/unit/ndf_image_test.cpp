#include "common/ndf_image.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "glint/bake/compressed/compress.h"
#include "unit/compress_fixture.h"

namespace glint::ndf_image_test {
namespace {

using CompressedNdf = AnisotropicNdf<CpNdf>;

bake::NdfCpData compressedFlakes() {
  PyramidShape shape = test::makeShape(256, 128, 32, 1);
  shape.sigma_r = 0.02f;
  const test::TestPyramid pyramid = test::makePyramid(test::flakes(256, 6, 2000, 2), shape);
  bake::CompressionOptions options;
  options.method = CompressionMethod::tucker;
  options.tolerance = 0.2;
  return bake::compressPyramid(pyramid.view(), options);
}

/// Mean of the densities in a pixel.
double meanOfDensities(const CompressedNdf& ndf, const Footprint& footprint, Vec2 low, float side) {
  constexpr int kPoints = 16;
  double sum = 0;
  for (int j = 0; j < kPoints; ++j) {
    for (int i = 0; i < kPoints; ++i) {
      const Vec2 at = {(static_cast<float>(i) + 0.5f) / kPoints, (static_cast<float>(j) + 0.5f) / kPoints};
      sum += ndf.density(footprint, low + side * at) / (kPoints * kPoints);
    }
  }
  return sum;
}

TEST(NdfImage, OfACompressedPyramidIsTheMeanOfItsDensities) {
  constexpr double kRounding = 2e-3, kTwoPoints = 0.05;  // errors of sums over 16 points along an axis, and over 2
  const bake::NdfCpData data = compressedFlakes();
  const CompressedNdf ndf(CpNdf(data.view()));
  const Footprint footprint = Footprint::isotropic({0.4f, 0.7f}, 1.3f * finestSigma(data.view().shape));
  for (const int resolution : {128, 64, 96}) {  // 96: no groups of pixels
    const std::vector<float> image = apps::ndfImage(api::AnyNdf(ndf), footprint, resolution);
    const float side = 2.0f / static_cast<float>(resolution);
    const double most = *std::max_element(image.begin(), image.end());
    double haze = 0, apart = 0;
    for (int y = 0; y < resolution; ++y) {
      for (int x = 0; x < resolution; ++x) {
        const Vec2 low = {-1 + static_cast<float>(x) * side, -1 + static_cast<float>(y) * side};
        const double shown = image[static_cast<std::size_t>(y * resolution + x)];
        if ((x + 5 * y) % 37 == 0) apart = std::max(apart, std::abs(shown - meanOfDensities(ndf, footprint, low, side)));
        if (shown == 0) haze += ndf.mean(footprint, {low, low + Vec2{side, side}});
      }
    }
    EXPECT_LT(apart, (128 % resolution == 0 ? kRounding : kTwoPoints) * most) << resolution;
    EXPECT_GT(haze, 0) << "a map that shows no haze tests nothing";
  }
}

}  // namespace
}  // namespace glint::ndf_image_test
