#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "glint/model/map_slopes.h"
#include "glint/model/near_normals.h"
#include "glint/model/normal_map.h"

namespace glint {

/// An angular block is kBlockSize x kBlockSize pixels of an NDF image (t in Deng 2022, section 4.2).
inline constexpr int kBlockSize = 16;
inline constexpr int kBlockPixels = kBlockSize * kBlockSize;
/// Most levels that a pyramid can have.
inline constexpr int kMaxPyramidLevels = 16;

/// Most 64-bit words that an image's mask of blocks can have: images of 1024^2.
inline constexpr int kMostMaskWords = 64;

/// Most footprints in a stride along each axis.
inline constexpr float kMostOverlap = 4;

/// Least columns and rows of the largest footprints below the size of a map (PyramidShape::gridOf).
inline constexpr int kLastCentres = 12;

/// The grid of footprints of one level. PyramidShape::centre has their centres.
struct PyramidGrid {
  float stride = 0;  ///< texels; the footprint has a deviation of kFootprintPerStride strides
  int columns = 0;   ///< as in PyramidShape::gridOf; 1 in the mean of the map
  int rows = 0;      ///< as in PyramidShape::gridOf; 1 in the mean of the map

  GLINT_HD constexpr std::size_t imageCount() const { return rowMajorIndex(0, rows, columns); }
};

/// Sizes and parameters of a pyramid of NDF images, compressed or not (Deng 2022, section 4.1).
struct PyramidShape {
  int width = 0;       ///< of the normal map, texels
  int height = 0;      ///< of the normal map, texels
  int resolution = 0;  ///< pixels of an NDF image along each axis; a multiple of kBlockSize
  float sigma_r = 0;   ///< intrinsic roughness, disk units
  Surface surface = Surface::flat;
  Boundary boundary = Boundary::wrap;
  /// Footprints in a stride along each axis, 1 to kMostOverlap. With 1, centres are one stride apart, and the gap across the
  /// border of the map is what is left. With more, centres are spread evenly over the map.
  float overlap = 1;
  int level_count = 0;
  PyramidGrid levels[kMaxPyramidLevels];
  MapSlopes slopes;  ///< of the normal map's texels, without sigma_r

  /// Whether the last level is one image of the whole map, for footprints that are larger than all other levels.
  GLINT_HD constexpr bool endsInMean() const { return level_count > 1 && levels[level_count - 1].imageCount() == 1; }
  /// Levels of Gaussian footprints: all levels but the mean.
  GLINT_HD constexpr int footprintLevels() const { return level_count - (endsInMean() ? 1 : 0); }
  /// Columns or rows of a level of footprints, but for those of gridOf.
  /// @param size  width or height of the map, texels
  GLINT_HD int centresAlong(int size, float stride) const {
    return static_cast<int>(std::ceil(static_cast<double>(size) * double{overlap} / double{stride}));
  }
  /// The grid of a level of footprints. On a map that repeats, the largest footprints below its size still see its slowest wave. Answers
  /// above their size depend on this level and the mean of the map alone, so this level has at least kLastCentres columns and rows,
  /// unless the map is far thinner than its footprints. With an overlap of 1, all levels are those of Deng 2022.
  GLINT_HD PyramidGrid gridOf(float stride) const {
    constexpr float kFarThinner = 1.5f;  // strides in which Gaussians keep 2e-4 of the slowest wave
    const bool last =
        boundary == Boundary::wrap && overlap > 1 && 2 * stride >= static_cast<float>(width > height ? width : height);
    const auto along = [&](int size) {
      const int count = centresAlong(size, stride);
      return last && count < kLastCentres && stride < kFarThinner * static_cast<float>(size) ? int{kLastCentres} : count;
    };
    return {stride, along(width), along(height)};
  }
  /// Distance between neighbouring centres of a level of footprints along u and v, texels.
  GLINT_HD Vec2 spacing(int level) const {
    const PyramidGrid& grid = levels[level];
    if (overlap == 1) return {grid.stride, grid.stride};
    return {static_cast<float>(width) / static_cast<float>(grid.columns),
            static_cast<float>(height) / static_cast<float>(grid.rows)};
  }
  /// Centre of footprint (i, j) of a level, texels.
  GLINT_HD Vec2 centre(int level, int i, int j) const {
    const Vec2 gap = spacing(level);
    return {(static_cast<float>(i) + 0.5f) * gap.x, (static_cast<float>(j) + 0.5f) * gap.y};
  }

  GLINT_HD constexpr int blocksPerAxis() const { return resolution / kBlockSize; }
  GLINT_HD constexpr int blocksPerImage() const { return blocksPerAxis() * blocksPerAxis(); }
  /// 64-bit words that hold one occupancy bit for each block of an image.
  GLINT_HD constexpr int maskWords() const { return (blocksPerImage() + 63) / 64; }
};

/// Standard deviation, in strides, of the footprint of a level: 1.5 / sqrt(12).
inline constexpr float kFootprintPerStride = 0.4330127018922193f;

enum class BlockPrecision : std::uint8_t { f16, f32 };

/// The NDF images of one level. Only blocks with a density above 0 are stored.
struct PyramidLevel {
  std::span<const std::uint64_t> masks;  ///< [rows][columns][maskWords]; bit b: block b = by * blocksPerAxis + bx is stored
  /// [rows][columns][maskWords], plus one element: number of stored blocks of the level before this word; the last element is
  /// the number of all stored blocks.
  std::span<const std::uint32_t> mask_ranks;
  std::span<const float> block_means;  ///< [blocks]: mean density of each stored block
  const void* pixels = nullptr;        ///< [blocks][16][16] of f16 or f32: density (pixel means) / value_scale
};

/// NDF images at every footprint size. Pixels hold the mean of the density over the pixel.
struct NdfPyramid {
  PyramidShape shape;
  BlockPrecision precision = BlockPrecision::f16;
  float value_scale = 1;  ///< density = value_scale * stored pixel
  PyramidLevel levels[kMaxPyramidLevels];
  /// The normals of the map, for footprints below level 0; nothing where the asset keeps none. Only kind ndf-pyramid stores them.
  std::optional<NearNormals> near_normals;
};

}  // namespace glint
