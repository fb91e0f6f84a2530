#include "glint/formats/kinds/wang_fields.h"

#include <cmath>
#include <string>

namespace glint::formats {

void checkTileSet(const WangTiles& tiles, Findings& findings) {
  if (tiles.scheme == WangScheme::corner && tiles.colors_h != tiles.colors_v) {
    findings.add("wang.corners", "/@colors_v",
                 "is " + std::to_string(tiles.colors_v) + ", and colors_h is " + std::to_string(tiles.colors_h));
    return;
  }
  if (tiles.tile_count % tiles.combinations() != 0)
    findings.add("wang.set", "/@tile_count",
                 "is " + std::to_string(tiles.tile_count) + ", no multiple of " + std::to_string(tiles.combinations()) +
                     " combinations of colours");
}

void checkTileImages(const WangImages& plane, const PyramidShape& shape, Findings& findings) {
  checkTileSet(plane.tiles, findings);
  checkSlopes(shape.slopes, findings);
  if (shape.resolution % kBlockSize != 0)
    findings.add("shape.resolution", "/@resolution", "is " + std::to_string(shape.resolution) + ", not a multiple of 16");
  for (int l = 0; l < shape.level_count; ++l) {
    const PyramidGrid& grid = shape.levels[l];
    const WangGrid& tile = plane.grids[l];
    if (l > 0 && grid.stride != 2 * shape.levels[l - 1].stride)
      findings.add("shape.strides", "/@level_strides", "level " + std::to_string(l) + " is not twice the level before");
    const bool is_mean = l + 1 == shape.level_count;
    const bool fits = is_mean ? grid.columns == 1 && grid.rows == 1 && tile.columns == 1
                              : grid.columns == tile.side() && tile.margin >= 0 &&
                                    tile.margin <= WangGrid::kMostMargins * tile.columns &&
                                    std::int64_t{grid.rows} == std::int64_t{plane.tiles.tile_count} * grid.columns;
    if (fits) continue;
    findings.add("wang.levels", "/@level_columns",
                 "level " + std::to_string(l) + " has " + std::to_string(grid.columns) + " x " + std::to_string(grid.rows) +
                     " images, which do not fit " + std::to_string(tile.columns) + " centres along a side of " +
                     std::to_string(plane.tiles.tile_count) + " tiles");
    return;
  }
}

void checkTileMasses(const WangImages& plane, const PyramidShape& shape, Findings& findings) {
  constexpr double kRounding = 1e-5;  // of a sum of a few floats
  for (int l = 0; l < shape.level_count; ++l) {
    const WangGrid& grid = plane.grids[l];
    for (int k = 0; k < grid.columns; ++k) {
      double sum = 0;
      bool valid = true;
      for (int place = k; place < grid.side(); place += grid.columns) {
        const float mass = grid.masses[static_cast<std::size_t>(place)];
        valid = valid && mass >= 0 && mass <= 1;
        sum += double{mass};
      }
      if (valid && std::abs(sum - 1) <= kRounding) continue;
      findings.add("wang.masses", "/" + levelPath("level_{l}/masses", l),
                   "do not sum to 1 at centre " + std::to_string(k) + " of a tile");
      return;
    }
  }
}

}  // namespace glint::formats
