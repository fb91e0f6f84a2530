#pragma once

#include <span>
#include <vector>

#include "glint/bake/displace/effective_brdf.h"
#include "glint/model/displacement.h"

namespace glint::bake {

/// The lobes of the cells of a level, with the base that each stands for.
struct LobeField {
  BaseBrdf base;
  std::size_t lobe_count = 0;  ///< of a cell
  std::size_t channels = 1;
  std::span<const VmfLobe> lobes;  ///< [coarse_y][coarse_x][lobe_count]
  std::span<const float> colors;   ///< [coarse_y][coarse_x][lobe_count][channels]; empty: 1
  std::span<const float> alphas;   ///< [coarse_y][coarse_x][lobe_count]; empty: that of the base
};

/// Effective BRDFs of a downsampled surface whose cells have the multi-lobe BRDF f'_low, single scattering only: the
/// denominators of the scaling function (Wu 2019, Eq. 12 and 20), times the visible projected area of the view.
/// @param heights  [coarse_y][coarse_x] of the vertices, cells
/// @note of more than 4096 cells, an even choice of as many is summed
EffectiveBrdf lowBrdf(std::span<const float> heights, const LobeField& field, std::span<const Vec3> directions,
                      const PatchGrid& grid);

}  // namespace glint::bake
