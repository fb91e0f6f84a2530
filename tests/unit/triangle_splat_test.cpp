#include "glint/bake/pyramid/triangle_splat.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace glint::bake::triangle_splat_test {
namespace {

constexpr int kBins = 128;  // of the fine grid along each axis
constexpr float kSigmaBins = 1.3f;

struct Moments {
  double mass = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;  // central, bins of the fine grid
};

/// Moments of one of the histograms, both grids together.
Moments momentsOf(const BlockBins& bins, const DirectionTiles& tiles, int channel) {
  Moments m;
  for (int pass = 0; pass < 2; ++pass) {  // means first
    for (std::size_t k = 0; k < bins.tiles().size(); ++k) {
      const bool coarse = bins.tiles()[k] >= tiles.coarse.first;
      const DirectionTiles::Grid& grid = coarse ? tiles.coarse : tiles.fine;
      const int tile = bins.tiles()[k] - grid.first;
      for (int b = 0; b < BlockBins::kTileBins; ++b) {
        const double w = bins.values(k)[channel * BlockBins::kTileBins + b], scale = coarse ? 2 : 1;
        const double x = scale * ((tile % grid.tilesPerAxis() - 1) * BlockBins::kTile + b % BlockBins::kTile + 0.5);
        const double y = scale * ((tile / grid.tilesPerAxis() - 1) * BlockBins::kTile + b / BlockBins::kTile + 0.5);
        if (pass == 0) m.mass += w, m.x += w * x, m.y += w * y;
        if (pass == 1) m.xx += w * (x - m.x) * (x - m.x), m.xy += w * (x - m.x) * (y - m.y), m.yy += w * (y - m.y) * (y - m.y);
      }
    }
    if (pass == 0) m.x /= m.mass, m.y /= m.mass;
    if (pass == 1) m.xx /= m.mass, m.xy /= m.mass, m.yy /= m.mass;
  }
  return m;
}

/// Splats one triangle and compares its first moments with those of a uniform density over it.
/// @param scale  size of the triangle, disk units
void expectMoments(Vec2 a, Vec2 b, Vec2 c) {
  // Small against the blur that follows, or against the triangle itself.
  constexpr double kMass = 1e-5, kMean = 0.005 * kSigmaBins, kSpread = 0.1 * kSigmaBins * kSigmaBins, kOwn = 0.02;
  const DirectionTiles tiles(kBins);
  TriangleSplatter splatter(tiles, kSigmaBins);
  const float weights[kMoments] = {2, -1, 0.5f, 3};
  splatter.add(a, b, c, weights);
  BlockBins bins(tiles.count(), kMoments);
  splatter.moveTo(bins);
  for (int channel = 0; channel < kMoments; ++channel) {
    const Moments m = momentsOf(bins, tiles, channel);
    EXPECT_NEAR(m.mass, weights[channel], kMass * std::fabs(weights[channel]));
    // Corners about the centroid: their mean square over 12 is the triangle's own spread.
    const auto spread = [&](float Vec2::*s, float Vec2::*t) {
      const double ms = (a.*s + b.*s + c.*s) / 3, mt = (a.*t + b.*t + c.*t) / 3;
      const double sum = (a.*s - ms) * (a.*t - mt) + (b.*s - ms) * (b.*t - mt) + (c.*s - ms) * (c.*t - mt);
      return 0.25 * kBins * kBins * sum / 12;
    };
    const bool coarse = bins.tiles().front() >= tiles.coarse.first;
    const double spline = (coarse ? 4 : 1) / 3.0;
    const double own = spread(&Vec2::x, &Vec2::x) + spread(&Vec2::y, &Vec2::y), tolerance = kSpread + kOwn * own;
    const auto place = [](float n) { return 0.5 * kBins * (double{n} + 1); };
    EXPECT_NEAR(m.x, place((a.x + b.x + c.x) / 3), kMean);
    EXPECT_NEAR(m.y, place((a.y + b.y + c.y) / 3), kMean);
    EXPECT_NEAR(m.xx - spline, spread(&Vec2::x, &Vec2::x), tolerance);
    EXPECT_NEAR(m.xy, spread(&Vec2::x, &Vec2::y), tolerance);
    EXPECT_NEAR(m.yy - spline, spread(&Vec2::y, &Vec2::y), tolerance);
  }
}

TEST(TriangleSplatter, TrianglesOfAnyShapeKeepMassMeanAndSpread) {
  std::mt19937 random(4);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (const float size : {0.0f, 0.002f, 0.02f, 0.05f, 0.1f, 0.3f, 0.6f}) {
    for (int k = 0; k < 60; ++k) {
      const Vec2 centre = {0.3f * unit(random), 0.3f * unit(random)};
      const auto corner = [&] { return centre + size * Vec2{unit(random), unit(random)}; };
      const Vec2 a = corner(), b = corner();
      // Every third is a sliver, every third a segment.
      const Vec2 c = k % 3 == 0 ? corner() : k % 3 == 1 ? a + 0.05f * (corner() - a) : a;
      SCOPED_TRACE(testing::Message() << "size " << size << " triangle " << k);
      expectMoments(a, b, c);
      if (testing::Test::HasFailure()) return;
    }
  }
}

TEST(TriangleSplatter, TrianglesAlongTheAxesKeepMassMeanAndSpread) {
  for (const float size : {0.02f, 0.1f, 0.4f}) {
    expectMoments({0, 0}, {size, 0}, {0, size});
    expectMoments({0, 0}, {size, 0}, {size, size});
    expectMoments({-size, 0}, {size, 0}, {0, size});
    expectMoments({0, -size}, {0, size}, {size, 0});
    expectMoments({0, 0}, {size, 0}, {0.5f * size, 0});
    expectMoments({0, 0}, {0, size}, {0, 0.5f * size});
  }
}

}  // namespace
}  // namespace glint::bake::triangle_splat_test
