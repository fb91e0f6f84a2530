#pragma once

#include <memory_resource>
#include <span>
#include <vector>

#include "glint/model/normal_map.h"

namespace glint::bake {

/// One level of a min-max pyramid, with the memory of its nodes.
struct NormalBoundsStorage {
  int columns = 0;
  int rows = 0;
  std::pmr::vector<NormalBounds> nodes;  ///< [rows][columns], in memory of the default resource
};

/// Builds the min-max pyramid of a normal map, from nodes of 2x2 texels up to one node for the map. Node (i, j) of level
/// k = 1, 2, ... bounds the normals of texels [i 2^k, (i+1) 2^k] x [j 2^k, (j+1) 2^k], wrapped around the map: a square of
/// 2^k x 2^k texels and one more row and column, since the triangles that start in the square reach those.
/// @param normals  [height][width], finite
/// @return levels k = 1, 2, ...; a map of one texel has one level. O(width * height)
std::vector<NormalBoundsStorage> buildNormalBounds(int width, int height, std::span<const Vec2> normals);

/// Makes a map refer to a pyramid. The pyramid must outlive the map.
void attachBounds(NormalMap& map, const std::vector<NormalBoundsStorage>& levels);

}  // namespace glint::bake
