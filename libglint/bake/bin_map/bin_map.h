#pragma once

#include <cstdint>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/model/bin_map.h"
#include "glint/model/normal_map.h"

namespace glint::bake {

struct BinMapOptions {
  float alpha = 0.01f;  ///< Beckmann roughness of the facets, kMinBinAlpha to 1; the smallest, if there is a range
  int leaf_size = 16;   ///< texels of a cell, on average at least, 1 to 1024; sparse blocks have fewer
  float alpha_max = 0;  ///< largest roughness that will be asked for, at most kMaxAlphaRange times alpha; 0: alpha
};

/// Smallest roughness: the number of bins grows with 1 / alpha^2.
inline constexpr float kMinBinAlpha = 5e-4f;
/// Largest quotient of the roughnesses of one bin map: a lobe of the largest reaches bins in proportion to its square.
inline constexpr float kMaxAlphaRange = 64;
/// Bins along each axis at most, reached near the smallest roughness.
inline constexpr int kMaxBinsPerAxis = 4096;

/// Bins along each axis for a roughness: 5 / sin(arctan(3 sigma)), so that five bins span six deviations (Atanasov 2021, Eq. 16
/// and table 4, which rounds down).
int binsPerAxis(float alpha);

/// Logarithm of the bins along each axis of a tile: 0 where texels are many.
int tileBits(int bins_per_axis, std::size_t texels);

/// Roughness of the bins that serve a range of roughnesses: the geometric mean, but not so rough that a normal is known to less
/// than a sixteenth of the bins of the smallest, or the smallest itself.
float binAlpha(float alpha_min, float alpha_max, int place_bits);

/// A CompactCounts that owns its arrays.
struct CompactCountsData {
  std::vector<std::uint64_t> bases;
  std::vector<std::uint16_t> offsets;
  int shift = 0;

  CompactCounts view() const { return {bases, offsets, shift}; }
};

/// Packs a non-decreasing sequence, with as few bases as its steps allow.
CompactCountsData compactCounts(const std::vector<std::uint64_t>& values);

/// A BinMap that owns its arrays.
struct BinMapData {
  int width = 0, height = 0;
  float alpha = 0, alpha_min = 0, alpha_max = 0;
  MapSlopes slopes;
  int bins_per_axis = 0, leaf_size = 0, tile_bits = 0;
  std::vector<std::uint32_t> nodes;
  std::vector<std::uint16_t> block_moments;
  CompactCountsData cell_starts;
  std::vector<std::uint32_t> texels, class_keys;
  std::vector<std::uint16_t> texel_classes;

  /// Spans over the arrays; valid while this object lives and is not changed.
  BinMap view() const;
  /// Bytes of all arrays, the same in memory and in a file.
  std::size_t sizeBytes() const;
};

/// Sorts the texels of a normal map by the blocks of their normals (Atanasov 2021, section 5.4, with blocks of bins for its
/// bins), each list by cells.
///
/// Two passes: into about 512 buckets of neighbouring tiles, then each bucket by cell in the cache. O(texels + bins).
/// @throws Error usage for options out of range; invalid_input for normals outside the disk; unsupported for maps whose columns
///         and rows need more than 28 bits together (16384 x 16384)
BinMapData buildBinMap(const NormalMap& map, const BinMapOptions& options, const ProgressFn& progress = {});

}  // namespace glint::bake
