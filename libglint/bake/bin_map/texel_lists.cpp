#include "glint/bake/bin_map/texel_lists.h"

#include <tbb/parallel_for.h>

#include <span>
#include <utility>

#include "glint/math/half.h"

namespace glint::bake {
namespace {

/// Gathers every second bit of x, from bit 0 on: the column of a bin from its key. The inverse of spreading bits.
std::uint32_t gatherBits(std::uint32_t x) {
  x &= 0x55555555;
  x = (x | x >> 1) & 0x33333333;
  x = (x | x >> 2) & 0x0f0f0f0f;
  x = (x | x >> 4) & 0x00ff00ff;
  return (x | x >> 8) & 0x0000ffff;
}

/// Finds the cells of the texels of a block, and packs the texels by the code of the block.
class BlockPacker {
 public:
  /// @param map         code of the texels in their buckets
  /// @param first_cell  cell that `cell` counts as 0
  BlockPacker(const TexelCode& map, const BinBlock& block, std::uint32_t first_cell)
      : map_(map),
        code_(blockCode(map, block.side_bits, block.cell_bits)),
        grid_(cellGrid(map, block.cell_bits)),
        first_cell_(block.first_cell - first_cell),
        key_mask_((1u << 2 * block.side_bits) - 1),
        kept_bits_(code_.subbin_bits - block.side_bits) {}

  std::uint32_t cell(const BinnedTexel& texel) const {
    return first_cell_ + (map_.row(texel.code) >> grid_.row_shift) * static_cast<std::uint32_t>(grid_.columns) +
           (map_.column(texel.code) >> grid_.column_shift);
  }

  std::uint32_t pack(const BinnedTexel& texel) const {
    const std::uint32_t bin = texel.key & key_mask_;
    const int dropped = map_.subbin_bits - kept_bits_;
    return code_.pack(map_.column(texel.code) & ((1u << grid_.column_shift) - 1),
                      map_.row(texel.code) & ((1u << grid_.row_shift) - 1),
                      gatherBits(bin) << kept_bits_ | map_.subbinX(texel.code) >> dropped,
                      gatherBits(bin >> 1) << kept_bits_ | map_.subbinY(texel.code) >> dropped);
  }

 private:
  TexelCode map_, code_;
  CellGrid grid_;
  std::uint32_t first_cell_, key_mask_;
  int kept_bits_;
};

/// Stores the mean and the covariance of the sub-bins of the texels [begin, end) of a block, as BinMap::block_moments.
void storeMoments(const TexelCode& code, std::span<const std::uint32_t> texels, std::uint64_t begin, std::uint64_t end,
                  std::uint16_t* moments) {
  std::uint64_t x = 0, y = 0;
  double xx = 0, xy = 0, yy = 0;
  for (std::uint64_t k = begin; k < end; ++k) {
    const std::uint64_t px = code.subbinX(texels[k]), py = code.subbinY(texels[k]);
    x += px, y += py;
    xx += static_cast<double>(px * px), xy += static_cast<double>(px * py), yy += static_cast<double>(py * py);
  }
  const double count = static_cast<double>(end - begin), step = 1.0 / (1 << code.subbin_bits);
  const double mx = static_cast<double>(x) / count, my = static_cast<double>(y) / count;
  const double values[5] = {(mx + 0.5) * step, (my + 0.5) * step, (xx / count - mx * mx) * step * step,
                            (xy / count - mx * my) * step * step, (yy / count - my * my) * step * step};
  for (int k = 0; k < 5; ++k) moments[k] = floatToHalf(static_cast<float>(values[k]));
}

/// Sorts the texels of one bucket by cell: a counting sort.
void listBucket(const TexelCode& code, const TexelBuckets& buckets, const BlockTrees& trees, std::size_t bucket,
                TexelLists& lists) {
  const std::uint32_t first = trees.bucket_first_blocks[bucket], end = trees.bucket_first_blocks[bucket + 1];
  if (first == end) return;
  const std::uint32_t first_cell = trees.blocks[first].first_cell;
  std::vector<BlockPacker> packers;
  for (std::uint32_t b = first; b < end; ++b) packers.emplace_back(code, trees.blocks[b], first_cell);
  const auto packerOf = [&](const BinnedTexel& texel) -> const BlockPacker& {
    return packers[trees.bin_blocks[texel.key] - first];
  };

  // Count the texels of each cell.
  const std::uint64_t begin = buckets.first_texels[bucket];
  const BinnedTexel* texels = buckets.texels.get() + begin;
  const std::size_t count = buckets.first_texels[bucket + 1] - begin;
  std::vector<std::uint32_t> texel_cells(count);
  std::uint64_t* cells = lists.cell_starts.data() + first_cell;
  const std::size_t cell_count = trees.firstCell(end) - first_cell;
  for (std::size_t k = 0; k < count; ++k) ++cells[texel_cells[k] = packerOf(texels[k]).cell(texels[k])];
  // Turn counts into starts, and move every texel to the next free index of its cell.
  std::uint64_t next = begin;
  for (std::size_t c = 0; c < cell_count; ++c) next += std::exchange(cells[c], next);
  for (std::size_t k = 0; k < count; ++k) lists.texels[cells[texel_cells[k]]++] = packerOf(texels[k]).pack(texels[k]);
  // The start of each cell has advanced to the start of the next one: shift the starts back.
  for (std::size_t c = cell_count; c-- > 1;) cells[c] = cells[c - 1];
  cells[0] = begin;
}

/// Stores the moments of all blocks of one bucket.
void storeBucketMoments(const TexelCode& code, const TexelBuckets& buckets, const BlockTrees& trees, std::size_t bucket,
                        TexelLists& lists) {
  const std::uint32_t first = trees.bucket_first_blocks[bucket], end = trees.bucket_first_blocks[bucket + 1];
  for (std::uint32_t b = first; b < end; ++b) {
    const BinBlock& block = trees.blocks[b];
    // The last block ends with the bucket: another thread may not have written the start of the next cell yet.
    const std::uint64_t last =
        b + 1 < end ? lists.cell_starts[trees.blocks[b + 1].first_cell] : buckets.first_texels[bucket + 1];
    storeMoments(blockCode(code, block.side_bits, block.cell_bits), lists.texels, lists.cell_starts[block.first_cell], last,
                 lists.block_moments.data() + 5 * std::size_t{b});
  }
}

}  // namespace

TexelLists listTexels(const TexelCode& code, const TexelBuckets& buckets, const BlockTrees& trees) {
  const std::uint64_t count = buckets.first_texels.back();
  TexelLists lists;
  lists.texels.resize(count);
  lists.cell_starts.resize(trees.cell_count + 1);
  lists.cell_starts.back() = count;
  lists.block_moments.resize(5 * trees.blocks.size());
  tbb::parallel_for(std::size_t{0}, buckets.count(), [&](std::size_t bucket) {
    listBucket(code, buckets, trees, bucket, lists);
    storeBucketMoments(code, buckets, trees, bucket, lists);
  });
  return lists;
}

}  // namespace glint::bake
