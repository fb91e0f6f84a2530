#pragma once

#include <cstdint>
#include <memory_resource>
#include <vector>

#include "glint/bake/bin_map/block_trees.h"
#include "glint/bake/bin_map/texel_buckets.h"
#include "glint/model/bin_map.h"

namespace glint::bake {

/// The texels of all blocks, sorted by cell. Arrays that grow with the map are in memory of the default resource.
struct TexelLists {
  std::pmr::vector<std::uint32_t> texels;       ///< as BinMap::texels
  std::pmr::vector<std::uint64_t> cell_starts;  ///< [cells + 1]: index in `texels` at which a cell begins
  std::vector<std::uint16_t> block_moments;     ///< as BinMap::block_moments
};

/// Sorts the texels of every bucket by the cells of their blocks. O(texels); a bucket stays in the cache.
TexelLists listTexels(const TexelCode& code, const TexelBuckets& buckets, const BlockTrees& trees);

}  // namespace glint::bake
