#pragma once

#include <cstdint>
#include <vector>

#include "glint/bake/block_bins.h"
#include "glint/model/vec.h"

namespace glint::bake {

/// Splats triangles of the disk into four histograms at once: one for each corner of a lattice cell.
///
/// A triangle is cut into columns on its longest edge and these into pieces no longer than a bin; every piece adds its share at
/// its centre with quadratic B-spline weights (see DirectionBins), which sum to a flat density where pieces are dense. So
/// triangles of any shape keep their mass, down to a segment or a point.
class TriangleSplatter {
 public:
  /// @param bins_per_axis  of the square [-1, 1]^2; a multiple of BlockBins::kTile
  explicit TriangleSplatter(int bins_per_axis);

  /// Adds a triangle of mass weights[corner] to each histogram.
  void add(Vec2 a, Vec2 b, Vec2 c, const float weights[4]);

  /// Moves the histograms out and clears them.
  void extract(BlockBins out[4]);

 private:
  void addPoint(float x, float y, float share, const float weights[4]);

  int bins_per_axis_;
  int tiles_;  // per axis, with the margin
  int pitch_;  // bins
  std::vector<float> bins_;  // [row][column][corner], with a tile of margin
  std::vector<std::uint8_t> touched_;
  std::vector<std::int32_t> touched_tiles_;
};

}  // namespace glint::bake
