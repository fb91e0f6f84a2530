#pragma once

// Private to formats/: what kinds of Wang tiles share.

#include "glint/formats/kinds/shared_fields.h"
#include "glint/model/wang_images.h"

namespace glint::formats {

/// Attributes: the set of tiles, and how it covers a plane.
void describeTileSet(Fields auto& fields, auto& tiles) {
  fields.integer("tile_size", tiles.size, {WangTiles::kLeastSize, WangTiles::kMostSize}, "texel", "width and height of a tile");
  fields.choice("scheme", tiles.scheme, "edge|corner", "what has colours: the sides of tiles, or their corners");
  constexpr Range kColors = {WangTiles::kLeastColors, WangTiles::kMostColors};
  fields.integer("colors_h", tiles.colors_h, kColors, "1", "colours of south and north sides; scheme corner: of corners");
  fields.integer("colors_v", tiles.colors_v, kColors, "1", "colours of west and east sides; scheme corner: as colors_h");
  fields.integer("tile_count", tiles.tile_count, {1, WangTiles::kMostTiles}, "1", "number of tiles");
  fields.integer("plane_seed", tiles.plane_seed, {0, 1 << 30}, "1", "seed of the colours of the plane");
  fields.real("texel_size_um", tiles.texel_size_um, {0, FLT_MAX}, "um", "width of a texel; 0 when unknown");
}

/// Attributes: the set of tiles, and which images a tile has.
void describeTileImages(Fields auto& fields, auto& plane, auto& shape) {
  describeTileSet(fields, plane.tiles);
  fields.set(shape.width, plane.tiles.size);
  fields.set(shape.height, plane.tiles.size);
  fields.set(shape.boundary, Boundary::clamp);
  fields.integer("resolution", shape.resolution, {kBlockSize, 1024}, "pixel",
                 "pixels of an NDF image along each axis; a multiple of 16");
  fields.real("sigma_r", shape.sigma_r, kDiskUnits, "1", "intrinsic roughness: standard deviation in disk units");
  fields.choice("surface", shape.surface, "flat|smooth", "normals between texel centres");
  fields.real("overlap", shape.overlap, {1, kMostOverlap}, "1", "footprints in a stride along each axis");
  fields.integer("level_count", shape.level_count, {2, kMaxPyramidLevels}, "1", "number of levels, with the mean of all tiles");
  const auto strides = [&](int l) -> auto& { return shape.levels[l].stride; };
  const auto centres = [&](int l) -> auto& { return plane.grids[l].columns; };
  const auto columns = [&](int l) -> auto& { return shape.levels[l].columns; };
  const auto rows = [&](int l) -> auto& { return shape.levels[l].rows; };
  fields.levelReals("level_strides", shape.level_count, strides, {FLT_MIN, kMaxMapSize}, "texel",
                    "stride of each level, which the size of its footprints follows");
  fields.levelIntegers("level_centres", shape.level_count, centres, kMapSize, "1", "centres along each side of a tile");
  fields.levelIntegers("level_columns", shape.level_count, columns, kMapSize, "1",
                       "images of a tile along each axis: centres in the tile, and beyond two of its sides");
  fields.levelIntegers("level_rows", shape.level_count, rows, {1, INT32_MAX}, "1",
                       "rows of images: level_columns for each tile; of the last level 1");
  for (int l = 0; l < shape.level_count; ++l)
    fields.set(plane.grids[l].margin, (shape.levels[l].columns - plane.grids[l].columns) / 2);
  describeSlopes(fields, shape.slopes);
}

/// Arrays: the masses of images.
void describeTileMasses(Fields auto& fields, auto& plane, auto& shape) {
  fields.levels("level_count", shape.level_count, [&](int l) {
    fields.array("level_{l}/masses", plane.grids[l].masses, {"level_columns[l]"}, "1",
                 "share of a footprint in the tile along one axis, for each column of images");
  });
}

/// Rules wang.set and wang.corners.
void checkTileSet(const WangTiles& tiles, Findings& findings);
/// Rules wang.levels, and those of shapes that planes have.
void checkTileImages(const WangImages& plane, const PyramidShape& shape, Findings& findings);
/// Rule wang.masses.
void checkTileMasses(const WangImages& plane, const PyramidShape& shape, Findings& findings);

}  // namespace glint::formats
