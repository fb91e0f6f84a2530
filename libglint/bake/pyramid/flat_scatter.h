#pragma once

#include "glint/bake/pyramid/direction_bins.h"
#include "glint/model/normal_map.h"

namespace glint::bake {

/// Gaussian footprints of the builders are cut at this many deviations: 0.22 % of the weight lies farther out, and weights are
/// normalised after the cut.
inline constexpr float kPyramidReach = 3.5f;

/// Adds the texels of a Gaussian footprint to bins: each texel its normalised weight, at its normal.
///
/// O(texels in the footprint), at most the map. Long sums are split in bands of kBandTexels, summed on their own first, because a float that
/// holds the sum of millions of terms no longer sees one of them.
/// @param map      flat surface
/// @param centre   texels
/// @param bins     cleared; the result is added here
/// @param band     cleared scratch of the same sizes; cleared again on return
void scatterFlatFootprint(const NormalMap& map, Boundary boundary, Vec2 centre, float sigma_texels, DirectionBins& bins,
                          DirectionBins& band);

/// The same for a footprint that sees all texels of the map alike.
void scatterFlatMap(const NormalMap& map, DirectionBins& bins, DirectionBins& band);

inline constexpr int kBandTexels = 131072;

}  // namespace glint::bake
