#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/bake/displace/base_texture.h"
#include "glint/bake/displace/cell_grid.h"
#include "glint/bake/displace/height_surface.h"
#include "glint/bake/displace/measured_brdf.h"
#include "glint/bake/displace/visibility_masks.h"
#include "glint/model/displacement.h"

namespace glint::bake {

/// A map cut into columns x rows patches. A patch has whole cells of the coarser grid that the map is downsampled to.
struct PatchGrid {
  int columns = 1;
  int rows = 1;
  int coarse_x = 0;   ///< columns of cells of the coarser grid
  int coarse_y = 0;   ///< rows of cells of the coarser grid
  int factor = 1;     ///< cells of the map along a side of a coarser cell
  int map_width = 0;  ///< cells of the map along each axis; 0: the factor divides them
  int map_height = 0;

  int count() const { return columns * rows; }
  int width() const { return map_width > 0 ? map_width : coarse_x * factor; }
  int height() const { return map_height > 0 ? map_height : coarse_y * factor; }
  CellGrid cells() const { return {width(), height(), coarse_x, coarse_y}; }
  /// First coarser cell in a column of patches, or in a row of patches.
  int firstCellColumn(int c) const {
    return static_cast<int>((static_cast<std::int64_t>(c) * coarse_x + columns - 1) / columns);
  }
  int firstCellRow(int r) const { return static_cast<int>((static_cast<std::int64_t>(r) * coarse_y + rows - 1) / rows); }
  /// First cell of the map in a column of patches, or in a row of patches.
  int firstColumn(int c) const { return cells().firstColumn(firstCellColumn(c)); }
  int firstRow(int r) const { return cells().firstRow(firstCellRow(r)); }
  /// Share of the map's cells that a patch has.
  double share(int patch) const;
  friend bool operator==(const PatchGrid&, const PatchGrid&) = default;
};

/// The directions of the angular grid of an asset: cells of equal solid angle.
std::vector<Vec3> angularDirections(int angular);

/// Scattering events of a light path when it is followed until it escapes.
inline constexpr int kAllBounces = 64;

struct EffectiveOptions {
  BaseBrdf base;
  int bounces = kAllBounces;  ///< most scattering events of a path; 1: shadowing and masking only
  std::uint64_t seed = 1;
  std::vector<float> distant_cells;  ///< up to 8 lengths: a hop over a longer horizontal distance counts as distant
  /// Number of facets whose single reflections are summed (ggx), and of random walks (ggx: from each view), in all patches
  /// together. 0: as many as the base needs.
  std::size_t facet_samples = 0;
  std::size_t walks = 0;
  BaseTexture texture = {};                        ///< how the base varies
  std::shared_ptr<const MeasuredBrdf> table = {};  ///< base of kind `table`: its numbers

  /// Channels of the light that is reflected: 1, or 3 where the table or the texture has colours.
  int channels() const { return table ? std::max(table->channels(), texture.channels) : texture.channels; }
};

/// Effective BRDF of each patch, times the visible projected area of the view: f_eff(wi, wo) A(wo) of Wu 2019 (Eq. 6, 17, 25).
/// The product is symmetric in wi and wo. On a flat surface it is f(wi, wo) cos(wi) cos(wo).
struct EffectiveBrdf {
  std::size_t directions = 0;
  std::size_t patches = 0;
  std::size_t channels = 1;
  std::vector<float> values;  ///< [channels][patches][directions][directions]
  /// Norm of the antisymmetric part of the estimates over the norm of the symmetric part, within 75 degrees of the normal. It
  /// is noise alone, since exact values are symmetric, and `values` are free of it.
  double asymmetry = 0;
  double interreflected = 0;    ///< share of the light reflected under an even sky that was scattered more than once
  std::vector<double> distant;  ///< for each length of distant_cells: share of the reflected light that made a longer hop

  std::span<const float> patch(std::size_t p, std::size_t channel = 0) const {
    const std::size_t pairs = directions * directions;
    return {&values[(channel * patches + p) * pairs], pairs};
  }
  /// Mean over the patches, weighted by their numbers of cells.
  std::vector<double> mean(const PatchGrid& grid, std::size_t channel = 0) const;
};

/// Cosine of the largest angle to the normal at which estimates are reliable. Directions beyond are grazing: their estimates
/// are finite, but measures of error leave them out.
inline constexpr float kGrazingCosine = 0.25881904510252076f;  // 75 degrees

/// Estimates the effective BRDFs of a surface whose facets have the base's reflectance, varied by the texture.
///
/// Single scattering is a sum over facets, each seen through its visibility mask. The sum has no noise unless facets are left
/// out. Interreflections come from random walks. A diffuse walk p, q1, q2 ... serves all pairs of directions at once:
/// F += (G_p / n_z)^T rho_p (G_p + rho_q1 (G_q1 + rho_q2 (G_q2 ...))), where G are the masked cosines of a facet. Glossy walks
/// start from each view, and collect light from all directions at every facet that they visit. Channels share the walks.
/// Results do not depend on the number of threads.
EffectiveBrdf effectiveBrdf(const HeightSurface& surface, const VisibilityMasks& masks, std::span<const Vec3> directions,
                            const PatchGrid& grid, const EffectiveOptions& options, const ProgressFn& progress = {});

}  // namespace glint::bake
