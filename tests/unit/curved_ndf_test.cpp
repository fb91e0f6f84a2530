#include "glint/query/curved_ndf.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "glint/bake/common/counter_random.h"
#include "glint/query/reference.h"
#include "support/test_maps.h"

namespace glint::curved_ndf_test {
namespace {

constexpr float kSigmaR = 0.02f;

const test::OwnedMap& map() {
  static const test::OwnedMap owned(64, 64, test::roughSurface(64, 64, 0.2f));
  return owned;
}

const Footprint kFootprint = Footprint::isotropic({0.3f, 0.6f}, 2);

TEST(CurvedNdf, IsTheModelWhereTheSurfaceIsFlat) {
  const Reference model(map().map(), kSigmaR);
  const CurvedNdf<Reference> flat(model, {0, std::numeric_limits<float>::quiet_NaN()});
  for (const Vec2 h : {Vec2{0, 0}, Vec2{0.1f, -0.05f}, Vec2{0.5f, 0.5f}}) {
    EXPECT_EQ(flat.density(kFootprint, h), model.density(kFootprint, h));
    EXPECT_EQ(flat.mean(kFootprint, {h, h + Vec2{0.1f, 0.2f}}), model.mean(kFootprint, {h, h + Vec2{0.1f, 0.2f}}));
  }
  EXPECT_EQ(flat.sample(kFootprint, {0.3f, 0.7f}).h, model.sample(kFootprint, {0.3f, 0.7f}).h);
}

/// Average of a function over the half vectors of a pixel: a box of these half widths.
template <class F>
double averageOver(Vec2 half, const F& value) {
  constexpr int kPoints = 40;
  double sum = 0;
  for (int j = 0; j < kPoints; ++j) {
    for (int i = 0; i < kPoints; ++i) {
      const auto at = [](int k) { return (2 * (static_cast<float>(k) + 0.5f) / kPoints - 1); };
      sum += value(Vec2{half.x * at(i), half.y * at(j)});
    }
  }
  return sum / (kPoints * kPoints);
}

TEST(CurvedNdf, IsTheAverageOverTheHalfVectorsOfThePixel) {
  const Reference model(map().map(), kSigmaR);
  for (const Vec2 spread : {Vec2{0.03f, 0.01f}, Vec2{0.1f, 0.1f}, Vec2{0.05f, 0}}) {
    const CurvedNdf<Reference> curved(model, spread);
    for (const Vec2 h : {Vec2{0, 0}, Vec2{0.1f, -0.05f}, Vec2{-0.2f, 0.15f}}) {
      const double truth = averageOver(spread, [&](Vec2 offset) { return model.density(kFootprint, h + offset); });
      EXPECT_NEAR(curved.density(kFootprint, h), truth, 0.02 * truth + 1e-3);
      for (const Vec2 size : {Vec2{0.12f, 0.08f}, Vec2{0.004f, 0.004f}, Vec2{0.3f, 0.01f}}) {
        const Box2 range = {h, h + size};
        const double mean = averageOver(spread, [&](Vec2 offset) {
          return model.mean(kFootprint, {range.low + offset, range.high + offset});
        });
        EXPECT_NEAR(curved.mean(kFootprint, range), mean, 0.03 * mean + 5e-3);
      }
    }
  }
}

TEST(CurvedNdf, DrawsHalfVectorsByItsDensity) {
  const Reference model(map().map(), kSigmaR);
  const CurvedNdf<Reference> curved(model, {0.06f, 0.03f});
  constexpr int kSamples = 40000, kCells = 8;
  constexpr float kCell = 0.1f;  // cells of [-0.4, 0.4]^2
  std::vector<int> counts(kCells * kCells);
  for (int k = 0; k < kSamples; ++k) {
    const HalfVectorSample s = curved.sample(kFootprint, bake::randomPair(5, 0, k));
    if (k < 200) {
      ASSERT_EQ(s.pdf, curved.density(kFootprint, s.h));
    }
    const int i = static_cast<int>(std::floor(s.h.x / kCell)) + kCells / 2,
              j = static_cast<int>(std::floor(s.h.y / kCell)) + kCells / 2;
    if (i >= 0 && j >= 0 && i < kCells && j < kCells) ++counts[static_cast<std::size_t>(j * kCells + i)];
  }
  for (int j = 0; j < kCells; ++j) {
    for (int i = 0; i < kCells; ++i) {
      const Vec2 low = {kCell * static_cast<float>(i - kCells / 2), kCell * static_cast<float>(j - kCells / 2)};
      const double expected = kSamples * double{curved.mean(kFootprint, {low, low + Vec2{kCell, kCell}})} * kCell * kCell;
      // Four deviations of a count, and the rule of nine boxes.
      EXPECT_NEAR(counts[static_cast<std::size_t>(j * kCells + i)], expected, 4 * std::sqrt(expected) + 0.03 * expected + 5);
    }
  }
}

TEST(CurvedNdf, KeepsAllLight) {
  const Reference model(map().map(), kSigmaR);
  const CurvedNdf<Reference> curved(model, {0.08f, 0.02f});
  EXPECT_NEAR(curved.mean(kFootprint, {{-1, -1}, {1, 1}}), 0.25f, 1e-4f);
  EXPECT_EQ(curved.density(kFootprint, {1.2f, 0}), 0);
}

TEST(CurvedNdf, HalfVectorsTurnAsTheyDoFromOnePixelToTheNext) {
  // A ball, a distant light and an eye nearby: half vectors of two rays, each in the frame of its point.
  const auto unit = [](Vec3 v) { return (1 / std::sqrt(dot(v, v))) * v; };
  const Vec3 to_light = unit({0.3f, -0.2f, 1}), eye = {0.4f, 0.1f, 5};
  struct Seen {
    Vec3 n, wo;
  };
  const auto seenAt = [&](float x, float y) {
    const Vec3 n = unit({x, y, 1});
    return Seen{n, unit(eye + -1.0f * n)};
  };
  // Frames that do not twist from one point to the next: along the projection of x, and of y.
  const auto local = [&](const Seen& seen, Vec3 w) {
    const Vec3 s = unit(Vec3{1, 0, 0} + (-seen.n.x) * seen.n);
    const Vec3 t = {seen.n.y * s.z - seen.n.z * s.y, seen.n.z * s.x - seen.n.x * s.z, seen.n.x * s.y - seen.n.y * s.x};
    return Vec3{dot(w, s), dot(w, t), dot(w, seen.n)};
  };
  constexpr float kStep = 1e-3f;
  const Seen here = seenAt(0.1f, 0);
  for (const auto& [dx, dy] : std::vector<std::pair<float, float>>{{kStep, 0}, {0, kStep}}) {
    const Seen next = seenAt(0.1f + dx, dy);
    const HalfVector h = halfVectorOf(local(here, to_light), local(here, here.wo));
    const HalfVector moved = halfVectorOf(local(next, to_light), local(next, next.wo));
    const Vec2 turn = halfVectorDifferential(h, local(here, next.n + -1.0f * here.n), local(here, next.wo + -1.0f * here.wo));
    EXPECT_NEAR(turn.x, moved.disk.x - h.disk.x, 0.05f * kStep);
    EXPECT_NEAR(turn.y, moved.disk.y - h.disk.y, 0.05f * kStep);
  }
  const Vec2 spread = halfVectorSpread({0.03f, 0}, {0.04f, 0.02f}, 0.5f);
  EXPECT_FLOAT_EQ(spread.x, 0.05f);
  EXPECT_FLOAT_EQ(spread.y, 0.02f);
}

}  // namespace
}  // namespace glint::curved_ndf_test
