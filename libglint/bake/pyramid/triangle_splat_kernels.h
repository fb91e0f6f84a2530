#pragma once

// Private to triangle_splat.cpp: its inner loops, in SIMD of the best instruction set of this machine.

#include <cstdint>
#include <vector>

#include "glint/bake/pyramid/block_bins.h"
#include "glint/math/vec.h"

namespace glint::bake {

/// Histograms of kMoments moments in a square of bins, whose centres are at halves.
struct SplatRaster {
  float* bins;  ///< [row][column][moment]
  int pitch;    ///< bins
  std::uint8_t* touched;
  int tiles;  ///< flags of a row: one for kTile x kTile bins
};

/// Sums of a triangle, [row][column] of its bounding box, before they are weighted by moments. All zero between calls.
struct SplatPatch {
  struct Span {
    int begin, end;
  };
  std::vector<float> sums;
  std::vector<Span> spans;  ///< of each row: columns that hold something
};

/// Adds a point of mass share * weights[moment] with cubic B-spline weights.
/// @param point  bins; two bins or more from the border
void splatPoint(Vec2 point, float share, const float weights[kMoments], const SplatRaster& raster);

/// Adds a triangle as points: columns on its longest edge that are cut into pieces.
/// @param p      corners, bins; the longest edge is p[0] p[1]
/// @param piece  longest piece, bins
void splatColumns(const Vec2 p[3], float piece, const float weights[kMoments], const SplatRaster& raster);

/// Adds a triangle as rows: segments along x, each with the mean of the B-spline's weights over its points.
/// @param p      corners, bins, in the order of y, of which the first and the last differ
/// @param piece  longest distance of rows, bins
void splatRows(const Vec2 p[3], float piece, const float weights[kMoments], SplatPatch& patch, const SplatRaster& raster);

}  // namespace glint::bake
