// Effective BRDFs against a path tracer that shares nothing with the estimators: Embree's triangles, rays to every direction from
// random points instead of masks, and no correction.

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <array>
#include <numbers>

#include "glint/bake/counter_random.h"
#include "glint/bake/effective_brdf.h"
#include "glint/query/base_brdf.h"
#include "support/test_heights.h"
#include "support/traced_surface.h"

namespace glint::bake {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kCosine70 = 0.342f;
/// The bound. The noise of the truth itself is about 0.4 %.
constexpr double kRms = 0.01;
constexpr std::size_t kWalks = 120000;
constexpr std::size_t kParts = 24;

/// Masked cosines of a point towards all directions.
std::vector<float> tracedCosines(const test::TracedSurface& traced, Vec3 point, Vec3 normal, std::span<const Vec3> directions) {
  std::vector<float> row(directions.size());
  for (std::size_t d = 0; d < directions.size(); ++d) {
    const float cosine = dot(normal, directions[d]);
    if (cosine > 0 && traced.visible(point, directions[d])) row[d] = cosine;
  }
  return row;
}

Vec3 cosineDirection(Vec3 n, Vec2 xi) {
  // A point of the unit sphere around the tip of the normal.
  const float z = 1 - 2 * xi.x, r = std::sqrt(std::max(0.0f, 1 - z * z));
  const Vec3 sum = n + Vec3{r * std::cos(2 * kPi * xi.y), r * std::sin(2 * kPi * xi.y), z};
  return (1 / std::sqrt(std::max(1e-12f, dot(sum, sum)))) * sum;
}

/// Diffuse interreflections by plain path tracing.
std::vector<double> tracedBrdf(const HeightSurface& surface, std::span<const Vec3> directions, float albedo) {
  const test::TracedSurface traced(surface);
  const std::size_t n = directions.size();
  std::vector<std::vector<double>> parts(kParts, std::vector<double>(n * n));
  tbb::parallel_for(std::size_t{0}, kParts, [&](std::size_t part) {
    for (std::size_t walk = part; walk < kWalks; walk += kParts) {
      std::uint64_t draw = 0;
      const auto random = [&] { return randomPair(77, walk, draw++); };
      std::size_t facet = static_cast<std::size_t>(random().x * static_cast<float>(surface.facetCount()));
      Vec2 xi = random();
      if (xi.x + xi.y > 1) xi = {1 - xi.x, 1 - xi.y};
      Vec3 point = surface.point(facet, xi.x, xi.y), normal = surface.normal(facet);
      const std::vector<float> views = tracedCosines(traced, point, normal, directions);
      std::vector<float> lights = views;
      const float area = 1 / normal.z;
      float throughput = 1;
      for (int bounce = 1; bounce < 40; ++bounce) {
        const Vec3 w = cosineDirection(normal, random());
        const auto hit = traced.trace(point, w);
        if (!hit) break;
        throughput *= albedo;
        point = hit->point, normal = surface.normal(hit->facet);
        const std::vector<float> more = tracedCosines(traced, point, normal, directions);
        for (std::size_t d = 0; d < n; ++d) lights[d] += throughput * more[d];
      }
      for (std::size_t i = 0; i < n; ++i)
        for (std::size_t o = 0; o < n; ++o) parts[part][i * n + o] += area * lights[i] * views[o];
    }
  });
  std::vector<double> sum(n * n);
  for (const auto& part : parts)
    for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += albedo / (kPi * kWalks) * part[k];
  return sum;
}

TEST(EffectiveBrdfTruth, DiffuseInterreflectionsAgreeWithAPathTracer) {
  const auto directions = angularDirections(7);
  const std::size_t n = directions.size();
  for (const SynthKind kind : {SynthKind::isotropic, SynthKind::weave, SynthKind::scratches, SynthKind::sawtooth}) {
    const test::OwnedSurface map = test::synthSurface(kind, 96, 64);
    const auto surface = map.surface();
    const VisibilityMasks masks(surface, directions);
    EffectiveOptions options;
    options.base.albedo = 0.8f;
    const EffectiveBrdf fast = effectiveBrdf(surface, masks, directions, {1, 1, 96, 64, 1}, options);
    const std::vector<double> truth = tracedBrdf(surface, directions, 0.8f);
    double squares = 0, count = 0;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t o = 0; o < n; ++o) {
        if (directions[i].z < kCosine70 || directions[o].z < kCosine70) continue;
        const double symmetric = 0.5 * (truth[i * n + o] + truth[o * n + i]);
        const double relative = fast.values[i * n + o] / symmetric - 1;
        squares += relative * relative, ++count;
      }
    }
    EXPECT_LT(std::sqrt(squares / count), kRms) << static_cast<int>(kind);
    RecordProperty("rms_" + std::to_string(static_cast<int>(kind)), std::to_string(std::sqrt(squares / count)));
  }
}

/// Glossy reflections seen from one direction by plain path tracing: turns are drawn by the cosine, not by the base.
std::vector<double> tracedView(const HeightSurface& surface, const test::TracedSurface& traced,
                               std::span<const Vec3> directions, std::size_t view, const BaseBrdf& base) {
  std::vector<std::vector<double>> parts(kParts, std::vector<double>(directions.size()));
  tbb::parallel_for(std::size_t{0}, kParts, [&](std::size_t part) {
    for (std::size_t walk = part; walk < kWalks; walk += kParts) {
      std::uint64_t draw = 0;
      const auto random = [&] { return randomPair(78 + view, walk, draw++); };
      const std::size_t facet = static_cast<std::size_t>(random().x * static_cast<float>(surface.facetCount()));
      Vec2 xi = random();
      if (xi.x + xi.y > 1) xi = {1 - xi.x, 1 - xi.y};
      Vec3 point = surface.point(facet, xi.x, xi.y), normal = surface.normal(facet), back = directions[view];
      if (dot(normal, back) <= 0 || !traced.visible(point, back)) continue;
      double weight = dot(normal, back) / normal.z;
      for (int bounce = 0; bounce < 30; ++bounce) {
        const float facing = std::max(1e-4f, dot(normal, back));
        for (std::size_t i = 0; i < directions.size(); ++i) {
          const float reflected = baseTimesCosines(base, normal, directions[i], back);
          if (reflected > 0 && traced.visible(point, directions[i])) parts[part][i] += weight * reflected / facing;
        }
        const Vec3 w = cosineDirection(normal, random());
        weight *= kPi * baseTimesCosines(base, normal, w, back) / (facing * std::max(1e-4f, dot(normal, w)));
        const auto hit = traced.trace(point, w);
        if (!hit) break;
        point = hit->point, normal = surface.normal(hit->facet), back = -1.0f * w;
      }
    }
  });
  std::vector<double> sum(directions.size());
  for (const auto& part : parts)
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += part[i] / kWalks;
  return sum;
}

TEST(EffectiveBrdfTruth, GlossyInterreflectionsAgreeWithAPathTracer) {
  const auto directions = angularDirections(5);
  const BaseBrdf base{BaseBrdf::Kind::ggx, 1, 0.5f, 0.2f, 3.9f};
  for (const SynthKind kind : {SynthKind::isotropic, SynthKind::weave}) {
    const test::OwnedSurface map = test::synthSurface(kind, 96, 64);
    const auto surface = map.surface();
    const VisibilityMasks masks(surface, directions);
    const EffectiveBrdf fast = effectiveBrdf(surface, masks, directions, {1, 1, 96, 64, 1}, {base, kAllBounces, 1, {}, 0, 0});
    const test::TracedSurface traced(surface);
    double difference = 0, norm = 0;
    for (const std::size_t view : {12u, 6u, 8u}) {
      const std::vector<double> truth = tracedView(surface, traced, directions, view, base);
      for (std::size_t i = 0; i < directions.size(); ++i) {
        if (directions[i].z < kCosine70) continue;
        const double d = fast.values[i * directions.size() + view] - truth[i];
        difference += d * d, norm += truth[i] * truth[i];
      }
    }
    EXPECT_LT(std::sqrt(difference / norm), kRms) << static_cast<int>(kind);
    EXPECT_GT(fast.interreflected, 0.02);
    RecordProperty("rms_" + std::to_string(static_cast<int>(kind)), std::to_string(std::sqrt(difference / norm)));
  }
}

}  // namespace
}  // namespace glint::bake
