// Histograms whose bins are lobes: against brute force blurred alike, and as a distribution.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "glint/bake/histogram/histogram_sat.h"
#include "glint/query/histogram_ndf.h"
#include "glint/query/reference.h"
#include "support/test_maps.h"

namespace glint::histogram_lobes_test {
namespace {

constexpr int kSide = 256;

struct Case {
  explicit Case(bake::SynthKind kind)
      : map(kSide, kSide, bake::synthNormals(options(kind))), data(bake::buildHistogramSat(map.map(), {9, 32, 8})) {}
  static bake::SynthOptions options(bake::SynthKind kind) {
    bake::SynthOptions o = bake::defaultSynthOptions(kind);
    o.width = o.height = kSide;
    return o;
  }
  HistogramNdf ndf(HistogramBins bins, float sigma_r) const {
    return HistogramNdf(data.view(), GaussianBoxes::one, 0, bins, sigma_r);
  }
  test::OwnedMap map;
  bake::HistogramSatData data;
};

/// Errors under a square light: root mean square over places and half vectors, over that of the truth; and of the sum.
struct LightErrors {
  double rms = 0, energy = 0;
};

/// Half of the half vectors are normals of the map, the others lie anywhere up to .4.
std::vector<Vec2> halfVectors(const NormalMap& map, std::mt19937& random) {
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<Vec2> halves;
  for (int k = 0; k < 16; ++k) {
    const float radius = 0.4f * std::sqrt(unit(random)), turn = 6.2831853f * unit(random);
    halves.push_back(k % 2 ? map.normals[random() % map.normals.size()]
                           : Vec2{radius * std::cos(turn), radius * std::sin(turn)});
  }
  return halves;
}

/// @param half_width  of the light, seen as a box of half vectors
LightErrors errorsUnder(const Case& c, float half_width, HistogramBins bins) {
  constexpr float kSigmaR = 0.005f;
  const Reference truth(c.map.map(), kSigmaR);
  const HistogramNdf ndf = c.ndf(bins, kSigmaR);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0, 1);
  const std::vector<Vec2> halves = halfVectors(c.map.map(), random);
  double errors = 0, squares = 0, sum = 0, expected = 0;
  for (int place = 0; place < 12; ++place) {
    const Footprint p = Footprint::box({unit(random), unit(random)}, {14, 3}, {-3, 12});
    for (const Vec2 h : halves) {
      const Vec2 half = {half_width, half_width};
      const double answer = ndf.mean(p, {h - half, h + half}), d = truth.mean(p, {h - half, h + half});
      errors += (answer - d) * (answer - d), squares += d * d;
      sum += answer, expected += d;
    }
  }
  return {std::sqrt(errors / squares), sum / expected - 1};
}

constexpr std::pair<bake::SynthKind, const char*> kMaps[] = {{bake::SynthKind::flakes, "flakes"},
                                                             {bake::SynthKind::brushed, "brushed"},
                                                             {bake::SynthKind::scratches, "scratches"},
                                                             {bake::SynthKind::isotropic, "isotropic"},
                                                             {bake::SynthKind::weave, "weave"}};

// The lights that histograms are meant for, 20 degrees wide, and ones of half that.
TEST(HistogramLobes, AnswerAsBruteForceUnderTheSameLight) {
  for (const auto& [kind, name] : kMaps) {
    const Case c(kind);
    for (const auto& [light, rms, energy] : {std::tuple{0.17f, 0.15, 0.03}, {0.087f, 0.35, 0.04}}) {
      const LightErrors lobes = errorsUnder(c, light, HistogramBins::lobes), even = errorsUnder(c, light, HistogramBins::even);
      std::printf("%s, light of half width %g: lobes rms %.3f energy %+.3f, even bins rms %.3f energy %+.3f\n", name,
                  double{light}, lobes.rms, lobes.energy, even.rms, even.energy);
      EXPECT_LT(lobes.rms, rms) << name << ' ' << light;
      EXPECT_LT(std::fabs(lobes.energy), energy) << name << ' ' << light;
      EXPECT_LT(lobes.rms, even.rms) << name << ' ' << light;
    }
  }
}

const Footprint kFootprint = Footprint::box({0.4f, 0.3f}, {9, 4}, {-3, 7});

TEST(HistogramLobes, IntegrateToOne) {
  for (const auto& [kind, name] : kMaps) {
    const Case c(kind);
    EXPECT_NEAR(4 * c.ndf(HistogramBins::lobes, 0.02f).mean(kFootprint, {{-1, -1}, {1, 1}}), 1, 1e-3) << name;
  }
}

TEST(HistogramLobes, BinsKeepTheMassOfTheirCounts) {
  // Two directions, far apart: three texels of four in the first bin.
  std::vector<Vec2> normals;
  for (int k = 0; k < 64 * 64; ++k) normals.push_back(k % 4 == 0 ? Vec2{0.4f, 0.1f} : Vec2{-0.3f, 0.02f * (k % 3)});
  const test::OwnedMap map(64, 64, normals);
  const auto data = bake::buildHistogramSat(map.map(), {9, 32, 8});
  const HistogramNdf ndf(data.view(), GaussianBoxes::one, 0, HistogramBins::lobes, 0.01f);
  const Footprint p = Footprint::box({0.5f, 0.5f}, {8, 0}, {0, 8});
  EXPECT_NEAR(2 * ndf.mean(p, {{0, -1}, {1, 1}}), 0.25f, 1e-4f);
  EXPECT_NEAR(2 * ndf.mean(p, {{-1, -1}, {0, 1}}), 0.75f, 1e-4f);
  // One normal in a bin is a facet, as brute force has it, but for the shape of the lobe off the pole.
  const Reference truth(map.map(), 0.01f);
  EXPECT_NEAR(ndf.density(p, {0.4f, 0.1f}), truth.density(p, {0.4f, 0.1f}), 0.02f * truth.density(p, {0.4f, 0.1f}));
}

TEST(HistogramLobes, SteepNormalsStayOnTheirSide) {
  // Slopes of the outermost ring have a spread that no lobe of slopes can stand for.
  std::vector<Vec2> normals;
  for (int k = 0; k < 64 * 64; ++k) normals.push_back({k % 50 == 0 ? 0.99999f : 0.99027f, 0});
  const test::OwnedMap map(64, 64, normals);
  const auto data = bake::buildHistogramSat(map.map(), {9, 32, 8});
  const HistogramNdf ndf(data.view(), GaussianBoxes::one, 0, HistogramBins::lobes, 0.01f);
  EXPECT_EQ(ndf.mean(kFootprint, {{-1, -1}, {0, 1}}), 0);
  EXPECT_NEAR(2 * ndf.mean(kFootprint, {{0, -1}, {1, 1}}), 1, 1e-4f);
  const HalfVectorSample s = ndf.sample(kFootprint, {0.3f, 0.6f});
  EXPECT_GT(s.h.x, 0.9f);
  EXPECT_NEAR(s.pdf, ndf.density(kFootprint, s.h), 1e-4f * s.pdf);
}

TEST(HistogramLobes, MeanIsTheAverageOfTheDensity) {
  const Case c(bake::SynthKind::isotropic);
  const HistogramNdf ndf = c.ndf(HistogramBins::lobes, 0.02f);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  constexpr int kPoints = 40;
  constexpr double kQuadrature = 0.01;
  for (int k = 0; k < 4; ++k) {
    const Vec2 low = {0.8f * unit(random) - 0.6f, 0.8f * unit(random) - 0.6f};
    const Box2 range = {low, low + Vec2{0.05f + 0.3f * unit(random), 0.05f + 0.3f * unit(random)}};
    double sum = 0;
    for (int y = 0; y < kPoints; ++y)
      for (int x = 0; x < kPoints; ++x)
        sum += ndf.density(kFootprint, range.low + Vec2{(static_cast<float>(x) + 0.5f) / kPoints * range.width(),
                                                        (static_cast<float>(y) + 0.5f) / kPoints * range.height()});
    EXPECT_NEAR(ndf.mean(kFootprint, range), sum / (kPoints * kPoints), kQuadrature * (1 + sum / (kPoints * kPoints)));
  }
}

TEST(HistogramLobes, AreContinuousWhereBinsEnd) {
  const Case c(bake::SynthKind::isotropic);
  const HistogramNdf lobes = c.ndf(HistogramBins::lobes, 0.02f), even = c.ndf(HistogramBins::even, 0.02f);
  const SphericalBins bins(9, 32);
  const auto step = [&](const HistogramNdf& ndf, Vec2 h, Vec2 d) {
    return std::fabs(ndf.density(kFootprint, h + d) - ndf.density(kFootprint, h));
  };
  double lobe_steps = 0, even_steps = 0;
  for (int k = 0; k < 32; ++k) {
    const float turn = 6.2831853f * (static_cast<float>(k) + 0.5f) / 32, ring = std::sin(0.1745329f);
    const Vec2 out = {std::cos(turn), std::sin(turn)};
    lobe_steps += step(lobes, (ring - 1e-4f) * out, 2e-4f * out);
    even_steps += step(even, (ring - 1e-4f) * out, 2e-4f * out);
  }
  EXPECT_LT(lobe_steps, 0.02 * even_steps);
}

TEST(HistogramLobes, SamplesFollowTheDensity) {
  const Case c(bake::SynthKind::weave);
  const HistogramNdf ndf = c.ndf(HistogramBins::lobes, 0.03f);
  constexpr int kSamples = 20000, kCells = 10;
  std::vector<double> found(kCells * kCells);
  std::mt19937 random(14);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int k = 0; k < kSamples; ++k) {
    const HalfVectorSample s = ndf.sample(kFootprint, {unit(random), unit(random)});
    if (!(s.pdf > 0)) continue;
    if (k < 200) {
      ASSERT_NEAR(s.pdf, ndf.density(kFootprint, s.h), 1e-4 * s.pdf);
    }
    const int x = std::clamp(static_cast<int>((s.h.x + 1) / 2 * kCells), 0, kCells - 1),
              y = std::clamp(static_cast<int>((s.h.y + 1) / 2 * kCells), 0, kCells - 1);
    ++found[static_cast<std::size_t>(y * kCells + x)];
  }
  for (int k = 0; k < kCells * kCells; ++k) {
    const float size = 2.0f / kCells, x = -1 + static_cast<float>(k % kCells) * size,
                y = -1 + static_cast<float>(k / kCells) * size;
    const double expected = kSamples * double{ndf.mean(kFootprint, {{x, y}, {x + size, y + size}})} * size * size;
    // Five deviations of a count, and the rule of the masses.
    EXPECT_NEAR(found[static_cast<std::size_t>(k)], expected, 5 * std::sqrt(expected + 1) + 3e-3 * expected) << k;
  }
}

}  // namespace
}  // namespace glint::histogram_lobes_test
