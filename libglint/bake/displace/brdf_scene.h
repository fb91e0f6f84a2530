#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "glint/bake/displace/base_texture.h"
#include "glint/bake/displace/effective_brdf.h"
#include "glint/bake/displace/effective_kernels.h"
#include "glint/bake/displace/height_tracer.h"
#include "glint/bake/displace/patch_facets.h"
#include "glint/math/tangents.h"

namespace glint::bake {

/// Number of samples that one call of a kernel takes: two rows over so many samples stay in the cache.
inline constexpr std::size_t kKernelSamples = 128;
/// A walk ends when it carries less than this part of the light that it started with.
inline constexpr float kLeastThroughput = 1e-4f;
/// Streams of random numbers for the choice of facets, for points on facets, and for the turn at bounce b (kTurnStream + b).
inline constexpr std::uint64_t kFacetStream = 101, kPointStream = 102, kTurnStream = 103;

/// An orthonormal frame with the normal of a facet as z axis.
struct FacetFrame {
  Vec3 n;
  Tangents tangents;
  explicit FacetFrame(Vec3 normal) : n(normal), tangents(tangentsOf(normal)) {}
  Vec3 toWorld(Vec3 v) const { return v.x * tangents.s + v.y * tangents.t + v.z * n; }
  Vec3 toLocal(Vec3 v) const { return {dot(v, tangents.s), dot(v, tangents.t), dot(v, n)}; }
};

/// Everything that an estimator reads: the surface, its base BRDF and visibility masks, and the directions.
struct BrdfScene {
  /// @param surface, masks  must outlive the scene
  BrdfScene(const HeightSurface& surface, const VisibilityMasks& masks, std::span<const Vec3> directions, const PatchGrid& grid,
            const EffectiveOptions& options);
  BrdfScene(const BrdfScene&) = delete;
  BrdfScene& operator=(const BrdfScene&) = delete;

  const HeightSurface& surface;
  const VisibilityMasks& masks;
  const DirectionTable directions;
  const PatchGrid grid;
  const EffectiveOptions options;
  const HeightTracer tracer;
  const FacetBase base;

  std::size_t channels() const { return static_cast<std::size_t>(base.channels()); }
  /// Lists the facets of every patch, and shares `samples` samples among the patches.
  std::vector<PatchFacets> patches(std::size_t samples) const;
  /// Computes the cosines of a facet towards all directions, 0 where the direction is hidden.
  /// @param row  [padded directions]
  void facingRow(std::size_t facet, float* row) const;
  /// Draws a point of a facet, evenly.
  /// @param index  number of the sample
  Vec3 pointOf(std::size_t facet, std::uint64_t index) const;
};

/// a *= scale * b in the first `channels` channels.
/// @return the largest of the products
inline float attenuate(Color& a, const Color& b, float scale, std::size_t channels) {
  float largest = 0;
  for (std::size_t c = 0; c < channels; ++c) largest = std::max(largest, a[c] *= scale * b[c]);
  return largest;
}

inline double meanOf(const Color& color, std::size_t channels) {
  double sum = 0;
  for (std::size_t c = 0; c < channels; ++c) sum += color[c];
  return sum / static_cast<double>(channels);
}

}  // namespace glint::bake
