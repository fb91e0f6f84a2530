#pragma once

#include <span>

#include "glint/model/ndf_cp.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/model/wang_tiles.h"

namespace glint {

/// Which images a plane of Wang tiles has (Deng 2022, section 5.5).
///
/// The centres of a level are a grid over the whole plane: `columns` along each side of every tile. A footprint at a centre may
/// reach several tiles. Each of these tiles has an image for the centre: the NDF of the texels of this tile alone, normalised as
/// any image is. The share of the footprint that lies in the tile is the image's mass. So the NDF of the plane at a centre is
/// the sum of masses times images, over edges and corners as inside a tile.
///
/// A tile has images for centres up to `margin` beyond its border. Masses are products of one number for the column and one for
/// the row of the centre, which is why they are no part of the images.
struct WangGrid {
  /// Centres beyond the border are at most this many times `columns`.
  static constexpr int kMostMargins = 2;

  int columns = 0;  ///< centres along a side of a tile
  int margin = 0;   ///< centres beyond each side of a tile that have an image
  /// [columns + 2 margin]: share of the footprint along one axis, from the centre `margin` before the tile on. The shares of one
  /// centre in all tiles sum to 1.
  std::span<const float> masses;

  /// Images of a tile along each axis.
  GLINT_HD constexpr int side() const { return columns + 2 * margin; }
};

/// The plane of an asset of images: how tiles lie, and which images they have.
struct WangImages {
  WangTiles tiles;  ///< has no normals
  /// Of all levels. The last level is the mean of all tiles, which occur equally often: one centre and one image.
  WangGrid grids[kMaxPyramidLevels];
};

/// NDF images of the tiles of a plane without end (asset kind `wang-pyramid`).
///
/// `images.shape` is that of one tile: width and height are the size of a tile, boundary is clamp. Image (i, j) of tile t on
/// level l is in column i and row t * grids[l].side() + j of the level's images.
struct WangPyramid {
  WangImages plane;
  NdfPyramid images;
};

/// The same, compressed (asset kind `wang-cp`).
struct WangCp {
  WangImages plane;
  NdfCp images;
};

}  // namespace glint
