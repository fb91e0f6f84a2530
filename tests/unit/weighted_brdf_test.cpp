#include "glint/query/brdf/weighted_brdf.h"

#include <gtest/gtest.h>

#include "glint/query/brdf/layered_brdf.h"
#include "support/beckmann_ndf.h"
#include "support/directions.h"

namespace glint::weighted_brdf_test {
namespace {

using test::BeckmannNdf;
using test::direction;
using test::Random;

const MapSlopes kSlopes = {{0.1f, -0.05f}, {0.05f, -0.01f, 0.03f}};
const Vec3 kViews[] = {{0, 0, 1}, direction(0.8, 0.3), direction(0.4, 2)};
const Rgb kDiffuse = {0.1f, 0.3f, 0.5f}, kSpecular = {0.6f, 0.4f, 0.2f};

struct Surface {
  BeckmannNdf ndf{kSlopes};
  MicrofacetBrdf<BeckmannNdf> glossy{ndf, Footprint{}, SmithMasking(kSlopes, 0), Fresnel::mirror()};
};

TEST(WeightedBrdf, IsTheWeighedSumOfItsParts) {
  const Surface surface;
  const WeightedBrdf both(surface.glossy, kDiffuse, kSpecular);
  Random random(1);
  for (int k = 0; k < 300; ++k) {
    const Vec3 wi = random.above(), wo = random.above();
    if (!(aboveHorizon(wi) && aboveHorizon(wo))) continue;
    const Rgb f = both.evaluate(wi, wo), glossy = surface.glossy.evaluate(wi, wo);
    EXPECT_FLOAT_EQ(f.r, kDiffuse.r / kPi + kSpecular.r * glossy.r);
    EXPECT_FLOAT_EQ(f.b, kDiffuse.b / kPi + kSpecular.b * glossy.b);
    EXPECT_NEAR(both.evaluate(wo, wi).g, f.g, 1e-4f * f.g);
  }
  EXPECT_EQ(both.evaluate({0, 0, -1}, {0, 0, 1}), Rgb{});
  EXPECT_EQ(both.pdf({0, 0, 1}, {1, 0, 0}), 0);
}

TEST(WeightedBrdf, OfOnePartAloneIsThatPart) {
  const Surface surface;
  const WeightedBrdf specular(surface.glossy, {}, Rgb::grey(1)), diffuse(surface.glossy, Rgb::grey(0.5f), {}),
      black(surface.glossy, {}, {});
  const Vec3 wi = direction(0.7, 1), wo = direction(0.5, 3);
  EXPECT_EQ(specular.evaluate(wi, wo), surface.glossy.evaluate(wi, wo));
  EXPECT_FLOAT_EQ(specular.pdf(wi, wo), surface.glossy.pdf(wi, wo));
  EXPECT_EQ(diffuse.evaluate(wi, wo), ((1 / kPi) * Rgb::grey(0.5f)));
  EXPECT_FLOAT_EQ(diffuse.pdf(wi, wo), wi.z / kPi);
  EXPECT_EQ(black.evaluate(wi, wo), Rgb{});
}

/// Mean of weights over stratified samples, and the integral of f cos over even directions, of one channel.
template <class Brdf>
double expectSamplesHaveTheIntegral(const Brdf& brdf, Vec3 wo) {
  constexpr int kSide = 200;
  constexpr double kTolerance = 0.02;  // of 40000 stratified samples and a lattice of as many directions
  double sampled = 0, integral = 0, density = 0;
  for (int j = 0; j < kSide; ++j) {
    for (int i = 0; i < kSide; ++i) {
      const Vec2 xi = {(static_cast<float>(i) + 0.5f) / kSide, (static_cast<float>(j) + 0.5f) / kSide};
      const BrdfSample drawn = brdf.sample(wo, xi);
      sampled += double{drawn.weight.g} / kSide / kSide;
      if (drawn.pdf > 0) {
        EXPECT_NEAR(drawn.pdf, brdf.pdf(drawn.wi, wo), 1e-3f * drawn.pdf);
      }
      const float s = std::sqrt(1 - xi.x * xi.x), phi = 2 * kPi * xi.y;
      const Vec3 wi = {s * std::cos(phi), s * std::sin(phi), xi.x};
      integral += 2 * kPi * double{brdf.evaluate(wi, wo).g} * wi.z / kSide / kSide;
      density += 2 * kPi * double{brdf.pdf(wi, wo)} / kSide / kSide;
    }
  }
  EXPECT_NEAR(sampled, integral, kTolerance * integral);
  EXPECT_LT(density, 1 + kTolerance);
  return integral;
}

TEST(WeightedBrdf, SamplesHaveTheirPdfAndTheIntegralOfTheBrdf) {
  const Surface surface;
  const LayeredBrdf layers(surface.glossy, surface.glossy, Fresnel::dielectric(1.5f));
  for (const Vec3 wo : kViews) {
    // No more light than the weights allow, but for the lean of the normals.
    EXPECT_LT(expectSamplesHaveTheIntegral(WeightedBrdf(surface.glossy, kDiffuse, kSpecular), wo),
              1.05f * (kDiffuse.g + kSpecular.g));
    expectSamplesHaveTheIntegral(WeightedBrdf(layers, kDiffuse, kSpecular), wo);
  }
}

}  // namespace
}  // namespace glint::weighted_brdf_test
