#pragma once

#include <array>
#include <span>
#include <vector>

#include "glint/math/vec.h"

namespace glint::bake {

/// The texels of one tile, bottom row first; empty where there is no tile.
template <class T>
struct TileTexels {
  std::span<const T> texels;  ///< [height][width]
  int width = 0;
  int height = 0;
};

/// A tile and its eight neighbours.
template <class T>
struct TileNeighbourhood {
  std::array<TileTexels<T>, 9> tiles;

  /// @param dx, dy  columns and rows from the tile, -1 to 1
  TileTexels<T>& at(int dx, int dy) { return tiles[static_cast<std::size_t>(3 * (dy + 1) + dx + 1)]; }
  const TileTexels<T>& at(int dx, int dy) const { return tiles[static_cast<std::size_t>(3 * (dy + 1) + dx + 1)]; }
};

/// The texels of a tile and of margins around it, which show the neighbours.
///
/// Neighbours of another resolution give their texel at the same place. Where both neighbours of a corner have margins and there is
/// no tile beyond the corner, texels of the two neighbours stand there in turn, mirrored at their borders, so that neither of
/// them gains weight.
/// @param margins  texels beyond the left, lower, right and upper border, at most the size of the tile; 0 where there is no
///                 neighbour on that side
/// @return [height + margins][width + margins]
template <class T>
std::vector<T> withMargins(const TileNeighbourhood<T>& around, const std::array<int, 4>& margins);

extern template std::vector<float> withMargins(const TileNeighbourhood<float>&, const std::array<int, 4>&);
extern template std::vector<Vec2> withMargins(const TileNeighbourhood<Vec2>&, const std::array<int, 4>&);

}  // namespace glint::bake
