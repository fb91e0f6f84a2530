// The steps of buildBinMap, each by itself.

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "glint/bake/bin_map/bin_map.h"
#include "glint/bake/bin_map/block_trees.h"
#include "glint/bake/bin_map/texel_buckets.h"
#include "glint/bake/bin_map/texel_lists.h"
#include "support/test_maps.h"

namespace glint::bake::bin_map_steps_test {
namespace {

/// A map whose width is no power of two, with its bins.
struct Steps {
  test::OwnedMap map{200, 128, test::roughSurface(200, 128, 0.2f)};
  TexelCode code = texelCode(200, 128);
  BinGrid grid = makeBinGrid(binsPerAxis(0.05f), 2, code.subbin_bits);
};

TEST(BinGrid, KeysNumberAllBinsOnce) {
  const BinGrid grid = makeBinGrid(13, 2, 5);
  EXPECT_EQ(grid.tiles_per_axis, 4);
  EXPECT_EQ(grid.key_count, 16u * 16u);
  std::vector<std::uint32_t> keys;
  for (const std::uint32_t row : grid.row_keys)
    for (const std::uint32_t column : grid.column_keys) keys.push_back(row + column);
  std::sort(keys.begin(), keys.end());
  EXPECT_EQ(std::adjacent_find(keys.begin(), keys.end()), keys.end());
  EXPECT_LT(keys.back(), grid.key_count);
}

TEST(TexelBuckets, HaveEveryTexelOnceInTheOrderOfTheMap) {
  const Steps s;
  const TexelBuckets buckets = fillBuckets(s.map.map(), s.code, s.grid, countRuns(s.map.map(), s.grid));
  ASSERT_EQ(buckets.first_texels.back(), 200u * 128u);
  std::vector<int> seen(200 * 128);
  for (std::size_t bucket = 0; bucket < buckets.count(); ++bucket) {
    std::int64_t before = -1;
    for (std::uint64_t k = buckets.first_texels[bucket]; k < buckets.first_texels[bucket + 1]; ++k) {
      const BinnedTexel texel = buckets.texels[k];
      const std::int64_t number = std::int64_t{s.code.row(texel.code)} * 200 + s.code.column(texel.code);
      EXPECT_GT(number, before);
      before = number;
      ++seen[static_cast<std::size_t>(number)];
      const std::size_t tile = texel.key / s.grid.keysPerTile();
      EXPECT_GE(tile, buckets.first_tiles[bucket]);
      EXPECT_LT(tile, buckets.first_tiles[bucket + 1]);
    }
  }
  EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), 200 * 128);
}

TEST(BlockTrees, BlocksHaveTheTexelsOfTheirBins) {
  const Steps s;
  const TexelBuckets buckets = fillBuckets(s.map.map(), s.code, s.grid, countRuns(s.map.map(), s.grid));
  const BlockTrees trees = divideTiles(s.code, s.grid, buckets, 16);
  std::vector<std::uint32_t> texels(trees.blocks.size());
  for (std::uint64_t k = 0; k < buckets.first_texels.back(); ++k) ++texels[trees.bin_blocks[buckets.texels[k].key]];
  for (std::size_t b = 0; b < trees.blocks.size(); ++b) {
    EXPECT_EQ(trees.blocks[b].texels, texels[b]);
    EXPECT_EQ(trees.firstCell(b + 1) - trees.firstCell(b), std::size_t{1} << trees.blocks[b].cell_bits);
  }
}

TEST(TexelLists, CellsFollowEachOther) {
  const Steps s;
  const TexelBuckets buckets = fillBuckets(s.map.map(), s.code, s.grid, countRuns(s.map.map(), s.grid));
  const BlockTrees trees = divideTiles(s.code, s.grid, buckets, 16);
  const TexelLists lists = listTexels(s.code, buckets, trees);
  EXPECT_TRUE(std::is_sorted(lists.cell_starts.begin(), lists.cell_starts.end()));
  EXPECT_EQ(lists.cell_starts.front(), 0u);
  EXPECT_EQ(lists.cell_starts.back(), lists.texels.size());
  for (std::size_t b = 0; b < trees.blocks.size(); ++b) {
    const std::uint64_t first = lists.cell_starts[trees.firstCell(b)], end = lists.cell_starts[trees.firstCell(b + 1)];
    EXPECT_EQ(end - first, trees.blocks[b].texels);
  }
}

}  // namespace
}  // namespace glint::bake::bin_map_steps_test
