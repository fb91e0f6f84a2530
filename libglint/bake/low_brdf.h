#pragma once

#include <span>
#include <vector>

#include "glint/bake/effective_brdf.h"
#include "glint/model/displacement.h"

namespace glint::bake {

/// Effective BRDFs of a downsampled surface whose cells have the multi-lobe BRDF f'_low, single scattering only: the denominators
/// of the scaling function (Wu 2019, Eq. 12 and 20), times the visible projected area of the view.
/// @param heights  [coarse_y][coarse_x] of the vertices, cells
/// @param lobes    [coarse_y][coarse_x][lobe_count]
/// @note of more than 4096 cells, an even choice of as many is summed
EffectiveBrdf lowBrdf(std::span<const float> heights, std::span<const VmfLobe> lobes, int lobe_count, const BaseBrdf& base,
                      std::span<const Vec3> directions, const PatchGrid& grid);

}  // namespace glint::bake
