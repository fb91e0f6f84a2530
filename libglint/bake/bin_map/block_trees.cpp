#include "glint/bake/bin_map/block_trees.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <utility>

namespace glint::bake {
namespace {

/// Most texels of a block of several bins, and of each of its bins. A query may merge all texels of a block into one lobe (see
/// BinMapNdf), and merging more would cost accuracy.
constexpr std::uint64_t kMostOfBlock = 4096, kMostOfSharedBin = 512;
/// Most bits, along each axis, of a sub-bin of a block: half of a code.
constexpr int kMostSubbinBits = 16;
/// A map with at most this many bits of position (column and row) has few texels. Sums over few texels do not average the
/// rounding to sub-bins, so codes then keep as many bits of sub-bins as they have room for.
constexpr int kFewPositionBits = 8;

/// Number of texels of each bin, by key.
std::vector<std::uint32_t> countBins(const BinGrid& grid, const TexelBuckets& buckets) {
  std::vector<std::uint32_t> counts(grid.key_count, 0);
  tbb::parallel_for(std::size_t{0}, buckets.count(), [&](std::size_t bucket) {
    for (std::uint64_t k = buckets.first_texels[bucket]; k < buckets.first_texels[bucket + 1]; ++k)
      ++counts[buckets.texels[k].key];
  });
  return counts;
}

/// Fewest bits, along each axis, of sub-bins of a bin: one less for each bit of position beyond kFewPositionBits.
int sureSubbinBits(const TexelCode& map) {
  const int beyond = std::max(map.column_bits + map.row_bits - kFewPositionBits, 0);
  return std::min(std::max(TexelCode::kMaxSubbinBits - beyond, kSureSubbinBits), map.subbin_bits);
}

/// Logarithm of the number of cells of a block: of `wanted`, or more where codes would have no room for sureSubbinBits. Smaller
/// cells leave more bits of a code to sub-bins.
int cellBits(const TexelCode& map, int side_bits, std::uint64_t wanted) {
  const int most = map.column_bits + map.row_bits;
  int bits = std::min(wanted == 0 ? 0 : static_cast<int>(std::bit_width(wanted)) - 1, most);
  const int sure = side_bits + sureSubbinBits(map);
  while (bits < most && blockCode(map, side_bits, bits).subbin_bits < sure) ++bits;
  return bits;
}

/// Divides tiles into blocks, one tile after the other.
class TileDivider {
 public:
  /// @param bin_counts  [keys]: number of texels
  TileDivider(const TexelCode& code, const BinGrid& grid, std::vector<std::uint32_t> bin_counts, int leaf_size)
      : code_(code), tile_bits_(grid.tile_bits), leaf_size_(leaf_size) {
    trees_.bin_blocks = std::move(bin_counts);
    trees_.nodes.assign(2 * grid.tileCount(), 0);
  }

  std::size_t blockCount() const { return trees_.blocks.size(); }
  void divideTile(std::size_t tile) { divide(tile, tile << 2 * tile_bits_, tile_bits_); }
  BlockTrees finish() { return std::move(trees_); }

 private:
  /// Number of texels of all bins of a square, and of the bin that has most.
  struct Filling {
    std::uint64_t all = 0, fullest = 0;
  };
  Filling filling(std::size_t first_key, int side_bits) const {
    Filling result;
    for (std::size_t key = first_key; key < first_key + (std::size_t{1} << 2 * side_bits); ++key) {
      result.all += trees_.bin_blocks[key];
      result.fullest = std::max<std::uint64_t>(result.fullest, trees_.bin_blocks[key]);
    }
    return result;
  }

  /// Makes a node with texels a block, or the parent of four nodes.
  void divide(std::size_t node, std::size_t first_key, int side_bits) {
    const Filling texels = filling(first_key, side_bits);
    if (texels.all == 0) return;
    const bool is_coarse = side_bits + sureSubbinBits(code_) > kMostSubbinBits;
    if (side_bits > 0 && (texels.all > kMostOfBlock || texels.fullest > kMostOfSharedBin || is_coarse))
      split(node, first_key, side_bits);
    else
      addBlock(node, first_key, side_bits, texels.all);
  }

  void split(std::size_t node, std::size_t first_key, int side_bits) {
    const auto first_child = static_cast<std::uint32_t>(trees_.nodes.size() / 2);
    trees_.nodes[2 * node] = BinMap::kSplit;
    trees_.nodes[2 * node + 1] = first_child;
    trees_.nodes.resize(trees_.nodes.size() + 8);
    const int child_bits = side_bits - 1;
    for (std::size_t quadrant = 0; quadrant < 4; ++quadrant)
      divide(first_child + quadrant, first_key + (quadrant << 2 * child_bits), child_bits);
  }

  void addBlock(std::size_t node, std::size_t first_key, int side_bits, std::uint64_t texels) {
    const int cell_bits = cellBits(code_, side_bits, texels / leaf_size_);
    const auto number = static_cast<std::uint32_t>(trees_.blocks.size());
    const BinBlock block{static_cast<std::uint32_t>(first_key), static_cast<std::uint32_t>(trees_.cell_count),
                         static_cast<std::uint32_t>(texels), static_cast<std::uint8_t>(side_bits),
                         static_cast<std::uint8_t>(cell_bits)};
    trees_.nodes[2 * node] = (block.cell_bits + 1u) | number << BinMap::kKindBits;
    trees_.nodes[2 * node + 1] = block.first_cell;
    trees_.cell_count += std::size_t{1} << cell_bits;
    // Nothing reads the counts of these bins again: from now on their entries hold the number of the block.
    std::fill_n(trees_.bin_blocks.begin() + static_cast<std::ptrdiff_t>(first_key), std::size_t{1} << 2 * side_bits, number);
    trees_.blocks.push_back(block);
  }

  TexelCode code_;
  int tile_bits_, leaf_size_;
  BlockTrees trees_;  ///< bin_blocks holds counts of texels for bins whose block is not made yet
};

}  // namespace

BlockTrees divideTiles(const TexelCode& code, const BinGrid& grid, const TexelBuckets& buckets, int leaf_size) {
  TileDivider divider(code, grid, countBins(grid, buckets), leaf_size);
  std::vector<std::uint32_t> bucket_first_blocks;
  std::size_t bucket = 0;
  for (std::size_t tile = 0; tile < grid.tileCount(); ++tile) {
    for (; bucket < buckets.count() && buckets.first_tiles[bucket] == tile; ++bucket)
      bucket_first_blocks.push_back(static_cast<std::uint32_t>(divider.blockCount()));
    divider.divideTile(tile);
  }
  bucket_first_blocks.push_back(static_cast<std::uint32_t>(divider.blockCount()));
  BlockTrees trees = divider.finish();
  trees.bucket_first_blocks = std::move(bucket_first_blocks);
  return trees;
}

}  // namespace glint::bake
