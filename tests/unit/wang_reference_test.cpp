#include "glint/query/wang_reference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/wang/wang_tiles.h"
#include "glint/query/reference.h"
#include "support/test_maps.h"

namespace glint::wang_reference_test {
namespace {

constexpr float kSigmaR = 0.05f;
constexpr int kSize = 16;

/// Tiles of a rough map, of both schemes.
struct Tiles {
  explicit Tiles(WangScheme scheme, int tile_count = 16) : normals(test::roughSurface(160, 128, 0.4f, 3)) {
    NormalMap map;
    map.width = 160, map.height = 128, map.normals = normals;
    bake::WangOptions options;
    options.scheme = scheme, options.size = kSize, options.tile_count = tile_count;
    data = bake::buildWangTiles(map, options);
  }
  std::vector<Vec2> normals;
  bake::WangTilesData data;
};

/// A point of the plane, and a footprint there.
struct Asked {
  std::string name;
  double x, y;  ///< texels
  Footprint shape;
};

std::vector<Asked> footprints() {
  const float s = kSize;
  const auto round = [](float sigma) { return Footprint::isotropic({}, sigma); };
  return {
      {"inside", 3.5 * kSize + 0.3, 1.4 * kSize, round(1.5f)},
      {"narrow", 0.4 * kSize, 0.6 * kSize, round(0.1f)},
      {"over an edge", 2.0 * kSize + 0.6, 1.5 * kSize, round(3)},
      {"over a corner", -3.0 * kSize + 1.1, 2.0 * kSize - 0.4, round(4)},
      {"over many", -0.2 * kSize, 7.7 * kSize, round(1.2f * s)},
      {"stretched", 5.1 * kSize, 2.9 * kSize, Footprint::gaussian({}, {300, -240, 220})},
      {"box", 1.9 * kSize, -1.2 * kSize, Footprint::box({}, {15.5f, 4}, {-3, 11})},
      {"far out", 0x1p40 + 0.25, -0x1p41 - 3.5, round(5)},
      {"far box", -0x1p40, 0x1p39 + 7, Footprint::box({}, {20, 0}, {0, 9})},
  };
}

/// The implicit plane, with its origin at a point.
float implicitDensity(const WangReference& plane, const Asked& asked, Vec2 h) {
  const WangPlace place = plane.layout().placeOf(asked.x, asked.y);
  Footprint p = asked.shape;
  p.centre = plane.layout().positionIn(place);
  return plane.movedTo(place.cell_x, place.cell_y).density(p, h);
}

/// The part of the plane around a point as a map, and the footprint in it.
struct Explicit {
  Explicit(const WangTiles& tiles, const Asked& asked, Surface surface, int reach) : width(2 * reach) {
    const double x = std::floor(asked.x) - reach, y = std::floor(asked.y) - reach;
    normals = bake::explicitPlane(tiles, static_cast<std::int64_t>(x), static_cast<std::int64_t>(y), width, width);
    NormalMap map;
    map.width = map.height = width, map.normals = normals;
    reference = Reference(map, kSigmaR, surface, Boundary::clamp);
    footprint = asked.shape;
    footprint.centre = {static_cast<float>((asked.x - x) / width), static_cast<float>((asked.y - y) / width)};
  }
  int width;
  std::vector<Vec2> normals;
  Reference reference;
  Footprint footprint;
};

/// Texels that hold six deviations of every footprint above.
constexpr int kReach = 130;
constexpr Vec2 kHalves[] = {{0, 0}, {0.1f, -0.05f}, {-0.2f, 0.15f}, {0.3f, 0.3f}};

TEST(WangReference, EqualsTheReferenceOnTheExplicitPlane) {
  // Lobes end where they are 3e-7 of their peak; positions in floats of maps of 260 texels.
  constexpr double kRelative = 2e-4, kOfPeak = 1e-4;
  for (const WangScheme scheme : {WangScheme::edge, WangScheme::corner}) {
    const Tiles tiles(scheme, 32);
    for (const Surface surface : {Surface::flat, Surface::smooth}) {
      const WangReference plane(tiles.data.view(), kSigmaR, surface);
      for (const Asked& asked : footprints()) {
        const Explicit part(tiles.data.view(), asked, surface, kReach);
        for (const Vec2 h : kHalves) {
          const double expected = part.reference.density(part.footprint, h);
          EXPECT_NEAR(implicitDensity(plane, asked, h), expected, kRelative * expected + kOfPeak) << asked.name << " " << h.x;
        }
      }
    }
  }
}

TEST(WangReference, MeansAreThoseOfTheExplicitPlane) {
  constexpr double kRelative = 2e-4;
  const Tiles tiles(WangScheme::corner);
  const WangReference plane(tiles.data.view(), kSigmaR);
  const Box2 range = {{-0.1f, -0.2f}, {0.2f, 0.1f}};
  for (const Asked& asked : footprints()) {
    const Explicit part(tiles.data.view(), asked, Surface::flat, kReach);
    const WangPlace place = plane.layout().placeOf(asked.x, asked.y);
    Footprint p = asked.shape;
    p.centre = plane.layout().positionIn(place);
    const double expected = part.reference.mean(part.footprint, range);
    EXPECT_NEAR(plane.movedTo(place.cell_x, place.cell_y).mean(p, range), expected, kRelative * expected) << asked.name;
  }
}

TEST(WangReference, CentresAreInTilesAndDoNotWrap) {
  const Tiles tiles(WangScheme::corner);
  const WangReference plane(tiles.data.view(), kSigmaR);
  const Footprint there = Footprint::isotropic({3.25f, -1.5f}, 4), here = Footprint::isotropic({0.25f, 0.5f}, 4);
  EXPECT_EQ(plane.density(there, {0.1f, 0}), plane.movedTo(3, -2).density(here, {0.1f, 0}));
  EXPECT_NE(plane.density(there, {0.1f, 0}), plane.density(here, {0.1f, 0}));
}

/// Means over the cells of a grid of half vectors.
std::vector<float> coarseImage(const auto& model, const Footprint& p) {
  constexpr int kCells = 6;
  std::vector<float> image;
  for (int k = 0; k < kCells * kCells; ++k) {
    const Vec2 low = {-1 + 2.0f / kCells * static_cast<float>(k % kCells), -1 + 2.0f / kCells * static_cast<float>(k / kCells)};
    image.push_back(model.mean(p, {low, low + Vec2{2.0f / kCells, 2.0f / kCells}}));
  }
  return image;
}

TEST(WangReference, WideFootprintsTendToTheMeanOfTheTiles) {
  const Tiles tiles(WangScheme::corner);
  const WangReference plane(tiles.data.view(), kSigmaR);
  const auto imageAt = [&](float tile_sigma, Vec2 centre) {
    return coarseImage(plane, Footprint::isotropic(centre, tile_sigma * kSize));
  };
  const std::vector<float> mean = imageAt(4, {});
  // Every footprint from kFarTiles on has the mean, whatever its shape; it is that of all texels.
  EXPECT_EQ(imageAt(3.01f, {0.3f, 17}), mean);
  EXPECT_EQ(coarseImage(plane, Footprint::gaussian({0.1f, 0.2f}, {1e30f, 0, 1})), mean);
  EXPECT_EQ(coarseImage(plane, Footprint::box({}, {1e20f, 0}, {0, 1e20f})), mean);
  NormalMap all;
  all.width = kSize, all.height = 16 * kSize, all.normals = tiles.data.normals;
  const Reference everything(all, kSigmaR);
  constexpr double kRounding = 1e-4;
  EXPECT_LT(test::totalVariation(mean, coarseImage(everything, Footprint::isotropic({}, 1e6f))), kRounding);
  // What is lost where the exact sum ends is the unevenness that 12 tiles squared still have.
  constexpr double kLost = 0.03;  // measured .012
  EXPECT_LT(test::totalVariation(imageAt(2, {0.4f, 0.6f}), mean), kLost);
  // No step between the two.
  for (const float sigma : {2.0f, 2.99f}) {
    constexpr double kStep = 0.003;  // of 1 % in size
    EXPECT_LT(test::totalVariation(imageAt(sigma, {}), imageAt(1.01f * sigma, {})), kStep) << sigma;
  }
}

/// Sixteen tiles of one normal each, all different.
struct PlainTiles {
  PlainTiles() {
    tiles.size = kSize, tiles.colors_h = tiles.colors_v = 2, tiles.tile_count = 16;
    for (int t = 0; t < 16; ++t) normals.insert(normals.end(), kSize * kSize, normalOf(t));
    tiles.normals = normals;
  }
  static Vec2 normalOf(int tile) {
    return {0.3f * static_cast<float>(tile % 4) - 0.45f, 0.3f * static_cast<float>(tile / 4) - 0.45f};
  }
  std::vector<Vec2> normals;
  WangTiles tiles;
};

TEST(WangReference, SamplesTilesByTheirMassNotEqually) {
  const PlainTiles plain;
  constexpr float kSharp = 0.01f;
  const WangReference plane(plain.tiles, kSharp);
  // A vertex around which the four tiles differ, and a footprint most of which lies in one of them.
  int cell = 0;
  const auto around = [&](int k) { return plane.layout().tileAt(cell - 1 + k % 2, k / 2 - 1); };
  const auto differ = [&] {
    for (int a = 0; a < 4; ++a)
      for (int b = 0; b < a; ++b)
        if (around(a) == around(b)) return false;
    return true;
  };
  while (!differ()) ++cell;
  const Footprint p = Footprint::isotropic({static_cast<float>(cell) + 0.2f, 0.2f}, 4);
  const double below = 0.5 * std::erfc(0.2 * kSize / 4 / std::sqrt(2.0));  // share beyond an edge
  const double masses[4] = {below * below, (1 - below) * below, below * (1 - below), (1 - below) * (1 - below)};
  constexpr int kSamples = 80;  // along each axis
  double found[4] = {}, equal_choice = 0;
  for (int k = 0; k < kSamples * kSamples; ++k) {
    const Vec2 xi = {(static_cast<float>(k % kSamples) + 0.5f) / kSamples,
                     (static_cast<float>(k / kSamples) + 0.5f) / kSamples};
    const HalfVectorSample s = plane.sample(p, xi);
    EXPECT_EQ(s.pdf, plane.density(p, s.h));
    for (int t = 0; t < 4; ++t) {
      const Vec2 d = s.h - PlainTiles::normalOf(around(t));
      if (std::hypot(d.x, d.y) < 0.15f) found[t] += 1.0 / (kSamples * kSamples);
    }
  }
  constexpr double kTexels = 0.02;  // masses are of whole texels of a Gaussian of 4
  for (int t = 0; t < 4; ++t) {
    EXPECT_NEAR(found[t], masses[t], kTexels) << t;
    equal_choice += 0.5 * std::abs(masses[t] - 0.25);
  }
  // The paper draws each of the four tiles as often, and calls D the pdf: by this total variation its samples are elsewhere.
  EXPECT_NEAR(equal_choice, 0.37, 0.01);
}

TEST(WangReference, SamplesFollowTheDensity) {
  const Tiles tiles(WangScheme::corner);
  const struct {
    Surface surface;
    Footprint p;
  } cases[] = {{Surface::flat, Footprint::isotropic({0.02f, 0.97f}, 5)},
               {Surface::smooth, Footprint::isotropic({1.02f, 0.97f}, 3)},
               {Surface::flat, Footprint::box({0, 0}, {9, 2}, {-3, 8})},
               {Surface::flat, Footprint::gaussian({0, 0}, {1600, 0, 1})},  // partly the mean
               {Surface::smooth, Footprint::isotropic({0, 0}, 4.0f * kSize)}};
  constexpr int kSamples = 2500, kCells = 8;
  for (const auto& c : cases) {
    const WangReference plane(tiles.data.view(), kSigmaR, c.surface);
    std::vector<double> counts(kCells * kCells, 0.0);
    for (int k = 0; k < kSamples; ++k) {
      const HalfVectorSample s = plane.sample(c.p, bake::randomPair(1, 0, static_cast<std::uint64_t>(k)));
      if (!(s.pdf > 0)) continue;
      if (k % 97 == 0) {
        EXPECT_EQ(s.pdf, plane.density(c.p, s.h));
      }
      const auto cell = [](float x) { return std::clamp(static_cast<int>((x + 1) * 0.5f * kCells), 0, kCells - 1); };
      ++counts[static_cast<std::size_t>(cell(s.h.y) * kCells + cell(s.h.x))];
    }
    double tv = 0;
    for (int k = 0; k < kCells * kCells; ++k) {
      const float width = 2.0f / kCells;
      const Vec2 low = {-1 + width * static_cast<float>(k % kCells), -1 + width * static_cast<float>(k / kCells)};
      const double mass = double{plane.mean(c.p, {low, low + Vec2{width, width}})} * double{width} * double{width};
      tv += 0.5 * std::abs(mass - counts[static_cast<std::size_t>(k)] / kSamples);
    }
    constexpr double kNoise = 0.07;  // of 2500 samples in about 40 cells: .05; tiles chosen equally often: .37
    EXPECT_LT(tv, kNoise);
  }
}

TEST(WangReference, AnswersAreFiniteWhateverIsAsked) {
  const PlainTiles plain;
  const WangReference plane(plain.tiles, kSigmaR);
  const float inf = INFINITY, nan = NAN;
  for (const Vec2 centre : {Vec2{nan, 0}, Vec2{inf, -inf}, Vec2{1e30f, 5}, Vec2{-1e-30f, 8e15f}})
    for (const Covariance c :
         {Covariance{nan, 0, 1}, Covariance{1, 5, 1}, Covariance{inf, 0, inf}, Covariance{-1, 0, -1}, Covariance{}}) {
      const Footprint p = Footprint::gaussian(centre, c);
      EXPECT_TRUE(std::isfinite(plane.density(p, {0.1f, 0.1f})));
      EXPECT_TRUE(std::isfinite(plane.mean(p, {{-1, -1}, {1, 1}})));
      EXPECT_TRUE(std::isfinite(plane.sample(p, {nan, 2}).pdf));
    }
  const WangReference far = plane.movedTo(INT64_MAX, INT64_MIN);
  EXPECT_TRUE(std::isfinite(far.density(Footprint::isotropic({0.9f, 0.1f}, 30), {0.1f, 0.1f})));
}

}  // namespace
}  // namespace glint::wang_reference_test
