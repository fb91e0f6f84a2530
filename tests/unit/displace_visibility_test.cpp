#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <random>

#include "glint/bake/displace/effective_brdf.h"
#include "glint/bake/displace/visibility_masks.h"
#include "support/test_heights.h"
#include "support/traced_surface.h"

namespace glint::bake::displace_visibility_test {
namespace {

using test::OwnedSurface;

/// Masks interpolate heights between cells and horizons between lines: the design's bound for that.
constexpr double kDisagreement = 0.01;
/// Rays that meet an edge exactly may go either way.
constexpr double kEdgeHits = 0.002;

Vec3 centroid(const HeightSurface& surface, std::size_t facet) { return surface.point(facet, 1.0f / 3, 1.0f / 3); }

TEST(Visibility, FlatSurfacesSeeTheWholeSky) {
  const OwnedSurface flat{8, 6, std::vector<float>(48, 3.0f)};
  const auto directions = angularDirections(15);
  const VisibilityMasks masks(flat.surface(), directions);
  for (std::size_t f = 0; f < flat.surface().facetCount(); ++f)
    for (std::size_t d = 0; d < directions.size(); ++d) ASSERT_TRUE(masks.visible(f, d));
}

TEST(Visibility, OfGroovesEndsAtTheRidge) {
  // From a wall's point at distance x from the valley's centre plane, the opposite ridge is half_width + x away and higher by
  // slope (half_width - x).
  const OwnedSurface map = test::grooves(16, 4, 8, 1);
  const auto surface = map.surface();
  const auto directions = angularDirections(15);
  const VisibilityMasks masks(surface, directions);
  for (std::size_t f = 0; f < surface.facetCount(); ++f) {
    const Vec3 p = centroid(surface, f), n = surface.normal(f);
    if (p.x < 1 || p.x > 15) continue;  // at the bottom, horizons are interpolated between the two walls
    for (std::size_t d = 0; d < directions.size(); ++d) {
      const Vec3 w = directions[d];
      if (std::abs(w.x) < 1e-3f || dot(n, w) < 0.05f) continue;
      // The surface is even in y, so only the rise for each step in x matters.
      const float ridge = w.x > 0 ? (p.x < 8 ? 8 : 24) : (p.x > 8 ? 8 : -8);
      const float margin = p.z + (ridge - p.x) * w.z / w.x - 8;
      if (std::abs(margin) < 0.05f) continue;
      EXPECT_EQ(masks.visible(f, d), margin > 0) << f << " " << d;
    }
  }
}

TEST(Visibility, AgreesWithTracedRays) {
  const auto directions = angularDirections(15);
  for (const SynthKind kind : {SynthKind::isotropic, SynthKind::weave, SynthKind::scratches, SynthKind::sawtooth}) {
    const OwnedSurface map = test::synthSurface(kind, 96, 64, 1.5f);
    const auto surface = map.surface();
    const VisibilityMasks masks(surface, directions);
    const test::TracedSurface traced(surface);
    std::mt19937 random(3);
    int tests = 0, different = 0, hidden = 0;
    for (int k = 0; k < 40000; ++k) {
      const std::size_t f = random() % surface.facetCount(), d = random() % directions.size();
      if (dot(surface.normal(f), directions[d]) <= 0) continue;
      const bool truth = traced.visible(centroid(surface, f), directions[d]);
      ++tests;
      hidden += !truth;
      different += masks.visible(f, d) != truth;
    }
    EXPECT_LT(different, kDisagreement * tests) << static_cast<int>(kind);
    EXPECT_GT(hidden, different) << static_cast<int>(kind);  // or the test says nothing
    RecordProperty("disagreement_" + std::to_string(static_cast<int>(kind)), std::to_string(1.0 * different / tests));
  }
}

TEST(Visibility, DoesNotDependOnThreads) {
  const OwnedSurface map = test::synthSurface(SynthKind::isotropic, 40, 56);
  const auto directions = angularDirections(9);
  const VisibilityMasks many(map.surface(), directions);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const VisibilityMasks single(map.surface(), directions);
  for (std::size_t f = 0; f < map.surface().facetCount(); ++f)
    for (std::size_t d = 0; d < directions.size(); ++d) ASSERT_EQ(many.visible(f, d), single.visible(f, d));
}

TEST(HeightTracer, HitsWhatEmbreeHits) {
  for (const SynthKind kind : {SynthKind::isotropic, SynthKind::weave, SynthKind::sawtooth}) {
    const OwnedSurface map = test::synthSurface(kind, 100, 56, 2);
    const auto surface = map.surface();
    const HeightTracer tracer(surface);
    const test::TracedSurface traced(surface);
    std::mt19937 random(5);
    std::normal_distribution<float> gauss;
    std::uniform_real_distribution<float> unit(0, 1);
    int tests = 0, hits = 0, different = 0;
    for (int k = 0; k < 40000; ++k) {
      const std::size_t f = random() % surface.facetCount();
      Vec3 w = {gauss(random), gauss(random), gauss(random)};
      w = (1 / std::sqrt(dot(w, w))) * w;
      if (dot(surface.normal(f), w) < 0) w = -1.0f * w;
      if (dot(surface.normal(f), w) < 0.01f) continue;
      const float u = unit(random), v = (1 - u) * unit(random);
      const Vec3 p = surface.point(f, u, v);
      const auto hit = tracer.trace(f, p, w);
      const auto truth = traced.trace(p, w);
      ++tests;
      hits += truth.has_value();
      const bool same =
          hit.has_value() == truth.has_value() &&
          (!hit || (std::abs(hit->distance - truth->distance) < 1e-2f && std::abs(hit->point.z - truth->point.z) < 1e-2f));
      different += !same;
    }
    EXPECT_LT(different, kEdgeHits * tests) << static_cast<int>(kind);
    EXPECT_GT(hits, tests / 20);
  }
}

TEST(HeightTracer, LetsNothingFallThroughTheSurface) {
  const OwnedSurface map = test::synthSurface(SynthKind::isotropic, 64, 64, 3);
  const auto surface = map.surface();
  const HeightTracer tracer(surface);
  std::mt19937 random(7);
  std::normal_distribution<float> gauss;
  for (int k = 0; k < 100000; ++k) {
    const std::size_t f = random() % surface.facetCount();
    Vec3 w = {gauss(random), gauss(random), -std::abs(gauss(random))};
    w = (1 / std::sqrt(dot(w, w))) * w;
    if (dot(surface.normal(f), w) <= 0) continue;
    ASSERT_TRUE(tracer.trace(f, centroid(surface, f), w)) << "a descending ray escaped";
  }
}

TEST(HeightTracer, RaysAlongAFlatSurfaceEnd) {
  const OwnedSurface flat{4, 4, std::vector<float>(16, 1.0f)};
  const HeightTracer tracer(flat.surface());
  EXPECT_FALSE(tracer.trace(0, {0.2f, 0.2f, 1}, {1, 0, 0}));
  EXPECT_FALSE(tracer.trace(0, {0.2f, 0.2f, 1}, {0, 0, 1}));
}

}  // namespace
}  // namespace glint::bake::displace_visibility_test
