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

/// Adds all texels of the map with equal weights. Parameters as for scatterFlatFootprint.
void scatterFlatMap(const NormalMap& map, DirectionBins& bins, DirectionBins& band);

/// Number of texels of a band.
inline constexpr int kBandTexels = 131072;

}  // namespace glint::bake
