#pragma once

#include <span>
#include <vector>

#include "glint/model/normal_map.h"

namespace glint::bake {

/// One level of a min-max pyramid, and the memory that its span refers to.
struct NormalBoundsStorage {
  int columns = 0;
  int rows = 0;
  std::vector<NormalBounds> nodes;  ///< [rows][columns]
};

/// Min-max pyramid of a normal map, from nodes of 2x2 texels to one node. Node (i, j) of level k = 1, 2, ... bounds the texels
/// [i 2^k, (i+1) 2^k] x [j 2^k, (j+1) 2^k], wrapped: its block and one more row and column.
/// @param normals  [height][width], finite
/// @return levels k = 1, 2, ...; a map of one texel has one level. O(width * height)
std::vector<NormalBoundsStorage> buildNormalBounds(int width, int height, std::span<const Vec2> normals);

/// Makes a map refer to a pyramid, which must outlive it.
void attachBounds(NormalMap& map, const std::vector<NormalBoundsStorage>& levels);

}  // namespace glint::bake
