#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "glint/bake/bin_map/bin_grid.h"
#include "glint/bake/bin_map/block_trees.h"
#include "glint/model/normal_map.h"

namespace glint::bake {

/// Classes of blocks, and the class of every texel, in memory of the default resource.
struct TexelClasses {
  std::vector<std::uint32_t> class_keys;          ///< as BinMap::class_keys
  std::pmr::vector<std::uint16_t> texel_classes;  ///< as BinMap::texel_classes
};

/// Makes a class of every block, or of several neighbouring blocks where there are more blocks than classes can be, and writes
/// the class of every texel. O(texels + blocks).
TexelClasses classifyTexels(const NormalMap& map, const BinGrid& grid, const BlockTrees& trees);

}  // namespace glint::bake
