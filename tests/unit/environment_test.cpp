#include "glint/query/light/environment.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "glint/bake/compressed/compress.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/pyramid_ndf.h"
#include "support/beckmann_ndf.h"
#include "support/directions.h"
#include "support/test_maps.h"

namespace glint::environment_test {
namespace {

using test::BeckmannNdf;
using test::direction;
using test::Random;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr MapSlopes kSlopes = {{0, 0}, {0.05f, 0.01f, 0.03f}};

TEST(SphericalGaussian, CompactSupportIsWhereItFallsToEpsilon) {
  for (const float sharpness : {3.0f, 30.0f, 300.0f}) {
    for (const float amplitude : {0.5f, 1.0f, 5.0f}) {
      const SphericalGaussian g = {{0, 0, 1}, sharpness, Rgb::grey(amplitude)};
      const float angle = compactSupport(amplitude, sharpness);
      EXPECT_NEAR(amplitude * valueOf(g, direction(std::cos(angle), 2)), 0.3f, 1e-3f);
    }
  }
  EXPECT_EQ(compactSupport(0.2f, 10), 0);                  // never so bright
  EXPECT_NEAR(compactSupport(1, 0.1f), kPi, 1e-6f);        // everywhere brighter
  EXPECT_NEAR(supportSide(0.25f * kPi) * 128, 64, 1e-4f);  // Eq. 9 halved: Q / 2 = 256 theta / pi pixels
  for (const float a : {0.0f, -1.0f, kNan, kInfinity}) EXPECT_TRUE(compactSupport(a, 10) >= 0 && compactSupport(a, 10) < 3.2f);
}

TEST(SphericalGaussian, IntegralIsThatOverTheSphere) {
  for (const float sharpness : {1.0f, 10.0f, 100.0f}) {
    const SphericalGaussian g = {direction(0.3, 1), sharpness, {}};
    const double sum = test::integrateCells(-1, 1, 0, 2 * std::numbers::pi, 600, 600, [&](Vec3 w) { return valueOf(g, w); });
    EXPECT_NEAR(integralOf(g), sum, 1e-3 * sum);
  }
}

TEST(SphericalGaussian, UnrollsToANormalDistribution) {
  Random random(1);
  for (const Vec3& axis : {Vec3{0, 0, 1}, Vec3{0, 0, -1}, direction(0.3, 2), direction(-0.7, 5)}) {
    const SphericalGaussian g = {axis, 7, {}};
    const Tangents frame = tangentsOf(axis);
    EXPECT_NEAR(dot(frame.s, frame.t), 0, 1e-6f);
    EXPECT_NEAR(dot(frame.s, axis), 0, 1e-6f);
    for (int k = 0; k < 100; ++k) {
      const Vec2 p = {2 * random.unit() - 1, 2 * random.unit() - 1};
      const Vec3 w = directionAt(g, frame, p);
      EXPECT_NEAR(dot(w, w), 1, 1e-5f);
      EXPECT_NEAR(valueOf(g, w), std::exp(-0.5f * 7 * dot(p, p)), 1e-5f);
    }
  }
}

TEST(SphericalGaussian, SamplesFollowIt) {
  constexpr int kSamples = 200000;
  Random random(2);
  for (const float sharpness : {0.5f, 20.0f, 5000.0f}) {
    const SphericalGaussian g = {direction(0.6, 4), sharpness, {}};
    // v = exp(lambda (w . axis - 1)) is uniform in [exp(-2 lambda), 1]; twenty bins of it.
    std::vector<double> counts(20), expected(20, kSamples / 20.0);
    Vec3 mean;
    const double lowest = std::exp(-2.0 * sharpness);
    for (int k = 0; k < kSamples; ++k) {
      const Vec3 w = sampleDirection(g, random.pair());
      const double v = (std::exp(double{sharpness} * (dot(w, g.axis) - 1.0)) - lowest) / (1 - lowest);
      ++counts[static_cast<std::size_t>(std::clamp(v, 0.0, 0.9999) * 20)];
      mean = mean + (1.0f / kSamples) * w;
    }
    EXPECT_GT(test::goodnessOfFit(counts, expected), 1e-4) << sharpness;
    const double length = 1 / std::tanh(sharpness) - 1 / sharpness;  // of the mean direction
    EXPECT_NEAR(dot(mean, g.axis), length, 0.01);
    EXPECT_NEAR(dot(mean, mean), length * length, 0.02);
  }
}

TEST(Environment, CellsHaveTheVarianceOfTheLobe) {
  for (int cells = 1; cells <= kMostLobeCells; ++cells) {
    const double extent = lobeExtent(cells), step = 2 * extent / cells;
    double mass = 0, moment = 0;
    for (int k = 0; k < cells; ++k) {
      const double low = -extent + k * step, middle = low + 0.5 * step;
      const double share = gaussianMass(static_cast<float>(low), static_cast<float>(low + step), 0, 1);
      mass += share, moment += share * (middle * middle + step * step / 12);
    }
    EXPECT_NEAR(moment / mass, 1, 2e-3) << cells;
  }
}

/// Converged: f cos L over the lobe by 300 x 300 points evenly spread on its plane out to 5 deviations.
template <class Brdf>
double convergedRadiance(const Brdf& brdf, Vec3 wo, const SphericalGaussian& light, int points = 300) {
  const Tangents frame = tangentsOf(light.axis);
  const float reach = std::min(5 / std::sqrt(light.sharpness), 2.0f), step = 2 * reach / static_cast<float>(points);
  double sum = 0;
  for (int j = 0; j < points; ++j) {
    for (int i = 0; i < points; ++i) {
      const Vec2 p = {-reach + step * (static_cast<float>(i) + 0.5f), -reach + step * (static_cast<float>(j) + 0.5f)};
      if (dot(p, p) >= 4) continue;
      const Vec3 wi = directionAt(light, frame, p);
      sum += double{brdf.evaluate(wi, wo).r} * std::max(0.0f, wi.z) * valueOf(light, wi);
    }
  }
  return light.amplitude.r * sum * step * step;
}

/// Relative error of an approximation over random views and lights: the norm of the difference over that of the truth.
struct ErrorNorm {
  double difference = 0, truth = 0;
  void add(double value, double exact) { difference += (value - exact) * (value - exact), truth += exact * exact; }
  double relative() const { return std::sqrt(difference / truth); }
};

struct RoughMap {
  RoughMap() : map(128, 128, test::roughSurface(128, 128, 0.25f)) {
    bake::PyramidOptions options;
    options.stride = 16;
    options.resolution = 128;
    options.sigma_r = 0.02f;
    pyramid = bake::buildPyramid(map.map(), options);
    bake::CompressionOptions compression;
    compression.tolerance = 0.05;
    compressed = bake::compressPyramid(pyramid.view(), compression);
  }
  SmithMasking masking() const { return SmithMasking(pyramid.shape.slopes, pyramid.shape.sigma_r); }
  test::OwnedMap map;
  bake::NdfPyramidData pyramid;
  bake::NdfCpData compressed;
};

const RoughMap& roughMap() {
  static const RoughMap map;
  return map;
}

/// Mean errors of prefiltering for one sharpness: the paper's range, and 1, 3 and 5 cells along each axis.
template <class Model>
std::array<double, 4> prefilterErrors(const Model& model, float sharpness, int queries) {
  std::array<ErrorNorm, 4> errors;
  Random random(3);
  for (int k = 0; k < queries; ++k) {
    const Footprint p = Footprint::isotropic(random.pair(), 7 + 10 * random.unit());
    const MicrofacetBrdf brdf(model, p, roughMap().masking(), Fresnel::dielectric(1.5f));
    const Vec3 wo = random.above(0.3);
    // Lights that the footprint reflects: around the mirror direction of a facet of common tilt.
    const Vec3 axis = reflected(wo, halfVectorAt({0.3f * random.unit() - 0.15f, 0.3f * random.unit() - 0.15f}, wo));
    if (axis.z < 0.1f) continue;
    const SphericalGaussian light = {axis, sharpness, Rgb::grey(1)};
    const double exact = convergedRadiance(brdf, wo, light);
    errors[0].add(prefilteredRadiance(brdf, wo, light, 1, LobeRange::support).r, exact);
    errors[1].add(prefilteredRadiance(brdf, wo, light, 1).r, exact);
    errors[2].add(prefilteredRadiance(brdf, wo, light, 3).r, exact);
    errors[3].add(prefilteredRadiance(brdf, wo, light, 5).r, exact);
  }
  return {errors[0].relative(), errors[1].relative(), errors[2].relative(), errors[3].relative()};
}

TEST(Environment, PrefilteredRadianceIsNearTheConvergedIntegral) {
  // Bounds are those that were measured, and some room: relative error over 12 views and lights of one rough map.
  struct Case {
    float sharpness;
    double support, one, three, five;
  };
  const PyramidNdf model(roughMap().pyramid.view());
  for (const Case& c : {Case{10, 2.0, 0.35, 0.2, 0.15},
                        {30, 0.8, 0.2, 0.1, 0.06},
                        {100, 0.25, 0.08, 0.02, 0.01},
                        {1000, 0.05, 0.03, 0.01, 0.01}}) {
    const auto e = prefilterErrors(model, c.sharpness, 12);
    RecordProperty("sharpness_" + std::to_string(static_cast<int>(c.sharpness)),
                   "support " + std::to_string(e[0]) + " one " + std::to_string(e[1]) + " three " + std::to_string(e[2]) +
                       " five " + std::to_string(e[3]));
    EXPECT_LT(e[0], c.support) << c.sharpness;
    EXPECT_LT(e[1], c.one) << c.sharpness;
    EXPECT_LT(e[2], c.three) << c.sharpness;
    EXPECT_LT(e[3], c.five) << c.sharpness;
    EXPECT_LT(e[2], e[1]);
    EXPECT_LT(e[1], e[0]);  // the paper's square is narrower than the lobe
  }
}

TEST(PrefilteredRadiance, ErrsMoreOnNdfsOfFewFacets) {
  const test::OwnedMap map(256, 256, test::synthesised(bake::SynthKind::flakes, 256, 256, 0.2f));
  bake::PyramidOptions options;
  options.levels = 2;
  const bake::NdfPyramidData pyramid = bake::buildPyramid(map.map(), options);
  const PyramidNdf model(pyramid.view());
  Random random(4);
  for (const float sharpness : {100.0f, 1000.0f}) {
    ErrorNorm few, most;
    for (int k = 0; k < 24; ++k) {
      const MicrofacetBrdf brdf(model, Footprint::isotropic(random.pair(), 20 + 20 * random.unit()),
                                SmithMasking(pyramid.shape.slopes, pyramid.shape.sigma_r), Fresnel::mirror());
      const Vec3 wo = random.above(0.3);
      const Vec3 axis = reflected(wo, halfVectorAt({0.3f * random.unit() - 0.15f, 0.3f * random.unit() - 0.15f}, wo));
      if (axis.z < 0.1f) continue;
      const SphericalGaussian light = {axis, sharpness, Rgb::grey(1)};
      const double exact = convergedRadiance(brdf, wo, light);
      few.add(prefilteredRadiance(brdf, wo, light).r, exact);
      most.add(prefilteredRadiance(brdf, wo, light, kMostLobeCells).r, exact);
    }
    std::printf("flakes, sharpness %g: error %.3f with %d cells, %.3f with %d\n", double{sharpness}, few.relative(), kLobeCells,
                most.relative(), kMostLobeCells);
    EXPECT_LT(few.relative(), 0.1);
    EXPECT_GT(few.relative(), 0.04);  // or the default cells would serve such maps, too
    EXPECT_LT(most.relative(), 0.025);
  }
}

TEST(Environment, CompressedModelsAreAsNear) {
  const CpNdf model(roughMap().compressed.view());
  EXPECT_LT(prefilterErrors(model, 100, 6)[2], 0.03);
}

TEST(Environment, PrefilteringIsLinearInTheLights) {
  const BeckmannNdf ndf(kSlopes);
  const MicrofacetBrdf brdf(ndf, Footprint{}, SmithMasking(kSlopes, 0), Fresnel::conductor({0.2f, 0.4f, 1.4f}, {3, 2, 1}));
  const SphericalGaussian lights[] = {{direction(0.9, 1), 30, {1, 2, 3}}, {direction(0.5, 4), 200, {4, 0.5f, 1}}};
  const Vec3 wo = direction(0.7, 2);
  const Rgb both = prefilteredRadiance(brdf, wo, SphericalGaussians{lights, 2});
  const Rgb apart = prefilteredRadiance(brdf, wo, lights[0]) + prefilteredRadiance(brdf, wo, lights[1]);
  EXPECT_NEAR(both.r, apart.r, 1e-6f * apart.r);
  EXPECT_NEAR(both.b, apart.b, 1e-6f * apart.b);
  SphericalGaussian brighter = lights[0];
  brighter.amplitude = 1000 * brighter.amplitude;
  EXPECT_NEAR(prefilteredRadiance(brdf, wo, brighter).g, 1000 * prefilteredRadiance(brdf, wo, lights[0]).g,
              1e-2f * prefilteredRadiance(brdf, wo, lights[0]).g);
}

/// What prefilteredRadiance says of itself.
TEST(PrefilteredRadiance, ErrsByTheWidthOfTheLobeAndTheView) {
  const BeckmannNdf ndf(kSlopes);
  const MicrofacetBrdf brdf(ndf, Footprint{}, SmithMasking(kSlopes, 0), Fresnel::mirror());
  for (const float sharpness : {1.0f, 3.0f, 10.0f, 30.0f, 100.0f}) {
    for (const double angle : {0.3, 1.2, 1.4}) {
      const Vec3 wo = direction(std::cos(angle), 1);
      const SphericalGaussian light = {direction(0.7, 4), sharpness, {1, 1, 1}};
      const double exact = convergedRadiance(brdf, wo, light);
      const double few = prefilteredRadiance(brdf, wo, light).r / exact,
                   most = prefilteredRadiance(brdf, wo, light, 8).r / exact;
      std::printf("sharpness %g, view at %g rad: %.3f of the radiance with %d cells, %.3f with 8\n", double{sharpness}, angle,
                  few, kLobeCells, most);
      EXPECT_NEAR(few, 1, sharpness >= 30 ? 0.025 : sharpness >= 3 ? 0.07 : 0.5);
      EXPECT_NEAR(most, 1, sharpness >= 30 ? 0.01 : sharpness >= 3 ? 0.035 : 0.2);
    }
  }
}

constexpr int kLights = 5;

/// Wide and narrow lobes, one below the horizon.
struct Lights {
  SphericalGaussian lobes[kLights] = {{direction(0.8, 0.5), 20, {1, 1, 1}},
                                      {direction(0.4, 3), 200, {5, 4, 3}},
                                      {direction(0.05, 4), 50, {2, 2, 2}},
                                      {direction(-0.6, 1), 8, {1, 2, 1}},
                                      {direction(0.7, 2.2), 2000, {30, 30, 40}}};
  SphericalGaussians view() const { return {lobes, kLights}; }
};

TEST(LightSampler, AveragesToTheIntegralWithLittleSpread) {
  constexpr int kSamples = 100000;
  Random random(5);
  const Lights lights;
  float shares[kLights];
  const BeckmannNdf ndf(kSlopes);
  const MicrofacetBrdf brdf(ndf, Footprint{}, SmithMasking(kSlopes, 0), Fresnel::mirror());
  for (const Vec3& wo : {Vec3{0, 0, 1}, direction(0.6, 5.3), direction(0.2, 1)}) {
    const LightSampler sampler(brdf, wo, lights.view(), shares);
    double sum = 0, squares = 0, exact = 0;
    for (int k = 0; k < kSamples; ++k) {
      const LightSample s = sampler.sample(random.pair());
      ASSERT_GT(s.pdf, 0);
      if (k % 20 == 0) {  // the estimate's parts are those that can be asked for
        EXPECT_NEAR(s.pdf, sampler.pdf(s.wi), 1e-4f * s.pdf);
        EXPECT_EQ(s.radiance, radianceAlong(lights.view(), s.wi));
      }
      const double value = double{brdf.evaluate(s.wi, wo).g} * std::max(0.0f, s.wi.z) * s.radiance.g / s.pdf;
      sum += value, squares += value * value;
    }
    for (const SphericalGaussian& light : lights.lobes) {
      SphericalGaussian grey = light;
      grey.amplitude.r = light.amplitude.g;
      exact += convergedRadiance(brdf, wo, grey);
    }
    const double mean = sum / kSamples, variance = squares / kSamples - mean * mean;
    EXPECT_NEAR(mean, exact, 4 * std::sqrt(variance / kSamples) + 2e-3 * exact) << wo.z;
    EXPECT_LT(std::sqrt(variance), 3 * exact) << wo.z;
  }
}

TEST(LightSampler, PdfIntegratesToOneOverTheSphere) {
  const Lights lights;
  float shares[kLights];
  const BeckmannNdf ndf(kSlopes);
  const MicrofacetBrdf brdf(ndf, Footprint{}, SmithMasking(kSlopes, 0), Fresnel::mirror());
  SphericalGaussians view = lights.view();
  view.count = kLights - 1;  // without the narrowest, which a lattice of directions would not resolve
  const LightSampler sampler(brdf, direction(0.6, 5), view, shares);
  EXPECT_NEAR(test::integrateCells(-1, 1, 0, 2 * std::numbers::pi, 120, 120, [&](Vec3 w) { return sampler.pdf(w); }), 1, 2e-3);
}

TEST(Environment, BadInputHasDocumentedAnswers) {
  const BeckmannNdf ndf(kSlopes);
  const MicrofacetBrdf brdf(ndf, Footprint{}, SmithMasking(kSlopes, 0), Fresnel::mirror());
  const Vec3 wo = direction(0.6, 1);
  const SphericalGaussian useless[] = {{{0, 0, 1}, 0, {1, 1, 1}},    {{0, 0, 1}, -5, {1, 1, 1}},
                                       {{0, 0, 1}, kNan, {1, 1, 1}}, {{0, 0, 1}, kInfinity, {1, 1, 1}},
                                       {{0, 0, 0}, 10, {1, 1, 1}},   {{kNan, 0, 1}, 10, {1, 1, 1}},
                                       {{0, 0, 5}, 10, {1, 1, 1}}};
  float shares[7];
  for (const SphericalGaussian& light : useless) EXPECT_EQ(prefilteredRadiance(brdf, wo, light), Rgb{});
  EXPECT_EQ(LightSampler(brdf, wo, SphericalGaussians{useless, 7}, shares).sample({0.5f, 0.5f}).pdf, 0);
  EXPECT_EQ(LightSampler(brdf, wo, SphericalGaussians{}, nullptr).pdf(wo), 0);

  const SphericalGaussian good = {direction(0.8, 2), 40, {1, 1, 1}};
  for (const Vec3& bad : {Vec3{0, 0, -1}, Vec3{}, Vec3{kNan, 0, 1}, Vec3{kInfinity, 0, 0}})
    EXPECT_EQ(prefilteredRadiance(brdf, bad, good), Rgb{});
  for (const float sharpness : {1e-6f, 0.1f, 1e6f, 9e9f}) {
    for (const double z : {1.0, 0.01, -0.01, -1.0}) {
      const SphericalGaussian light = {direction(z, 3), sharpness, {1, 1, 1}};
      for (const int cells : {-1, 1, 3, 100}) {
        const float r = prefilteredRadiance(brdf, wo, light, cells).r;
        EXPECT_TRUE(std::isfinite(r) && r >= 0) << sharpness << ' ' << z;
      }
      const LightSample s = LightSampler(brdf, wo, SphericalGaussians{&light, 1}, shares).sample({0.999f, 0.0f});
      EXPECT_TRUE(std::isfinite(s.pdf) && s.pdf > 0 && std::isfinite(s.wi.x)) << sharpness << ' ' << z;
    }
  }
  for (const float amplitude : {0.0f, -1.0f, kNan}) {
    const SphericalGaussian dark = {direction(0.8, 2), 40, Rgb::grey(amplitude)};
    EXPECT_EQ(LightSampler(brdf, wo, SphericalGaussians{&dark, 1}, shares).sample({0.5f, 0.5f}).pdf, 0) << amplitude;
  }
}

}  // namespace
}  // namespace glint::environment_test
