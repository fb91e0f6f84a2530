#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/bake/displace/effective_brdf.h"
#include "glint/model/displacement.h"
#include "glint/model/normal_map.h"

namespace glint::bake {

struct DisplaceOptions {
  std::vector<int> factors = {16};  ///< factor of each level: ascending, at most the shorter side of the map
  BaseBrdf base;
  BaseTexture texture;  ///< how the base varies over the map
  /// Numbers of a base of kind `table`, whose `base()` is then `base`; null for others.
  std::shared_ptr<const MeasuredBrdf> table = {};
  int lobes = kMaxLobes;  ///< lobes of each cell, 1 to kMaxLobes
  int angular = 15;       ///< N: N^2 directions, 3 to kMostAngular
  int spatial = 4;        ///< M: T has M^2 patches, 1 to 16; fewer where a level has fewer cells
  float scale_tolerance =
      0;  ///< terms are added to T S until |R - sum| / |R| is at most this, or are kMostScaleTerms; 0: T S alone
  int bounces = kAllBounces;  ///< most scattering events of a light path; 1: shadowing and masking only
  std::uint64_t seed = 1;

  /// Channels of colours, T and S: 1, or 3 where the table or the texture has colours.
  int channels() const { return table ? std::max(table->channels(), texture.channels) : texture.channels; }
};

/// Steepest slope that `displace` accepts: 80 degrees. One normal for each facet does not resolve light between steeper walls.
inline constexpr float kSteepestSlope = 5.6712818f;

/// Memory that tables over pairs of directions take at the peak of `displace`, bytes: what grows with the fourth power of
/// `angular`. Sums and results of all patches, sums of tasks that wait to be added, terms of the scaling function.
/// @param threads  that work at a time
double displacementPairBytes(int width, int height, const DisplaceOptions& options, int threads);

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
    std::vector<float> spatial_terms;
    std::vector<std::uint16_t> angular_terms;
    std::vector<float> singular_shares;
  };

  Displacement shape;  ///< sizes and parameters; its spans are empty
  std::vector<Level> levels;
  std::vector<float> base_table;  ///< of a base of kind `table`; else empty

  /// Spans over the arrays; valid while this object lives and is not changed.
  Displacement view() const;
};

/// Downsamples a displacement map so that it looks the same from afar (Wu 2019). Lobes describe the normals of each cell. The
/// scaling functions T and S restore the shadowing, masking and interreflections that the downsampled surface lacks.
///
/// Where the base varies, every lobe has the mean colour and roughness of its normals, and each channel its own T and S. So the
/// result keeps the correlation of colours and normals (Fig. 14).
///
/// A base that is a table is kept in the result, averaged over lobes of several bandwidths: so every lobe reflects by the table.
///
/// Where a factor does not divide the map, the nearest whole number of cells is taken: CellGrid.
///
/// The original surface is the periodic triangulation of the heights (HeightSurface). On a flat map T = S = 1.
/// @throws Error usage if an option is out of range; invalid_input if heights are not finite, a facet is steeper than 80
///         degrees, a factor is larger than the map, or the texture is not of the map's size or out of range
/// @note memory: about 85 bytes for each texel of the map with 15^2 directions, and N^4 times 16 bytes a patch and channel.
///         The result does not depend on the number of threads
DisplacementData displace(const HeightMap& map, const DisplaceOptions& options, const ProgressFn& progress = {});

/// Fits lobes to the normals of every cell of a coarser grid, and fills the lobes, their colours and roughness, the slope
/// moments and the errors of the fit in `level`.
void fitCells(const HeightSurface& surface, const FacetBase& base, const CellGrid& grid, int lobe_count,
              DisplacementData::Level& level);

}  // namespace glint::bake
