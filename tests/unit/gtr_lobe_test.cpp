// Bin maps whose facets are GTR distributions, against the sum over all texels (Atanasov 2021, Fig. 1; Burley 2012).

#include "glint/query/detail/bin_map/gtr_lobe.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "glint/bake/bin_map/bin_map.h"
#include "glint/bake/bin_map/bin_map_image.h"
#include "glint/bake/synth/synth.h"
#include "glint/query/brdf/bin_map_brdf.h"
#include "glint/query/reference.h"
#include "support/directions.h"
#include "support/test_maps.h"

namespace glint::gtr_lobe_test {
namespace {

using test::Random;

constexpr double kPi64 = std::numbers::pi;
const GtrDistribution kFigure1 = {1.5f, 0.002f};

TEST(GtrLobe, RadiiHoldTheirShareOfTheMass) {
  for (const float gamma : {0.2f, 1.0f, 1.5f, 2.0f, 4.0f}) {
    for (const float alpha : {0.002f, 0.05f, 0.6f}) {
      const GtrLobe lobe({gamma, alpha});
      EXPECT_EQ(lobe.massWithin(1), 1);
      EXPECT_EQ(lobe.massWithin(1.5), 1);
      EXPECT_EQ(lobe.radius(0), 0);
      // Rings of equal mass, cut into thin ones: the density times their area.
      constexpr int kThin = 400;
      double mass = 0, last = 0;
      for (int k = 1; k <= 20 * kThin; ++k) {
        const double share = k / (20.0 * kThin), radius = lobe.radius(static_cast<float>(share)), r = 0.5 * (last + radius);
        mass += 2 * kPi64 * r * (radius - last) * lobe.density(Vec2{static_cast<float>(r), 0});
        last = radius;
        if (k % kThin != 0) continue;
        EXPECT_NEAR(lobe.massWithin(radius), share, 1e-4) << gamma << " " << alpha;
        EXPECT_NEAR(mass, share, 2e-3) << gamma << " " << alpha;
      }
      EXPECT_EQ(lobe.density(Vec2{0.8f, 0.7f}), 0);
    }
  }
}

TEST(GtrLobe, MassesOfBoxesAreThoseOfDrawnPoints) {
  constexpr int kSide = 400;              // strata of radius and angle
  constexpr double kDrawn = 3.0 / kSide;  // points near the border of a box, several times their deviation
  Random random(3);
  for (const GtrDistribution& of : {kFigure1, GtrDistribution{1, 0.1f}, {3, 0.3f}, {0.3f, 0.05f}}) {
    const GtrLobe lobe(of);
    std::vector<Vec2> points;
    for (int k = 0; k < kSide * kSide; ++k) {
      const float r = lobe.radius((static_cast<float>(k / kSide) + random.unit()) / kSide);
      const float phi = 2 * kPi * (static_cast<float>(k % kSide) + random.unit()) / kSide;
      points.push_back(r * Vec2{std::cos(phi), std::sin(phi)});
    }
    for (int k = 0; k < 40; ++k) {
      const float size = std::exp2(-10 * random.unit());
      const Vec2 low = size * (2 * random.pair() - Vec2{1.5f, 1.5f}), high = low + size * random.pair();
      const Box2 box = k == 0 ? Box2{{-1, -1}, {1, 1}} : Box2{low, high};
      const auto inside = std::count_if(points.begin(), points.end(), [&](Vec2 p) {
        return p.x >= box.low.x && p.x < box.high.x && p.y >= box.low.y && p.y < box.high.y;
      });
      EXPECT_NEAR(lobe.mass(box), static_cast<double>(inside) / (kSide * kSide), kDrawn) << of.gamma << " " << k;
    }
    // Boxes of all sizes that make up the square.
    double sum = 0;
    constexpr float kCuts[] = {-1, -0.4f, -0.03f, -0.001f, 0.0005f, 0.002f, 0.2f, 1};
    for (int j = 0; j < 7; ++j)
      for (int i = 0; i < 7; ++i) sum += lobe.mass({{kCuts[i], kCuts[j]}, {kCuts[i + 1], kCuts[j + 1]}});
    EXPECT_NEAR(sum, 1, 1e-3) << of.gamma;
  }
}

TEST(GtrLobe, ManyFacetsAsOneHaveTheirMeanAndCovariance) {
  const GtrLobe lobe({1.5f, 0.1f});
  const Covariance spread = {4e-4f, 1e-4f, 2e-4f};
  // A cloud of facets, normally distributed, drawn by their deviations.
  Random random(8);
  double sum = 0;
  constexpr int kFacets = 40000;
  const Vec2 d = {0.08f, 0.05f};
  for (int k = 0; k < kFacets; ++k) {
    const float a = normalQuantile((static_cast<float>(k / 200) + random.unit()) / 200),
                b = normalQuantile((static_cast<float>(k % 200) + random.unit()) / 200);
    const float x = std::sqrt(spread.xx), along = spread.xy / x, across = std::sqrt(spread.yy - along * along);
    sum += lobe.density(d - Vec2{a * x, a * along + b * across});
  }
  const double wanted = sum / kFacets, error = std::abs(lobe.density(spread, d) - wanted);
  EXPECT_LT(error, 4e-3 * wanted);
  EXPECT_GT(std::abs(double{lobe.density(d)} - wanted), 3 * error);  // the mean alone
}

struct Case {
  std::string name;
  GtrDistribution facet;
  std::vector<Vec2> normals;
  int size;
};

std::vector<Case> cases() {
  bake::SynthOptions flakes = bake::defaultSynthOptions(bake::SynthKind::flakes);
  flakes.width = flakes.height = 256, flakes.gamma = 1.5f, flakes.alpha = 0.002f;
  return {{"flakes of Fig. 1", kFigure1, bake::synthNormals(flakes), 256},
          {"noise", {1.5f, 0.02f}, test::roughSurface(128, 128, 0.3f), 128},
          {"wide", {1, 0.3f}, test::roughSurface(128, 128, 0.3f), 128},
          {"any", {2, 0.05f}, test::randomNormals(64, 64, 0.95f, 3), 64},
          {"steep tail", {3.5f, 0.1f}, test::roughSurface(100, 60, 0.5f), 100}};
}

/// The sum over all texels of a footprint, in double precision.
double bruteForce(const NormalMap& map, const GtrDistribution& of, const Footprint& p, Vec2 h) {
  const Reference reference(map, 0.01f);
  const double a2 = double{of.alpha} * of.alpha;
  double sum = 0;
  const double total = reference.forEachTexel(p, [&](double weight, Vec2 n) {
    const double d2 = (double{h.x} - n.x) * (double{h.x} - n.x) + (double{h.y} - n.y) * (double{h.y} - n.y);
    if (d2 < 1) sum += weight * of.scale() / std::pow(a2 + (1 - a2) * d2, double{of.gamma});
  });
  return sum / total;
}

TEST(BinMapNdf, OfGtrFacetsIsTheSumOverTexels) {
  // Codes of normals are fine to 1/64 of a bin, at a slope of the lobe of 1; beside that, blocks that count as one.
  constexpr double kSmall = 0.003, kRootMeanSquare = 0.02, kWorst = 0.08;
  for (const Case& c : cases()) {
    const int height = static_cast<int>(c.normals.size()) / c.size;
    const test::OwnedMap map(c.size, height, c.normals);
    const bake::BinMapData data = bake::buildBinMap(map.map(), {c.facet.alpha});
    const BinMapNdf ndf(data.view(), c.facet.alpha, BinEstimator::exact, c.facet.gamma);
    Random random(5);
    for (const float side : {2.0f, 6.0f, 40.0f, 130.0f}) {
      double squares = 0, worst = 0;
      constexpr int kQuestions = 40;
      for (int k = 0; k < kQuestions; ++k) {
        const float turn = k % 2 == 0 ? 0 : 6 * random.unit(), s = side * (0.7f + 0.6f * random.unit());
        const Footprint p = Footprint::box(random.pair(), 0.5f * s * Vec2{std::cos(turn), std::sin(turn)},
                                           0.5f * s * Vec2{-std::sin(turn), std::cos(turn)});
        // Near the normal of a texel, at several lobes from it, and anywhere.
        const Vec2 n = c.normals[static_cast<std::size_t>(random.unit() * static_cast<float>(c.normals.size()))];
        const float phi = 6.3f * random.unit(), r = c.facet.alpha * static_cast<float>(k % 3) * 3 * random.unit();
        Vec2 h = n + r * Vec2{std::cos(phi), std::sin(phi)};
        if (k % 4 == 3) h = 0.7f * (2 * random.pair() - Vec2{1, 1});
        if (!(dot(h, h) < 1)) continue;
        const double wanted = bruteForce(map.map(), c.facet, p, h);
        if (wanted == 0) {  // all facets are on the other side of the disk
          EXPECT_EQ(ndf.density(p, h), 0);
          continue;
        }
        const double error = ndf.density(p, h) / wanted - 1;
        worst = std::max(worst, std::abs(error)), squares += error * error;
      }
      const double rms = std::sqrt(squares / kQuestions);
      std::printf("%s, side %g: error of D %.4f (worst %.4f)\n", c.name.c_str(), static_cast<double>(side), rms, worst);
      EXPECT_LT(rms, side < 10 ? kSmall : kRootMeanSquare) << c.name << " " << side;
      EXPECT_LT(worst, kWorst) << c.name << " " << side;
    }
  }
}

TEST(BinMapNdf, MeansOfGtrFacetsAreMeansOfTheDensity) {
  for (const Case& c : {cases()[1], cases()[2]}) {
    const test::OwnedMap map(c.size, c.size, c.normals);
    const bake::BinMapData data = bake::buildBinMap(map.map(), {c.facet.alpha});
    const BinMapNdf ndf(data.view(), c.facet.alpha, BinEstimator::exact, c.facet.gamma);
    Random random(6);
    for (const float side : {6.0f, 40.0f}) {
      for (int k = 0; k < 4; ++k) {
        const Footprint p = Footprint::box(random.pair(), {side, 0}, {0, side});
        const Vec2 low = 0.4f * (2 * random.pair() - Vec2{1, 1});
        const float size = k % 2 == 0 ? 0.02f : 0.3f;
        const Box2 box = {low, low + size * Vec2{1, 0.7f}};
        constexpr int kPoints = 24;
        double sum = 0;
        for (int n = 0; n < kPoints * kPoints; ++n)
          sum += ndf.density(
              p, low + size / kPoints *
                           Vec2{static_cast<float>(n % kPoints) + 0.5f, 0.7f * (static_cast<float>(n / kPoints) + 0.5f)});
        const double wanted = sum / (kPoints * kPoints);
        EXPECT_NEAR(ndf.mean(p, box), wanted, 0.02 * wanted) << c.name << " " << side << " " << k;
      }
    }
  }
}

TEST(BinMapNdf, ImagesOfGtrFacetsAreMeansOverPixels) {
  const Case c = cases()[1];
  const test::OwnedMap map(c.size, c.size, c.normals);
  const bake::BinMapData data = bake::buildBinMap(map.map(), {c.facet.alpha});
  const BinMapNdf ndf(data.view(), c.facet.alpha, BinEstimator::exact, c.facet.gamma);
  const Footprint p = Footprint::box({0.3f, 0.6f}, {2, 0}, {0.5f, 2});
  constexpr int kSide = 16;
  const std::vector<float> image = bake::binMapImage(ndf, p, kSide);
  double sum = 0;
  for (int k = 0; k < kSide * kSide; ++k) {
    const Vec2 low = {2.0f * static_cast<float>(k % kSide) / kSide - 1, 2.0f * static_cast<float>(k / kSide) / kSide - 1};
    const float mean = ndf.mean(p, {low, low + Vec2{2.0f / kSide, 2.0f / kSide}}), pixel = image[static_cast<std::size_t>(k)];
    EXPECT_NEAR(pixel, mean, 1e-4f * mean) << k;
    sum += double{pixel} * 4 / (kSide * kSide);
  }
  EXPECT_NEAR(sum, 1, 0.01);
}

TEST(BinMapNdf, GtrFacetsOfLevelMapsIntegrateToOne) {
  const test::OwnedMap level(32, 32, std::vector<Vec2>(1024, Vec2{0.001f, -0.002f}));
  for (const GtrDistribution& of : {kFigure1, GtrDistribution{1, 0.2f}, {3, 0.5f}}) {
    const bake::BinMapData data = bake::buildBinMap(level.map(), {of.alpha});
    const BinMapNdf ndf(data.view(), of.alpha, BinEstimator::exact, of.gamma);
    const Footprint p = Footprint::box({0.3f, 0.3f}, {5, 0}, {1, 5});
    EXPECT_NEAR(4 * ndf.mean(p, {{-1, -1}, {1, 1}}), 1, 2e-3);
  }
}

TEST(BinMapNdf, SamplesOfGtrFacetsFollowTheDensity) {
  for (const Case& c : {cases()[0], cases()[1], cases()[2]}) {
    const test::OwnedMap map(c.size, c.size, c.normals);
    const bake::BinMapData data = bake::buildBinMap(map.map(), {c.facet.alpha});
    const BinMapNdf ndf(data.view(), c.facet.alpha, BinEstimator::exact, c.facet.gamma);
    const Footprint p = Footprint::box({0.4f, 0.7f}, {2, 0.5f}, {-0.3f, 1});
    // Columns and rows that are narrow around the middle of the disk.
    constexpr int kSide = 12;
    std::vector<float> cuts;
    for (int k = 0; k <= kSide; ++k) {
      const float x = 2 * static_cast<float>(k) / kSide - 1;
      cuts.push_back(std::copysign(std::pow(std::abs(x), 2.5f), x));
    }
    std::vector<double> expected(kSide * kSide), drawn(kSide * kSide);
    constexpr int kSamples = 20000;
    double lost = kSamples;
    for (int k = 0; k < kSide * kSide; ++k) {
      const auto i = static_cast<std::size_t>(k % kSide), j = static_cast<std::size_t>(k / kSide);
      const Box2 box = {{cuts[i], cuts[j]}, {cuts[i + 1], cuts[j + 1]}};
      lost -= expected[static_cast<std::size_t>(k)] = kSamples * double{ndf.mean(p, box)} * double{box.area()};
    }
    Random random(9);
    double outside = 0;
    for (int k = 0; k < kSamples; ++k) {
      const HalfVectorSample sample = ndf.sample(p, random.pair());
      if (!(sample.pdf > 0)) {
        ++outside;
        continue;
      }
      const auto cell = [&](float x) { return std::upper_bound(cuts.begin() + 1, cuts.end() - 1, x) - cuts.begin() - 1; };
      ++drawn[static_cast<std::size_t>(cell(sample.h.y) * kSide + cell(sample.h.x))];
      if (k % 200 == 0) {
        EXPECT_NEAR(sample.pdf, bruteForce(map.map(), c.facet, p, sample.h), 0.02 * sample.pdf) << c.name;
      }
    }
    double squares = (outside - lost) * (outside - lost) / std::max(lost, 5.0);
    int degrees = 0;
    for (std::size_t k = 0; k < drawn.size(); ++k) {
      if (expected[k] < 5) continue;
      squares += (drawn[k] - expected[k]) * (drawn[k] - expected[k]) / expected[k], ++degrees;
    }
    EXPECT_GT(degrees, 20) << c.name;
    // Four deviations of chi-squared.
    EXPECT_LT(squares, degrees + 4 * std::sqrt(2.0 * degrees)) << c.name;
    std::printf("%s: chi-squared %.1f of %d cells\n", c.name.c_str(), squares, degrees);
  }
}

/// Lambda of GGX in the frame of a facet.
double ggxLambda(double cosine, double alpha) {
  const double tangent2 = (1 - cosine * cosine) / (cosine * cosine);
  return 0.5 * (std::sqrt(1 + alpha * alpha * tangent2) - 1);
}

TEST(BinMapBrdf, OfGgxFacetsIsTheSumOverTexels) {
  // The exponent 2 is GGX, whose shadowing and masking are known in closed form.
  constexpr float kAlpha = 0.1f;
  const test::OwnedMap map(64, 64, test::roughSurface(64, 64, 0.4f));
  const bake::BinMapData data = bake::buildBinMap(map.map(), {kAlpha});
  const BinMapNdf ndf(data.view(), kAlpha, BinEstimator::exact, 2);
  const SmithMasking masking(data.view().slopes, 0);
  Random random(4);
  int drawn = 0;
  for (int k = 0; k < 60; ++k) {
    const float side = k % 3 == 0 ? 2 : k % 3 == 1 ? 12 : 60;
    const Footprint p = Footprint::box(random.pair(), {0.5f * side, 0.1f * side}, {0, 0.5f * side});
    const BinMapBrdf brdf(ndf, p, Fresnel::mirror());
    const Vec3 wo = random.above(0.2);
    const BrdfSample sample = brdf.sample(wo, random.pair());
    if (!(sample.pdf > 0)) continue;
    ++drawn;
    const Vec3 wi = sample.wi, h = halfVectorOf(wi, wo).cosine > 0 ? wi + wo : Vec3{};
    const double length = std::sqrt(double{dot(h, h)});
    double value = 0, pdf = 0;
    const double share = Reference(map.map(), 0.01f).forEachTexel(p, [&](double weight, Vec2 n) {
      const Vec3 t = {n.x, n.y, std::sqrt(1 - dot(n, n))};
      const double c = dot(h, t) / length, i = dot(wi, t), o = dot(wo, t), a2 = double{kAlpha} * kAlpha;
      if (c <= 0) return;
      const double d = a2 / (kPi64 * std::pow(1 - (1 - a2) * c * c, 2));
      pdf += weight * d * c / (4 * dot(wo, h) / length);
      if (i <= 0 || o <= 0) return;
      value += weight * d / (1 + ggxLambda(i, kAlpha) + ggxLambda(o, kAlpha)) / double{t.z};
    });
    value *= double{masking.visibility(wi, wo)} / share, pdf /= share;
    EXPECT_NEAR(brdf.evaluate(wi, wo).r, value, 0.02 * value) << k;
    EXPECT_NEAR(brdf.evaluate(wo, wi).r, brdf.evaluate(wi, wo).r, 1e-3 * value) << k;
    EXPECT_NEAR(sample.pdf, pdf, 0.02 * pdf) << k;
    EXPECT_NEAR(sample.weight.r, value * wi.z / pdf, 0.03 * value * wi.z / pdf) << k;
  }
  EXPECT_GT(drawn, 30);
}

TEST(BinMapBrdf, OfGtrFacetsGainsNoLight) {
  const test::OwnedMap map(32, 32, test::roughSurface(32, 32, 0.2f));
  const bake::BinMapData data = bake::buildBinMap(map.map(), {0.2f});
  const BinMapNdf ndf(data.view(), 0.2f, BinEstimator::exact, 1.5f);
  const BinMapBrdf brdf(ndf, Footprint::box({0.5f, 0.5f}, {4, 0}, {0, 4}), Fresnel::mirror());
  for (const Vec3 wo : {Vec3{0, 0, 1}, test::direction(0.6, 1)}) {
    double reflected = 0, drawn = 0;
    reflected = test::integrateHemisphere(24, [&](Vec3 wi) {
      const BrdfValue value = brdf.evaluateWithPdf(wi, wo);
      drawn += value.pdf * 2 * kPi64 / (24 * 48);
      return double{value.f.r} * wi.z;
    });
    EXPECT_LT(reflected, 1.03);
    EXPECT_GT(reflected, 0.6);
    EXPECT_LT(drawn, 1.03);
    EXPECT_GT(drawn, 0.7);
  }
}

}  // namespace
}  // namespace glint::gtr_lobe_test
