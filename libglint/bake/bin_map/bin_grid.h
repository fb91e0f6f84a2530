#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/math/vec.h"
#include "glint/model/normal_map.h"

namespace glint::bake {

/// Parts of a map that threads visit on their own. Their number must not depend on the number of threads.
inline constexpr std::size_t kMapParts = 16;
/// Texels whose normals are binned at once.
inline constexpr std::size_t kBinChunk = 512;

/// The bins of a map and their keys (see BinMap). The key of a bin is the sum of the keys of its column and its row.
struct BinGrid {
  int bins_per_axis = 0;
  int tile_bits = 0;   ///< logarithm of the bins along an axis of a tile
  int place_bits = 0;  ///< bits along each axis that tell where in its bin a normal lies
  int tiles_per_axis = 0;
  std::size_t key_count = 0;
  std::vector<std::uint32_t> column_keys, row_keys;  ///< [bins_per_axis]

  std::size_t tileCount() const { return static_cast<std::size_t>(tiles_per_axis) * tiles_per_axis; }
  std::size_t keysPerTile() const { return std::size_t{1} << 2 * tile_bits; }
};

BinGrid makeBinGrid(int bins_per_axis, int tile_bits, int place_bits);

/// Texels that follow each other in a map, with the bins of their normals.
struct BinnedChunk {
  std::size_t first, count;
  const std::uint32_t* keys;    ///< [count]
  const std::uint16_t* places;  ///< [count]: x | y << place_bits, each the part of the bin that the normal lies in
};

/// First texel of a part of a map; that of part kMapParts is the end of the map.
/// @return a multiple of kBinChunk, or the number of texels
inline std::size_t firstTexel(std::size_t texels, std::size_t part) {
  return std::min(texels, part * (texels / kMapParts / kBinChunk + 1) * kBinChunk);
}

/// Columns, rows and places of the bins that normals lie in.
/// @return false if a normal is outside the disk
bool binNormals(const Vec2* normals, std::size_t count, const BinGrid& grid, std::uint16_t* columns, std::uint16_t* rows,
                std::uint16_t* places);

/// Calls visit(BinnedChunk) for the texels of one part of a map, in the order of the map.
/// @return false if a normal is outside the disk; the rest of the part is then not visited
template <class Visit>
bool visitBinned(const NormalMap& map, const BinGrid& grid, std::size_t part, Visit&& visit) {
  std::uint16_t columns[kBinChunk], rows[kBinChunk], places[kBinChunk];
  std::uint32_t keys[kBinChunk];
  const std::size_t end = firstTexel(map.normals.size(), part + 1);
  for (std::size_t first = firstTexel(map.normals.size(), part); first < end; first += kBinChunk) {
    const std::size_t count = std::min(kBinChunk, end - first);
    if (!binNormals(map.normals.data() + first, count, grid, columns, rows, places)) return false;
    for (std::size_t k = 0; k < count; ++k) keys[k] = grid.column_keys[columns[k]] + grid.row_keys[rows[k]];
    visit(BinnedChunk{first, count, keys, places});
  }
  return true;
}

}  // namespace glint::bake
