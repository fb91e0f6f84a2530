#pragma once

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <vector>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/displace/base_texture.h"
#include "glint/query/brdf/base_brdf.h"
#include "support/traced_surface.h"

namespace glint::test {

/// A path tracer that shares nothing with the estimators: Embree's triangles, rays to every direction from random points
/// instead of masks, colours and roughness interpolated at every point, turns drawn by the cosine, and no correction.
class PathTracer {
 public:
  /// @param texture  lives as long as this
  PathTracer(const bake::HeightSurface& surface, const BaseBrdf& base, const bake::BaseTexture& texture,
             std::span<const Vec3> directions, std::size_t walks)
      : surface_(surface), traced_(surface), base_(base), texture_(texture), directions_(directions), walks_(walks) {}

  /// Effective BRDFs times the visible area of the view, diffuse base: [channels][directions][directions].
  std::vector<double> diffuse() const {
    const std::size_t n = directions_.size(), channels = channelCount();
    return inParts(channels * n * n, [&](std::size_t walk, std::vector<double>& sums) {
      Random random{77, walk};
      Place at = start(random);
      const std::vector<float> views = cosines(at);
      std::vector<double> lights(channels * n);
      std::array<double, 3> throughput = {1 / at.normal.z, 1 / at.normal.z, 1 / at.normal.z};
      std::vector<float> seen = views;
      for (int bounce = 0; bounce < 40; ++bounce) {
        for (std::size_t c = 0; c < channels; ++c) {
          throughput[c] *= base_.albedo * color(at, c);
          for (std::size_t d = 0; d < n; ++d) lights[c * n + d] += throughput[c] * seen[d];
        }
        const auto hit = traced_.trace(at.point, cosineDirection(at.normal, random()));
        if (!hit) break;
        at = {hit->facet, hit->point, surface_.normal(hit->facet)};
        seen = cosines(at);
      }
      for (std::size_t k = 0; k < channels * n; ++k)
        for (std::size_t o = 0; o < n; ++o) sums[k * n + o] += kInversePi * lights[k] * views[o];
    });
  }

  /// The same seen from one direction, for any base: [channels][directions].
  std::vector<double> view(std::size_t o) const {
    const std::size_t n = directions_.size(), channels = channelCount();
    return inParts(channels * n, [&](std::size_t walk, std::vector<double>& sums) {
      Random random{78 + o, walk};
      Place at = start(random);
      Vec3 back = directions_[o];
      if (dot(at.normal, back) <= 0 || !traced_.visible(at.point, back)) return;
      double weight = dot(at.normal, back) / at.normal.z;
      std::array<double, 3> tint = {1, 1, 1};
      for (int bounce = 0; bounce < 30; ++bounce) {
        const BaseBrdf base = baseAt(at);
        const float facing = std::max(1e-4f, dot(at.normal, back));
        for (std::size_t c = 0; c < channels; ++c) tint[c] *= color(at, c);
        for (std::size_t i = 0; i < n; ++i) {
          const float reflected = baseTimesCosines(base, at.normal, directions_[i], back);
          if (reflected <= 0 || !traced_.visible(at.point, directions_[i])) continue;
          for (std::size_t c = 0; c < channels; ++c) sums[c * n + i] += tint[c] * weight * reflected / facing;
        }
        const Vec3 w = cosineDirection(at.normal, random());
        weight *= std::numbers::pi * baseTimesCosines(base, at.normal, w, back) / (facing * std::max(1e-4f, dot(at.normal, w)));
        const auto hit = traced_.trace(at.point, w);
        if (!hit) return;
        at = {hit->facet, hit->point, surface_.normal(hit->facet)}, back = -1.0f * w;
      }
    });
  }

 private:
  static constexpr std::size_t kParts = 24;  // that are traced in parallel

  struct Place {
    std::size_t facet;
    Vec3 point, normal;
  };
  struct Random {
    std::uint64_t stream, walk, draw = 0;
    Vec2 operator()() { return bake::randomPair(stream, walk, draw++); }
  };

  std::size_t channelCount() const { return static_cast<std::size_t>(texture_.channels); }

  template <class Walk>
  std::vector<double> inParts(std::size_t size, const Walk& walk) const {
    std::vector<std::vector<double>> parts(kParts, std::vector<double>(size));
    tbb::parallel_for(std::size_t{0}, kParts, [&](std::size_t part) {
      for (std::size_t k = part; k < walks_; k += kParts) walk(k, parts[part]);
    });
    std::vector<double> sum(size);
    for (const auto& part : parts)
      for (std::size_t k = 0; k < size; ++k) sum[k] += part[k] / static_cast<double>(walks_);
    return sum;
  }

  Place start(Random& random) const {
    // Evenly over the map: one start in each of as many parts as there are walks.
    const double part = (static_cast<double>(random.walk) + random().x) / static_cast<double>(walks_);
    const std::size_t count = surface_.facetCount(),
                      facet = std::min(count - 1, static_cast<std::size_t>(part * static_cast<double>(count)));
    Vec2 xi = random();
    if (xi.x + xi.y > 1) xi = {1 - xi.x, 1 - xi.y};
    return {facet, surface_.point(facet, xi.x, xi.y), surface_.normal(facet)};
  }

  /// Masked cosines of a point towards all directions.
  std::vector<float> cosines(const Place& at) const {
    std::vector<float> row(directions_.size());
    for (std::size_t d = 0; d < directions_.size(); ++d) {
      const float cosine = dot(at.normal, directions_[d]);
      if (cosine > 0 && traced_.visible(at.point, directions_[d])) row[d] = cosine;
    }
    return row;
  }

  static Vec3 cosineDirection(Vec3 n, Vec2 xi) {
    // A point of the unit sphere around the tip of the normal.
    const float z = 1 - 2 * xi.x, r = std::sqrt(std::max(0.0f, 1 - z * z)), angle = 2 * std::numbers::pi_v<float> * xi.y;
    const Vec3 sum = n + Vec3{r * std::cos(angle), r * std::sin(angle), z};
    return (1 / std::sqrt(std::max(1e-12f, dot(sum, sum)))) * sum;
  }

  /// Linear between the vertices of the facet.
  float interpolated(const Place& at, const std::vector<float>& values, std::size_t each, std::size_t c) const {
    if (values.empty()) return 1;
    const int i = static_cast<int>((at.facet / 2) % static_cast<std::size_t>(surface_.width())),
              j = static_cast<int>((at.facet / 2) / static_cast<std::size_t>(surface_.width()));
    const float u = at.point.x - static_cast<float>(i), v = at.point.y - static_cast<float>(j);
    const auto value = [&](int x, int y) {
      return values[(static_cast<std::size_t>(y % surface_.height()) * static_cast<std::size_t>(surface_.width()) +
                     static_cast<std::size_t>(x % surface_.width())) *
                        each +
                    c];
    };
    return at.facet % 2 == 0 ? (1 - u - v) * value(i, j) + u * value(i + 1, j) + v * value(i, j + 1)
                             : (u + v - 1) * value(i + 1, j + 1) + (1 - u) * value(i, j + 1) + (1 - v) * value(i + 1, j);
  }
  float color(const Place& at, std::size_t c) const { return interpolated(at, texture_.colors, channelCount(), c); }
  BaseBrdf baseAt(const Place& at) const {
    BaseBrdf base = base_;
    base.alpha *= interpolated(at, texture_.roughness, 1, 0);
    return base;
  }

  bake::HeightSurface surface_;
  TracedSurface traced_;
  BaseBrdf base_;
  const bake::BaseTexture& texture_;
  std::span<const Vec3> directions_;
  std::size_t walks_;
};

/// Relative difference of two lists, root mean square over pairs of directions within 70 degrees; the truth may be noisy, so
/// both ways of a pair are averaged.
/// @param truth  [directions][directions]
inline double rmsWithin70Degrees(std::span<const float> values, std::span<const double> truth,
                                 std::span<const Vec3> directions) {
  constexpr float kCosine70 = 0.342f;
  const std::size_t n = directions.size();
  double squares = 0, count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t o = 0; o < n; ++o) {
      if (directions[i].z < kCosine70 || directions[o].z < kCosine70) continue;
      const double relative = values[i * n + o] / (0.5 * (truth[i * n + o] + truth[o * n + i])) - 1;
      squares += relative * relative, ++count;
    }
  }
  return std::sqrt(squares / count);
}

}  // namespace glint::test
