#pragma once

#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/query/bin_map_ndf.h"

namespace glint::bake {

/// Computes the NDF image of a footprint: BinMapNdf::mean over every pixel. Visits the facets of the footprint once instead of once for
/// each pixel.
/// @return [resolution][resolution] pixel means of the density over [-1, 1]^2, bottom row first
std::vector<float> binMapImage(const BinMapNdf& ndf, const Footprint& footprint, int resolution,
                               const ProgressFn& progress = {});

}  // namespace glint::bake
