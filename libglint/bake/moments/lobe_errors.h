#pragma once

#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/model/normal_map.h"
#include "glint/model/slope_moments.h"

namespace glint::bake {

/// Largest number of texels of a level that lobeErrors looks at.
inline constexpr int kLobeErrorTexels = 16;

/// Difference of the lobes of a level from the real distributions of normals.
struct LobeError {
  /// Total variation, mean over texels, in [0, 1]: the share of the facets that the lobe turns into other directions.
  double variation = 0;
  double seen = 0;  ///< seen error; at the finest levels that of the far tails of lobes, whose shapes differ
};

/// Measures by how much one lobe for each texel differs from the real distribution of the normals under the texel, level by level.
/// The truth is the exact NDF image of the texel's area, with Gaussian facets of the given roughness; the lobe is the Beckmann lobe
/// of the texel's moments and the same roughness. Up to kLobeErrorTexels texels of each level are compared, spread evenly.
/// @param moments   of the map, with all levels and without facet variances
/// @param sigma_r   roughness of the material, disk units; below kFinestLobe it counts as kFinestLobe
/// @return one for each level
std::vector<LobeError> lobeErrors(const NormalMap& map, const SlopeMoments& moments, float sigma_r,
                                  const ProgressFn& progress = {});

/// Narrowest roughness for lobeErrors: a pixel of its images.
inline constexpr float kFinestLobe = 1.0f / 64;

}  // namespace glint::bake
