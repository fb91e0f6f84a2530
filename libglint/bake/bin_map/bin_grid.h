#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/math/vec.h"
#include "glint/model/normal_map.h"

namespace glint::bake {

/// Number of parts of a map that threads visit independently. Results depend on it, so it must not depend on the threads.
inline constexpr std::size_t kMapParts = 16;
/// Number of texels that one call of binNormals takes.
inline constexpr std::size_t kBinChunk = 512;

/// The bins of a map and their keys (see BinMap). The key of a bin is the sum of the keys of its column and its row.
struct BinGrid {
  int bins_per_axis = 0;
  int tile_bits = 0;    ///< logarithm of the bins along an axis of a tile
  int subbin_bits = 0;  ///< bits, along each axis, of the sub-bins of a bin
  int tiles_per_axis = 0;
  std::size_t key_count = 0;
  std::vector<std::uint32_t> column_keys, row_keys;  ///< [bins_per_axis]

  std::size_t tileCount() const { return static_cast<std::size_t>(tiles_per_axis) * tiles_per_axis; }
  std::size_t keysPerTile() const { return std::size_t{1} << 2 * tile_bits; }
};

/// @param subbin_bits  of the map's texelCode
BinGrid makeBinGrid(int bins_per_axis, int tile_bits, int subbin_bits);

/// Texels that follow each other in a map, with the bins that their normals lie in.
struct BinnedChunk {
  std::size_t first, count;
  const std::uint32_t* keys;     ///< [count]
  const std::uint16_t* subbins;  ///< [count]: sub-bins of the normals in their bins, x | y << subbin_bits
};

/// First texel of a part of a map. Part kMapParts begins at the end of the map.
/// @return a multiple of kBinChunk, or the number of texels
inline std::size_t firstTexel(std::size_t texels, std::size_t part) {
  return std::min(texels, part * (texels / kMapParts / kBinChunk + 1) * kBinChunk);
}

/// Finds the column and row of the bin that each normal lies in, and its sub-bin.
/// @return false if a normal is outside the disk
bool binNormals(const Vec2* normals, std::size_t count, const BinGrid& grid, std::uint16_t* columns, std::uint16_t* rows,
                std::uint16_t* subbins);

/// Calls visit(BinnedChunk) for the texels of one part of a map, in the order of the map.
/// @return false if a normal is outside the disk; the rest of the part is then not visited
template <class Visit>
bool visitBinned(const NormalMap& map, const BinGrid& grid, std::size_t part, Visit&& visit) {
  std::uint16_t columns[kBinChunk], rows[kBinChunk], subbins[kBinChunk];
  std::uint32_t keys[kBinChunk];
  const std::size_t end = firstTexel(map.normals.size(), part + 1);
  for (std::size_t first = firstTexel(map.normals.size(), part); first < end; first += kBinChunk) {
    const std::size_t count = std::min(kBinChunk, end - first);
    if (!binNormals(map.normals.data() + first, count, grid, columns, rows, subbins)) return false;
    for (std::size_t k = 0; k < count; ++k) keys[k] = grid.column_keys[columns[k]] + grid.row_keys[rows[k]];
    visit(BinnedChunk{first, count, keys, subbins});
  }
  return true;
}

}  // namespace glint::bake
