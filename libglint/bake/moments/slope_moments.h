#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/bake/common/slopes.h"
#include "glint/model/slope_moments.h"

namespace glint::bake {

struct SlopeMomentsOptions {
  /// First level that is kept: its texels cover 2^finest_level texels of the map along an axis. Levels beyond the last one, which
  /// holds the whole map, count as the last one.
  int finest_level = 1;
  Boundary boundary = Boundary::wrap;
  Gradient gradient = Gradient::central;  ///< of heights
  /// [height][width] variance of the slopes inside each texel, >= 0, along every axis: the roughness of the material. Empty: 0.
  std::span<const float> facet_variances = {};
};

/// SlopeMoments that own their arrays.
class SlopeMomentsData {
 public:
  SlopeMoments shape;                          ///< sizes and slopes; its spans are empty
  std::vector<std::vector<MapSlopes>> levels;  ///< [level_count][rows * columns]

  /// Spans over the arrays; valid while this object lives and is not changed.
  SlopeMoments view() const;
  std::size_t sizeBytes() const;
};

/// Averages the moments of the slopes of a map over the texels of every level.
///
/// Each texel of a level is the mean over its area of the level before, so that the last level is the mean of the map, whatever its
/// size. Means and covariances are averaged as those of mixtures (MomentMixture). O(texels); the same bytes on any number of
/// threads.
SlopeMomentsData buildSlopeMoments(const NormalMap& map, const SlopeMomentsOptions& options, const ProgressFn& progress = {});
/// The same of a height field. Slopes are not limited, as normals are.
/// @throws Error (invalid_input) if a height is not finite, or a slope is above 1e6
SlopeMomentsData buildSlopeMoments(const HeightMap& map, const SlopeMomentsOptions& options, const ProgressFn& progress = {});

/// Mean heights under the texels of every level of a full chain, averaged as the moments are.
std::vector<std::vector<float>> meanHeights(const HeightMap& map);

}  // namespace glint::bake
