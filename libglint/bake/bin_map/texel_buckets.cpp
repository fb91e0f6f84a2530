#include "glint/bake/bin_map/texel_buckets.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <string>
#include <utility>

#include "glint/model/counted.h"
#include "glint/model/error.h"
#include "glint/model/texel_name.h"

namespace glint::bake {
namespace {

/// Most runs of keys. Their counts for one part of the map take 256 kB, which a second-level cache holds.
constexpr std::size_t kMostRuns = 1 << 16;
/// Approximate number of buckets. A processor writes about so many streams at once without waiting for memory.
constexpr std::size_t kBuckets = 512;

[[noreturn]] void throwOutside(const NormalMap& map) {
  TexelTally outside(map.width, map.height);
  for (std::size_t k = 0; k < map.normals.size(); ++k)
    if (!(dot(map.normals[k], map.normals[k]) < 1)) outside.add(k);
  throw Error(ErrorCode::invalid_input, "normals.disk", {}, "/normals",
              counted(outside.count(), {"normal is", "normals are"}) + " not inside the unit disk (first at " +
                  outside.firstName() + ")",
              "make the map again with glint-ingest, which moves normals on the rim inside");
}

/// Joins neighbouring tiles to buckets of about equal numbers of texels.
/// @param run_buckets  [runs]: bucket of each run
TexelBuckets joinTiles(const BinGrid& grid, const RunCounts& counts, std::size_t texel_count,
                       std::vector<std::uint16_t>& run_buckets) {
  const int key_bits = 2 * grid.tile_bits;
  const std::uint64_t wanted = texel_count / kBuckets + 1;
  std::vector<std::uint64_t> totals(counts.runs);
  for (const auto& part : counts.parts)
    for (std::size_t r = 0; r < counts.runs; ++r) totals[r] += part[r];

  TexelBuckets buckets{{0}, {0}, nullptr};
  run_buckets.resize(counts.runs);
  std::uint64_t texels = 0, all = 0;
  for (std::size_t r = 0; r < counts.runs; ++r) {
    // A full bucket ends where a tile begins, so that no tile is in two buckets.
    const std::size_t key = r << counts.shift, tile = key >> key_bits;
    if (texels >= wanted && key == tile << key_bits) {
      buckets.first_tiles.push_back(tile);
      buckets.first_texels.push_back(all);
      texels = 0;
    }
    run_buckets[r] = static_cast<std::uint16_t>(buckets.first_tiles.size() - 1);
    texels += totals[r], all += totals[r];
  }
  buckets.first_tiles.push_back(grid.tileCount());
  buckets.first_texels.push_back(all);
  return buckets;
}

/// For each part of the map, the index in each bucket at which it writes its first texel: after the texels of earlier parts.
std::vector<std::vector<std::uint64_t>> firstTexels(const RunCounts& counts, const std::vector<std::uint16_t>& run_buckets,
                                                    const TexelBuckets& buckets) {
  std::vector<std::vector<std::uint64_t>> cursors(kMapParts, std::vector<std::uint64_t>(buckets.count()));
  for (std::size_t part = 0; part < kMapParts; ++part)
    for (std::size_t r = 0; r < counts.runs; ++r) cursors[part][run_buckets[r]] += counts.parts[part][r];
  for (std::size_t bucket = 0; bucket < buckets.count(); ++bucket) {
    std::uint64_t next = buckets.first_texels[bucket];
    for (auto& cursor : cursors) next += std::exchange(cursor[bucket], next);
  }
  return cursors;
}

}  // namespace

RunCounts countRuns(const NormalMap& map, const BinGrid& grid) {
  RunCounts result;
  while (((grid.key_count - 1) >> result.shift) >= kMostRuns) ++result.shift;
  result.runs = ((grid.key_count - 1) >> result.shift) + 1;
  result.parts.resize(kMapParts);
  bool inside[kMapParts];
  tbb::parallel_for(std::size_t{0}, kMapParts, [&](std::size_t part) {
    std::vector<std::uint32_t>& counts = result.parts[part];
    counts.assign(result.runs, 0);
    inside[part] = visitBinned(map, grid, part, [&](const BinnedChunk& chunk) {
      for (std::size_t k = 0; k < chunk.count; ++k) ++counts[chunk.keys[k] >> result.shift];
    });
  });
  if (!std::all_of(inside, inside + kMapParts, [](bool b) { return b; })) throwOutside(map);
  return result;
}

TexelBuckets fillBuckets(const NormalMap& map, const TexelCode& code, const BinGrid& grid, const RunCounts& counts) {
  std::vector<std::uint16_t> run_buckets;
  TexelBuckets buckets = joinTiles(grid, counts, map.normals.size(), run_buckets);
  std::vector<std::vector<std::uint64_t>> cursors = firstTexels(counts, run_buckets, buckets);
  buckets.texels = makeLargeArray<BinnedTexel>(map.normals.size());
  BinnedTexel* texels = buckets.texels.get();
  const auto width = static_cast<std::uint32_t>(map.width);
  tbb::parallel_for(std::size_t{0}, kMapParts, [&](std::size_t part) {
    std::uint64_t* cursor = cursors[part].data();
    visitBinned(map, grid, part, [&](const BinnedChunk& chunk) {
      auto row = static_cast<std::uint32_t>(chunk.first / width), column = static_cast<std::uint32_t>(chunk.first % width);
      for (std::size_t k = 0; k < chunk.count; ++k) {
        const std::uint32_t key = chunk.keys[k];
        texels[cursor[run_buckets[key >> counts.shift]]++] = {code.pack(column, row, chunk.subbins[k], 0), key};
        if (++column == width) column = 0, ++row;
      }
    });
  });
  return buckets;
}

}  // namespace glint::bake
