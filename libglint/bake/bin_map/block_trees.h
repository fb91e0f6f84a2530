#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/bake/bin_map/texel_buckets.h"

namespace glint::bake {

/// Bits, along each axis, that codes keep of sub-bins of a bin: at least this many, where the map leaves room for them.
inline constexpr int kSureSubbinBits = 5;

/// A block of bins, as it is known before its texels are listed.
struct BinBlock {
  std::uint32_t first_key, first_cell, texels;
  std::uint8_t side_bits;  ///< logarithm of the bins along a side
  std::uint8_t cell_bits;  ///< logarithm of the number of cells
};

/// The quadtrees of a bin map and the blocks that are their leaves.
struct BlockTrees {
  std::vector<std::uint32_t> nodes;       ///< as BinMap::nodes
  std::vector<BinBlock> blocks;           ///< in the order of their keys
  std::vector<std::uint32_t> bin_blocks;  ///< [keys]: number of the block that has a bin; 0 for bins outside all blocks
  std::vector<std::uint32_t> bucket_first_blocks;  ///< [buckets + 1]: number of the first block of a bucket
  std::size_t cell_count = 0;                      ///< cells of all blocks

  /// First cell of a block. The block after the last one begins at the number of cells.
  std::size_t firstCell(std::size_t block) const { return block < blocks.size() ? blocks[block].first_cell : cell_count; }
};

/// Divides the tiles of bins into blocks. Bins with many texels get small blocks. O(texels + bins).
/// @param leaf_size  mean number of texels of a cell, at least
BlockTrees divideTiles(const TexelCode& code, const BinGrid& grid, const TexelBuckets& buckets, int leaf_size);

}  // namespace glint::bake
