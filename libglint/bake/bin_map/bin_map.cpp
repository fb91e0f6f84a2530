#include "glint/bake/bin_map/bin_map.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "glint/bake/bin_map/bin_grid.h"
#include "glint/bake/bin_map/block_trees.h"
#include "glint/bake/bin_map/texel_buckets.h"
#include "glint/bake/bin_map/texel_classes.h"
#include "glint/bake/bin_map/texel_lists.h"
#include "glint/bake/common/slopes.h"
#include "glint/model/error.h"

namespace glint::bake {
namespace {

/// A tile has about kTexelsOfTile texels on average, or is a single bin. Queries with large footprints take long to search a
/// tile of more than 8 x 8 bins (kWideTileBits), so only tiles with about kFewTexelsOfTile texels are that wide.
constexpr std::size_t kTexelsOfTile = 1024, kFewTexelsOfTile = 64;
constexpr int kWideTileBits = 3;

void checkOptions(const NormalMap& map, const BinMapOptions& o) {
  const auto usage = [](const char* option, const std::string& range) {
    throw Error(ErrorCode::usage, "option.range", {}, option, "out of range", "give " + range);
  };
  if (!(o.alpha >= kMinBinAlpha && o.alpha <= 1)) usage("--alpha", "a Beckmann roughness of 0.0005 to 1");
  if (o.alpha_max != 0 && !(o.alpha_max >= o.alpha && o.alpha_max <= std::min(1.0f, kMaxAlphaRange * o.alpha)))
    usage("--alpha", "a range that rises to at most 1 and 64 times its beginning");
  if (!(o.leaf_size >= 1 && o.leaf_size <= 1024)) usage("--leaf-size", "1 to 1024 texels");
  if (map.width < 1 || map.height < 1) throw Error(ErrorCode::invalid_input, "normals.size", {}, {}, "the map has no texels");
  if (texelCode(map.width, map.height).subbin_bits < 0) {
    throw Error(ErrorCode::unsupported, "bin_map.size", {}, {},
                std::to_string(map.width) + " x " + std::to_string(map.height) + " texels are too many for a bin map",
                "cut the map to at most 16384 x 16384 texels, or as many in another shape of powers of two");
  }
}

}  // namespace

int binsPerAxis(float alpha) {
  const double reach = 3 * double{alpha} / std::sqrt(2.0);
  return std::min(static_cast<int>(5 * std::sqrt(1 + reach * reach) / reach), kMaxBinsPerAxis);
}

int tileBits(int bins_per_axis, std::size_t texels) {
  // The fewest bits that leave at most `most` tiles.
  const auto bitsFor = [&](std::size_t most) {
    int bits = 0;
    for (; bits < BinMap::kMaxTileBits; ++bits)
      if (const auto across = static_cast<std::size_t>((bins_per_axis - 1) >> bits) + 1; across * across <= most) break;
    return bits;
  };
  return std::min(bitsFor(texels / kTexelsOfTile), std::max(kWideTileBits, bitsFor(texels / kFewTexelsOfTile)));
}

float binAlpha(float alpha_min, float alpha_max, int subbin_bits) {
  constexpr int kSubbinBits = 4;
  const int spare = std::max(std::min(subbin_bits, kSureSubbinBits) - kSubbinBits, 0);
  const float finest = alpha_min * std::exp2(static_cast<float>(spare));
  return alpha_min == alpha_max ? alpha_min : std::min(std::sqrt(alpha_min * alpha_max), finest);
}

CompactCountsData compactCounts(std::span<const std::uint64_t> values) {
  CompactCountsData data;
  const auto fits = [&](int shift) {
    const std::size_t step = std::size_t{1} << shift;
    for (std::size_t k = 0; k < values.size(); k += step)
      if (values[std::min(k + step, values.size()) - 1] - values[k] > UINT16_MAX) return false;
    return true;
  };
  data.shift = CompactCounts::kMaxShift;
  while (data.shift > 0 && !fits(data.shift)) --data.shift;
  const std::size_t step = std::size_t{1} << data.shift;
  for (std::size_t k = 0; k < values.size(); k += step) data.bases.push_back(values[k]);
  data.offsets.resize(values.size());
  for (std::size_t k = 0; k < values.size(); ++k)
    data.offsets[k] = static_cast<std::uint16_t>(values[k] - data.bases[k >> data.shift]);
  return data;
}

BinMap BinMapData::view() const {
  BinMap v;
  v.width = width;
  v.height = height;
  v.alpha = alpha;
  v.alpha_min = alpha_min;
  v.alpha_max = alpha_max;
  v.slopes = slopes;
  v.bins_per_axis = bins_per_axis;
  v.leaf_size = leaf_size;
  v.tile_bits = tile_bits;
  v.nodes = nodes;
  v.block_moments = block_moments;
  v.cell_starts = cell_starts.view();
  v.texels = texels;
  v.class_keys = class_keys;
  v.texel_classes = texel_classes;
  return v;
}

std::size_t BinMapData::sizeBytes() const {
  const auto bytes = [](const auto&... arrays) { return (... + (arrays.size() * sizeof(arrays[0]))); };
  return bytes(nodes, block_moments, cell_starts.bases, cell_starts.offsets, texels, class_keys, texel_classes);
}

BinMapData buildBinMap(const NormalMap& map, const BinMapOptions& options, const ProgressFn& progress) {
  checkOptions(map, options);
  const auto step = [&](std::size_t done) {
    if (progress) progress(done, 4);
  };
  // Choose the bins for the roughness, and tiles for the number of texels.
  const TexelCode code = texelCode(map.width, map.height);
  BinMapData data;
  data.width = map.width;
  data.height = map.height;
  data.alpha_min = options.alpha;
  data.alpha_max = options.alpha_max == 0 ? options.alpha : options.alpha_max;
  data.alpha = binAlpha(data.alpha_min, data.alpha_max, code.subbin_bits);
  data.leaf_size = options.leaf_size;
  data.bins_per_axis = binsPerAxis(data.alpha);
  data.tile_bits = tileBits(data.bins_per_axis, map.normals.size());

  // Move texels to buckets of neighbouring bins, which fit the cache.
  const BinGrid grid = makeBinGrid(data.bins_per_axis, data.tile_bits, code.subbin_bits);
  const RunCounts counts = countRuns(map, grid);
  step(1);
  const TexelBuckets buckets = fillBuckets(map, code, grid, counts);
  step(2);
  // Divide the bins into blocks, and list the texels of each block by cell.
  BlockTrees trees = divideTiles(code, grid, buckets, options.leaf_size);
  step(3);
  TexelLists lists = listTexels(code, buckets, trees);
  // Note for every texel which block has it.
  TexelClasses classes = classifyTexels(map, grid, trees);

  data.nodes = std::move(trees.nodes);
  data.texels = std::move(lists.texels);
  data.block_moments = std::move(lists.block_moments);
  data.cell_starts = compactCounts(lists.cell_starts);
  data.class_keys = std::move(classes.class_keys);
  data.texel_classes = std::move(classes.texel_classes);
  data.slopes = mapSlopes(map);
  step(4);
  return data;
}

}  // namespace glint::bake
