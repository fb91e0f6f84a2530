#pragma once

#include "glint/model/normal_map.h"

namespace glint::api {

/// Pixels of an NDF image along each axis, for models that store no images.
inline constexpr int kDefaultResolution = 256;

/// Shapes of footprints that a model weighs as they are. It answers the other shape as a footprint of the same second moments.
struct FootprintShapes {
  bool gaussians = false;
  bool boxes = false;
};

/// Properties that models of every kind have.
struct NdfInfo {
  int width = 0;       ///< of the normal map, texels
  int height = 0;      ///< of the normal map, texels
  int resolution = 0;  ///< pixels of an NDF image along each axis; 256 where the model has none
  float sigma_r = 0;   ///< intrinsic roughness, disk units; 0 where the model has none
  Surface surface = Surface::flat;
  Boundary boundary = Boundary::wrap;
  FootprintShapes shapes;
  int level_count = 0;            ///< footprint sizes that are stored; 0: every size is answered from the texels or their sums
  float finest_sigma_texels = 0;  ///< deviation of the footprints of level 0; 0 where there are no levels
  /// Deviation of the footprints of the last level; larger ones tend to the mean of the map. 0 where there are no levels.
  float coarsest_sigma_texels = 0;
  /// Deviation of the smallest footprint that is answered as wide as it is asked for; smaller ones are answered up to this wide. 0
  /// where there are no levels, or the normals are given or kept.
  float smallest_sigma_texels = 0;
};

}  // namespace glint::api
