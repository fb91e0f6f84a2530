#pragma once

#include <cstdint>
#include <vector>

#include "glint/model/normal_map.h"

namespace glint::apps {

/// A small map that stands for a large one.
struct ProbeMap {
  int width = 0;
  int height = 0;
  std::vector<Vec2> normals;  ///< [height][width]
};

/// Puts a small map together from pieces of a large one: each of 4 x 4 parts of the map gives a piece from a random place in it. Of
/// several such choices, takes the one whose normals are distributed most like those of the map. Seams between pieces change nothing
/// for methods that take texels as facets.
/// @param edge  texels along each axis, a multiple of 4, at most those of the map
ProbeMap probeMap(const NormalMap& map, int edge, std::uint64_t seed);

}  // namespace glint::apps
