#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <numbers>
#include <set>

#include "glint/bake/common/slopes.h"
#include "glint/bake/synth/synth.h"
#include "glint/model/error.h"

namespace glint::bake::synth_surface_test {
namespace {

constexpr SynthKind kAllKinds[] = {SynthKind::isotropic, SynthKind::brushed,    SynthKind::flakes,     SynthKind::scratches,
                                   SynthKind::leather,   SynthKind::weave,      SynthKind::sawtooth,   SynthKind::flat,
                                   SynthKind::grating,   SynthKind::flake2d,    SynthKind::twill,      SynthKind::silk,
                                   SynthKind::bumps,     SynthKind::scales,     SynthKind::structured, SynthKind::relief,
                                   SynthKind::wood,      SynthKind::anisotropic};

SynthOptions sized(SynthKind kind, int width, int height) {
  SynthOptions p = defaultSynthOptions(kind);
  p.width = width;
  p.height = height;
  return p;
}

struct Stats {
  double mean = 0;
  double variance = 0;
  double kurtosis = 0;  ///< fourth moment over squared variance; 3 for a Gaussian
};

template <class Value>
Stats slopeStats(const std::vector<Vec2>& normals, const Value& value) {
  double m[5] = {};
  for (const Vec2 n : normals) {
    const double z = std::sqrt(1 - dot(n, n));
    const double s = -value(n) / z;
    m[1] += s, m[2] += s * s, m[4] += s * s * s * s;
  }
  const auto count = static_cast<double>(normals.size());
  const double mean = m[1] / count;
  const double variance = m[2] / count - mean * mean;
  return {mean, variance, m[4] / count / (variance * variance)};
}

TEST(SynthIsotropic, HasTheSlopeVarianceOfItsBeckmannRoughness) {
  SynthOptions p = sized(SynthKind::isotropic, 512, 384);
  p.alpha = 0.3f;
  const auto normals = synthNormals(p);
  const Stats x = slopeStats(normals, [](Vec2 n) { return n.x; });
  const Stats y = slopeStats(normals, [](Vec2 n) { return n.y; });
  // Both axes together are scaled exactly; each alone scatters with the number of independent patches, about 512*384/(4 pi 8).
  constexpr double kFloatRounding = 1e-4, kAxisScatter = 0.1;
  EXPECT_NEAR(0.5 * (x.variance + y.variance), 0.045, 0.045 * kFloatRounding);
  EXPECT_NEAR(x.variance, 0.045, 0.045 * kAxisScatter);
  EXPECT_NEAR(x.mean, 0, 1e-6);
  // Standard error of the kurtosis is sqrt(24 / 1960 patches) = 0.11.
  constexpr double kKurtosisScatter = 0.4;
  EXPECT_NEAR(x.kurtosis, 3, kKurtosisScatter);
  EXPECT_NEAR(y.kurtosis, 3, kKurtosisScatter);
}

TEST(SynthBrushed, IsRoughAcrossTheStreaksOnly) {
  const auto normals = synthNormals(sized(SynthKind::brushed, 512, 512));
  const double along = slopeStats(normals, [](Vec2 n) { return n.x; }).variance;
  const double across = slopeStats(normals, [](Vec2 n) { return n.y; }).variance;
  EXPECT_NEAR(across, 0.15 * 0.15 / 2, 1e-5);
  EXPECT_LT(along, across / 100);
}

TEST(SynthFlakes, TiltsFollowTheGtrDistribution) {
  for (const float gamma : {1.0f, 2.0f, 3.5f}) {
    SynthOptions p = sized(SynthKind::flakes, 512, 512);
    p.gamma = gamma;
    p.alpha = 0.3f;
    p.feature_texels = 4;
    // One value for each flake: orientations differ between flakes with probability 1.
    const auto less = [](Vec2 a, Vec2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); };
    const auto normals = synthNormals(p);
    const std::set<Vec2, decltype(less)> flakes(normals.begin(), normals.end(), less);
    std::vector<double> tilts;
    for (const Vec2 n : flakes) tilts.push_back(dot(n, n));
    std::sort(tilts.begin(), tilts.end());
    // sin^2 s: density (1 + (a^2 - 1)(1 - s))^-gamma, integrated numerically as an independent check of the closed form.
    const double a2 = 0.09;
    constexpr int kSteps = 200000;
    const double last = 1 - kMinFlakeCosine * kMinFlakeCosine;
    std::vector<double> cdf(kSteps + 1);
    for (int i = 0; i < kSteps; ++i) {
      cdf[i + 1] = cdf[i] + std::pow(1 + (a2 - 1) * (1 - (i + 0.5) * last / kSteps), -static_cast<double>(gamma));
    }
    double distance = 0;
    for (std::size_t i = 0; i < tilts.size(); ++i) {
      const auto bin = static_cast<std::size_t>(std::clamp(tilts[i] / last, 0.0, 1.0) * kSteps);
      distance = std::max(distance,
                          std::abs(cdf[bin] / cdf.back() - (static_cast<double>(i) + 0.5) / static_cast<double>(tilts.size())));
    }
    constexpr double kKolmogorov = 1.95;  // exceeded by chance once in a thousand seeds
    ASSERT_GT(tilts.size(), 10000u);
    EXPECT_LT(distance, kKolmogorov / std::sqrt(static_cast<double>(tilts.size()))) << "gamma " << gamma;
  }
}

TEST(SynthFlat, PointsUpEverywhere) {
  for (const Vec2 n : synthNormals(sized(SynthKind::flat, 9, 7))) EXPECT_EQ(n, (Vec2{0, 0}));
}

TEST(SynthSawtooth, HasTheTwoSlopesOfItsRamps) {
  SynthOptions p = sized(SynthKind::sawtooth, 64, 4);
  p.feature_texels = 16;
  p.slope = 0.6f;
  std::set<int> slopes;
  for (const Vec2 n : synthNormals(p)) {
    EXPECT_FLOAT_EQ(n.y, 0);
    slopes.insert(static_cast<int>(std::lround(-n.x / std::sqrt(1 - n.x * n.x) * 100)));
  }
  EXPECT_EQ(*slopes.begin(), -60);
  EXPECT_TRUE(slopes.contains(20));  // three quarters up, one quarter down
}

TEST(Synth, GratingsHaveTheirDepthAndProfile) {
  constexpr float kTolerance = 1e-5f;
  SynthOptions p = sized(SynthKind::grating, 64, 4);
  p.alpha = 0;
  p.feature_texels = 16;
  p.depth_texels = 0.5f;
  const std::vector<float> sine = synthHeights(p);
  // The extremes of the sine lie between texels: the highest of them is at 3.5 or 4.5 sixteenths of a period.
  const float amplitude = 0.25f / std::sin(7 * std::numbers::pi_v<float> / 16);
  for (int i = 0; i < 64; ++i)
    EXPECT_NEAR(sine[static_cast<std::size_t>(i)],
                amplitude * std::sin((static_cast<float>(i) + 0.5f) * std::numbers::pi_v<float> / 8), kTolerance);
  p.profile = bake::GratingProfile::blazed;
  const std::vector<float> blazed = synthHeights(p);
  int rising = 0;
  for (int i = 0; i < 63; ++i) rising += blazed[static_cast<std::size_t>(i) + 1] > blazed[static_cast<std::size_t>(i)] ? 1 : 0;
  EXPECT_EQ(rising, 4 * 13);  // of the 14 sixteenths of the ramp, 13 lie between texels of it
  const auto [low, high] = std::minmax_element(blazed.begin(), blazed.end());
  EXPECT_NEAR(*high - *low, 0.5f, kTolerance);
}

TEST(Synth, PatternsReachTheSlopeAskedFor) {
  for (const SynthKind kind :
       {SynthKind::scratches, SynthKind::leather, SynthKind::weave, SynthKind::sawtooth, SynthKind::grating, SynthKind::twill,
        SynthKind::silk, SynthKind::bumps, SynthKind::scales, SynthKind::structured, SynthKind::relief, SynthKind::wood}) {
    SynthOptions p = sized(kind, 256, 192);
    p.alpha = 0;
    p.slope = 0.8f;
    EXPECT_NEAR(slopeVariances(256, 192, synthHeights(p)).steepest, 0.8f, 1e-4f) << static_cast<int>(kind);
  }
}

/// Largest difference of heights and the same heights a number of threads away.
float shiftedDifference(SynthKind kind, int threads_u, int threads_v) {
  constexpr int kSize = 128, kThread = 8;
  SynthOptions p = sized(kind, kSize, kSize);
  p.alpha = 0;
  p.feature_texels = kThread;
  const std::vector<float> heights = synthHeights(p);
  float most = 0;
  for (int j = 0; j < kSize; ++j)
    for (int i = 0; i < kSize; ++i) {
      const int x = (i + kThread * threads_u) % kSize, y = (j + kThread * threads_v) % kSize;
      most = std::max(
          most, std::abs(heights[static_cast<std::size_t>(j * kSize + i)] - heights[static_cast<std::size_t>(y * kSize + x)]));
    }
  return most;
}

TEST(Synth, WeavesRepeatAsTheirDrafts) {
  constexpr float kSame = 1e-4f, kOther = 0.5f;  // texels
  EXPECT_LT(shiftedDifference(SynthKind::weave, 1, 1), kSame);
  EXPECT_GT(shiftedDifference(SynthKind::weave, 1, 0), kOther);
  EXPECT_LT(shiftedDifference(SynthKind::twill, 1, 1), kSame);
  EXPECT_LT(shiftedDifference(SynthKind::twill, 4, 0), kSame);
  EXPECT_GT(shiftedDifference(SynthKind::twill, 2, 0), kOther);
  EXPECT_GT(shiftedDifference(SynthKind::twill, 1, 3), kOther) << "ridges run along one diagonal";
  EXPECT_LT(shiftedDifference(SynthKind::silk, 3, 1), kSame);
  EXPECT_GT(shiftedDifference(SynthKind::silk, 1, 1), kOther) << "no ridge along a diagonal";
}

/// Share of the texels whose normals fulfil a condition.
template <class Holds>
double shareOf(const SynthOptions& p, const Holds& holds) {
  const auto normals = synthNormals(p);
  return static_cast<double>(std::count_if(normals.begin(), normals.end(), holds)) / static_cast<double>(normals.size());
}

TEST(Synth, PatternsHaveTheNormalsOfTheirShapes) {
  const auto plain = [](SynthKind kind) {
    SynthOptions p = sized(kind, 256, 256);
    p.alpha = 0;
    return p;
  };
  const auto level = [](Vec2 n) { return dot(n, n) < 1e-8f; };
  // A pyramid has four sides of one steepness; between them lie edges, one texel wide.
  SynthOptions pyramids = plain(SynthKind::structured);
  pyramids.slope = 0.75f;  // the normal leans by .6
  const double sides = shareOf(pyramids, [](Vec2 n) {
    return std::abs(std::max(std::abs(n.x), std::abs(n.y)) - 0.6f) < 1e-3f && std::min(std::abs(n.x), std::abs(n.y)) < 1e-3f;
  });
  EXPECT_GT(sides, 0.75);
  // Discs of radii from a quarter to a half of their cell, one a cell, cover some two fifths of the ground.
  const double ground = shareOf(plain(SynthKind::bumps), level);
  EXPECT_GT(ground, 0.4);
  EXPECT_LT(ground, 0.8);
  // Noise is within a quarter of a deviation of its mean at a fifth of all places: these are walls.
  EXPECT_NEAR(shareOf(plain(SynthKind::relief), level), 0.8, 0.1);
  // Scales slope towards their tips, up where v falls.
  EXPECT_GT(shareOf(plain(SynthKind::scales), [](Vec2 n) { return n.y > 0; }), 0.8);
}

TEST(Synth, PatternsFinerThanTexelsAreFlat) {
  for (const SynthKind kind : {SynthKind::weave, SynthKind::twill, SynthKind::silk}) {
    SynthOptions p = sized(kind, 64, 64);
    p.feature_texels = 1;
    p.alpha = 0;
    for (const float h : synthHeights(p)) ASSERT_LT(std::abs(h), 100) << static_cast<int>(kind);
  }
}

TEST(Synth, GrainRunsAlongU) {
  for (const SynthKind kind : {SynthKind::wood, SynthKind::anisotropic}) {
    const auto normals = synthNormals(sized(kind, 512, 512));
    const double along = slopeStats(normals, [](Vec2 n) { return n.x; }).variance;
    const double across = slopeStats(normals, [](Vec2 n) { return n.y; }).variance;
    EXPECT_LT(along, across / 8) << static_cast<int>(kind);
  }
}

/// Mean squared difference of neighbours: inside the map, and across its left and bottom edges.
void expectNoSeam(const std::vector<Vec2>& n, int width, int height, int kind) {
  const auto at = [&](int i, int j) { return n[static_cast<std::size_t>(j) * width + i]; };
  const auto difference = [](Vec2 a, Vec2 b) { return dot(a - b, a - b); };
  double inside_x = 0, inside_y = 0, seam_x = 0, seam_y = 0;
  for (int j = 1; j < height; ++j) {
    for (int i = 1; i < width; ++i) {
      inside_x += difference(at(i, j), at(i - 1, j));
      inside_y += difference(at(i, j), at(i, j - 1));
    }
  }
  for (int j = 0; j < height; ++j) seam_x += difference(at(0, j), at(width - 1, j));
  for (int i = 0; i < width; ++i) seam_y += difference(at(i, 0), at(i, height - 1));
  const double count = static_cast<double>(width - 1) * (height - 1);
  // A seam lies on a thread or tooth boundary, and few scratches cross it; a broken one is hundreds of times the mean of noise.
  constexpr double kSeamFactor = 20;
  constexpr double kSmall = 1e-9;
  EXPECT_LE(seam_x / height, kSeamFactor * inside_x / count + kSmall) << "kind " << kind;
  EXPECT_LE(seam_y / width, kSeamFactor * inside_y / count + kSmall) << "kind " << kind;
}

TEST(Synth, TilesWithoutASeam) {
  for (const SynthKind kind : kAllKinds) expectNoSeam(synthNormals(sized(kind, 250, 190)), 250, 190, static_cast<int>(kind));
}

TEST(SynthIsotropic, SeamIsAsSmoothAsTheInside) {
  SynthOptions p = sized(SynthKind::isotropic, 256, 256);
  p.correlation_texels = 16;  // neighbours differ by 1 % of the variance, so a seam would stand out a hundredfold
  const auto n = synthNormals(p);
  double seam = 0, inside = 0;
  for (int j = 0; j < 256; ++j) {
    const Vec2* row = n.data() + j * 256;
    seam += dot(row[0] - row[255], row[0] - row[255]);
    inside += dot(row[128] - row[127], row[128] - row[127]);
  }
  EXPECT_LT(seam, 3 * inside);
}

TEST(Synth, SameBytesForAnyNumberOfThreads) {
  for (const SynthKind kind : kAllKinds) {
    const SynthOptions p = sized(kind, 133, 97);
    const auto many = synthNormals(p);
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const auto single = synthNormals(p);
    EXPECT_EQ(std::memcmp(many.data(), single.data(), many.size() * sizeof(Vec2)), 0) << static_cast<int>(kind);
  }
}

TEST(Synth, SeedsDiffer) {
  for (const SynthKind kind :
       {SynthKind::isotropic, SynthKind::flakes, SynthKind::scratches, SynthKind::leather, SynthKind::flake2d, SynthKind::bumps,
        SynthKind::relief, SynthKind::wood, SynthKind::anisotropic}) {
    SynthOptions p = sized(kind, 64, 64);
    const auto first = synthNormals(p);
    p.seed = 2;
    EXPECT_NE(first, synthNormals(p)) << static_cast<int>(kind);
  }
}

TEST(Synth, AnySizeHasNormalsInsideTheDisk) {
  for (const SynthKind kind : kAllKinds) {
    for (const auto& [width, height] : {std::pair{1, 1}, {2, 1}, {5, 3}, {350, 17}}) {
      for (const Vec2 n : synthNormals(sized(kind, width, height))) ASSERT_LT(dot(n, n), 1) << static_cast<int>(kind);
    }
  }
}

TEST(Synth, FlakesHaveNoHeights) {
  for (const SynthKind kind : {SynthKind::flakes, SynthKind::flake2d}) {
    try {
      synthHeights(sized(kind, 8, 8));
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::unsupported);
    }
  }
}

TEST(SynthFlake2d, CoversItsShareOfTheMap) {
  for (const float coverage : {0.0f, 0.25f, 0.5f, 0.75f, 1.0f}) {
    SynthOptions p = sized(SynthKind::flake2d, 1024, 1024);
    p.coverage = coverage;
    double covered = 0;
    for (const float presence : synthPresence(p)) covered += presence > 0 ? 1.0 / (1024 * 1024) : 0;
    // The node has a curve that was fitted to its own flakes; the map has 10,000 cells.
    constexpr double kFit = 0.03;
    EXPECT_NEAR(covered, coverage, kFit);
  }
}

TEST(SynthFlake2d, OfSmoothFlakesIsLevelEverywhere) {
  SynthOptions p = sized(SynthKind::flake2d, 4096, 4096);
  p.flake_size_uv = 0.0004f, p.roughness = 0, p.coverage = 1;  // the hash of some flakes rounds to 1
  for (const Vec2 n : synthNormals(p)) ASSERT_LT(std::abs(n.x) + std::abs(n.y), 1e-3f);
}

TEST(SynthFlake2d, TilesWhereItsSidesHoldWholeCells) {
  SynthOptions p = sized(SynthKind::flake2d, 200, 100);
  EXPECT_TRUE(flake2dTiles(p));
  p.height = 101;  // 50.5 cells of two texels
  EXPECT_FALSE(flake2dTiles(p));
  p.flake_size_uv = 1.0f / 3;
  EXPECT_FALSE(flake2dTiles(p));
  p.height = 200;
  EXPECT_TRUE(flake2dTiles(p));
}

TEST(SynthFlake2d, OtherKindsHaveNoPresence) { EXPECT_THROW(synthPresence(sized(SynthKind::flakes, 8, 8)), Error); }

TEST(Synth, RefusesParametersOutOfRange) {
  SynthOptions p = sized(SynthKind::flakes, 8, 8);
  p.alpha = 1;
  EXPECT_THROW(synthNormals(p), Error);
  p = sized(SynthKind::flake2d, 8, 8);
  p.coverage = 1.1f;
  EXPECT_THROW(synthNormals(p), Error);
  p = sized(SynthKind::isotropic, 0, 8);
  EXPECT_THROW(synthNormals(p), Error);
  p = sized(SynthKind::isotropic, 8, 8);
  p.alpha = std::nanf("");
  EXPECT_THROW(synthNormals(p), Error);
}

TEST(Slopes, AreTheCentralDifferencesOfAPeriodicField) {
  const std::vector<float> heights = {0, 1, 4, 0, 0, 0};  // bottom row, top row
  const auto normals = normalsFromHeights(3, 2, heights);
  // Bottom row: right minus left, halved, wrapped: (1-4)/2, (4-0)/2, (0-1)/2. With two rows above and below are the same row.
  const float expected[] = {-1.5f, 2, -0.5f};
  for (int i = 0; i < 3; ++i) {
    EXPECT_FLOAT_EQ(normals[i].x, -expected[i] / std::sqrt(1 + expected[i] * expected[i]));
    EXPECT_FLOAT_EQ(normals[i].y, 0);
  }
}

}  // namespace
}  // namespace glint::bake::synth_surface_test
