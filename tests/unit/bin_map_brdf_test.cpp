#include "glint/query/brdf/bin_map_brdf.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "glint/bake/bin_map/bin_map.h"
#include "glint/bake/common/slopes.h"
#include "glint/query/reference.h"
#include "support/directions.h"
#include "support/test_maps.h"

namespace glint::bin_map_brdf_test {
namespace {

using test::direction;
using test::Random;

/// Normals are kept to 1/256 of a bin of 1.2 deviations here; single precision.
constexpr double kTolerance = 0.01;
/// Midpoints of the hemisphere against lobes of three of their steps and more.
constexpr double kQuadratureError = 5e-3;
const Vec3 kViews[] = {{0, 0, 1}, direction(0.8, 0.3), direction(0.4, 2), direction(0.1, 4)};

class RoughMap {
 public:
  RoughMap(const std::vector<Vec2>& normals, int size, float alpha)
      : map_(size, size, normals), data_(bake::buildBinMap(map_.map(), {alpha, 8})), ndf_(data_.view()) {}
  const NormalMap& map() const { return map_.map(); }
  const BinMapNdf& ndf() const { return ndf_; }
  BinMapBrdf brdf(const Footprint& p, const Fresnel& fresnel = Fresnel::mirror()) const { return {ndf_, p, fresnel}; }

 private:
  test::OwnedMap map_;
  bake::BinMapData data_;
  BinMapNdf ndf_;
};

RoughMap roughMap(float map_alpha, float alpha) { return {test::roughSurface(128, 128, map_alpha), 128, alpha}; }

struct Double3 {
  double x, y, z;
};
Double3 wide(Vec3 v) { return {v.x, v.y, v.z}; }
double dot(Double3 a, Double3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// Lambda of Beckmann (Walter et al. 2007, before their fit), cosine to the facet's normal.
double beckmannLambda(double cosine, double alpha) {
  const double tangent = std::sqrt(std::max(0.0, 1 - cosine * cosine)) / cosine;
  if (tangent < 1e-9) return 0;
  const double a = 1 / (alpha * tangent);
  return 0.5 * (std::erf(a) - 1) + std::exp(-a * a) / (2 * a * std::sqrt(std::numbers::pi));
}

double beckmann(double cosine, double alpha) {
  if (cosine <= 0) return 0;
  const double c2 = cosine * cosine, tangent2 = (1 - c2) / c2;
  return std::exp(-tangent2 / (alpha * alpha)) / (std::numbers::pi * alpha * alpha * c2 * c2);
}

struct Brute {
  double value = 0;  ///< f with F = 1
  double pdf = 0;    ///< of sampling
  double area = 0;   ///< that facets turn towards wo
};

/// Eq. 5 and 11 of Atanasov 2021 with 1 / t.z, summed over the texels in double precision.
Brute bruteForce(const RoughMap& surface, const Footprint& p, double alpha, Vec3 wi, Vec3 wo) {
  const Reference reference(surface.map(), static_cast<float>(alpha));
  const SmithMasking masking(surface.ndf().map().slopes, 0);
  const Double3 i = wide(wi), o = wide(wo), sum = {i.x + o.x, i.y + o.y, i.z + o.z};
  const double length = std::sqrt(dot(sum, sum));
  const Double3 h = {sum.x / length, sum.y / length, sum.z / length};
  Brute brute;
  double share = 0;
  reference.forEachTexel(p, [&](double weight, Vec2 n) {
    const Double3 t = {n.x, n.y, std::sqrt(1 - double{n.x} * n.x - double{n.y} * n.y)};
    share += weight;
    brute.area += weight * std::max(0.0, dot(o, t)) / t.z;
    const double d = beckmann(dot(h, t), alpha);
    brute.pdf += weight * d * dot(h, t) / (4 * dot(o, h));
    if (dot(i, t) <= 0 || dot(o, t) <= 0) return;
    const double own = 1 / (1 + beckmannLambda(dot(i, t), alpha) + beckmannLambda(dot(o, t), alpha));
    brute.value += weight * d * own * masking.g2(wi, wo) / (4 * i.z * o.z * t.z);
  });
  brute.value /= share, brute.pdf /= share, brute.area /= share;
  return brute;
}

Footprint randomBox(Random& random, float side) {
  const double a = 2 * std::numbers::pi * random.unit();
  const float c = 0.5f * side * static_cast<float>(std::cos(a)), s = 0.5f * side * static_cast<float>(std::sin(a));
  return Footprint::box(random.pair(), {c, s}, {-s, c});
}

TEST(BinMapBrdf, IsTheSumOverTexels) {
  // Level and steep maps; footprints that are looked up texel by texel, in lists, and merged.
  for (const auto& [steepness, alpha] : {std::pair{0.3f, 0.02f}, {0.3f, 0.1f}, {1.0f, 0.1f}, {0.3f, 0.2f}}) {
    const RoughMap surface = roughMap(steepness, alpha);
    Random random(5);
    int bright = 0;
    for (int k = 0; k < 300; ++k) {
      const Footprint p = randomBox(random, k % 3 == 0 ? 3 : k % 3 == 1 ? 20 : 100);
      const Vec3 wo = random.above(0.05);
      const BrdfSample drawn = surface.brdf(p).sample(wo, random.pair());
      const Vec3 wi = drawn.pdf > 0 ? drawn.wi : random.above(0.05);
      const Brute expected = bruteForce(surface, p, alpha, wi, wo);
      const BinMapBrdf brdf = surface.brdf(p);
      // What the sample cannot reach within five deviations is 0 instead of 4e-6 of the peak.
      const double peak = 1e-4 / (alpha * alpha * wi.z * wo.z), slack = k % 3 == 2 ? 1.5 : 1;
      EXPECT_NEAR(brdf.evaluate(wi, wo).r, expected.value, slack * kTolerance * expected.value + peak) << alpha << " " << k;
      EXPECT_NEAR(brdf.pdf(wi, wo), expected.pdf, slack * kTolerance * expected.pdf + peak) << alpha << " " << k;
      bright += expected.value > 10 * peak;
    }
    EXPECT_GT(bright, 50) << alpha;
  }
}

TEST(BinMapBrdf, MergedBinsOfWideLobesHaveFacetsThatGrazingDirectionsAreTurnedAwayFrom) {
  // Bins are up to .4 of the disk wide. What is left is that their moments are those of the whole map, and nothing of higher
  // order.
  constexpr double kMerged = 0.07, kFewer = 0.015;
  for (const float alpha : {0.4f, 0.8f}) {
    const RoughMap surface = roughMap(0.3f, alpha);
    Random random(5);
    int grazing = 0, fewer = 0;
    for (int k = 0; k < 300; ++k) {
      const Footprint p = randomBox(random, 100);
      const Vec3 wo = random.above(0.05);
      const BrdfSample drawn = surface.brdf(p).sample(wo, random.pair());
      if (drawn.pdf == 0) continue;
      const Brute expected = bruteForce(surface, p, alpha, drawn.wi, wo);
      const double peak = 1e-4 / (alpha * alpha * drawn.wi.z * wo.z), value = surface.brdf(p).evaluate(drawn.wi, wo).r;
      EXPECT_NEAR(value, expected.value, kMerged * expected.value + peak) << alpha << " " << k;
      fewer += std::fabs(value - expected.value) > kFewer * expected.value + peak;
      grazing += std::min(drawn.wi.z, wo.z) < 0.15f;
    }
    EXPECT_LT(fewer, 10);
    EXPECT_GT(grazing, 20);
  }
}

TEST(BinMapBrdf, WhiteFacetsReflectAtMostWhatTheyTurnToTheView) {
  for (const float steepness : {0.3f, 0.6f}) {
    constexpr float alpha = 0.3f;
    const RoughMap surface = roughMap(steepness, alpha);
    const SmithMasking masking(surface.ndf().map().slopes, 0);
    Random random(6);
    for (const Vec3& wo : kViews) {
      for (const float side : {4.0f, 128.0f}) {
        const Footprint p = Footprint::box(random.pair(), {0.5f * side, 0}, {0, 0.5f * side});
        const double most = bruteForce(surface, p, alpha, wo, wo).area / masking.projectedArea(wo);
        const double reflected =
            test::integrateHemisphere(20, [&](Vec3 wi) { return double{surface.brdf(p).evaluate(wi, wo).r} * wi.z; });
        EXPECT_LT(reflected, most + kQuadratureError) << wo.z << " " << side;
        if (side < 100) continue;
        EXPECT_LT(reflected, 1 + kQuadratureError) << wo.z;
        // The rest would bounce between facets, or between microfacets.
        EXPECT_GT(reflected, wo.z > 0.7f ? 0.75 : 0.5) << wo.z;
      }
    }
  }
}

TEST(BinMapBrdf, SteepFacetsKeepTheirArea) {
  // One facet tilted by 60 degrees, looked at along its normal: a mirror of all light, and it is 1 / t.z = 2 times its share.
  const RoughMap surface(std::vector<Vec2>(64 * 64, Vec2{std::sqrt(0.75f), 0}), 64, 0.1f);
  const Vec3 wo = {std::sqrt(0.75f), 0, 0.5f};
  const SmithMasking level({{0, 0}, {0, 0, 0}}, 0);
  const BinMapBrdf brdf(surface.ndf(), Footprint::box({0.5f, 0.5f}, {5, 0}, {0, 5}), level, Fresnel::mirror());
  // Unmasked by the map: f wi.z integrates to (o . t) / (o.z t.z) = 4 but for what leaves below the horizon or is masked.
  const double reflected = test::integrateHemisphere(150, [&](Vec3 wi) { return double{brdf.evaluate(wi, wo).r} * wi.z; });
  EXPECT_NEAR(reflected, 4, 0.04);
}

TEST(BinMapBrdf, BecomesTheMicrofacetBrdfAsRoughnessFalls) {
  const RoughMap surface = roughMap(0.2f, 0.01f);
  const SmithMasking masking(surface.ndf().map().slopes, 0);
  Random random(7);
  double sum = 0, expected = 0;
  for (int k = 0; k < 200; ++k) {
    const Footprint p = randomBox(random, 16);
    const MicrofacetBrdf<BinMapNdf> plain(surface.ndf(), p, masking, Fresnel::mirror());
    const Vec3 wo = random.above(0.3);
    const BrdfSample drawn = surface.brdf(p).sample(wo, random.pair());
    if (drawn.pdf == 0) continue;
    sum += surface.brdf(p).evaluate(drawn.wi, wo).r * drawn.wi.z, expected += plain.evaluate(drawn.wi, wo).r * drawn.wi.z;
  }
  EXPECT_NEAR(sum, expected, 0.03 * expected);
}

TEST(BinMapBrdf, IsReciprocalAndColoured) {
  const RoughMap surface = roughMap(0.3f, 0.1f);
  const Fresnel gold = Fresnel::conductor({0.18f, 0.42f, 1.37f}, {3.42f, 2.35f, 1.77f});
  Random random(8);
  for (int k = 0; k < 100; ++k) {
    const Footprint p = randomBox(random, 30);
    const Vec3 wi = random.above(), wo = random.above();
    const Rgb there = surface.brdf(p, gold).evaluate(wi, wo), back = surface.brdf(p, gold).evaluate(wo, wi);
    EXPECT_NEAR(there.r, back.r, 1e-4f * there.r + 1e-6f);
    const float white = surface.brdf(p).evaluate(wi, wo).r;
    const HalfVector h = halfVectorOf(wi, wo);
    EXPECT_NEAR(there.b, white * gold.reflectance(h.towards).b, 1e-5f * white);
  }
}

TEST(BinMapBrdf, SamplesFollowThePdfAndAverageToTheIntegral) {
  for (const float alpha : {0.1f, 0.3f}) {
    const RoughMap surface = roughMap(0.3f, alpha);
    Random random(9);
    for (const Vec3& wo : {kViews[1], kViews[3]}) {
      const BinMapBrdf brdf = surface.brdf(Footprint::box({0.3f, 0.6f}, {4, 1}, {-2, 3}));
      constexpr int kSamples = 10000, kRows = 8, kColumns = 12;
      std::vector<double> counts(kRows * kColumns), expected(kRows * kColumns);
      double sum = 0, squares = 0;
      for (int k = 0; k < kSamples; ++k) {
        const BrdfSample s = brdf.sample(wo, random.pair());
        sum += s.weight.r, squares += double{s.weight.r} * s.weight.r;
        if (s.pdf == 0) continue;
        if (k < 100) {
          const float pdf = brdf.pdf(s.wi, wo);
          EXPECT_NEAR(s.pdf, pdf, 1e-3f * pdf);
          EXPECT_NEAR(s.weight.r * s.pdf, brdf.evaluate(s.wi, wo).r * s.wi.z, 2e-3f * s.weight.r * s.pdf);
        }
        const double phi = std::atan2(s.wi.y, s.wi.x) + std::numbers::pi;
        const int row = std::min(static_cast<int>(s.wi.z * kRows), kRows - 1);
        const int column = std::min(static_cast<int>(phi / (2 * std::numbers::pi) * kColumns), kColumns - 1);
        ++counts[static_cast<std::size_t>(row * kColumns + column)];
      }
      const double albedo = test::integrateHemisphere(100, [&](Vec3 wi) { return double{brdf.evaluate(wi, wo).r} * wi.z; });
      const double mean = sum / kSamples, error = std::sqrt((squares / kSamples - mean * mean) / kSamples);
      EXPECT_NEAR(mean, albedo, 5 * error + kQuadratureError) << alpha << " " << wo.z;
      for (int r = 0; r < kRows; ++r)
        for (int c = 0; c < kColumns; ++c)
          expected[static_cast<std::size_t>(r * kColumns + c)] =
              kSamples * test::integrateCells(double(r) / kRows, double(r + 1) / kRows,
                                              2 * std::numbers::pi * c / kColumns - std::numbers::pi,
                                              2 * std::numbers::pi * (c + 1) / kColumns - std::numbers::pi, 12, 12,
                                              [&](Vec3 wi) { return double{brdf.pdf(wi, wo)}; });
      EXPECT_GT(test::goodnessOfFit(counts, expected), 1e-5) << alpha << " " << wo.z;
    }
  }
}

TEST(BinMapBrdf, IsFiniteAtGrazingAnglesAndZeroBelow) {
  // Normals up to the rim of the disk, and a constant map that masks nothing.
  std::vector<Vec2> steep = test::randomNormals(64, 64, 0.9999f, 3);
  const RoughMap maps[] = {{steep, 64, 0.3f}, {std::vector<Vec2>(64 * 64, Vec2{0.99999f, 0}), 64, 0.05f}};
  Random random(10);
  const auto fine = [](float v) { return std::isfinite(v) && v >= 0; };
  for (const RoughMap& surface : maps) {
    for (int k = 0; k < 500; ++k) {
      const BinMapBrdf brdf = surface.brdf(randomBox(random, 20));
      const Vec3 wo = direction(std::pow(10.0, -6.5 * random.unit()), 6.3 * random.unit());
      const Vec3 wi = direction(std::pow(10.0, -6.5 * random.unit()), 6.3 * random.unit());
      EXPECT_TRUE(fine(brdf.evaluate(wi, wo).r)) << wi.z << " " << wo.z;
      EXPECT_TRUE(fine(brdf.pdf(wi, wo)));
      const BrdfSample s = brdf.sample(wo, random.pair());
      EXPECT_TRUE(fine(s.weight.r) && fine(s.pdf)) << wo.z;
    }
    const BinMapBrdf brdf = surface.brdf(randomBox(random, 20));
    const float nan = std::numeric_limits<float>::quiet_NaN();
    for (const Vec3& bad : {Vec3{0, 0, -1}, Vec3{1, 0, 0}, Vec3{nan, 0, 1}, Vec3{3, 0, 3}}) {
      EXPECT_EQ(brdf.evaluate(bad, {0, 0, 1}).r, 0);
      EXPECT_EQ(brdf.evaluate({0, 0, 1}, bad).r, 0);
      EXPECT_EQ(brdf.pdf(bad, {0, 0, 1}), 0);
      EXPECT_EQ(brdf.sample(bad, {0.5f, 0.5f}).pdf, 0);
    }
  }
}

}  // namespace
}  // namespace glint::bin_map_brdf_test
