#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/bake/bin_map/bin_grid.h"
#include "glint/bake/common/large_array.h"
#include "glint/model/bin_map.h"

namespace glint::bake {

/// Number of texels of each part of a map in each run of neighbouring keys. Counts of runs stay in the cache, as counts of
/// single bins would not.
struct RunCounts {
  int shift = 0;  ///< a run has 2^shift keys
  std::size_t runs = 0;
  std::vector<std::vector<std::uint32_t>> parts;  ///< [kMapParts][runs]
};

/// Counts the texels of a map. O(texels).
/// @throw Error invalid_input if a normal is outside the disk
RunCounts countRuns(const NormalMap& map, const BinGrid& grid);

/// A texel and the bin of its normal.
struct BinnedTexel {
  std::uint32_t code;  ///< packed by the map's texelCode
  std::uint32_t key;   ///< of the bin
};

/// The texels of a map in buckets. A bucket has the texels of a few neighbouring tiles, in the order of the map.
struct TexelBuckets {
  std::vector<std::size_t> first_tiles;     ///< [buckets + 1]
  std::vector<std::uint64_t> first_texels;  ///< [buckets + 1]: index in `texels` at which a bucket begins
  LargeArray<BinnedTexel> texels;

  std::size_t count() const { return first_tiles.size() - 1; }
};

/// Moves the texels of a map to about 512 buckets of about equal numbers of texels. O(texels).
TexelBuckets fillBuckets(const NormalMap& map, const TexelCode& code, const BinGrid& grid, const RunCounts& counts);

}  // namespace glint::bake
