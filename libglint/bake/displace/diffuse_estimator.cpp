#include "glint/bake/displace/diffuse_estimator.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/displace/brdf_sums.h"
#include "glint/bake/displace/effective_kernels.h"
#include "glint/bake/displace/ordered_sums.h"

namespace glint::bake {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr std::size_t kWalks = 1 << 18;  // walks in all patches together, unless the options give a number

/// Follows a random walk from a facet through diffuse reflections, and collects the light from every direction that reaches the
/// facet along it.
/// @param rows  rows[channel * stride + d]: on entry, channel 0 has the masked cosines of the facet towards directions d; on
///              return, each channel has the light from direction d that the facet reflects, without the base's albedo / pi
void walk(const BrdfScene& scene, std::size_t facet, std::uint64_t index, std::size_t stride, float* rows, float* scratch,
          LightShares& shares) {
  const std::size_t channels = scene.channels(), n = scene.directions.count;
  Color throughput = scene.base.color(facet);
  float largest = 1, longest = 0;
  // Light that arrives directly, from all directions.
  double light = 0;
  for (std::size_t d = 0; d < n; ++d) light += rows[d];
  shares.all += meanOf(throughput, channels) * light;
  if (scene.base.colored())
    for (std::size_t c = channels; c-- > 0;)
      for (std::size_t d = 0; d < n; ++d) rows[c * stride + d] = throughput[c] * rows[d];
  Vec3 point = scene.pointOf(facet, index);
  for (int bounce = 1; bounce < scene.options.bounces && largest > kLeastThroughput; ++bounce) {
    // Turn to a random direction, with a density in proportion to its cosine, and go to the facet that lies there.
    const Vec2 xi = randomPair(scene.options.seed, kTurnStream + static_cast<std::uint64_t>(bounce), index);
    const float radius = std::sqrt(xi.x), angle = 2 * kPi * xi.y;
    const Vec3 local = {radius * std::cos(angle), radius * std::sin(angle), std::sqrt(1 - xi.x)};
    const auto hit = scene.tracer.trace(facet, point, FacetFrame(scene.surface.normal(facet)).toWorld(local));
    if (!hit) return;
    facet = hit->facet, point = hit->point;
    largest = attenuate(throughput, scene.base.color(facet), scene.options.base.albedo, channels);
    longest = std::max(longest, hit->distance);
    // Add the light that arrives at this facet and comes back along the walk.
    scene.facingRow(facet, scratch);
    light = 0;
    for (std::size_t d = 0; d < n; ++d) light += scratch[d];
    for (std::size_t c = 0; c < channels; ++c)
      for (std::size_t d = 0; d < n; ++d) rows[c * stride + d] += throughput[c] * scratch[d];
    light *= meanOf(throughput, channels);
    shares.all += light;
    shares.addHop(light, longest, scene.options.distant_cells);
  }
}

/// Adds the samples of a chunk: a matrix product of the light that facets reflect and the area that they show to each view.
void addSamples(const BrdfScene& scene, const PatchFacets& facets, const SampleChunk& chunk, ChunkSums& sums,
                LightShares& shares) {
  const std::size_t size = scene.directions.padded, stride = kKernelSamples * size;
  std::vector<float> views(stride), lights(scene.channels() * stride), scratch(size);
  for (std::size_t start = chunk.first; start < chunk.last; start += kKernelSamples) {
    const std::size_t count = std::min(kKernelSamples, chunk.last - start);
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint64_t index =
          (start + k) * static_cast<std::size_t>(scene.grid.count()) + static_cast<std::size_t>(chunk.patch);
      const std::size_t facet = facets.facet(start + k, randomPair(scene.options.seed, kFacetStream, index).x);
      float* view = &views[k * size];
      float* light = &lights[k * size];
      scene.facingRow(facet, light);
      const float area = 1 / scene.surface.normal(facet).z;
      for (std::size_t d = 0; d < size; ++d) sums.areas[d] += view[d] = area * light[d];
      walk(scene, facet, index, stride, light, scratch.data(), shares);
    }
    for (std::size_t c = 0; c < scene.channels(); ++c)
      addProducts(&lights[c * stride], views.data(), count, size, &sums.pairs[c * size * size]);
  }
}

}  // namespace

EffectiveBrdf estimateDiffuse(const BrdfScene& scene, const ProgressFn& progress) {
  const std::vector<PatchFacets> patches = scene.patches(scene.options.walks > 0 ? scene.options.walks : kWalks);
  const std::vector<SampleChunk> chunks = makeChunks(patches);
  std::vector<LightShares> shares(chunks.size());
  ProgressCounter counter(progress, chunks.size());
  const auto sumOf = [&](std::size_t c) {
    ChunkSums sums = emptySums(scene);
    addSamples(scene, patches[static_cast<std::size_t>(chunks[c].patch)], chunks[c], sums, shares[c]);
    counter.advance();
    return sums;
  };
  BrdfSums sums(scene);
  LightShares total;
  addInOrder(chunks.size(), chunkBytes(scene), sumOf, [&](std::size_t c, const ChunkSums& of_chunk) {
    const auto samples = static_cast<double>(patches[static_cast<std::size_t>(chunks[c].patch)].samples());
    sums.addChunk(scene, chunks[c], of_chunk, samples, scene.options.base.albedo / kPi);
    total.add(shares[c]);
  });
  return sums.finish(scene, total);
}

}  // namespace glint::bake
