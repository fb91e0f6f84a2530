#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "glint/model/footprint.h"
#include "glint/model/normal_map.h"

namespace glint::apps {

/// Intrinsic roughness of every method of the bench, disk units: the default of all tools.
inline constexpr float kBenchSigmaR = 0.005f;

enum class FootprintShape : std::uint8_t {
  round,      ///< Gaussian
  stretched,  ///< Gaussian of aspect 8, in any direction
  box,        ///< square in any direction, of the second moments of the round one
};
std::string_view shapeName(FootprintShape shape);

/// Footprints of one shape and size, at random places.
struct FootprintSet {
  FootprintShape shape = FootprintShape::round;
  float sigma_texels = 0;  ///< deviation, geometric mean of both axes
  std::vector<Footprint> footprints;
  std::size_t places = 0;  ///< of the footprints, from the first on, at which methods are asked
};

/// The sets of a map: round ones of every octave from 2 texels to an eighth of the map, stretched ones and boxes of every second.
/// @param places  footprints of a set at which methods are asked
/// @param truths  footprints of a set in all, >= places: at the rest only the truth is known
std::vector<FootprintSet> benchFootprints(const NormalMap& map, std::uint64_t seed, int places, int truths);

/// A question of a renderer: a round footprint, and a half vector near a normal of it.
struct BenchQuery {
  Footprint footprint;
  Vec2 half;
  Box2 range;  ///< half vectors of a lamp of about 6 degrees
  Vec2 xi;     ///< random numbers for a sample
};

/// A half vector that facets of a round footprint have: the normal of a texel that is so many deviations from its centre.
Vec2 litNormal(const NormalMap& map, Vec2 centre_uv, float sigma_texels, Vec2 deviations_away);

/// Questions about round footprints of these deviations in turn, texels, anywhere on the map.
std::vector<BenchQuery> benchQueries(const NormalMap& map, std::uint64_t seed, int count, const std::vector<float>& sigmas);

/// Deviations of the round footprints of some sets.
std::vector<float> roundSizes(const std::vector<FootprintSet>& sets);

}  // namespace glint::apps
