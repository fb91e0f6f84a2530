#pragma once

// Private to triangle_splat.cpp: its inner loops, in SIMD of the best instruction set of the machine.

#include <cstdint>
#include <vector>

#include "glint/bake/pyramid/block_bins.h"
#include "glint/math/vec.h"

namespace glint::bake {

/// Histograms of kMoments moments over a square of bins. Bin k covers [k, k + 1] along an axis, so centres are at k + 0.5.
struct SplatRaster {
  float* bins;  ///< [row][column][moment]
  int pitch;    ///< bins from one row to the next
  std::uint8_t* touched;
  int tiles;  ///< flags from one row of tiles to the next; one flag for kTile x kTile bins
};

/// Memory for one triangle: its mass in the bins of its bounding box, [row][column], before moments weight it. All zero between
/// calls.
struct SplatPatch {
  struct Span {
    int begin, end;
  };
  std::vector<float> sums;
  std::vector<Span> spans;  ///< [rows]: columns that are not zero
};

/// Adds a point of mass share * weights[moment] with cubic B-spline weights.
/// @param point  in bins, at least two bins from the border
void splatPoint(Vec2 point, float share, const float weights[kMoments], const SplatRaster& raster);

/// Adds a triangle as points, the centres of pieces: cuts it into columns on its longest edge, and columns into pieces.
/// @param p      corners, in bins; the longest edge is p[0] p[1]
/// @param piece  length of the longest piece, in bins
void splatColumns(const Vec2 p[3], float piece, const float weights[kMoments], const SplatRaster& raster);

/// Adds a triangle as rows: segments along x, each with the B-spline weights averaged over its points.
/// @param p      corners, in bins, in ascending order of y; the first and the last y differ
/// @param piece  largest distance between rows, in bins
void splatRows(const Vec2 p[3], float piece, const float weights[kMoments], SplatPatch& patch, const SplatRaster& raster);

}  // namespace glint::bake
