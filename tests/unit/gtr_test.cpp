#include "glint/query/brdf/gtr.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "glint/bake/bin_map/bin_map.h"
#include "glint/bake/synth/synth.h"
#include "glint/model/slope_sums.h"
#include "glint/query/brdf/bin_map_brdf.h"
#include "support/directions.h"
#include "support/test_maps.h"

namespace glint::gtr_test {
namespace {

using test::direction;
using test::Random;

constexpr double kPi64 = std::numbers::pi;
const GtrDistribution kFigure1 = {1.5f, 0.002f};  // Atanasov 2021, Fig. 1

TEST(Gtr, IntegratesToOneOverTheDisk) {
  for (const float gamma : {0.5f, 1.0f, 1.5f, 2.0f, 3.5f}) {
    for (const float alpha : {0.002f, 0.05f, 0.5f}) {
      const GtrDistribution flakes = {gamma, alpha};
      // Rings of equal width in log(sin + alpha / 100).
      double sum = 0;
      constexpr int kRings = 20000;
      const double least = alpha / 100, range = std::log((1 + least) / least);
      for (int k = 0; k < kRings; ++k) {
        const double shifted = least * std::exp(range * (k + 0.5) / kRings), sine = shifted - least;
        sum += 2 * kPi64 * sine * shifted * range / kRings * flakes.density({static_cast<float>(sine), 0});
      }
      EXPECT_NEAR(sum, 1, 2e-3) << gamma << " " << alpha;
    }
  }
  EXPECT_EQ(kFigure1.density({0.8f, 0.7f}), 0);
}

TEST(Gtr, OfExponentTwoIsGgx) {
  for (const float alpha : {0.002f, 0.1f, 0.6f}) {
    const GtrMasking masking({2, alpha});
    for (const double degrees : {1.0, 20.0, 50.0, 75.0, 85.0, 89.0, 89.9}) {
      const double t = degrees * kPi64 / 180, tangent = std::tan(t);
      const double wanted = 0.5 * (std::sqrt(1 + double{alpha} * alpha * tangent * tangent) - 1);
      const Vec3 w = {static_cast<float>(std::sin(t)), 0, static_cast<float>(std::cos(t))};
      // Lambda + 1 = A / cos: the error of T over the part that T has in A.
      EXPECT_NEAR(masking.lambda(w), wanted, 3e-3 * wanted + 2e-6) << alpha << " " << degrees;
      EXPECT_NEAR(masking.g1(w), 1 / (1 + wanted), 3e-3 / (1 + wanted)) << alpha << " " << degrees;
    }
  }
  const double half = GtrDistribution{2, 0.3f}.density({0.2f, 0.1f});
  const double z2 = 1 - 0.05, ggx = 0.09 / (kPi64 * std::pow(z2 * (0.09 - 1) + 1, 2));
  EXPECT_NEAR(half, ggx, 1e-5 * ggx);
}

TEST(Gtr, TableIsTheQuadrature) {
  for (const GtrDistribution& flakes : {kFigure1, GtrDistribution{1.5f, 0.3f}, {0.5f, 0.05f}, {1, 0.1f}, {4, 0.02f}}) {
    const GtrMasking masking(flakes);
    for (double angle = 0.01; angle < 1.57; angle += 0.013) {
      const double sine = std::sin(angle), cosine = std::cos(angle), exact = masking.excess(cosine / sine);
      const Vec3 w = {static_cast<float>(sine), 0, static_cast<float>(cosine)};
      // The table errs by 2e-3 of T, and float by 1e-7 of the cosine.
      EXPECT_NEAR(masking.projectedArea(w) - w.z, sine * exact, 2e-3 * sine * exact + 2e-7) << flakes.gamma << " " << angle;
    }
  }
}

std::vector<Vec2> flakeNormals(const GtrDistribution& flakes, int size) {
  bake::SynthOptions options = bake::defaultSynthOptions(bake::SynthKind::flakes);
  options.width = options.height = size;
  options.feature_texels = 3, options.gamma = flakes.gamma, options.alpha = flakes.alpha;
  return bake::synthNormals(options);
}

/// Area that flakes turn towards w, projected along it, by a sum over all texels.
double areaOf(const std::vector<Vec2>& normals, Vec3 w) {
  double sum = 0;
  for (const Vec2 n : normals) {
    const double z = std::sqrt(1 - double{n.x} * n.x - double{n.y} * n.y);
    sum += std::max(0.0, double{w.x} * n.x + double{w.y} * n.y + w.z * z) / z;
  }
  return sum / static_cast<double>(normals.size());
}

TEST(Gtr, MasksAsTheFlakesOfAMapDoWhereANormalDistributionOfSlopesDoesNot) {
  const std::vector<Vec2> normals = flakeNormals(kFigure1, 1024);
  const test::OwnedMap map(1024, 1024, normals);
  const GtrMasking gtr(kFigure1);
  const SmithMasking smith(slopesOf(map.map()), 0);
  double worst_gtr = 0, worst_smith = 0;
  for (const float degrees : {60.0f, 85.0f, 89.0f, 89.9f}) {
    for (const float azimuth : {0.3f, 2.0f, 4.0f}) {
      const float t = degrees * std::numbers::pi_v<float> / 180;
      const Vec3 w = {std::sin(t) * std::cos(azimuth), std::sin(t) * std::sin(azimuth), std::cos(t)};
      const double wanted = areaOf(normals, w);
      worst_gtr = std::max(worst_gtr, std::abs(gtr.projectedArea(w) / wanted - 1));
      worst_smith = std::max(worst_smith, std::abs(smith.projectedArea(w) / wanted - 1));
    }
  }
  EXPECT_LT(worst_gtr, 0.1);  // the long tail of 100,000 flakes: a few of them make the area at 89.9 degrees
  EXPECT_GT(worst_smith, 3 * worst_gtr);
  std::printf("worst error of the projected area: GTR %.3f, normal slopes %.3f\n", worst_gtr, worst_smith);
}

TEST(Gtr, ShadowsTheFacetsOfABinMap) {
  const GtrDistribution flakes = {1.5f, 0.1f};
  const test::OwnedMap map(32, 32, flakeNormals(flakes, 32));
  const bake::BinMapData data = bake::buildBinMap(map.map(), {0.05f, 8});
  const BinMapNdf ndf(data.view());
  const Footprint footprint = Footprint::box({0.4f, 0.6f}, {5, 1}, {-2, 4});
  const GtrMasking gtr(flakes);
  const BasicBinMapBrdf<GtrMasking> masked(ndf, footprint, gtr, Fresnel::mirror());
  const BinMapBrdf smith(ndf, footprint, Fresnel::mirror());
  Random random(4);
  int reflecting = 0;
  for (int k = 0; k < 100; ++k) {
    const Vec3 wi = random.above(), wo = random.above();
    if (!(aboveHorizon(wi) && aboveHorizon(wo))) continue;
    const BrdfValue a = masked.evaluateWithPdf(wi, wo), b = smith.evaluateWithPdf(wi, wo);
    EXPECT_EQ(a.pdf, b.pdf);  // G_x does not change what is drawn
    const float wanted = b.f.r * gtr.visibility(wi, wo) / smith.masking().visibility(wi, wo);
    EXPECT_NEAR(a.f.r, wanted, 1e-4f * wanted);
    EXPECT_NEAR(masked.evaluate(wo, wi).r, a.f.r, 1e-3f * a.f.r);
    reflecting += wanted > 0;
  }
  EXPECT_GT(reflecting, 10);
  // The white furnace of the whole map: no more light than comes.
  const BasicBinMapBrdf<GtrMasking> whole(ndf, Footprint::box({0.5f, 0.5f}, {16, 0}, {0, 16}), gtr, Fresnel::mirror());
  for (const Vec3 wo : {Vec3{0, 0, 1}, direction(0.5, 1)}) {
    double reflected = 0;
    constexpr int kSide = 60;
    for (int j = 0; j < kSide; ++j) {
      for (int i = 0; i < kSide; ++i) {
        const float z = (static_cast<float>(j) + 0.5f) / kSide,
                    phi = 2 * std::numbers::pi_v<float> * (static_cast<float>(i) + 0.5f) / kSide;
        const float s = std::sqrt(1 - z * z);
        reflected += 2 * kPi64 / kSide / kSide * z * whole.evaluate({s * std::cos(phi), s * std::sin(phi), z}, wo).r;
      }
    }
    EXPECT_LT(reflected, 1.05);  // of 3600 directions
    EXPECT_GT(reflected, 0.5);
  }
}

TEST(Gtr, ParametersOutOfRangeAreClamped) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const GtrDistribution& bad : {GtrDistribution{nan, nan}, {-1, 2}, {100, 0}}) {
    const GtrMasking masking(bad);
    for (const Vec3 w : {Vec3{0, 0, 1}, direction(0.01, 2), direction(0.5, 2)}) {
      EXPECT_GT(masking.g1(w), 0);
      EXPECT_LE(masking.g1(w), 1);
    }
  }
}

}  // namespace
}  // namespace glint::gtr_test
