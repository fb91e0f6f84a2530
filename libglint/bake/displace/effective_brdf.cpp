#include "glint/bake/displace/effective_brdf.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/displace/effective_kernels.h"
#include "glint/bake/displace/height_tracer.h"
#include "glint/math/concentric_map.h"
#include "glint/math/tangents.h"
#include "glint/query/brdf/base_brdf.h"

namespace glint::bake {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr std::size_t kBlock = 128;   // samples of one call of a kernel: two rows of them stay in the cache
constexpr std::size_t kChunk = 8192;  // samples whose sum is kept in float
constexpr float kLeastThroughput = 1e-4f;
constexpr double kMostCorrection = 1.25;  // of visible areas

constexpr std::uint64_t kFacetStream = 101, kPointStream = 102, kTurnStream = 103;

/// The frame of a facet.
struct Frame {
  Vec3 n;
  Tangents tangents;
  explicit Frame(Vec3 normal) : n(normal), tangents(tangentsOf(normal)) {}
  Vec3 toWorld(Vec3 v) const { return v.x * tangents.s + v.y * tangents.t + v.z * n; }
  Vec3 toLocal(Vec3 v) const { return {dot(v, tangents.s), dot(v, tangents.t), dot(v, n)}; }
};

/// The facets of one patch as a list, of which `samples` are drawn evenly.
class PatchFacets {
 public:
  PatchFacets(const PatchGrid& grid, int patch, std::size_t wanted)
      : width_(grid.width()), column_(grid.firstColumn(patch % grid.columns)), row_(grid.firstRow(patch / grid.columns)) {
    columns_ = static_cast<std::size_t>(grid.firstColumn(patch % grid.columns + 1) - column_);
    facets_ = 2 * columns_ * static_cast<std::size_t>(grid.firstRow(patch / grid.columns + 1) - row_);
    repeats_ = std::max<std::size_t>(1, wanted / facets_);
    samples_ = wanted < facets_ ? std::max<std::size_t>(wanted, 1) : facets_ * repeats_;
  }
  std::size_t samples() const { return samples_; }
  /// Facet of sample s: each as often as any other, or one of each of `samples` equal parts of the list.
  std::size_t facet(std::size_t s, float random) const {
    const std::size_t k =
        samples_ >= facets_
            ? s / repeats_
            : std::min(facets_ - 1, static_cast<std::size_t>((static_cast<double>(s) + random) * static_cast<double>(facets_) /
                                                             static_cast<double>(samples_)));
    const std::size_t cell = k / 2;
    return 2 * ((static_cast<std::size_t>(row_) + cell / columns_) * static_cast<std::size_t>(width_) +
                static_cast<std::size_t>(column_) + cell % columns_) +
           k % 2;
  }

 private:
  int width_, column_, row_;
  std::size_t columns_ = 0, facets_ = 0, repeats_ = 1, samples_ = 0;
};

/// Part of the samples of one patch.
struct Chunk {
  int patch;
  std::size_t first, last;
};

std::vector<Chunk> makeChunks(const std::vector<PatchFacets>& patches) {
  std::vector<Chunk> chunks;
  for (std::size_t p = 0; p < patches.size(); ++p)
    for (std::size_t s = 0; s < patches[p].samples(); s += kChunk)
      chunks.push_back({static_cast<int>(p), s, std::min(s + kChunk, patches[p].samples())});
  return chunks;
}

/// What a chunk adds up.
struct ChunkSums {
  std::vector<float> pairs;  ///< [channels][padded directions][padded directions]
  std::vector<float> areas;  ///< [padded directions]: visible projected area
};

/// Light that was followed: all, scattered more than once, and over hops longer than each of the distances.
struct Shares {
  double all = 0, interreflected = 0;
  std::array<double, kMaxDisplacementLevels> distant = {};

  void addHop(double light, float longest, std::span<const float> distances) {
    interreflected += light;
    for (std::size_t k = 0; k < distances.size(); ++k) distant[k] += longest > distances[k] ? light : 0;
  }
  void add(const Shares& other) {
    all += other.all, interreflected += other.interreflected;
    for (std::size_t k = 0; k < distant.size(); ++k) distant[k] += other.distant[k];
  }
};

/// Rows over all directions that a walk needs.
struct Scratch {
  std::vector<float> visible, light;
  std::vector<float> sum;  ///< [channels][padded directions]
};

/// a *= scale * b in the first `channels`; returns the largest of them.
float multiply(Color& a, const Color& b, float scale, std::size_t channels) {
  float largest = 0;
  for (std::size_t c = 0; c < channels; ++c) largest = std::max(largest, a[c] *= scale * b[c]);
  return largest;
}

double meanOf(const Color& color, std::size_t channels) {
  double sum = 0;
  for (std::size_t c = 0; c < channels; ++c) sum += color[c];
  return sum / static_cast<double>(channels);
}

/// What all estimators share.
class Estimator {
 public:
  Estimator(const HeightSurface& surface, const VisibilityMasks& masks, std::span<const Vec3> directions, const PatchGrid& grid,
            const EffectiveOptions& options, const ProgressFn& progress)
      : surface_(surface),
        masks_(masks),
        directions_(directions),
        grid_(grid),
        options_(options),
        progress_(progress),
        tracer_(surface),
        base_(surface_, options_.base, options_.texture) {
    result_.directions = directions_.count;
    result_.patches = static_cast<std::size_t>(grid.count());
    result_.channels = static_cast<std::size_t>(base_.channels());
    sums_.resize(result_.channels * result_.patches * directions_.count * directions_.count);
    areas_.resize(directions_.count);
  }

  EffectiveBrdf diffuse();
  EffectiveBrdf glossy();

 private:
  std::vector<PatchFacets> facets(std::size_t samples) const;
  void facingRow(std::size_t facet, float* row) const;
  Vec3 pointOf(std::size_t facet, std::uint64_t index) const;
  void diffuseWalk(std::size_t facet, std::uint64_t index, std::size_t stride, float* rows, float* scratch,
                   Shares& shares) const;
  void diffuseChunk(const PatchFacets& facets, const Chunk& chunk, ChunkSums& sums, Shares& shares) const;
  void glossyChunk(const PatchFacets& facets, const Chunk& chunk, std::span<const Vec3> half, ChunkSums& sums) const;
  void completeGlossyPairs();
  Shares glossyView(const std::vector<PatchFacets>& facets, std::size_t view);
  void glossyWalk(std::size_t facet, std::size_t view, std::uint64_t index, float scale, Scratch& scratch,
                  Shares& shares) const;
  void addChunk(const Chunk& chunk, const ChunkSums& sums, double samples, double scale);
  ChunkSums emptySums() const;
  EffectiveBrdf finish(const Shares& shares);

  double& sum(std::size_t channel, std::size_t patch, std::size_t i, std::size_t o) {
    return sums_[((channel * result_.patches + patch) * directions_.count + i) * directions_.count + o];
  }

  const HeightSurface& surface_;
  const VisibilityMasks& masks_;
  DirectionTable directions_;
  PatchGrid grid_;
  EffectiveOptions options_;
  const ProgressFn& progress_;
  HeightTracer tracer_;
  FacetBase base_;
  std::vector<double> sums_;   ///< [channels][patches][directions][directions]
  std::vector<double> areas_;  ///< [directions]: visible projected area of the whole map
  EffectiveBrdf result_;
};

std::vector<PatchFacets> Estimator::facets(std::size_t samples) const {
  std::vector<PatchFacets> list;
  for (int p = 0; p < grid_.count(); ++p) list.emplace_back(grid_, p, samples / static_cast<std::size_t>(grid_.count()));
  return list;
}

/// Masked cosines of a facet towards all directions.
void Estimator::facingRow(std::size_t facet, float* row) const {
  masks_.expand(facet, row);
  std::fill(row + directions_.count, row + directions_.padded, 0.0f);
  multiplyCosines(directions_, surface_.normal(facet), row);
}

/// A random point of a facet.
Vec3 Estimator::pointOf(std::size_t facet, std::uint64_t index) const {
  Vec2 xi = randomPair(options_.seed, kPointStream, index);
  if (xi.x + xi.y > 1) xi = {1 - xi.x, 1 - xi.y};
  return surface_.point(facet, xi.x, xi.y);
}

/// Follows light from a facet through diffuse reflections: rows[channel * stride + d], which hold the facet's masked cosines,
/// become the light that it reflects, in units of the base, from directions d.
void Estimator::diffuseWalk(std::size_t facet, std::uint64_t index, std::size_t stride, float* rows, float* scratch,
                            Shares& shares) const {
  const std::size_t channels = result_.channels, n = directions_.count;
  Color throughput = base_.color(facet);
  float largest = 1, longest = 0;
  double light = 0;
  for (std::size_t d = 0; d < n; ++d) light += rows[d];
  shares.all += meanOf(throughput, channels) * light;
  if (base_.colored())
    for (std::size_t c = channels; c-- > 0;)
      for (std::size_t d = 0; d < n; ++d) rows[c * stride + d] = throughput[c] * rows[d];
  Vec3 point = pointOf(facet, index);
  for (int bounce = 1; bounce < options_.bounces && largest > kLeastThroughput; ++bounce) {
    const Vec2 xi = randomPair(options_.seed, kTurnStream + static_cast<std::uint64_t>(bounce), index);
    const float radius = std::sqrt(xi.x), angle = 2 * kPi * xi.y;
    const Vec3 local = {radius * std::cos(angle), radius * std::sin(angle), std::sqrt(1 - xi.x)};
    const auto hit = tracer_.trace(facet, point, Frame(surface_.normal(facet)).toWorld(local));
    if (!hit) return;
    facet = hit->facet, point = hit->point;
    largest = multiply(throughput, base_.color(facet), options_.base.albedo, channels);
    longest = std::max(longest, hit->distance);
    facingRow(facet, scratch);
    light = 0;
    for (std::size_t d = 0; d < n; ++d) light += scratch[d];
    for (std::size_t c = 0; c < channels; ++c)
      for (std::size_t d = 0; d < n; ++d) rows[c * stride + d] += throughput[c] * scratch[d];
    light *= meanOf(throughput, channels);
    shares.all += light;
    shares.addHop(light, longest, options_.distant_cells);
  }
}

void Estimator::diffuseChunk(const PatchFacets& facets, const Chunk& chunk, ChunkSums& sums, Shares& shares) const {
  const std::size_t size = directions_.padded, stride = kBlock * size;
  std::vector<float> views(stride), lights(result_.channels * stride), scratch(size);
  for (std::size_t start = chunk.first; start < chunk.last; start += kBlock) {
    const std::size_t count = std::min(kBlock, chunk.last - start);
    for (std::size_t k = 0; k < count; ++k) {
      const std::uint64_t index = (start + k) * static_cast<std::size_t>(grid_.count()) + static_cast<std::size_t>(chunk.patch);
      const std::size_t facet = facets.facet(start + k, randomPair(options_.seed, kFacetStream, index).x);
      float* view = &views[k * size];
      float* light = &lights[k * size];
      facingRow(facet, light);
      const float area = 1 / surface_.normal(facet).z;
      for (std::size_t d = 0; d < size; ++d) sums.areas[d] += view[d] = area * light[d];
      diffuseWalk(facet, index, stride, light, scratch.data(), shares);
    }
    for (std::size_t c = 0; c < result_.channels; ++c)
      addProducts(&lights[c * stride], views.data(), count, size, &sums.pairs[c * size * size]);
  }
}

ChunkSums Estimator::emptySums() const {
  return {std::vector<float>(result_.channels * directions_.padded * directions_.padded),
          std::vector<float>(directions_.padded)};
}

void Estimator::addChunk(const Chunk& chunk, const ChunkSums& sums, double samples, double scale) {
  for (std::size_t i = 0; i < directions_.count; ++i) {
    areas_[i] += grid_.share(chunk.patch) * sums.areas[i] / samples;
    for (std::size_t c = 0; c < result_.channels; ++c)
      for (std::size_t o = 0; o < directions_.count; ++o)
        sum(c, static_cast<std::size_t>(chunk.patch), i, o) +=
            scale / samples * sums.pairs[(c * directions_.padded + i) * directions_.padded + o];
  }
}

EffectiveBrdf Estimator::diffuse() {
  const std::vector<PatchFacets> patches = facets(options_.walks > 0 ? options_.walks : std::size_t{1} << 18);
  const std::vector<Chunk> chunks = makeChunks(patches);
  std::vector<ChunkSums> sums(chunks.size());
  std::vector<Shares> shares(chunks.size());
  ProgressCounter counter(progress_, chunks.size());
  tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t c) {
    sums[c] = emptySums();
    diffuseChunk(patches[static_cast<std::size_t>(chunks[c].patch)], chunks[c], sums[c], shares[c]);
    counter.advance();
  });
  Shares total;
  for (std::size_t c = 0; c < chunks.size(); ++c) {
    const auto samples = static_cast<double>(patches[static_cast<std::size_t>(chunks[c].patch)].samples());
    addChunk(chunks[c], sums[c], samples, options_.base.albedo / kPi);
    total.add(shares[c]);
  }
  return finish(total);
}

/// Quadrature of single reflections from GGX facets, without Fresnel's factor and 1 / (4 pi).
void Estimator::glossyChunk(const PatchFacets& facets, const Chunk& chunk, std::span<const Vec3> half, ChunkSums& sums) const {
  const std::size_t n = directions_.count, channels = result_.channels;
  std::vector<float> x(kBlock), y(kBlock), z(kBlock), bend(kBlock), colors(3 * kBlock), masked(n * kBlock),
      row(directions_.padded);
  for (std::size_t start = chunk.first; start < chunk.last; start += kBlock) {
    const std::size_t count = std::min(kBlock, chunk.last - start), used = (count + 7) / 8 * 8;
    for (std::size_t k = 0; k < used; ++k) {
      const bool padding = k >= count;  // the last facet again, without light
      const std::uint64_t index =
          std::min(start + k, chunk.last - 1) * static_cast<std::size_t>(grid_.count()) + static_cast<std::size_t>(chunk.patch);
      const std::size_t facet =
          facets.facet(std::min(start + k, chunk.last - 1), randomPair(options_.seed, kFacetStream, index).x);
      const Vec3 normal = surface_.normal(facet);
      const Color color = base_.color(facet);
      const float alpha = base_.of(facet).alpha;
      x[k] = normal.x, y[k] = normal.y, z[k] = normal.z, bend[k] = alpha * alpha - 1;
      for (std::size_t c = 0; c < channels; ++c) colors[c * kBlock + k] = color[c];
      facingRow(facet, row.data());
      const float area = padding ? 0 : 1 / normal.z;
      // Rows are multiplied by each other, so half of a facet's weight is in each. That of a grey facet includes its colour.
      const float weight = alpha * std::sqrt(channels == 1 ? area * color[0] : area);
      for (std::size_t d = 0; d < n; ++d) masked[d * used + k] = row[d] > 0 ? weight * ggxMasking(row[d], alpha) : 0.0f;
      for (std::size_t d = 0; d < n; ++d) sums.areas[d] += area * row[d];
    }
    const FacetArrays arrays{x.data(), y.data(), z.data(), bend.data(), masked.data(), used};
    if (channels == 1)
      addGgxPairs(arrays, half, n, directions_.padded, sums.pairs.data());
    else
      addColoredGgxPairs(arrays, colors.data(), kBlock, half, n, directions_.padded, sums.pairs.data());
  }
}

/// Normal that a GGX facet shows towards a view, drawn from those visible (Heitz 2018). All vectors in the facet's frame.
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

/// Follows a view through glossy reflections and adds the light that every facet after the first one reflects into it.
void Estimator::glossyWalk(std::size_t facet, std::size_t view, std::uint64_t index, float scale, Scratch& scratch,
                           Shares& shares) const {
  const std::size_t channels = result_.channels, n = directions_.count;
  Vec3 point = pointOf(facet, index), back = directions_.at(view);
  BaseBrdf base = base_.of(facet);
  Color throughput = base_.color(facet);
  float largest = 1, longest = 0;
  for (int bounce = 1; bounce < options_.bounces && largest > kLeastThroughput; ++bounce) {
    const Frame frame(surface_.normal(facet));
    const Vec3 local = frame.toLocal(back);
    const Vec2 xi = randomPair(options_.seed, kTurnStream + static_cast<std::uint64_t>(bounce), index);
    const Vec3 m = visibleGgxNormal(local, base.alpha, xi);
    const float cosine = dot(m, local);
    const Vec3 turned = 2 * cosine * m - local;
    if (turned.z <= 0) return;
    const float reflected = conductorFresnel(cosine, base.eta, base.k) * ggxMasking(turned.z, base.alpha);
    const Vec3 direction = frame.toWorld(turned);
    const auto hit = tracer_.trace(facet, point, direction);
    if (!hit) return;
    facet = hit->facet, point = hit->point, back = -1.0f * direction;
    base = base_.of(facet);
    largest = multiply(throughput, base_.color(facet), reflected, channels);
    longest = std::max(longest, hit->distance);
    masks_.expand(facet, scratch.visible.data());
    std::fill(scratch.light.begin(), scratch.light.end(), 0.0f);
    addGgxLights(directions_, scratch.visible.data(), surface_.normal(facet), back, base, scale, scratch.light.data());
    double light = 0;
    for (std::size_t d = 0; d < n; ++d) light += scratch.light[d];
    for (std::size_t c = 0; c < channels; ++c)
      for (std::size_t d = 0; d < n; ++d) scratch.sum[c * directions_.padded + d] += throughput[c] * scratch.light[d];
    shares.addHop(meanOf(throughput, channels) * light, longest, options_.distant_cells);
  }
}

/// Interreflections seen from one direction, in all patches.
Shares Estimator::glossyView(const std::vector<PatchFacets>& patches, std::size_t view) {
  Shares shares;
  Scratch scratch{std::vector<float>(directions_.padded), std::vector<float>(directions_.padded),
                  std::vector<float>(result_.channels * directions_.padded)};
  const Vec3 direction = directions_.at(view);
  for (std::size_t p = 0; p < patches.size(); ++p) {
    std::fill(scratch.sum.begin(), scratch.sum.end(), 0.0f);
    for (std::size_t s = 0; s < patches[p].samples(); ++s) {
      const std::uint64_t index = (s * patches.size() + p) * directions_.count + view;
      const std::size_t facet = patches[p].facet(s, randomPair(options_.seed, kFacetStream, index).x);
      const Vec3 normal = surface_.normal(facet);
      const float cosine = dot(normal, direction);
      if (cosine <= 0 || !masks_.visible(facet, view)) continue;
      glossyWalk(facet, view, index, cosine / (normal.z * static_cast<float>(patches[p].samples())), scratch, shares);
    }
    for (std::size_t c = 0; c < result_.channels; ++c)
      for (std::size_t i = 0; i < directions_.count; ++i) sum(c, p, i, view) += scratch.sum[c * directions_.padded + i];
  }
  return shares;
}

/// Completes sums of single reflections of pairs i <= o: Fresnel's factor, and the pairs the other way round.
void Estimator::completeGlossyPairs() {
  const std::size_t n = directions_.count;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t o = i; o < n; ++o) {
      const Vec3 sum = directions_.at(i) + directions_.at(o);
      const float fresnel = conductorFresnel(0.5f * std::sqrt(dot(sum, sum)), options_.base.eta, options_.base.k);
      for (std::size_t plane = 0; plane < sums_.size(); plane += n * n)  // channels and patches
        sums_[plane + o * n + i] = sums_[plane + i * n + o] *= fresnel;
    }
  }
}

/// Facets of the quadrature, and walks of each view: narrow lobes need more for the same noise.
struct GlossySamples {
  std::size_t facets;
  std::size_t walks;
};

GlossySamples samplesFor(float alpha) {
  if (alpha >= 0.25f) return {1 << 18, 1 << 13};
  if (alpha >= 0.15f) return {1 << 19, 1 << 15};
  return {1 << 21, 5 << 15};
}

EffectiveBrdf Estimator::glossy() {
  const std::size_t n = directions_.count;
  const GlossySamples samples = samplesFor(base_.leastAlpha());
  const std::vector<PatchFacets> patches = facets(options_.facet_samples > 0 ? options_.facet_samples : samples.facets);
  const std::vector<Chunk> chunks = makeChunks(patches);
  std::vector<Vec3> half(n * n);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t o = 0; o < n; ++o) {
      const Vec3 sum = directions_.at(i) + directions_.at(o);
      half[i * n + o] = (1 / std::sqrt(dot(sum, sum))) * sum;
    }
  }
  const bool follow = options_.bounces > 1;
  ProgressCounter counter(progress_, chunks.size() + (follow ? n : 0));
  std::vector<ChunkSums> sums(chunks.size());
  tbb::parallel_for(std::size_t{0}, chunks.size(), [&](std::size_t c) {
    sums[c] = emptySums();
    glossyChunk(patches[static_cast<std::size_t>(chunks[c].patch)], chunks[c], half, sums[c]);
    counter.advance();
  });
  for (std::size_t c = 0; c < chunks.size(); ++c)
    addChunk(chunks[c], sums[c], static_cast<double>(patches[static_cast<std::size_t>(chunks[c].patch)].samples()),
             1 / (4 * kPi));
  completeGlossyPairs();
  Shares total;
  if (follow) {
    for (const double value : sums_) total.all += value / static_cast<double>(result_.channels);
    const std::vector<PatchFacets> starts = facets(options_.walks > 0 ? options_.walks : samples.walks);
    std::vector<Shares> shares(n);
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t view) {
      shares[view] = glossyView(starts, view);
      counter.advance();
    });
    for (const Shares& share : shares) total.add(share);
    total.all += total.interreflected;
  }
  return finish(total);
}

/// Makes the estimates symmetric, since both halves estimate the same function, and their visible areas exact: the projected
/// area that a periodic surface shows to a direction is its cosine (Wu 2019, Eq. 8), so what the masks show too much or too
/// little of is known.
EffectiveBrdf Estimator::finish(const Shares& shares) {
  result_.interreflected = shares.all > 0 ? shares.interreflected / shares.all : 0;
  for (std::size_t k = 0; k < options_.distant_cells.size(); ++k)
    result_.distant.push_back(shares.all > 0 ? shares.distant[k] / shares.all : 0);
  const std::size_t n = directions_.count;
  std::vector<double> correction(n, 1.0);
  for (std::size_t d = 0; d < n; ++d)
    if (areas_[d] > 0) correction[d] = std::clamp(directions_.z[d] / areas_[d], 1 / kMostCorrection, kMostCorrection);
  result_.values.resize(sums_.size());
  double difference = 0, norm = 0;
  for (std::size_t plane = 0; plane < sums_.size(); plane += n * n) {  // channels and patches
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t o = 0; o < n; ++o) {
        const double a = sums_[plane + i * n + o], b = sums_[plane + o * n + i];
        result_.values[plane + i * n + o] = static_cast<float>(0.5 * correction[i] * correction[o] * (a + b));
        if (directions_.z[i] < kGrazingCosine || directions_.z[o] < kGrazingCosine) continue;
        difference += (a - b) * (a - b), norm += (a + b) * (a + b);
      }
    }
  }
  result_.asymmetry = norm > 0 ? std::sqrt(difference / norm) : 0;
  return std::move(result_);
}

}  // namespace

std::vector<Vec3> angularDirections(int angular) {
  std::vector<Vec3> directions;
  for (int d = 0; d < angular * angular; ++d) directions.push_back(gridDirection(d, angular));
  return directions;
}

double PatchGrid::share(int patch) const {
  const int c = patch % columns, r = patch / columns;
  return static_cast<double>(firstColumn(c + 1) - firstColumn(c)) * (firstRow(r + 1) - firstRow(r)) /
         (static_cast<double>(coarse_x) * coarse_y * factor * factor);
}

std::vector<double> EffectiveBrdf::mean(const PatchGrid& grid, std::size_t channel) const {
  std::vector<double> mean(directions * directions);
  for (int p = 0; p < grid.count(); ++p)
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += grid.share(p) * patch(static_cast<std::size_t>(p), channel)[k];
  return mean;
}

EffectiveBrdf effectiveBrdf(const HeightSurface& surface, const VisibilityMasks& masks, std::span<const Vec3> directions,
                            const PatchGrid& grid, const EffectiveOptions& options, const ProgressFn& progress) {
  Estimator estimator(surface, masks, directions, grid, options, progress);
  return options.base.kind == BaseBrdf::Kind::diffuse ? estimator.diffuse() : estimator.glossy();
}

}  // namespace glint::bake
