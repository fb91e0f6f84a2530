#include "glint/bake/displace/glossy_estimator.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <vector>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/displace/brdf_sums.h"
#include "glint/bake/displace/effective_kernels.h"
#include "glint/bake/displace/ordered_sums.h"
#include "glint/bake/displace/table_kernels.h"
#include "glint/query/brdf/base_brdf.h"

namespace glint::bake {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

/// Adds single reflections from the GGX facets of a chunk, without Fresnel's factor and 1 / (4 pi).
void addSamples(const BrdfScene& scene, const PatchFacets& facets, const SampleChunk& chunk, std::span<const Vec3> half,
                ChunkSums& sums) {
  const std::size_t n = scene.directions.count, channels = scene.channels();
  std::vector<float> x(kKernelSamples), y(kKernelSamples), z(kKernelSamples), bend(kKernelSamples), colors(3 * kKernelSamples),
      masked(n * kKernelSamples), row(scene.directions.padded);
  for (std::size_t start = chunk.first; start < chunk.last; start += kKernelSamples) {
    const std::size_t count = std::min(kKernelSamples, chunk.last - start), used = (count + 7) / 8 * 8;
    for (std::size_t k = 0; k < used; ++k) {
      // Fill up to a multiple of 8 with the last facet, without light.
      const bool padding = k >= count;
      const std::uint64_t index = std::min(start + k, chunk.last - 1) * static_cast<std::size_t>(scene.grid.count()) +
                                  static_cast<std::size_t>(chunk.patch);
      const std::size_t facet =
          facets.facet(std::min(start + k, chunk.last - 1), randomPair(scene.options.seed, kFacetStream, index).x);
      const Vec3 normal = scene.surface.normal(facet);
      const Color color = scene.base.color(facet);
      const float alpha = scene.base.of(facet).alpha;
      x[k] = normal.x, y[k] = normal.y, z[k] = normal.z, bend[k] = alpha * alpha - 1;
      for (std::size_t c = 0; c < channels; ++c) colors[c * kKernelSamples + k] = color[c];
      scene.facingRow(facet, row.data());
      const float area = padding ? 0 : 1 / normal.z;
      // The kernel multiplies the rows of two directions, so each row has the root of the facet's weight. The weight includes
      // the colour where there is one channel.
      const float weight = alpha * std::sqrt(channels == 1 ? area * color[0] : area);
      for (std::size_t d = 0; d < n; ++d) masked[d * used + k] = row[d] > 0 ? weight * ggxMasking(row[d], alpha) : 0.0f;
      for (std::size_t d = 0; d < n; ++d) sums.areas[d] += area * row[d];
    }
    const FacetArrays arrays{x.data(), y.data(), z.data(), bend.data(), masked.data(), used};
    if (channels == 1)
      addGgxPairs(arrays, half, n, scene.directions.padded, sums.pairs.data());
    else
      addColoredGgxPairs(arrays, colors.data(), kKernelSamples, half, n, scene.directions.padded, sums.pairs.data());
  }
}

/// Adds single reflections from the facets of a chunk whose base is a table.
void addTableSamples(const BrdfScene& scene, const PatchFacets& facets, const SampleChunk& chunk,
                     std::span<const TablePair> pairs, ChunkSums& sums) {
  static_assert(kKernelSamples <= kMostTableFacets);
  const std::size_t n = scene.directions.count, channels = scene.channels();
  std::vector<float> x(kKernelSamples), y(kKernelSamples), z(kKernelSamples), colors(4 * kKernelSamples),
      masked(n * kKernelSamples), row(scene.directions.padded);
  for (std::size_t start = chunk.first; start < chunk.last; start += kKernelSamples) {
    const std::size_t count = std::min(kKernelSamples, chunk.last - start), used = (count + 7) / 8 * 8;
    for (std::size_t k = 0; k < used; ++k) {
      // Fill up to a multiple of 8 with the last facet, without light.
      const std::size_t sample = std::min(start + k, chunk.last - 1);
      const std::uint64_t index = sample * static_cast<std::size_t>(scene.grid.count()) + static_cast<std::size_t>(chunk.patch);
      const std::size_t facet = facets.facet(sample, randomPair(scene.options.seed, kFacetStream, index).x);
      const Vec3 normal = scene.surface.normal(facet);
      const Color color = scene.base.color(facet);
      x[k] = normal.x, y[k] = normal.y, z[k] = normal.z;
      std::copy(color.begin(), color.end(), &colors[4 * k]);
      scene.facingRow(facet, row.data());
      const float area = k >= count ? 0 : 1 / normal.z, weight = std::sqrt(channels == 1 ? area * color[0] : area);
      for (std::size_t d = 0; d < n; ++d) masked[d * used + k] = weight * row[d];
      for (std::size_t d = 0; d < n; ++d) sums.areas[d] += area * row[d];
    }
    const bool plain = channels == 1 || !scene.base.colored();
    addTablePairs(scene.options.table->nodes(),
                  {x.data(), y.data(), z.data(), masked.data(), plain ? nullptr : colors.data(), used}, pairs, n, channels,
                  scene.directions.padded, sums.pairs.data());
  }
}

/// Draws a microscopic normal of a GGX facet from the normals that a view sees (Heitz 2018). All vectors are in the frame of
/// the facet.
Vec3 visibleGgxNormal(Vec3 view, float alpha, Vec2 xi) {
  const Vec3 stretched = {alpha * view.x, alpha * view.y, view.z};
  const Vec3 v = (1 / std::sqrt(dot(stretched, stretched))) * stretched;
  const float across = v.x * v.x + v.y * v.y;
  const Vec3 t1 = across > 0 ? (1 / std::sqrt(across)) * Vec3{-v.y, v.x, 0} : Vec3{1, 0, 0};
  const Vec3 t2 = {v.y * t1.z - v.z * t1.y, v.z * t1.x - v.x * t1.z, v.x * t1.y - v.y * t1.x};
  const float r = std::sqrt(xi.x), angle = 2 * kPi * xi.y;
  const float p1 = r * std::cos(angle), s = 0.5f * (1 + v.z);
  const float p2 = (1 - s) * std::sqrt(std::max(0.0f, 1 - p1 * p1)) + s * r * std::sin(angle);
  const Vec3 n = p1 * t1 + p2 * t2 + std::sqrt(std::max(0.0f, 1 - p1 * p1 - p2 * p2)) * v;
  const Vec3 m = {alpha * n.x, alpha * n.y, std::max(1e-6f, n.z)};
  return (1 / std::sqrt(dot(m, m))) * m;
}

/// A direction that a walk turns to, in the frame of the facet, and f cos over its density. No light: z is not above 0.
struct Turn {
  Vec3 direction;
  Color weight = {1, 1, 1};
};

/// Mirrors the view at a microscopic normal.
Turn turnGgx(const BaseBrdf& base, Vec3 view, Vec2 xi) {
  const Vec3 m = visibleGgxNormal(view, base.alpha, xi);
  const float cosine = dot(m, view);
  Turn turn{2 * cosine * m - view};
  if (turn.direction.z > 0)
    turn.weight.fill(conductorFresnel(cosine, base.eta, base.k) * ggxMasking(turn.direction.z, base.alpha));
  return turn;
}

/// Draws from the mixture that fits the table, and weights with the table itself.
Turn turnTable(const MeasuredBrdf& table, Vec3 view, Vec2 xi) {
  const float share = table.diffuseShare(), alpha = table.base().alpha;
  Turn turn;
  if (xi.x < share) {
    const float unit = xi.x / share, radius = std::sqrt(unit), angle = 2 * kPi * xi.y;
    turn.direction = {radius * std::cos(angle), radius * std::sin(angle), std::sqrt(1 - unit)};
  } else {
    const Vec3 m = visibleGgxNormal(view, alpha, {(xi.x - share) / (1 - share), xi.y});
    turn.direction = 2 * dot(m, view) * m - view;
  }
  const float pdf = tableSamplePdf(alpha, share, view, turn.direction);
  if (!(pdf > 0)) return {};
  const Rgb f = table.value(tablePair(view, turn.direction), {0, 0, 1});
  const float scale = turn.direction.z / pdf;
  turn.weight = {scale * f.r, scale * f.g, scale * f.b};
  return turn;
}

/// Rows over all directions, which walks use again.
struct Scratch {
  explicit Scratch(const BrdfScene& scene)
      : visible(scene.directions.padded),
        light(scene.channels() * scene.directions.padded),
        sum(scene.channels() * scene.directions.padded) {}
  std::vector<float> visible;
  std::vector<float> light;  ///< [channels][padded directions]: of one facet; ggx: the first channel alone
  std::vector<float> sum;    ///< [channels][padded directions]: light of all walks
};

/// Adds the light from every direction that a facet reflects back along a walk.
/// @return the light of all directions, the mean of the channels
double addLights(const BrdfScene& scene, std::size_t facet, Vec3 back, const Color& throughput, float scale, Scratch& scratch) {
  const std::size_t channels = scene.channels(), n = scene.directions.count, padded = scene.directions.padded;
  const Vec3 normal = scene.surface.normal(facet);
  const MeasuredBrdf* table = scene.options.table.get();
  scene.masks.expand(facet, scratch.visible.data());
  std::fill(scratch.light.begin(), scratch.light.end(), 0.0f);
  if (table != nullptr)
    addTableLights(table->nodes(), scene.directions, scratch.visible.data(), normal, back, channels, scale,
                   scratch.light.data());
  else
    addGgxLights(scene.directions, scratch.visible.data(), normal, back, scene.base.of(facet), scale, scratch.light.data());
  double all = 0;
  for (std::size_t c = 0; c < channels; ++c) {
    const float* light = &scratch.light[table != nullptr ? c * padded : 0];
    double sum = 0;
    for (std::size_t d = 0; d < n; ++d) sum += light[d];
    for (std::size_t d = 0; d < n; ++d) scratch.sum[c * padded + d] += throughput[c] * light[d];
    all += throughput[c] * sum;
  }
  return all / static_cast<double>(channels);
}

/// Follows a view through glossy reflections, and adds the light that every facet after the first one reflects into the view.
/// @param scale  weight of the walk
void walk(const BrdfScene& scene, std::size_t facet, std::size_t view, std::uint64_t index, float scale, Scratch& scratch,
          LightShares& shares) {
  const std::size_t channels = scene.channels();
  Vec3 point = scene.pointOf(facet, index), back = scene.directions.at(view);
  Color throughput = scene.base.color(facet);
  float largest = 1, longest = 0;
  for (int bounce = 1; bounce < scene.options.bounces && largest > kLeastThroughput; ++bounce) {
    const FacetFrame frame(scene.surface.normal(facet));
    const Vec3 local = frame.toLocal(back);
    const Vec2 xi = randomPair(scene.options.seed, kTurnStream + static_cast<std::uint64_t>(bounce), index);
    const Turn turn =
        scene.options.table ? turnTable(*scene.options.table, local, xi) : turnGgx(scene.base.of(facet), local, xi);
    if (turn.direction.z <= 0) return;
    const Vec3 direction = frame.toWorld(turn.direction);
    const auto hit = scene.tracer.trace(facet, point, direction);
    if (!hit) return;
    facet = hit->facet, point = hit->point, back = -1.0f * direction;
    Color weight = scene.base.color(facet);
    for (std::size_t c = 0; c < channels; ++c) weight[c] *= turn.weight[c];
    largest = attenuate(throughput, weight, 1, channels);
    longest = std::max(longest, hit->distance);
    shares.addHop(addLights(scene, facet, back, throughput, scale, scratch), longest, scene.options.distant_cells);
  }
}

/// Adds the interreflections that one view sees, in all patches.
LightShares followView(const BrdfScene& scene, const std::vector<PatchFacets>& patches, std::size_t view, BrdfSums& sums) {
  LightShares shares;
  Scratch scratch(scene);
  const Vec3 direction = scene.directions.at(view);
  for (std::size_t p = 0; p < patches.size(); ++p) {
    std::fill(scratch.sum.begin(), scratch.sum.end(), 0.0f);
    for (std::size_t s = 0; s < patches[p].samples(); ++s) {
      const std::uint64_t index = (s * patches.size() + p) * scene.directions.count + view;
      const std::size_t facet = patches[p].facet(s, randomPair(scene.options.seed, kFacetStream, index).x);
      const Vec3 normal = scene.surface.normal(facet);
      const float cosine = dot(normal, direction);
      if (cosine <= 0 || !scene.masks.visible(facet, view)) continue;
      walk(scene, facet, view, index, cosine / (normal.z * static_cast<float>(patches[p].samples())), scratch, shares);
    }
    for (std::size_t c = 0; c < scene.channels(); ++c)
      for (std::size_t i = 0; i < scene.directions.count; ++i)
        sums.at(c, p, i, view) += scratch.sum[c * scene.directions.padded + i];
  }
  return shares;
}

/// Completes the sums of single reflections, which have pairs i <= o only: multiplies by Fresnel's factor (ggx), and copies each pair
/// to the pair with light and view exchanged.
void completePairs(const BrdfScene& scene, BrdfSums& sums) {
  std::vector<double>& values = sums.values();
  const std::size_t n = scene.directions.count;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t o = i; o < n; ++o) {
      const Vec3 sum = scene.directions.at(i) + scene.directions.at(o);
      const float fresnel =
          scene.options.table ? 1
                              : conductorFresnel(0.5f * std::sqrt(dot(sum, sum)), scene.options.base.eta, scene.options.base.k);
      for (std::size_t plane = 0; plane < values.size(); plane += n * n)  // channels and patches
        values[plane + o * n + i] = values[plane + i * n + o] *= fresnel;
    }
  }
}

/// Number of facets that single reflections are summed over, and of walks from each view. Narrow lobes need more samples for
/// the same noise.
struct GlossySamples {
  std::size_t facets;
  std::size_t walks;
};

/// A table costs several times as much a facet as GGX: fewer of them take its time.
GlossySamples tableSamplesFor(float alpha) {
  if (alpha >= 0.25f) return {1 << 16, 1 << 12};
  if (alpha >= 0.15f) return {1 << 17, 1 << 14};
  return {1 << 19, 5 << 14};
}

GlossySamples samplesFor(const BrdfScene& scene) {
  const float alpha = scene.base.leastAlpha();
  if (scene.options.table) return tableSamplesFor(alpha);
  if (alpha >= 0.25f) return {1 << 18, 1 << 13};
  if (alpha >= 0.15f) return {1 << 19, 1 << 15};
  return {1 << 21, 5 << 15};
}

/// Unit half vectors of all pairs of directions.
std::vector<Vec3> halfVectors(const DirectionTable& directions) {
  const std::size_t n = directions.count;
  std::vector<Vec3> half(n * n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t o = 0; o < n; ++o) {
      const Vec3 sum = directions.at(i) + directions.at(o);
      half[i * n + o] = (1 / std::sqrt(dot(sum, sum))) * sum;
    }
  }
  return half;
}

/// Frames of all pairs of directions.
std::vector<TablePair> tablePairs(const DirectionTable& directions) {
  const std::size_t n = directions.count;
  std::vector<TablePair> pairs(n * n);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t o = i; o < n; ++o) pairs[i * n + o] = tablePair(directions.at(i), directions.at(o));
  return pairs;
}

/// Adds the single reflections of all chunks.
void addSingleReflections(const BrdfScene& scene, const std::vector<PatchFacets>& patches,
                          const std::vector<SampleChunk>& chunks, ProgressCounter& counter, BrdfSums& sums) {
  const bool table = scene.options.table != nullptr;
  const std::vector<Vec3> half = table ? std::vector<Vec3>() : halfVectors(scene.directions);
  const std::vector<TablePair> pairs = table ? tablePairs(scene.directions) : std::vector<TablePair>();
  const auto sumOf = [&](std::size_t c) {
    ChunkSums of_chunk = emptySums(scene);
    const PatchFacets& facets = patches[static_cast<std::size_t>(chunks[c].patch)];
    if (table)
      addTableSamples(scene, facets, chunks[c], pairs, of_chunk);
    else
      addSamples(scene, facets, chunks[c], half, of_chunk);
    counter.advance();
    return of_chunk;
  };
  addInOrder(chunks.size(), chunkBytes(scene), sumOf, [&](std::size_t c, const ChunkSums& of_chunk) {
    sums.addChunk(scene, chunks[c], of_chunk, static_cast<double>(patches[static_cast<std::size_t>(chunks[c].patch)].samples()),
                  table ? 1 : 1 / (4 * kPi));
  });
  completePairs(scene, sums);
}

/// Adds the light of random walks to sums that hold all single reflections.
/// @param walks  number of walks from each view, in all patches together
LightShares addInterreflections(const BrdfScene& scene, std::size_t walks, ProgressCounter& counter, BrdfSums& sums) {
  LightShares total;
  for (const double value : sums.values()) total.all += value / static_cast<double>(scene.channels());
  const std::vector<PatchFacets> starts = scene.patches(walks);
  std::vector<LightShares> shares(scene.directions.count);
  tbb::parallel_for(std::size_t{0}, shares.size(), [&](std::size_t view) {
    shares[view] = followView(scene, starts, view, sums);
    counter.advance();
  });
  for (const LightShares& share : shares) total.add(share);
  total.all += total.interreflected;
  return total;
}

}  // namespace

EffectiveBrdf estimateGlossy(const BrdfScene& scene, const ProgressFn& progress) {
  const EffectiveOptions& options = scene.options;
  const GlossySamples samples = samplesFor(scene);
  const std::vector<PatchFacets> patches = scene.patches(options.facet_samples > 0 ? options.facet_samples : samples.facets);
  const std::vector<SampleChunk> chunks = makeChunks(patches);
  const bool follow = options.bounces > 1;
  ProgressCounter counter(progress, chunks.size() + (follow ? scene.directions.count : 0));
  BrdfSums sums(scene);
  addSingleReflections(scene, patches, chunks, counter, sums);
  LightShares shares;
  if (follow) shares = addInterreflections(scene, options.walks > 0 ? options.walks : samples.walks, counter, sums);
  return sums.finish(scene, shares);
}

}  // namespace glint::bake
