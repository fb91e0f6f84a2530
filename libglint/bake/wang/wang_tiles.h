#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/model/normal_map.h"
#include "glint/model/wang_tiles.h"

namespace glint::bake {

struct WangOptions {
  std::string name;  ///< of the map, for error messages
  WangScheme scheme = WangScheme::corner;
  int size = 512;       ///< texels along each side of a tile, WangTiles::kLeastSize to kMostSize
  int colors_h = 2;     ///< of south and north sides; scheme corner: of corners. kLeastColors to kMostColors
  int colors_v = 2;     ///< of west and east sides; scheme corner: equal to colors_h
  int tile_count = 16;  ///< a multiple of colors_h^2 colors_v^2: each combination of colours has as many variants
  int overlap = 0;      ///< texels from the border of a tile within which seams run, 2 to size / 4; 0: size / 16, at least 4
  Boundary boundary = Boundary::clamp;  ///< clamp: patches lie inside the map; wrap: the map is periodic, and patches wrap
  std::uint64_t seed = 1;               ///< of the patches and of the plane
};

/// How the tiles were made.
struct WangReport {
  double seam_cost = 0;         ///< WangTiles::seam_cost
  double ndf_tv = 0;            ///< WangTiles::ndf_tv
  double repetition = 0;        ///< WangTiles::repetition
  double input_repetition = 0;  ///< largest autocorrelation of the input at the same distances that it has; 0 where it has none
  bool enlarged = false;        ///< whether the map was smaller than patches, and was quilted to a larger one first
};

/// WangTiles that own their array.
class WangTilesData {
 public:
  WangTiles shape;  ///< its span is empty
  std::vector<Vec2> normals;
  WangReport report;

  /// A span over the array; valid while this object lives and is not changed.
  WangTiles view() const;
};

/// Makes Wang tiles of a normal map.
///
/// The border of a tile comes from patches of its colours, so that texels on both sides of an edge are neighbours in the input:
/// from a strip along each edge (scheme edge), or from a cross around each corner (scheme corner), whose arms meet in a seam in the
/// middle of an edge, at a place that the two corners decide. A patch of its own fills the inside of each tile, as Ng et al. 2005
/// have it: without it, a set of two colours would show two patches only. Patches meet along the seams of least difference of normals (cutSeam).
/// Patches are searched for: those of the inside cover the input evenly, and among candidates with small differences along the seam
/// those are taken that bring the normals of the set nearest to those of the input.
///
/// Bytes depend on the map and the options alone, not on the number of threads.
/// @param map  finite normals in the disk, at least 16 x 16 texels; smaller than the tiles if need be
/// @throws Error (usage) for options out of range; (invalid_input) for a map below 16 texels along an axis
/// @note memory: three times the tiles and a hundred bytes for each texel of a tile in each thread
WangTilesData buildWangTiles(const NormalMap& map, const WangOptions& options, const ProgressFn& progress = {});

/// A part of the plane as an ordinary map.
/// @param x, y  texel of the plane that becomes texel (0, 0)
/// @return [height][width]
std::vector<Vec2> explicitPlane(const WangTiles& tiles, std::int64_t x, std::int64_t y, int width, int height);

}  // namespace glint::bake
