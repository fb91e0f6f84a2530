#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "glint/math/vec.h"
#include "glint/model/map_slopes.h"

namespace glint {

/// What the colours of Wang tiles are of.
enum class WangScheme : std::uint8_t {
  edge,    ///< the sides of a tile (Cohen et al. 2003): neighbours across a side agree, not those across a corner
  corner,  ///< the corners of a tile (Lagae and Dutre 2006): neighbours across corners agree as well
};

/// Colours of a tile, in the order that numbers its set. Scheme edge: of the south, north, west and east side. Scheme corner: of
/// the south-west, south-east, north-west and north-east corner. North is +v, east is +u.
using WangColors = std::array<int, 4>;

/// Square tiles of normals that cover a plane without end (Deng 2022, section 5.5; asset kind `wang-tiles`).
///
/// The set is complete: each combination of colours has the same number of tiles, the variants. Tiles are in the order of their
/// colours, the first one slowest, and then of their variants. So a plane needs no table to find a tile (WangLayout).
struct WangTiles {
  static constexpr int kLeastSize = 16, kMostSize = 4096;  ///< texels along a side of a tile
  static constexpr int kLeastColors = 2, kMostColors = 8;
  static constexpr int kMostTiles = 4096;
  /// Texels of all tiles together: 8 GB of normals.
  static constexpr std::int64_t kMostTexels = std::int64_t{1} << 30;

  int size = 0;  ///< texels along each side of a tile
  WangScheme scheme = WangScheme::corner;
  int colors_h = 0;  ///< of south and north sides; scheme corner: of corners
  int colors_v = 0;  ///< of west and east sides; scheme corner: as colors_h
  int tile_count = 0;
  int plane_seed = 0;       ///< of the colours of the plane, 0 to 2^30
  float texel_size_um = 0;  ///< 0 when unknown
  MapSlopes slopes;         ///< of the texels of all tiles, which occur equally often
  float seam_cost = 0;      ///< mean difference of normals along seams, over that of neighbouring texels of the input
  float ndf_tv = 0;         ///< total variation between normals of the tiles and of the input, on 64 x 64 cells of the disk
  float repetition = 0;     ///< largest autocorrelation of the plane at whole numbers of tiles, up to four each way
  std::span<const Vec2> normals;  ///< [tile_count][size][size], each tile bottom row first

  /// Number of colours of element k of WangColors.
  GLINT_HD constexpr int colorsOf(int k) const { return k < 2 ? colors_h : colors_v; }
  GLINT_HD constexpr int combinations() const { return colors_h * colors_h * colors_v * colors_v; }
  /// Tiles with the same colours.
  GLINT_HD constexpr int variants() const { return tile_count / combinations(); }
  /// Number of the first tile with these colours.
  GLINT_HD constexpr int firstTile(int first, int second, int third, int fourth) const {
    return (((first * colors_h + second) * colors_v + third) * colors_v + fourth) * variants();
  }
  constexpr WangColors colorsOfTile(int tile) const {
    WangColors colors = {};
    int rest = tile / variants();
    for (int k = 3; k >= 0; --k) colors[static_cast<std::size_t>(k)] = rest % colorsOf(k), rest /= colorsOf(k);
    return colors;
  }

  GLINT_HD constexpr std::size_t texelsOfTile() const {
    return static_cast<std::size_t>(size) * static_cast<std::size_t>(size);
  }
  /// Normal of texel (i, j) of a tile.
  GLINT_HD const Vec2& at(int tile, int i, int j) const {
    return normals.data()[static_cast<std::size_t>(tile) * texelsOfTile() + rowMajorIndex(i, j, size)];
  }
};

}  // namespace glint
