#include "glint/query/brdf/layered_brdf.h"

#include <gtest/gtest.h>

#include "support/beckmann_ndf.h"
#include "support/directions.h"

namespace glint::layered_brdf_test {
namespace {

using test::BeckmannNdf;
using test::direction;
using test::Random;

const MapSlopes kBaseSlopes = {{0.1f, -0.05f}, {0.05f, -0.01f, 0.03f}};
const MapSlopes kCoatSlopes = {{0, 0}, {0.02f, 0, 0.02f}};
const Fresnel kMetal = Fresnel::conductor({0.18f, 0.42f, 1.37f}, {3.42f, 2.35f, 1.77f});
const Fresnel kLacquer = Fresnel::dielectric(1.5f);
const Vec3 kViews[] = {{0, 0, 1}, direction(0.8, 0.3), direction(0.4, 2), direction(0.1, 4)};

struct Layers {
  BeckmannNdf base_ndf{kBaseSlopes}, coat_ndf{kCoatSlopes};
  MicrofacetBrdf<BeckmannNdf> base, coat;
  LayeredBrdf<BeckmannNdf, BeckmannNdf> both;

  Layers(const Fresnel& of_base, const Fresnel& of_coat)
      : base(base_ndf, Footprint{}, SmithMasking(kBaseSlopes, 0), of_base),
        coat(coat_ndf, Footprint{}, SmithMasking(kCoatSlopes, 0), of_coat),
        both(base, coat, of_coat) {}
};

TEST(LayeredBrdf, IsTheCoatAndWhatItLetsThroughToTheBase) {
  const Layers layers(kMetal, kLacquer);
  Random random(1);
  for (int k = 0; k < 500; ++k) {
    const Vec3 wi = random.above(), wo = random.above();
    if (!(aboveHorizon(wi) && aboveHorizon(wo))) continue;
    const Rgb f = layers.both.evaluate(wi, wo), base = layers.base.evaluate(wi, wo), coat = layers.coat.evaluate(wi, wo);
    const Rgb reflected = kLacquer.reflectance(halfVectorOf(wi, wo).towards);
    EXPECT_FLOAT_EQ(f.r, base.r * (1 - reflected.r) + coat.r);
    EXPECT_FLOAT_EQ(f.b, base.b * (1 - reflected.b) + coat.b);
    const Rgb turned = layers.both.evaluate(wo, wi);
    EXPECT_NEAR(turned.g, f.g, 1e-4f * f.g);  // reciprocal, but for rounding
  }
}

TEST(LayeredBrdf, OfACoatThatReflectsAllOrNothingIsOneOfItsLayers) {
  const Layers all(kMetal, Fresnel::mirror()), nothing(kMetal, Fresnel::dielectric(1));
  Random random(2);
  for (int k = 0; k < 200; ++k) {
    const Vec3 wi = random.above(), wo = random.above();
    EXPECT_EQ(all.both.evaluate(wi, wo), all.coat.evaluate(wi, wo));
    EXPECT_EQ(nothing.both.evaluate(wi, wo), nothing.base.evaluate(wi, wo));
  }
}

TEST(LayeredBrdf, SamplesHaveTheirPdfAndTheIntegralOfTheBrdf) {
  const Layers layers(kMetal, kLacquer);
  constexpr int kSide = 200;
  constexpr double kTolerance = 0.02;  // of 40000 stratified samples and a lattice of as many directions
  for (const Vec3 wo : kViews) {
    double drawn = 0, integral = 0, pdf = 0, chosen = 0;
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i) {
        const Vec2 xi = {(static_cast<float>(i) + 0.5f) / kSide, (static_cast<float>(j) + 0.5f) / kSide};
        const BrdfSample s = layers.both.sample(wo, xi);
        if (s.pdf > 0) {
          ++chosen;
          drawn += s.weight.g;
          EXPECT_NEAR(s.pdf, layers.both.pdf(s.wi, wo), 1e-4f * s.pdf);
        }
        const float z = xi.x, r = std::sqrt(1 - z * z), angle = 2 * kPi * xi.y;
        const BrdfValue value = layers.both.evaluateWithPdf({r * std::cos(angle), r * std::sin(angle), z}, wo);
        integral += double{value.f.g} * z;
        pdf += value.pdf;
      }
    constexpr double kCount = kSide * kSide, kSphere = 2 * kPi / kCount;
    EXPECT_NEAR(drawn / kCount, integral * kSphere, kTolerance);
    EXPECT_NEAR(chosen / kCount, pdf * kSphere, kTolerance);
    EXPECT_LT(integral * kSphere, 1.02);
  }
}

}  // namespace
}  // namespace glint::layered_brdf_test
