#pragma once

#include <array>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/model/wang_images.h"

namespace glint::bake {

/// WangImages that own their arrays.
struct WangImagesData {
  WangTiles tiles;  ///< its span is empty
  int level_count = 0;
  std::array<WangGrid, kMaxPyramidLevels> grids;  ///< their spans are empty
  std::array<std::vector<float>, kMaxPyramidLevels> masses;

  /// Spans over the arrays; valid while this object lives and is not changed.
  WangImages view() const;
};

/// A WangPyramid that owns its arrays.
struct WangPyramidData {
  WangImagesData plane;
  NdfPyramidData images;

  /// Spans over the arrays; valid while this object lives and is not changed.
  WangPyramid view() const { return {plane.view(), images.view()}; }
};

/// A centre beyond the border of a tile has an image in the tile if at least this share of its footprint lies in the tile along
/// the axis of the border. What is left out is spread over the tiles that have an image: at most this share of a footprint, at
/// centres near a border. Images of less hardly count in any answer, and take most of the bytes when they are compressed.
inline constexpr double kLeastTileShare = 0.01;

/// The memory that buildWangPyramid takes at its peak, bytes, as pyramidBytes says it.
/// @throws Error  as buildWangPyramid
double wangPyramidBytes(const WangTiles& tiles, const PyramidOptions& options, double most_bytes);

/// Builds the NDF images of all tiles of a plane, in one pyramid (Deng 2022, section 5.5 and Fig. 12).
///
/// The images of a tile are those of buildPyramid, of the texels in the tile alone; and also of centres beyond its border whose
/// footprint meets it. Each image is normalised, and its mass is known by its centre (WangGrid). So at every centre of the plane
/// the masses times the images of the tiles sum to the image that a map of the plane has there, over edges and corners.
/// @param options  `boundary` is not used: a plane has no border. `levels` 0: all strides below the size of a tile
/// @throws Error (usage) for options out of range; (unsupported) for smooth surfaces
WangPyramidData buildWangPyramid(const WangTiles& tiles, const PyramidOptions& options, const ProgressFn& progress = {});

/// Masses of the images of all levels: CompressionOptions::image_masses, without which images that hardly count take most of the
/// bytes.
std::vector<float> imageMasses(const WangPyramid& pyramid);

}  // namespace glint::bake
