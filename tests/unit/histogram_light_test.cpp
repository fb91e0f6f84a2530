// The product integral from accumulated histograms, from a normal map to light: against the NDF of Reference, integrated over
// all half vectors.

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "glint/bake/common/reference_image.h"
#include "glint/bake/histogram/histogram_sat.h"
#include "glint/bake/sh/light.h"
#include "glint/bake/sh/lobes.h"
#include "glint/query/histogram_ndf.h"
#include "glint/query/light/sh_light_query.h"
#include "glint/query/light/sh_transfer.h"
#include "glint/query/reference.h"
#include "support/light_reference.h"
#include "support/test_maps.h"

namespace glint::histogram_light_test {
namespace {

using test::TestLight;

constexpr float kSigma = 0.1f;
constexpr int kOrder = 40;
constexpr int kSide = 128;

/// Facets of a few directions, each alone in its bin of 9 x 32, in patches of 4 x 4 texels: histograms then know all normals.
std::vector<Vec2> patchwork() {
  std::vector<Vec2> palette;
  for (const int ring : {0, 1, 2})
    for (int sector = ring; sector < 32; sector += 5)
      palette.push_back(SphericalBins(9, 32).point(ring * 32 + sector, {0.3f, 0.6f}));
  std::mt19937 random(3);
  std::vector<Vec2> normals(kSide * kSide);
  for (int j = 0; j < kSide; j += 4) {
    for (int i = 0; i < kSide; i += 4) {
      const Vec2 n = palette[random() % palette.size()];
      for (int k = 0; k < 16; ++k) normals[(j + k / 4) * kSide + i + k % 4] = n;
    }
  }
  return normals;
}

/// Integral of L(wi) D(h) dwi over the upper hemisphere, per channel, over the pixels of an image of D.
std::vector<double> integrateImage(const std::vector<float>& image, int size, const bake::Environment& light, Vec3 wo) {
  std::vector<double> sum(3);
  for (int y = 0; y < size; ++y) {
    for (int x = 0; x < size; ++x) {
      const float d = image[static_cast<std::size_t>(y) * size + x];
      const float pixel = 2.0f / static_cast<float>(size);
      const Vec2 h = {-1 + (static_cast<float>(x) + 0.5f) * pixel, -1 + (static_cast<float>(y) + 0.5f) * pixel};
      const float z2 = 1 - dot(h, h);
      if (d <= 0 || z2 <= 0) continue;
      const Vec3 half = {h.x, h.y, std::sqrt(z2)};
      const float ho = dot(half, wo);
      const Vec3 wi = 2 * ho * half - wo;
      if (!(ho > 0 && wi.z > 0)) continue;
      // dwi = 4 (wo . h) dh, and a pixel covers its area over h.z of directions.
      const double weight = d * 4.0 * ho / half.z * (4.0 / size / size);
      for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * light.at(wi)[c];
    }
  }
  return sum;
}

/// A map as histograms, and light, ready to be asked for the product of both.
class Chain {
 public:
  explicit Chain(TestLight light)
      : map_(kSide, kSide, patchwork()),
        sat_(bake::buildHistogramSat(map_.map(), {.theta_bins = 9, .phi_bins = 32, .stride = 4})),
        environment_(test::testEnvironment(light, 128)),
        light_(bake::buildShLight(environment_, {.order = kOrder, .grid = {17, 32}})) {
    const std::vector<double> f = bake::zonalLobe(kSigma, kOrder);
    zonal_.assign(f.begin(), f.end());
    memory_.resize(ShRecurrence<float>::size(kOrder));
    recurrence_ = ShRecurrence<float>(kOrder, memory_);
    scratch_.resize(ShLightQuery<float>::scratchSize(kOrder));
  }

  HistogramSat sat() const { return sat_.view(); }
  ShLightIntegral ask(const HistogramNdf& ndf, const Footprint& p, Vec3 wo) {
    return ShLightQuery<float>(light_.view(), zonal_, recurrence_, kSigma).integral(ndf, p, {}, wo, {}, scratch_);
  }

  /// The light integral of Reference for every outgoing direction.
  std::vector<std::vector<double>> truth(const Footprint& p) const {
    constexpr int kPixels = 512;
    const auto image = bake::referenceImage(map_.map(), kSigma, Surface::flat, Boundary::wrap, p, kPixels);
    std::vector<std::vector<double>> integrals;
    for (const Vec3 wo : directions()) integrals.push_back(integrateImage(image, kPixels, environment_, wo));
    return integrals;
  }

  /// RMS of the error over outgoing directions and colours, relative to the truth.
  double relativeError(const HistogramNdf& ndf, const Footprint& p, const std::vector<std::vector<double>>& truth) {
    double error = 0, norm = 0;
    for (std::size_t d = 0; d < truth.size(); ++d) {
      const ShLightIntegral answer = ask(ndf, p, directions()[d]);
      for (std::size_t c = 0; c < 3; ++c)
        error += std::pow(answer.value[c] - truth[d][c], 2), norm += truth[d][c] * truth[d][c];
    }
    return std::sqrt(error / norm);
  }

 private:
  static std::vector<Vec3> directions() {
    return {{0, 0, 1}, test::unit({0.3f, 0.2f, 0.93f}), test::unit({-0.5f, 0.3f, 0.8f}), test::unit({0.1f, -0.7f, 0.7f})};
  }

  test::OwnedMap map_;
  bake::HistogramSatData sat_;
  bake::Environment environment_;
  bake::ShLightData light_;
  std::vector<float> zonal_, memory_, scratch_;
  ShRecurrence<float> recurrence_;
};

/// @param exact  what is left where the histogram is exact: the cut of the series at order 40, the share of lobes at the
///               horizon, and that Reference blurs facets on the disk, which stretches the lobes of tilted ones
void expectReference(TestLight light, double exact) {
  Chain chain(light);
  const HistogramNdf ndf(chain.sat(), GaussianBoxes::one, 0), strips(chain.sat());
  const Footprint aligned = Footprint::box({0.31f, 0.62f}, {21.4f, 0}, {0, 13.7f});
  EXPECT_LT(chain.relativeError(ndf, aligned, chain.truth(aligned)), exact);

  const Footprint rotated = Footprint::box({0.31f, 0.62f}, {26, 15}, {-14, 24});
  const auto rotated_truth = chain.truth(rotated);
  EXPECT_LT(chain.relativeError(ndf, rotated, rotated_truth), exact);
  ASSERT_GT(planStrips(chain.sat(), 26, 15, -14, 24, kSlantTolerance).rows, 0);
  EXPECT_LT(chain.relativeError(strips, rotated, rotated_truth), exact + kSlantTolerance);
  EXPECT_NE(chain.ask(strips, rotated, {0, 0, 1}).value[0], chain.ask(ndf, rotated, {0, 0, 1}).value[0]);

  // A Gaussian is answered as the box of its covariance; from the Gaussian itself, boxes are off by some of their variation.
  const Footprint gaussian = Footprint::gaussian({0.7f, 0.2f}, {90, 0, 60});
  const Footprint box = Footprint::box({0.7f, 0.2f}, {std::sqrt(270.0f), 0}, {0, std::sqrt(180.0f)});
  EXPECT_LT(chain.relativeError(ndf, gaussian, chain.truth(box)), exact);
  const auto gaussian_truth = chain.truth(gaussian);
  EXPECT_LT(chain.relativeError(HistogramNdf(chain.sat(), GaussianBoxes::three), gaussian, gaussian_truth), 0.16 + exact);
  // Another footprint would be seen, but for light that is the same everywhere.
  if (light != TestLight::constant) {
    EXPECT_GT(chain.relativeError(ndf, aligned, gaussian_truth), 2 * exact);
  }
}

TEST(HistogramLight, EqualsReferenceUnderConstantLight) { expectReference(TestLight::constant, 0.01); }
TEST(HistogramLight, EqualsReferenceUnderABrightSpot) { expectReference(TestLight::bright_spot, 0.03); }
/// Lobes this wide straddle the horizon, with sky above and ground below, as in sh_light_query_test.
TEST(HistogramLight, EqualsReferenceUnderASynthesisedEnvironment) { expectReference(TestLight::studio, 0.05); }

TEST(HistogramLight, FresnelAndMaskingAreThoseOfTheMirrorDirection) {
  const MapSlopes slopes = {{0.02f, -0.01f}, {0.05f, 0.01f, 0.03f}};
  const SmithMasking masking(slopes, kSigma);
  const Fresnel gold = Fresnel::conductor({0.2f, 0.4f, 1.4f}, {3, 2, 1});
  for (const Vec3 w : {Vec3{0, 0, 1}, {0.5f, -0.3f, 0.4f}, {0.9f, 0.1f, 0.1f}}) {
    const Vec3 wo = test::unit(w), mirror = {-wo.x, -wo.y, wo.z};
    const Rgb factor = transferFactor(gold, masking, wo), f = gold.reflectance(wo.z);
    const float g = masking.g2(mirror, wo);
    EXPECT_NEAR(factor.r, transferFactor(f.r, g, wo.z), 1e-5f);
    EXPECT_NEAR(factor.g, transferFactor(f.g, g, wo.z), 1e-5f);
    EXPECT_NEAR(factor.b, transferFactor(f.b, g, wo.z), 1e-5f);
    EXPECT_GT(factor.r, factor.b);
  }
  EXPECT_EQ(transferFactor(gold, masking, {1, 0, 0}), Rgb{});
}

}  // namespace
}  // namespace glint::histogram_light_test
