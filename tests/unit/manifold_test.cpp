#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "glint/query/manifold_ndf.h"
#include "glint/query/reference.h"
#include "support/test_maps.h"

namespace glint::manifold_test {
namespace {

using test::OwnedMap;

/// Answers leave out up to kLoss of the light, and the functions of a lane err by some 1e-4.
constexpr double kStated = ManifoldNdf::kLoss;

class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}
  float unit() { return static_cast<float>(random_() >> 8) * 0x1p-24f; }
  float between(float low, float high) { return low + (high - low) * unit(); }
  float logBetween(float low, float high) { return low * std::pow(high / low, unit()); }
  Vec2 texel(const NormalMap& map) { return map.normals[random_() % map.normals.size()]; }
  Vec2 point(float extent) { return {between(-extent, extent), between(-extent, extent)}; }

  /// Round, stretched by up to 1:8 in any direction, or a box.
  Footprint footprint(int kind, float sigma) {
    const Vec2 centre = {unit(), unit()};
    const float angle = between(0, 2 * kPi), c = std::cos(angle), s = std::sin(angle), stretch = between(1, 8);
    const float a = sigma * std::sqrt(stretch), b = sigma / std::sqrt(stretch);
    if (kind == 0) return Footprint::isotropic(centre, sigma);
    if (kind == 1)
      return Footprint::gaussian(centre,
                                 {c * c * a * a + s * s * b * b, c * s * (a * a - b * b), s * s * a * a + c * c * b * b});
    return Footprint::box(centre, {2 * a * c, 2 * a * s}, {-2 * b * s, 2 * b * c});
  }
  /// Near a normal of a texel under the footprint.
  Vec2 half(const NormalMap& map, const Footprint& p, float sigma_r) {
    const auto texel = [&](float u, int n) { return wrapIndex(static_cast<int>(std::floor(u * static_cast<float>(n))), n); };
    const Vec2 spread = {std::sqrt(p.covariance.xx) / static_cast<float>(map.width),
                         std::sqrt(p.covariance.yy) / static_cast<float>(map.height)};
    const Vec2 uv = p.centre + Vec2{between(-1, 1) * spread.x, between(-1, 1) * spread.y};
    return map.at(texel(uv.x, map.width), texel(uv.y, map.height)) + point(2 * sigma_r);
  }

 private:
  std::mt19937 random_;
};

/// Root mean square of a difference over that of the truth.
struct Error {
  double difference = 0, truth = 0;
  void add(double answer, double expected) {
    difference += (answer - expected) * (answer - expected);
    truth += expected * expected;
  }
  double relative() const { return std::sqrt(difference / truth); }
};

TEST(Lanes, DecayIsTheExponentialFunction) {
  constexpr double kRelative = 6e-5;  // as decayOf says
  for (float u = 0; u <= 20; u += 1.0f / 1024)
    ASSERT_NEAR(decayOf(Lanes1{u}).v, std::exp(-double{u}), kRelative * std::exp(-double{u})) << u;
  EXPECT_EQ(decayOf(Lanes1{1e30f}).v, decayOf(Lanes1{20}).v);
  EXPECT_EQ(decayOf(Lanes1{std::numeric_limits<float>::quiet_NaN()}).v, decayOf(Lanes1{20}).v);
}

Corners<Lanes1> corners(const Vec2* t) { return {{t[0].x}, {t[0].y}, {t[1].x}, {t[1].y}, {t[2].x}, {t[2].y}}; }

/// A triangle of any size from a fiftieth of a deviation to 200, or a sliver, around a half vector up to three deviations away.
void randomTriangle(Random& random, int kind, Vec2* t) {
  const float extent = random.logBetween(0.02f, 200);
  for (int k = 0; k < 3; ++k) t[k] = random.point(extent);
  if (kind > 0) t[2] = t[0] + random.unit() * (t[1] - t[0]) + random.point(kind == 1 ? 0.3f : kind == 2 ? 1e-3f : 0);
  const float s = random.unit(), r = (1 - s) * random.unit();
  const Vec2 at = t[0] + s * (t[1] - t[0]) + r * (t[2] - t[0]) + random.point(3);
  for (int k = 0; k < 3; ++k) t[k] = t[k] - at;
}

TEST(Manifold, TheDensityOfATriangleIsThatOfTheReference) {
  constexpr double kOfPeak = 1e-3;    // one rule for a side of any length, and tails beyond 3.5 deviations
  constexpr double kRelative = 1e-3;  // of triangleDensity
  Random random(1);
  for (int k = 0; k < 4000; ++k) {
    Vec2 t[3];
    randomTriangle(random, k % 4, t);
    const double expected = triangleDensity(t[0], t[1], t[2], {0, 0}, 1);
    const float answer = TriangleDensity<Lanes1>::of(TriangleFrames<Lanes1>::of(corners(t))).v;
    ASSERT_NEAR(answer, expected, kRelative * expected + kOfPeak / (2 * std::numbers::pi))
        << t[0].x << ' ' << t[0].y << ' ' << t[1].x << ' ' << t[1].y << ' ' << t[2].x << ' ' << t[2].y;
  }
}

TEST(Manifold, TheMassOfATriangleInABoxIsThatOfTheReference) {
  constexpr double kOfMass = 5e-3;  // panels of two and a half deviations
  constexpr float kUnit = 1e-3f;    // triangleMass takes triangles of the disk
  Random random(2);
  for (int k = 0; k < 400; ++k) {
    Vec2 t[3];
    randomTriangle(random, k % 4, t);
    const Vec2 half = {random.logBetween(0.1f, 30), random.logBetween(0.1f, 30)};
    Vec2 scaled[3];
    for (int q = 0; q < 3; ++q) scaled[q] = kUnit * t[q];
    const double expected = triangleMass(scaled[0], scaled[1], scaled[2], {(-kUnit) * half, kUnit * half}, kUnit);
    Lanes1 numbers[6];
    for (int q = 0; q < 6; ++q) numbers[q] = {q % 2 == 0 ? t[q / 2].x : t[q / 2].y};
    const double peak = std::min(1.0, 4.0 * half.x * half.y / (2 * std::numbers::pi));
    ASSERT_NEAR(TriangleMass<Lanes1>::of(numbers, half).v, expected, kOfMass * (expected + 0.2 * peak)) << k;
  }
}

/// Leaves numbers from -size to size in the memory below the caller, where the next call keeps its variables.
[[gnu::noinline]] void litterStack(unsigned seed, float size) {
  Random random(seed);
  volatile float litter[8192];
  for (volatile float& x : litter) x = random.between(-size, size);
}

struct Surroundings {
  Surface surface;
  Boundary boundary;
  int kind;  ///< of footprints
};
constexpr Surroundings kSurroundings[] = {{Surface::smooth, Boundary::wrap, 0},  {Surface::smooth, Boundary::wrap, 1},
                                          {Surface::smooth, Boundary::clamp, 0}, {Surface::smooth, Boundary::wrap, 2},
                                          {Surface::smooth, Boundary::clamp, 1}, {Surface::flat, Boundary::wrap, 0},
                                          {Surface::flat, Boundary::clamp, 1},   {Surface::flat, Boundary::wrap, 2},
                                          {Surface::flat, Boundary::clamp, 2},   {Surface::smooth, Boundary::clamp, 2}};
constexpr bake::SynthKind kKinds[] = {bake::SynthKind::isotropic, bake::SynthKind::brushed, bake::SynthKind::flakes,
                                      bake::SynthKind::scratches, bake::SynthKind::leather, bake::SynthKind::weave};

TEST(Manifold, DensitiesAreThoseOfTheReferenceWithinTheStatedErrorInEveryOctaveOfSize) {
  constexpr int kFlatQueries = 16, kSmoothQueries = 5;  // of each map, octave and roughness; a smooth reference is slow
  for (const bake::SynthKind kind : kKinds) {
    bake::SynthOptions options = bake::defaultSynthOptions(kind);
    options.width = 93, options.height = 70;
    const OwnedMap owned(93, 70, bake::synthNormals(options));
    for (const Surroundings& around : kSurroundings) {
      for (const float sigma_r : {0.001f, 0.02f, 0.1f}) {
        const Reference reference(owned.map(), sigma_r, around.surface, around.boundary, Reference::Search::pruned);
        const ManifoldNdf ndf(owned.map(), sigma_r, around.surface, around.boundary);
        const float largest = sigma_r < 0.01f ? 4 : 16;  // the reference takes milliseconds beyond
        for (float octave = 0.25f; octave < largest; octave *= 2) {
          Random random(3);
          Error error;
          for (int k = 0; k < (around.surface == Surface::flat ? kFlatQueries : kSmoothQueries); ++k) {
            const Footprint p = random.footprint(around.kind, random.logBetween(octave, 2 * octave));
            const Vec2 h = random.half(owned.map(), p, sigma_r);
            error.add(ndf.density(p, h), reference.density(p, h));
          }
          EXPECT_LT(error.relative(), kStated) << "kind " << static_cast<int>(kind) << " roughness " << sigma_r << " octave "
                                               << octave << " surroundings " << &around - kSurroundings;
        }
      }
    }
  }
}

TEST(Manifold, MeansAreThoseOfTheReferenceWithinTheStatedError) {
  for (const bake::SynthKind kind : {bake::SynthKind::isotropic, bake::SynthKind::brushed, bake::SynthKind::flakes}) {
    bake::SynthOptions options = bake::defaultSynthOptions(kind);
    options.width = 64, options.height = 51;
    const OwnedMap owned(64, 51, bake::synthNormals(options));
    for (const Surroundings& around : kSurroundings) {
      Random random(4);
      Error error;
      const float sigma_r = 0.01f;
      const Reference reference(owned.map(), sigma_r, around.surface, around.boundary, Reference::Search::pruned);
      const ManifoldNdf ndf(owned.map(), sigma_r, around.surface, around.boundary);
      for (int k = 0; k < 12; ++k) {
        const Footprint p = random.footprint(around.kind, random.logBetween(0.3f, 1));
        const Vec2 h = random.half(owned.map(), p, sigma_r),
                   half = {random.logBetween(0.002f, 0.2f), random.logBetween(0.002f, 0.2f)};
        error.add(ndf.mean(p, {h - half, h + half}), reference.mean(p, {h - half, h + half}));
      }
      EXPECT_LT(error.relative(), kStated) << "kind " << static_cast<int>(kind) << " surroundings " << &around - kSurroundings;
    }
  }
}

TEST(Manifold, AnswersDoNotDependOnMemoryThatWasUsedBefore) {
  constexpr int kQueries = 500;  // about one in ten has lanes that hold nothing
  const OwnedMap owned(64, 48, test::roughSurface(64, 48, 0.2f));
  Random random(1);
  for (const float sigma_r : {0.003f, 0.01f, 0.03f}) {
    const ManifoldNdf ndf(owned.map(), sigma_r, Surface::smooth);
    for (unsigned k = 0; k < kQueries; ++k) {
      const Footprint p = Footprint::isotropic({random.unit(), random.unit()}, random.between(0.3f, 1.3f));
      const Vec2 h = random.texel(owned.map()), side = {0.02f, 0.02f};
      litterStack(k, 0);
      const float density = ndf.density(p, h), mean = ndf.mean(p, {h - side, h + side});
      litterStack(k, 8);
      ASSERT_EQ(ndf.density(p, h), density) << k;
      litterStack(k, 500);
      ASSERT_EQ(ndf.mean(p, {h - side, h + side}), mean) << k;
    }
  }
}

TEST(Manifold, LeavesOutNoMoreThanTheLossFromNarrowFootprints) {
  // A footprint of a quarter texel between four texels has all of them in its tail.
  constexpr float kSigmaR = 0.005f, kStep = 0.25f * kSigmaR;
  constexpr int kSteps = 24;  // on each side of a lobe: six deviations
  const OwnedMap owned(16, 16, test::randomNormals(16, 16, 0.5f, 3));
  const ManifoldNdf ndf(owned.map(), kSigmaR);
  const Reference reference(owned.map(), kSigmaR, Surface::flat, Boundary::wrap, Reference::Search::pruned);
  for (const float sigma : {0.1f, 0.25f, 0.3f, 0.5f, 1.0f}) {
    for (const Vec2 offset : {Vec2{0, 0}, {0.25f, 0.25f}, {0.5f, 0.5f}, {0, 0.5f}}) {
      const Footprint p = Footprint::isotropic((1.0f / 16) * (Vec2{8, 8} + offset), sigma);
      double answered = 0, expected = 0;
      for (int texel = 0; texel < 9; ++texel) {
        const Vec2 n = owned.map().at(7 + texel % 3, 7 + texel / 3);
        for (int y = -kSteps; y <= kSteps; ++y)
          for (int x = -kSteps; x <= kSteps; ++x) {
            const Vec2 h = n + kStep * Vec2{static_cast<float>(x), static_cast<float>(y)};
            answered += double{ndf.density(p, h)};
            expected += double{reference.density(p, h)};
          }
      }
      EXPECT_LE(1 - answered / expected, kStated) << sigma << ' ' << offset.x << ' ' << offset.y;
    }
  }
}

TEST(Manifold, SumsOverManyTexelsKeepTheirDigits) {
  // Every texel has the same normal, so that the density has a closed form.
  constexpr float kSigmaR = 0.1f;
  constexpr double kOfPeak = 2e-4;  // the ball leaves out 1e-4 at the middle of a lobe, and the functions of a lane err
  const Vec2 n = {0.1f, -0.05f};
  const double peak = gaussianDensity({}, kSigmaR);
  const OwnedMap owned(256, 256, std::vector<Vec2>(256 * 256, n));
  for (const Surface surface : {Surface::flat, Surface::smooth})
    for (const float sigma : {4.0f, 128.0f})
      EXPECT_NEAR(ManifoldNdf(owned.map(), kSigmaR, surface).density(Footprint::isotropic({0.3f, 0.6f}, sigma), n), peak,
                  kOfPeak * peak)
          << sigma;
}

TEST(Manifold, NarrowFootprintsKeepTheirWeightsFarFromTheOrigin) {
  // Every texel has the same normal, so that only the sum of the weights can be wrong. Places are rounded to a thousandth of a texel.
  constexpr float kSigmaR = 0.1f;
  constexpr int kWidth = 16384;
  constexpr double kLane = 2e-4;  // error of the functions of a lane
  const Vec2 n = {0.1f, -0.05f};
  const double peak = gaussianDensity({}, kSigmaR);
  const OwnedMap owned(kWidth, 2, std::vector<Vec2>(2 * kWidth, n));
  Random random(12);
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    const ManifoldNdf ndf(owned.map(), kSigmaR, surface);
    for (int k = 0; k < 200; ++k) {
      const Footprint p = Footprint::isotropic({random.between(0.6f, 1), random.unit()}, random.between(0.25f, 0.6f));
      ASSERT_NEAR(ndf.density(p, n), peak, kLane * peak) << p.centre.x << ' ' << p.centre.y;
    }
  }
}

TEST(Manifold, AnswersStripsAndMapsOfFewTexels) {
  constexpr float kSigmaR = 0.04f;
  constexpr double kFew = 2e-3;  // few questions of every size together
  for (const auto& [width, height] : {std::array{1, 1}, {1, 7}, {7, 1}, {2, 2}, {3, 5}, {33, 2}, {9, 9}, {17, 4}}) {
    const OwnedMap owned(width, height, test::randomNormals(width, height, 0.05f, 7));
    for (const Surface surface : {Surface::flat, Surface::smooth})
      for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
        SCOPED_TRACE(std::to_string(width) + 'x' + std::to_string(height));
        const ManifoldNdf ndf(owned.map(), kSigmaR, surface, boundary);
        const Reference reference(owned.map(), kSigmaR, surface, boundary, Reference::Search::pruned);
        const bool empty = surface == Surface::smooth && boundary == Boundary::clamp && std::min(width, height) == 1;
        Random random(9);
        Error density, mean;
        for (int k = 0; k < 40; ++k) {
          const float a = random.between(0.3f, 6), b = random.between(0.3f, 2);
          const Vec2 centre = {k % 5 == 0 ? 0 : random.unit(), k % 7 == 0 ? 0.99999f : random.unit()};
          const Footprint p = k % 3 == 0   ? Footprint::isotropic(centre, a)
                              : k % 3 == 1 ? Footprint::gaussian(centre, {a * a + 1, 0.4f * a * b, b * b + 1})
                                           : Footprint::box(centre, {a, 0.3f}, {-0.2f, b});
          const Vec2 h = random.texel(owned.map()), side = {0.03f, 0.02f};
          density.add(ndf.density(p, h), reference.density(p, h));
          mean.add(ndf.mean(p, {h - side, h + side}), reference.mean(p, {h - side, h + side}));
          EXPECT_EQ(ndf.sample(p, {random.unit(), random.unit()}).pdf > 0, !empty);
        }
        if (empty) {
          EXPECT_EQ(density.difference + mean.difference, 0);
          continue;
        }
        EXPECT_LT(density.relative(), kFew);
        EXPECT_LT(mean.relative(), kFew);
      }
  }
}

const OwnedMap& rough() {
  static const OwnedMap map(64, 48, test::roughSurface(64, 48, 0.2f));
  return map;
}

TEST(Manifold, TheWholeSquareHoldsAllMassButTheLoss) {
  Random random(5);
  for (const Surroundings& around : kSurroundings)
    for (int k = 0; k < 6; ++k) {
      const ManifoldNdf ndf(rough().map(), 0.01f, around.surface, around.boundary);
      EXPECT_NEAR(4 * ndf.mean(random.footprint(around.kind, random.logBetween(0.3f, 12)), {{-1, -1}, {1, 1}}), 1, kStated);
    }
}

TEST(Manifold, ASmallerLossIsNearerToTheReference) {
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    Random random(6);
    Error coarse, fine;
    const float sigma_r = 0.03f;
    const Reference reference(rough().map(), sigma_r, surface, Boundary::wrap, Reference::Search::pruned);
    for (int k = 0; k < 60; ++k) {
      const Footprint p = random.footprint(k % 2, random.logBetween(0.5f, 6));
      const Vec2 h = random.half(rough().map(), p, sigma_r);
      const double expected = reference.density(p, h);
      coarse.add(ManifoldNdf(rough().map(), sigma_r, surface, Boundary::wrap, 0.05f).density(p, h), expected);
      fine.add(ManifoldNdf(rough().map(), sigma_r, surface, Boundary::wrap, 1e-4f).density(p, h), expected);
    }
    EXPECT_LT(fine.relative(), 4e-4);
    EXPECT_GT(coarse.relative(), 5 * fine.relative());
    EXPECT_LT(coarse.relative(), 0.05);
  }
}

TEST(Manifold, ASmallerLossNeverHasMoreError) {
  constexpr double kLane = 1e-4;  // error of the functions of a lane
  const OwnedMap owned(64, 64, test::randomNormals(64, 64, 0.3f, 3));
  const auto error = [&](const ManifoldNdf& ndf, const Reference& reference) {
    Random random(5);
    Error sum;
    for (int k = 0; k < 40; ++k) {
      const Footprint p = Footprint::isotropic({random.unit(), random.unit()}, 4);
      const Vec2 h = random.point(0.3f);
      sum.add(ndf.density(p, h), reference.density(p, h));
    }
    return sum.relative();
  };
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    const Reference reference(owned.map(), 0.02f, surface, Boundary::wrap, Reference::Search::pruned);
    for (const float loss : {1e-2f, 1e-3f, 1e-4f})
      EXPECT_LT(error({owned.map(), 0.02f, surface, Boundary::wrap, loss}, reference), double{loss} + kLane) << loss;
    // The smallest loss is 1e-4.
    EXPECT_EQ(error({owned.map(), 0.02f, surface, Boundary::wrap, 0}, reference),
              error({owned.map(), 0.02f, surface, Boundary::wrap, 1e-4f}, reference));
  }
}

TEST(Manifold, BoundsOfNormalsChangeTheCostAndNotTheAnswer) {
  constexpr double kOrder = 1e-5;  // facets are added in another order
  NormalMap bare = rough().map();
  bare.bounds_level_count = 0;
  Random random(7);
  for (const Surroundings& around : kSurroundings)
    for (int k = 0; k < 6; ++k) {
      const ManifoldNdf with(rough().map(), 0.01f, around.surface, around.boundary),
          without(bare, 0.01f, around.surface, around.boundary);
      const Footprint p = random.footprint(around.kind, random.logBetween(0.3f, 12));
      const Vec2 h = random.half(bare, p, 0.01f);
      EXPECT_NEAR(without.density(p, h), with.density(p, h), kOrder * (with.density(p, h) + 1));
    }
}

TEST(Manifold, AnswersHaveTheSameBitsWithAndWithoutAvx2) {
#ifdef GLINT_AVX2
  if (!hasAvx2()) GTEST_SKIP() << "needs a processor with AVX2";
  Random random(10);
  int seen = 0;
  for (const Surroundings& around : kSurroundings) {
    const NearSurface surface = {rough().map(), 0.01f, around.surface, around.boundary, 18.5f};
    for (int k = 0; k < 40; ++k) {
      const Footprint p = random.footprint(around.kind, random.logBetween(0.3f, 6));
      const FootprintWeights weights = weightsOf(surface.grid(), p);
      const Vec2 h = random.half(rough().map(), p, 0.01f), side = {0.02f, 0.03f};
      const auto expectSameBits = [&](const auto& lobe) {
        const double sum = nearSumAvx2(surface, weights, lobe, surface.reach2);
        EXPECT_EQ(nearSumAny(surface, weights, lobe, surface.reach2), sum) << k;
        if (sum > 0) ++seen;
      };
      expectSameBits(NearPoint{h});
      expectSameBits(NearBox{{h - side, h + side}, (1 / surface.sigma_r) * side});
    }
  }
  EXPECT_GT(seen, 400);  // of 800
#else
  GTEST_SKIP() << "needs a compiler for AVX2";
#endif
}

TEST(Manifold, OneLaneAndEightAgree) {
  // Eight lanes take the rule that the longest of them needs.
  constexpr double kRule = 5e-4;
  Random random(8);
  const NearSurface surface = {rough().map(), 0.01f, Surface::smooth, Boundary::wrap, 18.5f};
  Error error;
  for (int k = 0; k < 100; ++k) {
    const Footprint p = random.footprint(k % 3, random.logBetween(0.3f, 12));
    const FootprintWeights weights = weightsOf(surface.grid(), p);
    const NearPoint lobe{random.half(rough().map(), p, 0.01f)};
    error.add(nearSum(surface, weights, lobe, surface.reach2),
              NearSum<Lanes1, NearPoint>(surface, weights, lobe, surface.reach2).sum());
  }
  EXPECT_LT(error.relative(), kRule);
}

TEST(Manifold, SamplesFollowTheDensity) {
  // Counts of 64 cells by 10000 samples: a cell has some hundred, so a standard error of some percent.
  constexpr int kSide = 100, kSamples = kSide * kSide, kCells = 8;
  for (const Surroundings& around : kSurroundings) {
    Random random(9);
    const float sigma_r = 0.03f;
    const ManifoldNdf ndf(rough().map(), sigma_r, around.surface, around.boundary);
    const Footprint p = random.footprint(around.kind, 1.5f);
    const Vec2 h = random.half(rough().map(), p, 0);
    const float reach = 0.2f;
    double counts[kCells * kCells] = {};
    for (int k = 0; k < kSamples; ++k) {
      const HalfVectorSample s = ndf.sample(p, {(static_cast<float>(k % kSide) + random.unit()) / kSide,
                                                (static_cast<float>(k / kSide) + random.unit()) / kSide});
      if (!(s.pdf > 0)) continue;
      if (k % 100 == 0) {
        EXPECT_EQ(s.pdf, ndf.density(p, s.h));
      }
      const Vec2 at = (kCells / (2 * reach)) * (s.h - h + Vec2{reach, reach});
      if (at.x >= 0 && at.y >= 0 && at.x < kCells && at.y < kCells)
        ++counts[static_cast<int>(at.y) * kCells + static_cast<int>(at.x)];
    }
    for (int k = 0; k < kCells * kCells; ++k) {
      const float side = 2 * reach / kCells;
      const Vec2 low =
          h - Vec2{reach, reach} + Vec2{side * static_cast<float>(k % kCells), side * static_cast<float>(k / kCells)};
      const double expected = double{side} * side * ndf.mean(p, {low, low + Vec2{side, side}}) * kSamples;
      EXPECT_NEAR(counts[k], expected, 5 * std::sqrt(expected) + 5 + kStated * kSamples) << k;
    }
  }
}

TEST(Manifold, ABrokenNormalTakesItsOwnTexelsOnly) {
  // Of 3072 texels three are broken; each has a part in six triangles.
  constexpr double kBroken = 3 * 6 / (2 * 64.0 * 48);
  std::vector<Vec2> normals = rough().normals();
  for (const std::size_t k : {100u, 1500u, 2900u}) normals[k].x = std::numeric_limits<float>::quiet_NaN();
  const OwnedMap broken(64, 48, normals);
  for (const Surface surface : {Surface::flat, Surface::smooth})
    for (const Footprint& p : {Footprint::isotropic({0.5f, 0.5f}, 64), Footprint::box({0.5f, 0.5f}, {32, 0}, {0, 24})}) {
      const Box2 range = {{-0.9f, -0.9f}, {0.05f, 0.9f}};
      const double expected = ManifoldNdf(rough().map(), 0.01f, surface).mean(p, range);
      EXPECT_NEAR(ManifoldNdf(broken.map(), 0.01f, surface).mean(p, range), expected, 2 * kBroken + kStated * expected);
    }
}

TEST(Manifold, AnswersAreFiniteForBrokenMapsAndQuestions) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  std::vector<Vec2> normals = rough().normals();
  for (std::size_t k = 0; k < normals.size(); k += 5) normals[k] = {k % 2 == 0 ? kNan : kInfinity, k % 3 == 0 ? -1e30f : 0.2f};
  const OwnedMap broken(64, 48, normals);
  const auto finite = [](float x) { return x >= 0 && x < kInfinity; };
  for (const Surroundings& around : kSurroundings) {
    const ManifoldNdf ndf(broken.map(), 0.01f, around.surface, around.boundary);
    for (const float sigma : {0.0f, 1.0f, 1e6f, kInfinity, kNan})
      for (const Vec2 h : {Vec2{0, 0}, Vec2{kNan, 0}, Vec2{0.1f, kInfinity}, Vec2{-1, 1}}) {
        const Footprint p = Footprint::isotropic({0.3f, sigma > 5 ? kNan : 0.7f}, sigma);
        EXPECT_TRUE(finite(ndf.density(p, h)));
        EXPECT_TRUE(finite(ndf.mean(p, {h - Vec2{0.1f, 0.1f}, h + Vec2{0.1f, 0.1f}})));
        EXPECT_TRUE(finite(ndf.sample(p, h).pdf));
      }
  }
}

}  // namespace
}  // namespace glint::manifold_test
