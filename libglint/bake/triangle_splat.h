#pragma once

#include <cstdint>
#include <vector>

#include "glint/bake/block_bins.h"
#include "glint/model/vec.h"

namespace glint::bake {

/// Splats triangles of the disk into four histograms at once: one for each corner of a lattice cell.
///
/// A triangle is cut into columns on its longest edge and these into pieces; every piece adds its share at its centre with
/// quadratic B-spline weights (see DirectionBins). Pieces are moved outwards a little, so that the spread along the longest edge
/// is the triangle's own. So triangles of any shape keep their mass, mean and extent, down to a segment or a point; the blur that
/// follows flattens the pieces.
class TriangleSplatter {
 public:
  /// @param bins_per_axis  of the square [-1, 1]^2; a multiple of BlockBins::kTile
  /// @param sigma_bins     deviation of the blur that follows, bins
  TriangleSplatter(int bins_per_axis, float sigma_bins);

  /// Adds a triangle of mass weights[corner] to each histogram.
  void add(Vec2 a, Vec2 b, Vec2 c, const float weights[4]);

  /// Takes the histograms out, without their masses, and clears them.
  CornerBins extract();

 private:
  struct Raster {
    float* bins;  // [row][column][corner], with a tile of margin
    std::uint8_t* touched;
    int pitch;  // bins
    int tiles;  // per axis, with the margin
  };
  static void splatPoint(Vec2 point, float share, const float weights[4], const Raster& raster);

  float half_;   // bins in half the square
  float piece_;  // longest piece, bins
  int tiles_;
  int pitch_;
  std::vector<float> bins_;
  std::vector<std::uint8_t> touched_;
};

}  // namespace glint::bake
