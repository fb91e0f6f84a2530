#pragma once

#include <cstdint>
#include <vector>

#include "glint/bake/pyramid/block_bins.h"
#include "glint/bake/pyramid/triangle_splat_kernels.h"
#include "glint/math/vec.h"

namespace glint::bake {

/// Numbers the tiles of two grids of bins over the square [-1, 1]^2 of directions. Bins of the coarse grid are twice as wide.
/// Each grid has one tile of margin on every side.
struct DirectionTiles {
  struct Grid {
    int bins_per_axis;   // bins along the square; a multiple of BlockBins::kTile
    std::int32_t first;  // number of its first tile

    int tilesPerAxis() const { return bins_per_axis / BlockBins::kTile + 2; }
    std::int32_t end() const { return first + tilesPerAxis() * tilesPerAxis(); }
  };
  Grid fine, coarse;

  /// @param bins_per_axis  bins of the fine grid along the square: a multiple of 2 * kTile
  explicit DirectionTiles(int bins_per_axis) : fine{bins_per_axis, 0}, coarse{bins_per_axis / 2, fine.end()} {}
  std::size_t count() const { return static_cast<std::size_t>(coarse.end()); }
};

/// Splats triangles of the disk into the histograms of all moments of a lattice cell at once.
///
/// A thin triangle is cut into columns that stand on its longest edge, and columns into pieces; every piece adds its share at
/// its centre with cubic B-spline weights (see PixelFilter). A fat triangle is cut into rows, and each row is exact along x.
/// Columns and rows are moved a little, so that their mean and spread are those of the triangle. So triangles of any shape,
/// down to a segment or a point, keep their mass, mean and extent, and the blur that follows hides the pieces. Long triangles
/// go to the coarse grid.
class TriangleSplatter {
 public:
  /// @param sigma_bins  deviation of the blur that follows, bins of the fine grid
  TriangleSplatter(const DirectionTiles& tiles, float sigma_bins);

  /// Adds a triangle of mass weights[moment] to each histogram.
  void add(Vec2 a, Vec2 b, Vec2 c, const float weights[kMoments]);

  /// Adds all histograms to `moments`, which has kMoments channels, and clears them.
  void moveTo(BlockBins& moments);

 private:
  /// All bins of one grid.
  struct Raster {
    explicit Raster(const DirectionTiles::Grid& grid);
    Vec2 place(Vec2 normal) const {
      return {(normal.x + 1) * half + BlockBins::kTile, (normal.y + 1) * half + BlockBins::kTile};
    }
    SplatRaster view() { return {bins.data(), pitch, touched.data(), tiles}; }
    void moveTo(BlockBins& moments);

    float half;  // bins in half the square
    std::int32_t first;
    int tiles;                // tiles along each axis, with the margin
    int pitch;                // bins from one row to the next
    std::vector<float> bins;  // [row][column][moment], with a tile of margin
    std::vector<std::uint8_t> touched;
  };

  Raster fine_, coarse_;
  SplatPatch patch_;
  float piece_;  // longest piece, bins of the fine grid
};

}  // namespace glint::bake
