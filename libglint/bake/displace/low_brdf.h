#pragma once

#include <span>
#include <vector>

#include "glint/bake/displace/effective_brdf.h"
#include "glint/model/displacement.h"

namespace glint::bake {

/// The lobes of all cells of a downsampled level. A lobe stands for facets with the base BRDF, in its own colour and roughness.
struct LobeField {
  BaseBrdf base;
  std::size_t lobe_count = 0;  ///< lobes of one cell
  std::size_t channels = 1;
  std::span<const VmfLobe> lobes;     ///< [coarse_y][coarse_x][lobe_count]
  std::span<const float> colors;      ///< [coarse_y][coarse_x][lobe_count][channels]; empty: all 1
  std::span<const float> alphas;      ///< [coarse_y][coarse_x][lobe_count]; empty: all the base's alpha
  std::span<const float> table = {};  ///< BaseTable::values; empty unless the base is a table
};

/// Computes what a downsampled surface reflects when every cell has its multi-lobe BRDF f'_low (Wu 2019, Eq. 12), with
/// shadowing and masking and without interreflections: the effective BRDF of each patch, times the visible projected area of
/// the view.
///
/// These are the denominators of the scaling function (Eq. 20), which corrects the downsampled surface to look as the original.
/// @param heights  [coarse_y][coarse_x], heights of the vertices in cells
/// @note sums at most 4096 cells, evenly chosen, where there are more
EffectiveBrdf lowBrdf(std::span<const float> heights, const LobeField& field, std::span<const Vec3> directions,
                      const PatchGrid& grid);

}  // namespace glint::bake
