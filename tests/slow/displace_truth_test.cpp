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
    std::printf("kind %d: RMS %.4f\n", static_cast<int>(kind), std::sqrt(squares / count));
  }
}

}  // namespace
}  // namespace glint::bake
