#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/model/bin_map.h"
#include "glint/model/normal_map.h"

namespace glint::bake {

struct BinMapOptions {
  float alpha = 0.01f;  ///< Beckmann roughness of the facets, kMinBinAlpha to 1; the smallest, if there is a range
  int leaf_size = 16;   ///< mean number of texels of a cell, at least, 1 to 1024; cells of sparse blocks have fewer
  float alpha_max = 0;  ///< largest roughness that a query may ask for, at most kMaxAlphaRange times alpha; 0: alpha
};

/// Smallest roughness: the number of bins grows with 1 / alpha^2.
inline constexpr float kMinBinAlpha = 5e-4f;
/// Largest quotient of the largest and the smallest roughness of one bin map. A lobe of the largest roughness reaches a number
/// of bins that grows with the square of the quotient.
inline constexpr float kMaxAlphaRange = 64;
/// Most bins along each axis. Roughnesses near kMinBinAlpha need that many.
inline constexpr int kMaxBinsPerAxis = 4096;

/// Number of bins along each axis for a roughness: 5 / sin(arctan(3 sigma)), so that five bins span six deviations of a lobe
/// (Atanasov 2021, Eq. 16). Rounded down, as in table 4 of the paper.
int binsPerAxis(float alpha);

/// Logarithm of the number of bins along each axis of a tile. 0, tiles of one bin, where bins have many texels.
int tileBits(int bins_per_axis, std::size_t texels);

/// Roughness for which bins are made when queries may ask for any roughness from alpha_min to alpha_max: the geometric mean of
/// the two, or less where codes have few bits. A code must tell a normal to a sixteenth of a bin that is made for alpha_min.
float binAlpha(float alpha_min, float alpha_max, int subbin_bits);

/// A CompactCounts that owns its arrays.
struct CompactCountsData {
  std::vector<std::uint64_t> bases;
  std::pmr::vector<std::uint16_t> offsets;
  int shift = 0;

  CompactCounts view() const { return {bases, offsets, shift}; }
};

/// Packs a non-decreasing sequence with as few bases as 16-bit offsets allow.
CompactCountsData compactCounts(std::span<const std::uint64_t> values);

/// A BinMap that owns its arrays. Those that grow with the map are in memory of the default resource.
struct BinMapData {
  int width = 0, height = 0;
  float alpha = 0, alpha_min = 0, alpha_max = 0;
  MapSlopes slopes;
  int bins_per_axis = 0, leaf_size = 0, tile_bits = 0;
  std::vector<std::uint32_t> nodes;
  std::vector<std::uint16_t> block_moments;
  CompactCountsData cell_starts;
  std::pmr::vector<std::uint32_t> texels;
  std::vector<std::uint32_t> class_keys;
  std::pmr::vector<std::uint16_t> texel_classes;

  /// Spans over the arrays; valid while this object lives and is not changed.
  BinMap view() const;
  /// Bytes of all arrays, the same in memory and in a file.
  std::size_t sizeBytes() const;
};

/// Sorts the texels of a normal map by the blocks of bins that their normals lie in, and the texels of a block by cell of the
/// map (Atanasov 2021, section 5.4; there each bin has a list of its own).
///
/// Two passes: the first moves texels to about 512 buckets of neighbouring tiles, the second sorts each bucket by cell, inside
/// the cache. O(texels + bins). Both passes write large arrays from their beginnings on, or buckets, so that these may be in files.
/// @throws Error usage for options out of range; invalid_input for normals outside the disk; unsupported for maps whose columns
///         and rows need more than 28 bits together (16384 x 16384)
BinMapData buildBinMap(const NormalMap& map, const BinMapOptions& options, const ProgressFn& progress = {});

}  // namespace glint::bake
