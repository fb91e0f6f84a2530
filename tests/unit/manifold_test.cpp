#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "glint/query/manifold_ndf.h"
#include "glint/query/reference.h"
#include "support/test_maps.h"

namespace glint {
namespace {

using test::OwnedMap;

/// Answers leave out up to kLoss of the mass of flat facets, and the rule along sides of triangles errs by some 1e-4 of the peak.
constexpr double kStated = ManifoldNdf::kLoss;

class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}
  float unit() { return static_cast<float>(random_() >> 8) * 0x1p-24f; }
  float between(float low, float high) { return low + (high - low) * unit(); }
  float logBetween(float low, float high) { return low * std::pow(high / low, unit()); }
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

struct Surroundings {
  Surface surface;
  Boundary boundary;
  int kind;  ///< of footprints
};
constexpr Surroundings kSurroundings[] = {
    {Surface::smooth, Boundary::wrap, 0}, {Surface::smooth, Boundary::wrap, 1},  {Surface::smooth, Boundary::clamp, 0},
    {Surface::smooth, Boundary::wrap, 2}, {Surface::smooth, Boundary::clamp, 1}, {Surface::flat, Boundary::wrap, 0},
    {Surface::flat, Boundary::clamp, 1},  {Surface::flat, Boundary::wrap, 2},    {Surface::flat, Boundary::clamp, 2}};
constexpr bake::SynthKind kKinds[] = {bake::SynthKind::isotropic, bake::SynthKind::brushed, bake::SynthKind::flakes,
                                      bake::SynthKind::scratches, bake::SynthKind::leather, bake::SynthKind::weave};

TEST(Manifold, DensitiesAreThoseOfTheReferenceWithinTheStatedError) {
  constexpr int kQueries = 24;  // of each map, size and roughness
  for (const bake::SynthKind kind : kKinds) {
    bake::SynthOptions options = bake::defaultSynthOptions(kind);
    options.width = 93, options.height = 70;
    const OwnedMap owned(93, 70, bake::synthNormals(options));
    for (const Surroundings& around : kSurroundings) {
      for (const float sigma_r : {0.001f, 0.005f, 0.02f, 0.1f}) {
        Random random(3);
        Error error;
        const Reference reference(owned.map(), sigma_r, around.surface, around.boundary, Reference::Search::pruned);
        const ManifoldNdf ndf(owned.map(), sigma_r, around.surface, around.boundary);
        for (int k = 0; k < kQueries; ++k) {
          const float sigma = random.logBetween(0.3f, sigma_r < 0.01f ? 4 : 16);  // the reference takes milliseconds beyond
          const Footprint p = random.footprint(around.kind, sigma);
          const Vec2 h = random.half(owned.map(), p, sigma_r);
          error.add(ndf.density(p, h), reference.density(p, h));
        }
        EXPECT_LT(error.relative(), kStated)
            << "kind " << static_cast<int>(kind) << " roughness " << sigma_r << " surroundings " << &around - kSurroundings;
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

TEST(Manifold, OneLaneAndEightAgree) {
  // Eight lanes take the rule that the longest of them needs.
  constexpr double kRule = 5e-4;
  Random random(8);
  const NearSurface surface = {rough().map(), 0.01f, Surface::smooth, Boundary::wrap, 18.5f};
  Error error;
  for (int k = 0; k < 100; ++k) {
    const Footprint p = random.footprint(k % 3, random.logBetween(0.3f, 12));
    const FootprintWeights weights = weightsOf(surface, p);
    const NearPoint lobe{random.half(rough().map(), p, 0.01f)};
    error.add(nearSum(surface, weights, lobe), NearSum<Lanes1, NearPoint>(surface, weights, lobe).sum());
  }
  EXPECT_LT(error.relative(), kRule);
}

TEST(Manifold, SamplesFollowTheDensity) {
  // Counts of 64 cells by 40000 samples: a cell has some hundreds, so a standard error of some percent.
  constexpr int kSamples = 200 * 200, kCells = 8;
  for (const Surroundings& around : kSurroundings) {
    Random random(9);
    const float sigma_r = 0.03f;
    const ManifoldNdf ndf(rough().map(), sigma_r, around.surface, around.boundary);
    const Footprint p = random.footprint(around.kind, 1.5f);
    const Vec2 h = random.half(rough().map(), p, 0);
    const float reach = 0.2f;
    double counts[kCells * kCells] = {};
    for (int k = 0; k < kSamples; ++k) {
      const HalfVectorSample s = ndf.sample(
          p, {(static_cast<float>(k % 200) + random.unit()) / 200, (static_cast<float>(k / 200) + random.unit()) / 200});
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
}  // namespace glint
