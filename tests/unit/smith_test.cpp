#include "glint/query/brdf/smith.h"

#include <gtest/gtest.h>

#include <random>

#include "glint/bake/common/slopes.h"
#include "glint/bake/compressed/compress.h"
#include "glint/bake/histogram/histogram_sat.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/query/reference.h"
#include "support/beckmann_ndf.h"
#include "support/directions.h"
#include "support/test_maps.h"

namespace glint::smith_test {
namespace {

using test::BeckmannNdf;

constexpr double kQuadratureError = 1e-3;

const MapSlopes kSmooth = {{0, 0}, {0.02f, 0, 0.02f}};
const MapSlopes kBrushed = {{0, 0}, {0.2f, 0.03f, 0.01f}};
const MapSlopes kLeaning = {{0.1f, -0.05f}, {0.05f, -0.01f, 0.03f}};

Vec3 randomDirection(std::mt19937& random, double lowest_z = 0.02) {
  std::uniform_real_distribution<double> unit(0, 1);
  return test::direction(lowest_z + (1 - lowest_z) * unit(random), 6.283185 * unit(random));
}

/// Facet area of a distribution that faces w, projected along w.
template <class Model>
double projectedAreaOf(const Model& model, const Footprint& p, Vec3 w) {
  return test::integrateDisk(300, [&](Vec2 h) {
    const double z = std::sqrt(1 - dot(h, h));
    return model.density(p, h) * std::max(0.0, (h.x * w.x + h.y * w.y) / z + w.z);
  });
}

TEST(Smith, ProjectedAreaIsThatOfTheFacets) {
  std::mt19937 random(1);
  for (const MapSlopes& slopes : {kSmooth, kBrushed, kLeaning}) {
    const SmithMasking masking(slopes, 0);
    for (int k = 0; k < 10; ++k) {
      const Vec3 w = randomDirection(random);
      const double area = projectedAreaOf(BeckmannNdf(slopes), {}, w);
      EXPECT_NEAR(masking.projectedArea(w), std::max<double>(area, w.z), kQuadratureError * area) << w.x << ' ' << w.y;
    }
  }
}

TEST(Smith, WeakWhiteFurnaceGivesOne) {
  // What is seen of the facets, G1 <wo . h> D, covers the view of the surface: wo.z (Heitz 2014, section 3).
  std::mt19937 random(2);
  for (const MapSlopes& slopes : {kSmooth, kBrushed}) {
    const BeckmannNdf ndf(slopes);
    const SmithMasking masking(slopes, 0);
    for (int k = 0; k < 10; ++k) {
      const Vec3 wo = randomDirection(random);
      EXPECT_NEAR(masking.g1(wo) * projectedAreaOf(ndf, {}, wo) / wo.z, 1, kQuadratureError) << wo.z;
    }
  }
}

TEST(Smith, LambdaIsBeckmannsOnIsotropicSurfaces) {
  for (const double alpha : {0.05, 0.3, 1.0}) {
    const auto variance = static_cast<float>(alpha * alpha / 2);
    const SmithMasking masking({{0, 0}, {variance, 0, variance}}, 0);
    for (double tilt = 0.05; tilt < 1.56; tilt += 0.05) {
      const double a = 1 / (alpha * std::tan(tilt));
      const double lambda = 0.5 * (std::erf(a) - 1 + std::exp(-a * a) / (a * std::sqrt(std::numbers::pi)));
      EXPECT_NEAR(masking.lambda(test::direction(std::cos(tilt), 1.1)), lambda, 2e-6 * (1 + lambda) / std::cos(tilt));
    }
  }
}

TEST(Smith, HeightCorrelatedMaskingIsSymmetricAndAtMostEither) {
  std::mt19937 random(3);
  for (const MapSlopes& slopes : {kSmooth, kBrushed, kLeaning}) {
    const SmithMasking masking(slopes, 0.02f);
    for (int k = 0; k < 1000; ++k) {
      const Vec3 wi = randomDirection(random), wo = randomDirection(random);
      const float g2 = masking.g2(wi, wo);
      EXPECT_NEAR(g2, 1 / (1 + masking.lambda(wi) + masking.lambda(wo)), 1e-5);
      EXPECT_NEAR(g2, masking.g2(wo, wi), 1e-6f);
      EXPECT_LE(g2, std::min(masking.g1(wi), masking.g1(wo)) * (1 + 1e-5f));
      EXPECT_GE(g2, masking.g1(wi) * masking.g1(wo) * (1 - 1e-5f));  // at least as if heights were independent
    }
  }
}

TEST(Smith, BlurOfFacetsRoughensTheSurface) {
  // The blur is made in the disk: level facets of deviation 0.05 there are within 3 % of slopes of that deviation.
  constexpr double kLobeError = 0.03;
  const float sigma_r = 0.05f;
  const test::OwnedMap level(2, 2, std::vector<Vec2>(4));
  const Reference ndf(level.map(), sigma_r);
  const SmithMasking masking({}, sigma_r);
  for (const double z : {0.7, 0.3, 0.1, 0.03}) {
    const Vec3 w = test::direction(z, 0.4);
    const double lambda = projectedAreaOf(ndf, Footprint::isotropic({0.5f, 0.5f}, 0.25f), w) / z - 1;
    EXPECT_NEAR(masking.lambda(w), lambda, kLobeError * lambda + kQuadratureError) << z;
  }
}

TEST(Smith, StaysFiniteAtTheHorizonAndOnFlatMaps) {
  for (const MapSlopes& slopes : {MapSlopes{}, kSmooth, kBrushed, kLeaning, MapSlopes{{0, 0}, {1e7f, 0, 1e7f}}}) {
    const SmithMasking masking(slopes, 0);
    for (const float z : {1.0f, 0.5f, 1e-3f, 1e-6f}) {
      const Vec3 w = test::direction(z, 2.5);
      EXPECT_TRUE(std::isfinite(masking.projectedArea(w)) && masking.projectedArea(w) >= z);
      EXPECT_TRUE(masking.g1(w) > 0 && masking.g1(w) <= 1);
      EXPECT_TRUE(std::isfinite(masking.visibility(w, w)));
    }
  }
  EXPECT_NEAR(SmithMasking({}, 0).g1(test::direction(0.1, 0)), 1, 1e-6f);
}

TEST(MapSlopes, AreTheMomentsOfTheTexels) {
  const auto owned = test::OwnedMap(256, 256, test::roughSurface(256, 256, 0.3f));
  const MapSlopes slopes = bake::mapSlopes(owned.map());
  // Heights of a periodic field: no mean slope; the noise has its variance per axis on average.
  EXPECT_NEAR(slopes.mean.x, 0, 1e-6);
  EXPECT_NEAR(slopes.mean.y, 0, 1e-6);
  EXPECT_NEAR(0.5 * (slopes.covariance.xx + slopes.covariance.yy), 0.5 * 0.3 * 0.3, 1e-5);

  const Vec2 up = bake::normalFromSlopes(0.5f, -0.25f), down = bake::normalFromSlopes(-0.1f, 0.35f);
  const MapSlopes two = bake::mapSlopes(test::OwnedMap(2, 1, {up, down}).map());
  EXPECT_NEAR(two.mean.x, 0.2f, 1e-6f);
  EXPECT_NEAR(two.mean.y, 0.05f, 1e-6f);
  EXPECT_NEAR(two.covariance.xx, 0.09f, 1e-6f);
  EXPECT_NEAR(two.covariance.xy, -0.09f, 1e-6f);
  EXPECT_NEAR(two.covariance.yy, 0.09f, 1e-6f);

  const MapSlopes level = bake::mapSlopes(test::OwnedMap(16, 16, std::vector<Vec2>(256, Vec2{0.3f, -0.1f})).map());
  EXPECT_EQ(level.covariance.xx, 0);
  EXPECT_EQ(level.covariance.xy, 0);
}

TEST(MapSlopes, ReachHistograms) {
  const auto owned = test::OwnedMap(32, 32, test::roughSurface(32, 32, 0.3f));
  const MapSlopes expected = bake::mapSlopes(owned.map()), stored = bake::buildHistogramSat(owned.map(), {}).view().slopes;
  EXPECT_GT(expected.covariance.xx, 0.01f);
  EXPECT_EQ(stored.mean, expected.mean);
  EXPECT_EQ(stored.covariance.xx, expected.covariance.xx);
  EXPECT_EQ(stored.covariance.xy, expected.covariance.xy);
  EXPECT_EQ(stored.covariance.yy, expected.covariance.yy);
}

TEST(MapSlopes, ReachThePyramidAndWhatIsCompressedFromIt) {
  const auto owned = test::OwnedMap(32, 32, test::roughSurface(32, 32, 0.3f));
  bake::PyramidOptions options;
  options.stride = 16;
  options.resolution = 32;
  options.sigma_r = 0.05f;
  const bake::NdfPyramidData pyramid = bake::buildPyramid(owned.map(), options);
  const MapSlopes expected = bake::mapSlopes(owned.map()),
                  compressed = bake::compressPyramid(pyramid.view(), {}).view().shape.slopes;
  EXPECT_GT(expected.covariance.xx, 0.01f);
  EXPECT_EQ(pyramid.view().shape.slopes.covariance.xx, expected.covariance.xx);
  EXPECT_EQ(compressed.mean, expected.mean);
  EXPECT_EQ(compressed.covariance.xx, expected.covariance.xx);
  EXPECT_EQ(compressed.covariance.xy, expected.covariance.xy);
  EXPECT_EQ(compressed.covariance.yy, expected.covariance.yy);
}

}  // namespace
}  // namespace glint::smith_test
