#include "glint/query/brdf/microfacet_brdf.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "glint/bake/common/slopes.h"
#include "glint/bake/compressed/compress.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/pyramid_ndf.h"
#include "glint/query/reference.h"
#include "support/beckmann_ndf.h"
#include "support/directions.h"
#include "support/test_maps.h"

namespace glint::microfacet_brdf_test {
namespace {

using test::BeckmannNdf;
using test::direction;
using test::Random;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kQuadratureError = 2e-3;
constexpr float kTiny = 1e-30f;  // below it floats lose their digits

const MapSlopes kIsotropic = {{0, 0}, {0.02f, 0, 0.02f}};
const MapSlopes kBrushed = {{0, 0}, {0.2f, 0.03f, 0.02f}};
const MapSlopes kLeaning = {{0.1f, -0.05f}, {0.05f, -0.01f, 0.03f}};
const MapSlopes kAll[] = {kIsotropic, kBrushed, kLeaning};
const Vec3 kViews[] = {{0, 0, 1}, direction(0.8, 0.3), direction(0.4, 2), direction(0.1, 4)};

const Fresnel kGold = Fresnel::conductor({0.18f, 0.42f, 1.37f}, {3.42f, 2.35f, 1.77f});

MicrofacetBrdf<BeckmannNdf> brdfOf(const BeckmannNdf& ndf, const MapSlopes& slopes,
                                   const Fresnel& fresnel = Fresnel::mirror()) {
  return {ndf, Footprint{}, SmithMasking(slopes, 0), fresnel};
}

TEST(HalfVector, OfADirectionAndItsMirrorImageIsTheFacet) {
  Random random(1);
  for (int k = 0; k < 1000; ++k) {
    const Vec3 wo = random.above();
    const HalfVector facet = halfVectorAt({0.6f * random.unit() - 0.3f, 0.6f * random.unit() - 0.3f}, wo);
    const Vec3 wi = reflected(wo, facet);
    EXPECT_NEAR(dot(wi, wi), 1, 1e-5);
    if (!aboveHorizon(wi)) continue;
    const HalfVector found = halfVectorOf(wi, wo);
    EXPECT_NEAR(found.disk.x, facet.disk.x, 1e-4f);
    EXPECT_NEAR(found.disk.y, facet.disk.y, 1e-4f);
    EXPECT_NEAR(found.cosine, facet.cosine, 1e-4f);
    EXPECT_NEAR(found.towards, facet.towards, 1e-4f);
  }
}

TEST(HalfVector, JacobianIsThatOfMovingThePointOfTheDisk) {
  Random random(2);
  constexpr float kStep = 1e-3f;
  for (int k = 0; k < 200; ++k) {
    const Vec3 wo = random.above(0.2);
    const Vec2 at = {0.8f * random.unit() - 0.4f, 0.8f * random.unit() - 0.4f};
    const auto wi = [&](float dx, float dy) { return reflected(wo, halfVectorAt({at.x + dx, at.y + dy}, wo)); };
    const Vec3 u = (0.5f / kStep) * (wi(kStep, 0) - wi(-kStep, 0)), v = (0.5f / kStep) * (wi(0, kStep) - wi(0, -kStep));
    const double solid_angle = std::sqrt(double{dot(u, u)} * dot(v, v) - double{dot(u, v)} * dot(u, v));
    const HalfVector h = halfVectorAt(at, wo);
    if (h.towards < 0.1f) continue;
    EXPECT_NEAR(projectedToIncident(1, h) * solid_angle, 1, 5e-3);
    EXPECT_NEAR(incidentToProjected(projectedToIncident(0.7f, h), h), 0.7f, 1e-5f);
  }
}

TEST(MicrofacetBrdf, WithAllFacetsLevelIsTheBeckmannBrdfAtNormalIncidence) {
  // f = D F G2 / (4 cos cos) with D = 1 / (pi alpha^2) towards the normal.
  const float alpha2 = 0.04f;
  const BeckmannNdf ndf({{0, 0}, {alpha2 / 2, 0, alpha2 / 2}});
  const Rgb f = brdfOf(ndf, {{0, 0}, {alpha2 / 2, 0, alpha2 / 2}}, kGold).evaluate({0, 0, 1}, {0, 0, 1});
  EXPECT_NEAR(f.r, fresnelConductor(1, 0.18f, 3.42f) / (4 * kPi * alpha2), 1e-4);
  EXPECT_NEAR(f.b, fresnelConductor(1, 1.37f, 1.77f) / (4 * kPi * alpha2), 1e-4);
}

TEST(MicrofacetBrdf, IsReciprocal) {
  constexpr float kRounding = 1e-4f;  // D is steep: the half vector's rounding counts several times
  Random random(3);
  for (const MapSlopes& slopes : kAll) {
    const BeckmannNdf ndf(slopes);
    const auto brdf = brdfOf(ndf, slopes, kGold);
    int lit = 0;
    for (int k = 0; k < 1000; ++k) {
      const Vec3 wi = random.above(), wo = random.above();
      const Rgb there = brdf.evaluate(wi, wo), back = brdf.evaluate(wo, wi);
      EXPECT_NEAR(there.r, back.r, kRounding * there.r + 1e-7f);
      EXPECT_NEAR(there.b, back.b, kRounding * there.b + 1e-7f);
      lit += there.r > 1e-3f;
    }
    EXPECT_GT(lit, 100);
  }
}

template <class Brdf>
double albedo(const Brdf& brdf, Vec3 wo, int n = 300) {
  return test::integrateHemisphere(n, [&](Vec3 wi) { return double{brdf.evaluate(wi, wo).r} * wi.z; });
}

TEST(MicrofacetBrdf, WhiteFacetsReflectAtMostEverything) {
  for (const MapSlopes& slopes : {kIsotropic, kBrushed}) {
    const BeckmannNdf ndf(slopes);
    for (const Vec3& wo : kViews) {
      const double reflected = albedo(brdfOf(ndf, slopes), wo);
      EXPECT_LT(reflected, 1 + kQuadratureError) << wo.z;
      EXPECT_GT(reflected, 0.75) << wo.z;  // the rest would bounce between facets
    }
  }
}

TEST(MicrofacetBrdf, SamplesAverageToTheIntegral) {
  constexpr int kSamples = 200000;
  Random random(4);
  for (const MapSlopes& slopes : kAll) {
    const BeckmannNdf ndf(slopes);
    for (const Vec3& wo : kViews) {
      const auto brdf = brdfOf(ndf, slopes);
      double sum = 0, squares = 0;
      for (int k = 0; k < kSamples; ++k) {
        const double w = brdf.sample(wo, random.pair()).weight.r;
        sum += w, squares += w * w;
      }
      const double mean = sum / kSamples, deviation = std::sqrt((squares / kSamples - mean * mean) / kSamples);
      EXPECT_NEAR(mean, albedo(brdf, wo), 4 * deviation + kQuadratureError) << wo.z;
    }
  }
}

TEST(MicrofacetBrdf, SamplesGiveTheirOwnPdfAndWeight) {
  constexpr float kRounding = 2e-3f;  // of the half vector found again from wi, near the horizon
  Random random(5);
  for (const MapSlopes& slopes : kAll) {
    const BeckmannNdf ndf(slopes);
    const auto brdf = brdfOf(ndf, slopes, kGold);
    int drawn = 0;
    for (int k = 0; k < 5000; ++k) {
      const Vec3 wo = random.above();
      const BrdfSample s = brdf.sample(wo, random.pair());
      if (s.pdf == 0) {
        EXPECT_EQ(s.weight, Rgb{});
        continue;
      }
      ++drawn;
      ASSERT_TRUE(aboveHorizon(s.wi));
      EXPECT_NEAR(brdf.pdf(s.wi, wo), s.pdf, kRounding * s.pdf);
      const Rgb expected = (s.wi.z / s.pdf) * brdf.evaluate(s.wi, wo);
      EXPECT_NEAR(s.weight.g, expected.g, kRounding * expected.g + kTiny);
    }
    EXPECT_GT(drawn, 3000);
  }
}

/// Draws directions and compares their counts in 12 x 24 cells of the hemisphere, and those that are no directions, with the
/// pdf.
template <class Brdf>
double directionFit(const Brdf& brdf, Vec3 wo, int samples, int subdivision, unsigned seed) {
  constexpr int kRows = 12, kColumns = 24;
  std::vector<double> counts(kRows * kColumns + 1), expected(kRows * kColumns + 1);
  Random random(seed);
  for (int k = 0; k < samples; ++k) {
    const BrdfSample s = brdf.sample(wo, random.pair());
    double phi = std::atan2(s.wi.y, s.wi.x) / (2 * std::numbers::pi);
    if (phi < 0) phi += 1;
    const int row = std::min(static_cast<int>(s.wi.z * kRows), kRows - 1),
              column = std::min(static_cast<int>(phi * kColumns), kColumns - 1);
    ++counts[s.pdf > 0 ? static_cast<std::size_t>(row * kColumns + column) : kRows * kColumns];
  }
  double rest = samples;
  for (int i = 0; i < kRows; ++i) {
    for (int j = 0; j < kColumns; ++j) {
      double& cell = expected[static_cast<std::size_t>(i * kColumns + j)];
      cell = samples * test::integrateCells(double(i) / kRows, double(i + 1) / kRows, 2 * std::numbers::pi * j / kColumns,
                                            2 * std::numbers::pi * (j + 1) / kColumns, subdivision, subdivision,
                                            [&](Vec3 wi) { return brdf.pdf(wi, wo); });
      rest -= cell;
    }
  }
  EXPECT_GT(rest, -2e-3 * samples);  // the pdf integrates to at most 1
  expected.back() = std::max(rest, 0.0);
  return test::goodnessOfFit(counts, expected);
}

TEST(MicrofacetBrdf, DirectionsFollowThePdf) {
  constexpr double kSignificance = 1e-4;  // for a fixed seed; without the factor h.z most are below 1e-10
  int case_number = 0;
  for (const MapSlopes& slopes : kAll) {
    const BeckmannNdf ndf(slopes);
    for (const Vec3& wo : kViews) {
      const double p = directionFit(brdfOf(ndf, slopes), wo, 50000, 24, 6);
      RecordProperty("p_" + std::to_string(case_number++), std::to_string(p));
      EXPECT_GT(p, kSignificance) << wo.z;
    }
  }
}

TEST(MicrofacetBrdf, WeightsAreBounded) {
  Random random(7);
  constexpr MapSlopes kRough = {{0, 0}, {0.8f, 0, 0.8f}};  // a footprint rougher than its map: flakes on a smooth one
  float largest = 0, largest_alone = 0;
  for (const auto& [footprint, slopes] :
       {std::pair{kIsotropic, kIsotropic}, {kBrushed, kBrushed}, {kLeaning, kLeaning}, {kRough, kIsotropic}}) {
    const BeckmannNdf ndf(footprint);
    const SmithMasking masking(slopes, 0);
    const auto brdf = brdfOf(ndf, slopes);
    for (int k = 0; k < 200000; ++k) {
      const Vec3 wo = random.above(k % 2 == 0 ? 0.05 : 1e-4);
      const Vec3 view = k % 4 == 1 ? direction(1e-5 + 1e-3 * random.unit(), 6.283 * random.unit()) : wo;  // and grazing ones
      const BrdfSample s = brdf.sample(view, random.pair());
      if (s.pdf == 0) continue;
      const float share = brdf.uniformShare(view), area = masking.projectedArea(view);
      const HalfVector h = halfVectorOf(s.wi, view);
      const float density = ndf.density({}, h.disk);
      const float bound =
          std::min(2 / ((1 - share) * area * view.z), share > 0 ? kPi * density / (2 * share * area) : kInfinity);
      ASSERT_LE(s.weight.r, bound * 1.001f + kTiny) << view.z << ' ' << s.wi.z;
      largest = std::max(largest, s.weight.r);
      if (density > 0.01f) largest_alone = std::max(largest_alone, s.weight.r * s.pdf / projectedToIncident(density, h));
    }
    EXPECT_LE(brdf.sample({0, 0, 1}, {0.3f, 0.4f}).weight.r, 2);
  }
  RecordProperty("largest_weight", std::to_string(largest));
  RecordProperty("largest_weight_from_the_density_alone", std::to_string(largest_alone));
  EXPECT_LT(largest, 0.6f * largest_alone);  // what the even share is for
}

/// Models of one rough map, and what a BRDF of it needs.
class MapModels {
 public:
  MapModels() : map_(96, 96, test::roughSurface(96, 96, 0.3f)) {
    bake::PyramidOptions options;
    options.stride = 12;
    options.resolution = 128;
    options.sigma_r = 0.03f;
    pyramid_ = bake::buildPyramid(map_.map(), options);
    compressed_ = bake::compressPyramid(pyramid_.view(), {});
  }
  /// Calls visitor(model, name).
  template <class Visitor>
  void forEach(Visitor&& visitor) const {
    visitor(Reference(map_.map(), 0.03f, Surface::flat, Boundary::wrap, Reference::Search::pruned), "Reference");
    visitor(PyramidNdf(pyramid_.view()), "PyramidNdf");
    visitor(CpNdf(compressed_.view()), "CpNdf");
  }
  SmithMasking masking() const { return SmithMasking(pyramid_.shape.slopes, pyramid_.shape.sigma_r); }

 private:
  test::OwnedMap map_;
  bake::NdfPyramidData pyramid_;
  bake::NdfCpData compressed_;
};

const MapModels& mapModels() {
  static const MapModels models;
  return models;
}

Footprint randomFootprint(Random& random) { return Footprint::isotropic(random.pair(), 5.5f + 2 * random.unit()); }

TEST(MicrofacetBrdf, WhiteFurnaceOfProjectedNormalsIsOne) {
  // D h.z over the hemisphere: facets cover the surface once.
  constexpr double kFurnaceError = 2e-3;
  const auto furnace = [](const auto& model, const Footprint& p, int n) {
    return test::integrateDisk(n, [&](Vec2 h) { return model.density(p, h); });  // dhx dhy = h.z dw
  };
  for (const MapSlopes& slopes : kAll) EXPECT_NEAR(furnace(BeckmannNdf(slopes), {}, 300), 1, kFurnaceError);
  mapModels().forEach([&](const auto& model, const char* name) {
    Random random(8);
    // Images are constant over pixels, 128 across: they take a finer lattice than the texels' smooth lobes.
    const int points = std::string(name) == "Reference" ? 60 : 160;
    for (int k = 0; k < 2; ++k) EXPECT_NEAR(furnace(model, randomFootprint(random), points), 1, kFurnaceError) << name;
  });
}

TEST(MicrofacetBrdf, OfAFootprintReflectsAtMostWhatItsFacetsShow) {
  // The documented bound: A_D / A, which a footprint that leans towards the viewer may take beyond 1.
  const SmithMasking masking = mapModels().masking();
  mapModels().forEach([&](const auto& model, const char* name) {
    Random random(9);
    const Footprint p = randomFootprint(random);
    for (const double z : {0.9, 0.3}) {
      const Vec3 wo = direction(z, 1);
      const MicrofacetBrdf brdf(model, p, masking, Fresnel::mirror());
      const double reflected_share = test::integrateDisk(60, [&](Vec2 disk) {
        const HalfVector h = halfVectorAt(disk, wo);
        if (!(h.towards > 0)) return 0.0;
        const Vec3 wi = reflected(wo, h);
        return brdf.evaluate(wi, wo).r * double{wi.z} / projectedToIncident(1, h);
      });
      const double facing = test::integrateDisk(60, [&](Vec2 disk) {
        const HalfVector h = halfVectorAt(disk, wo);
        return model.density(p, disk) * std::max(0.0f, h.towards / h.cosine);
      });
      EXPECT_LT(reflected_share, facing / masking.projectedArea(wo) * 1.01) << name;
      EXPECT_GT(reflected_share, 0.6 * facing / masking.projectedArea(wo)) << name;
    }
  });
}

TEST(MicrofacetBrdf, OfAMapIsReciprocal) {
  // The half vector is the same but for its last digits; at the border of a pixel these change D.
  const SmithMasking masking = mapModels().masking();
  mapModels().forEach([&](const auto& model, const char* name) {
    Random random(10);
    int same = 0, lit = 0;
    for (int k = 0; k < 500; ++k) {
      const MicrofacetBrdf brdf(model, randomFootprint(random), masking, kGold);
      const Vec3 wo = random.above(), wi = reflected(wo, halfVectorAt({0.4f * random.unit() - 0.2f, 0.2f * random.unit()}, wo));
      const float there = brdf.evaluate(wi, wo).r, back = brdf.evaluate(wo, wi).r;
      if (!(there > 0)) continue;
      ++lit;
      same += std::abs(there - back) <= 1e-3f * there;
    }
    EXPECT_GT(lit, 200) << name;
    EXPECT_GE(same, lit - 3) << name;
  });
}

TEST(MicrofacetBrdf, OfAMapSamplesAverageToTheIntegral) {
  constexpr int kSamples = 20000;
  const SmithMasking masking = mapModels().masking();
  mapModels().forEach([&](const auto& model, const char* name) {
    Random random(11);
    const Footprint p = randomFootprint(random);
    const MicrofacetBrdf brdf(model, p, masking, Fresnel::mirror());
    for (const Vec3& wo : {direction(0.9, 1), direction(0.3, 4)}) {
      double sum = 0, squares = 0;
      int found = 0, drawn = 0;
      for (int k = 0; k < kSamples; ++k) {
        const BrdfSample s = brdf.sample(wo, random.pair());
        sum += s.weight.r, squares += double{s.weight.r} * s.weight.r;
        if (k % 10 != 0 || s.pdf == 0) continue;
        ++drawn;  // at the border of a pixel the half vector of wi may fall on the other side
        found += std::abs(brdf.pdf(s.wi, wo) - s.pdf) <= 2e-3f * s.pdf;
      }
      EXPECT_GE(found, drawn - drawn / 100) << name;
      const double mean = sum / kSamples, deviation = std::sqrt((squares / kSamples - mean * mean) / kSamples);
      const double exact = test::integrateDisk(std::string(name) == "Reference" ? 60 : 160, [&](Vec2 disk) {
        const HalfVector h = halfVectorAt(disk, wo);
        const Vec3 wi = reflected(wo, h);
        return h.towards > 0 ? brdf.evaluate(wi, wo).r * double{wi.z} / projectedToIncident(1, h) : 0.0;
      });
      EXPECT_NEAR(mean, exact, 4 * deviation + 2 * kQuadratureError) << name << ' ' << wo.z;
    }
  });
}

TEST(MicrofacetBrdf, OfAMapDirectionsFollowThePdf) {
  // Of Reference, whose pdf is smooth enough to be integrated over cells with few points.
  mapModels().forEach([](const auto& model, const char* name) {
    if (std::string(name) != "Reference") return;
    Random random(12);
    const MicrofacetBrdf brdf(model, randomFootprint(random), mapModels().masking(), Fresnel::mirror());
    const double p = directionFit(brdf, direction(0.7, 2), 20000, 8, 13);
    RecordProperty("p", std::to_string(p));
    EXPECT_GT(p, 1e-4);
  });
}

/// What spills over the rim of the disk: everything is drawn outside.
struct Spilled {
  float density(const Footprint&, Vec2) const { return 1; }
  float mean(const Footprint&, const Box2&) const { return 1; }
  HalfVectorSample sample(const Footprint&, Vec2 xi) const { return {{0.8f + 0.1f * xi.x, 0.9f}, 1}; }
};

TEST(MicrofacetBrdf, HalfVectorsOutsideTheDiskAreNoSamples) {
  const Spilled ndf;
  const MicrofacetBrdf brdf(ndf, Footprint{}, SmithMasking(kIsotropic, 0), Fresnel::mirror());
  for (float x = 0.2f; x < 1; x += 0.1f) {  // beyond the even share
    const BrdfSample s = brdf.sample(direction(0.7, 1), {x, 0.5f});
    EXPECT_EQ(s.pdf, 0);
    EXPECT_EQ(s.weight, Rgb{});
  }
}

template <class Brdf>
void expectDefinedAnswers(const Brdf& brdf) {
  const Vec3 good = direction(0.7, 1);
  for (const Vec3& bad : {Vec3{0, 0, -1}, Vec3{1, 0, 0}, Vec3{0.6f, 0, -0.8f}, Vec3{}, Vec3{kNan, 0, 1}, Vec3{0, 0, kNan},
                          Vec3{kInfinity, 0, 1}, Vec3{0, 0, kInfinity}, Vec3{3, 4, 5}, Vec3{1e30f, 1e30f, 1e30f}}) {
    EXPECT_EQ(brdf.evaluate(bad, good), Rgb{});
    EXPECT_EQ(brdf.evaluate(good, bad), Rgb{});
    EXPECT_EQ(brdf.pdf(bad, good), 0);
    EXPECT_EQ(brdf.pdf(good, bad), 0);
  }
  for (const float z : {1e-5f, 1e-3f, 0.5f, 1.0f}) {
    for (const double phi : {1.0, 1.0 + std::numbers::pi, 2.0}) {
      const Vec3 w = direction(z, 1), other = direction(1e-5, phi);
      const Rgb f = brdf.evaluate(w, other);
      EXPECT_TRUE(std::isfinite(f.r) && f.r >= 0 && std::isfinite(brdf.pdf(w, other)) && brdf.pdf(w, other) >= 0);
    }
  }
}

template <class Brdf>
void expectDefinedSamples(const Brdf& brdf) {
  for (const Vec3& bad : {Vec3{0, 0, -1}, Vec3{}, Vec3{kNan, 0, 1}, Vec3{kInfinity, 0, 1}})
    EXPECT_EQ(brdf.sample(bad, {0.5f, 0.5f}).pdf, 0);
  for (const float z : {1e-5f, 0.1f, 1.0f}) {
    for (const float x : {0.0f, 0.1f, 0.5f, 0x1.fffffep-1f}) {
      const BrdfSample s = brdf.sample(direction(z, 1), {x, 0x1.fffffep-1f});
      EXPECT_TRUE(std::isfinite(s.pdf) && s.pdf >= 0 && std::isfinite(s.weight.r) && s.weight.r >= 0);
    }
  }
}

TEST(MicrofacetBrdf, BadInputHasDocumentedAnswers) {
  const BeckmannNdf ndf(kBrushed);
  expectDefinedAnswers(brdfOf(ndf, kBrushed, kGold));
  expectDefinedSamples(brdfOf(ndf, kBrushed, kGold));
  mapModels().forEach([](const auto& model, const char*) {
    const SmithMasking masking = mapModels().masking();
    for (const Footprint& p : {Footprint::isotropic({0.3f, 0.7f}, 0), Footprint::isotropic({0.3f, 0.7f}, 1e18f),
                               Footprint::isotropic({0.3f, 0.7f}, kNan), Footprint::isotropic({1e9f, -1e9f}, 10),
                               Footprint::isotropic({kNan, kInfinity}, 10), Footprint::box({0.5f, 0.5f}, {0, 0}, {kNan, 1})})
      expectDefinedAnswers(MicrofacetBrdf(model, p, masking, kGold));
  });
}

}  // namespace
}  // namespace glint::microfacet_brdf_test
