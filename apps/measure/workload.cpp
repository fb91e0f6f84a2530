#include "measure/workload.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "glint/bake/common/counter_random.h"

namespace glint::apps {
namespace {

constexpr float kNarrowest = 2;  // texels

/// Largest deviation: an eighth of the map's shorter side, or the narrowest where that is less.
float widestOf(const NormalMap& map) {
  return std::max(kNarrowest, 0.125f * static_cast<float>(std::min(map.width, map.height)));
}

Footprint footprintOf(FootprintShape shape, Vec2 uv, float sigma, float angle) {
  if (shape == FootprintShape::round) return Footprint::isotropic(uv, sigma);
  const float c = std::cos(angle), s = std::sin(angle);
  if (shape == FootprintShape::box) {
    const float half = std::sqrt(3.0f) * sigma;
    return Footprint::box(uv, {half * c, half * s}, {-half * s, half * c});
  }
  constexpr float kAspect = 8;
  const float along = sigma * sigma * kAspect, across = sigma * sigma / kAspect;
  return Footprint::gaussian(uv, {along * c * c + across * s * s, (along - across) * c * s, along * s * s + across * c * c});
}

}  // namespace

std::string_view shapeName(FootprintShape shape) {
  switch (shape) {
    case FootprintShape::round:
      return "round";
    case FootprintShape::stretched:
      return "stretched";
    case FootprintShape::box:
      return "box";
  }
  return "round";
}

std::vector<FootprintSet> benchFootprints(const NormalMap& map, std::uint64_t seed, int places, int truths) {
  std::vector<FootprintSet> sets;
  int octave = 0;
  for (float sigma = kNarrowest; sigma <= widestOf(map); sigma *= 2, ++octave) {
    for (const FootprintShape shape : {FootprintShape::round, FootprintShape::stretched, FootprintShape::box}) {
      if (shape != FootprintShape::round && octave % 2 == 0) continue;
      FootprintSet set{shape, sigma, {}, static_cast<std::size_t>(places)};
      const auto stream = static_cast<std::uint64_t>(4 * octave) + static_cast<std::uint64_t>(shape);
      for (int k = 0; k < truths; ++k) {
        const auto index = static_cast<std::uint64_t>(2 * k);
        const float angle = std::numbers::pi_v<float> * bake::randomPair(seed, stream, index + 1).x;
        set.footprints.push_back(footprintOf(shape, bake::randomPair(seed, stream, index), sigma, angle));
      }
      sets.push_back(std::move(set));
    }
  }
  return sets;
}

std::vector<float> roundSizes(const std::vector<FootprintSet>& sets) {
  std::vector<float> sizes;
  for (const FootprintSet& set : sets)
    if (set.shape == FootprintShape::round) sizes.push_back(set.sigma_texels);
  return sizes;
}

Vec2 litNormal(const NormalMap& map, Vec2 centre_uv, float sigma_texels, Vec2 deviations_away) {
  const auto texel = [](float centre, float offset, int size) {
    const auto at = static_cast<int>(std::floor(centre * static_cast<float>(size) + offset));
    return (at % size + size) % size;
  };
  return map.at(texel(centre_uv.x, sigma_texels * deviations_away.x, map.width),
                texel(centre_uv.y, sigma_texels * deviations_away.y, map.height));
}

std::vector<BenchQuery> benchQueries(const NormalMap& map, std::uint64_t seed, int count, const std::vector<float>& sigmas) {
  constexpr std::uint64_t kStream = 1000;
  constexpr float kRangeReach = 0.05f;
  std::vector<BenchQuery> queries;
  for (int k = 0; k < count; ++k) {
    const auto index = static_cast<std::uint64_t>(3 * k);
    const float sigma = sigmas[static_cast<std::size_t>(k) % sigmas.size()];
    const Vec2 uv = bake::randomPair(seed, kStream, index), away = bake::randomGaussians(seed, kStream, index + 1);
    // A texel about one deviation from the centre, so that it counts in the footprint.
    const Vec2 normal = litNormal(map, uv, sigma, away);
    const Vec2 reach = {kRangeReach, kRangeReach};
    queries.push_back({Footprint::isotropic(uv, sigma),
                       normal,
                       {normal - reach, normal + reach},
                       bake::randomPair(seed, kStream, index + 2)});
  }
  return queries;
}

}  // namespace glint::apps
