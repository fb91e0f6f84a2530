#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/bake/bin_map/texel_buckets.h"

namespace glint::bake {

/// Places in bins are kept to at least this many bits along each axis, where the map is not too large for it.
inline constexpr int kSurePlaceBits = 5;

/// A block of bins, before its texels are listed.
struct BinBlock {
  std::uint32_t first_key, first_cell, texels;
  std::uint8_t side_bits;  ///< logarithm of the bins along a side
  std::uint8_t cell_bits;  ///< logarithm of the number of cells
};

/// The quadtrees of a bin map and the blocks that are their leaves.
struct BlockTrees {
  std::vector<std::uint32_t> nodes;                ///< as BinMap::nodes
  std::vector<BinBlock> blocks;                    ///< in the order of their keys
  std::vector<std::uint32_t> bin_blocks;           ///< [keys]: number of the block of a bin; 0 for bins outside all blocks
  std::vector<std::uint32_t> bucket_first_blocks;  ///< [buckets + 1]
  std::size_t cell_count = 0;                      ///< cells of all blocks

  /// First cell of a block; that of the block after the last one is the number of cells.
  std::size_t firstCell(std::size_t block) const { return block < blocks.size() ? blocks[block].first_cell : cell_count; }
};

/// Divides the tiles of bins in blocks: the fuller a part of a tile is, the smaller its blocks. O(texels + bins).
/// @param leaf_size  texels of a cell, on average at least
BlockTrees divideTiles(const TexelCode& code, const BinGrid& grid, const TexelBuckets& buckets, int leaf_size);

}  // namespace glint::bake
