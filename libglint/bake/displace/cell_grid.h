#pragma once

#include <cstdint>

#include "glint/model/displacement.h"

namespace glint::bake {

/// A map of width x height texels cut into columns x rows cells of a downsampled surface.
///
/// Where the cells do not divide the map, they are width / columns by height / rows texels large, and a texel belongs to the
/// cell whose borders, rounded to whole texels, it lies between.
struct CellGrid {
  int width = 0;
  int height = 0;
  int columns = 1;
  int rows = 1;

  static CellGrid of(int width, int height, int factor) {
    return {width, height, displacementCells(width, factor), displacementCells(height, factor)};
  }

  /// First texel of a column of cells; of column `columns`, the width of the map.
  int firstColumn(int column) const { return border(column, width, columns); }
  /// First texel of a row of cells; of row `rows`, the height of the map.
  int firstRow(int row) const { return border(row, height, rows); }
  /// Sides of a cell, texels.
  float cellWidth() const { return static_cast<float>(width) / static_cast<float>(columns); }
  float cellHeight() const { return static_cast<float>(height) / static_cast<float>(rows); }

  friend bool operator==(const CellGrid&, const CellGrid&) = default;

 private:
  static int border(int cell, int texels, int cells) {
    return static_cast<int>((2 * static_cast<std::int64_t>(cell) * texels + cells) / (2 * static_cast<std::int64_t>(cells)));
  }
};

}  // namespace glint::bake
