#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "glint/model/ndf_pyramid.h"

namespace glint {

/// Most regions that the images of a pyramid can be divided into.
inline constexpr int kMostRegions = 1024;

/// One of `count` parts of the images of a pyramid.
struct PyramidRegion {
  int index = 1;  ///< from 1 to `count`, counted from the bottom of the map
  int count = 1;
  friend bool operator==(const PyramidRegion&, const PyramidRegion&) = default;
};

/// Rows [first, end) of the images of one level.
struct ImageRows {
  int first = 0;
  int end = 0;
  constexpr int count() const { return end - first; }
};

/// The rows of images of a level that a region has. Every row is in exactly one region.
///
/// The regions are bands of the map of equal height, and a row of images is in the region that holds its centres. But of a smooth
/// surface, levels with less than kSplitRows rows for each region are whole in the last region: the footprints of such a level
/// reach far beyond a band, and every region that has some of them would rasterise triangles of the whole map.
constexpr ImageRows regionRows(const PyramidShape& shape, int level, PyramidRegion region) {
  constexpr std::int64_t kSplitRows = 12;
  const std::int64_t rows = shape.levels[level].rows, count = region.count;
  if (shape.surface == Surface::smooth && rows < kSplitRows * count)
    return region.index == region.count ? ImageRows{0, static_cast<int>(rows)} : ImageRows{};
  // Row j is centred at (2 j + 1) / (2 rows) of the height. This is the first row at or above band / count.
  const auto first = [&](std::int64_t band) { return static_cast<int>((2 * rows * band + count - 1) / (2 * count)); };
  return {first(region.index - 1), first(region.index)};
}

/// The rows of texels that a region has: a band of the map.
constexpr ImageRows regionTexels(int height, PyramidRegion region) {
  const auto first = [&](std::int64_t band) { return static_cast<int>(height * band / region.count); };
  return {first(region.index - 1), first(region.index)};
}

/// The normals of one region, of a pyramid that keeps the normals of its map.
struct ShardNormals {
  NearType type = NearType::f32;  ///< of the normals that the joined pyramid keeps
  int rows = 0;                   ///< rows of texels that are here: those of regionTexels()
  std::span<const Vec2> normals;  ///< [rows][width], as the map has them
};

/// How the number of levels of a pyramid is found.
enum class LevelChoice : std::uint8_t {
  given,     ///< all levels stay
  agreeing,  ///< levels that agree with the next finer level are dropped when shards are joined
};

/// The images of one region of a pyramid. Joined with those of all other regions they are the pyramid.
struct NdfPyramidShard {
  PyramidRegion region;
  LevelChoice level_choice = LevelChoice::given;
  int rows[kMaxPyramidLevels] = {};  ///< rows of images of each level that are here: those of regionRows()
  /// The shape is that of the whole pyramid. Arrays of a level hold the rows that are here.
  NdfPyramid images;
  std::optional<ShardNormals> near_normals;  ///< nothing where the pyramid keeps none
};

}  // namespace glint
