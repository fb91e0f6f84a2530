#pragma once

#include <cstdint>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/bake/displace/effective_brdf.h"
#include "glint/model/displacement.h"
#include "glint/model/normal_map.h"

namespace glint::bake {

struct DisplaceOptions {
  std::vector<int> factors = {16};  ///< one level for each: ascending, dividing both sizes of the map
  BaseBrdf base;
  BaseTexture texture;        ///< how the base varies over the map
  int lobes = kMaxLobes;      ///< of each cell, 1 to kMaxLobes
  int angular = 15;           ///< N: N^2 directions, 3 to 25
  int spatial = 4;            ///< M: T has M^2 patches, 1 to 16; fewer where a level has fewer cells
  int bounces = kAllBounces;  ///< scattering events of a light path at most; 1: shadowing and masking only
  std::uint64_t seed = 1;
};

/// Steepest slope that is accepted: 80 degrees. Light between steeper walls is not resolved by one normal for each facet.
inline constexpr float kSteepestSlope = 5.6712818f;

/// A Displacement that owns its arrays.
class DisplacementData {
 public:
  struct Level {
    std::vector<float> heights;
    std::vector<VmfLobe> lobes;
    std::vector<float> lobe_colors;
    std::vector<float> lobe_alphas;
    std::vector<MapSlopes> slopes;
    std::vector<float> fit_errors;
    std::vector<float> spatial_scale;
    std::vector<std::uint16_t> angular_scale;
  };

  Displacement shape;  ///< without spans
  std::vector<Level> levels;

  /// Spans over the arrays; valid while this object lives and is not changed.
  Displacement view() const;
};

/// Downsamples a displacement map and computes what keeps its appearance (Wu 2019): lobes for each cell, and the scaling
/// functions T and S that add shadowing, masking and interreflections.
///
/// Where the base varies, every lobe has the mean colour and roughness of its normals, and each channel its own T and S, so
/// that what colours and normals have to do with each other is kept (Fig. 14).
///
/// The original surface is the periodic triangulation of the heights (HeightSurface); the map may be flat, then T = S = 1.
/// @throws Error usage if an option is out of range; invalid_input if heights are not finite, a facet is steeper than 80
///         degrees, a factor does not divide the map, or the texture is not of the map's size or out of range
/// @note memory: about 85 bytes for each texel of the map. The same result for any number of threads
DisplacementData displace(const HeightMap& map, const DisplaceOptions& options, const ProgressFn& progress = {});

/// Lobes with their colours and roughness, slope moments and errors of the cells of a coarser grid.
void fitCells(const HeightSurface& surface, const FacetBase& base, int factor, int lobe_count, DisplacementData::Level& level);

}  // namespace glint::bake
