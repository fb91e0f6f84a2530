#pragma once

#include "glint/bake/pyramid/direction_bins.h"
#include "glint/model/normal_map.h"

namespace glint::bake {

/// The builders end Gaussian footprints at this many deviations. 0.22 % of the weight lies farther out; the weights inside are
/// normalised.
inline constexpr float kPyramidReach = 3.5f;

/// Adds the texels of a Gaussian footprint to bins: each texel adds its normalised weight at its normal.
///
/// O(texels in the footprint), at most the texels of the map. Large footprints are summed in bands of kBandTexels, whose sums
/// are then added: a float that holds the sum of millions of terms would lose each new term to rounding.
/// @param map      flat surface
/// @param centre   texels
/// @param bins     empty bins, which get the result
/// @param band     empty bins of the same sizes, for bands; empty again on return
void scatterFlatFootprint(const NormalMap& map, Boundary boundary, Vec2 centre, float sigma_texels, DirectionBins& bins,
                          DirectionBins& band);

/// Footprints on tiles end at this many deviations along each axis, 0.27 % of the weight lies farther out: a square, so that the
/// share of a footprint in a tile is a product of one share along each axis.
inline constexpr float kTileReach = 3.2f;

/// Share of a Gaussian that lies in a tile along one axis, when it ends at kTileReach deviations.
/// @param centre  texels from the low side of the tile; may lie beyond the tile
double shareInTile(float centre, float sigma_texels, int size);

/// Adds the part of a Gaussian footprint that lies in a tile: the texels of the tile, with weights that sum to 1.
/// @param tile    flat surface; the footprint must meet it
/// @param centre  texels; may lie beyond the tile
void scatterFlatTile(const NormalMap& tile, Vec2 centre, float sigma_texels, DirectionBins& bins, DirectionBins& band);

/// Adds all texels of the map with equal weights. Parameters as for scatterFlatFootprint.
void scatterFlatMap(const NormalMap& map, DirectionBins& bins, DirectionBins& band);

/// Number of texels of a band.
inline constexpr int kBandTexels = 131072;

}  // namespace glint::bake
