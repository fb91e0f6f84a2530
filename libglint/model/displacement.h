#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "glint/math/vec.h"
#include "glint/model/map_slopes.h"

namespace glint {

/// Most levels of detail of a displacement asset.
inline constexpr int kMaxDisplacementLevels = 8;
/// Most lobes of a cell.
inline constexpr int kMaxLobes = 6;
/// Most directions along an axis of the angular grid.
inline constexpr int kMostAngular = 45;
/// Most terms T S of a scaling function, and the number of its singular values that an asset tells.
inline constexpr int kMostScaleTerms = 8;

/// Tables of a base BRDF: the number of nodes along sqrt(1 - cos theta_d), and along each axis of the square of half-angle
/// coordinates (`TablePoint` of base_table.h).
inline constexpr int kBaseTableDifference = 32;
inline constexpr int kBaseTableHalf = 48;
/// Tables of an asset. Table k < kBaseTables - 1 has f cos(wi) cos(wo) averaged over normals of a von Mises-Fisher lobe of
/// bandwidth 2^k; the last table has f itself.
inline constexpr int kBaseTables = 14;
inline constexpr std::size_t kBaseTableNodes = static_cast<std::size_t>(kBaseTableDifference) * kBaseTableHalf * kBaseTableHalf;

/// Cells along an axis of a level: the nearest number to texels / factor, at least 1. A cell is texels / cells long.
constexpr int displacementCells(int texels, int factor) { return std::max(1, (2 * texels + factor) / (2 * factor)); }

/// Bandwidth of a lobe around normals that are all the same.
inline constexpr float kMaxKappa = 1e6f;

/// Reflectance of a facet of the original surface.
struct BaseBrdf {
  enum class Kind : std::uint8_t {
    diffuse,  ///< albedo / pi
    ggx,      ///< D G1 G1 F / (4 cos cos), roughness alpha
    table,    ///< isotropic, given by numbers: BaseTable
  };
  Kind kind = Kind::diffuse;
  float albedo = 1;  ///< diffuse: 0 < albedo <= 1
  float alpha = 0;   ///< ggx: roughness; table: roughness of the lobe that samples are drawn from
  float eta = 1;     ///< ggx: refractive index and extinction of a conductor; eta 1 and k 0: F = 1
  float k = 0;
};

/// The numbers of a base of kind `table`.
struct BaseTable {
  float diffuse_share = 0;        ///< share of the samples that are drawn by the cosine, the others by alpha's lobe
  std::span<const float> values;  ///< [kBaseTables][kBaseTableDifference][kBaseTableHalf][kBaseTableHalf][channels], >= 0
};

/// One lobe of a cell's distribution of normals: amplitude * kappa / (4 pi sinh kappa) exp(kappa dot(mu, n)) (Wu 2019, Eq. 4).
/// Amplitudes add up to the area of the original surface over each unit of projected area. Empty lobes have amplitude 0.
struct VmfLobe {
  Vec2 mu;              ///< projection of the centre on the disk; z > 0
  float kappa = 0;      ///< bandwidth, 0 to kMaxKappa
  float amplitude = 0;  ///< >= 0
};
static_assert(sizeof(VmfLobe) == 16);
static_assert(sizeof(MapSlopes) == 20);

/// One level of detail.
///
/// Vertex (I, J) lies over texel (I width / columns, J height / rows) of the original; cell (I, J) is the rectangle between
/// vertices (I, J) and (I + 1, J + 1), wrapped. Its sides are `factor` texels where this divides the map; else the
/// number of cells is the nearest whole one. All arrays have J slowest.
struct DisplacementLevel {
  int factor = 0;           ///< texels of the original along a side of a cell
  int columns = 0;          ///< displacementCells(width, factor)
  int rows = 0;             ///< displacementCells(height, factor)
  int spatial_columns = 0;  ///< columns of T, at most `columns`
  int spatial_rows = 0;

  std::span<const float> heights;        ///< [rows][columns] of the vertices, texels of the original
  std::span<const VmfLobe> lobes;        ///< [rows][columns][lobe_count], largest amplitude first
  std::span<const float> lobe_colors;    ///< [rows][columns][lobe_count][channels], factors of the base; empty: all 1
  std::span<const float> lobe_alphas;    ///< [rows][columns][lobe_count], ggx roughness; empty: alpha of the base
  std::span<const MapSlopes> slopes;     ///< [rows][columns], for the single-lobe variant
  std::span<const float> fit_errors;     ///< [rows][columns]: relative error of the lobes, both sides blurred by 8 degrees
  std::span<const float> spatial_scale;  ///< T [spatial_rows][spatial_columns][channels], mean 1 over the cells
  std::span<const std::uint16_t> angular_scale;  ///< S [][channels], half precision: pair i <= o is at o (o + 1) / 2 + i
  /// Further terms of the scaling function, of either sign: [more_terms] times as spatial_scale and angular_scale.
  std::span<const float> spatial_terms;
  std::span<const std::uint16_t> angular_terms;
  /// Shares of the kMostScaleTerms largest singular values' squares of R, largest first; 0 where R has fewer.
  std::span<const float> singular_shares;

  // Errors of the factorisation and its assumptions, for directions below 75 degrees; worst channel or mean of channels.
  float rank1_residual = 0;  ///< |R - T S| / |R| of the scaling function R before it was factorised
  float scale_residual = 0;  ///< the same of all terms
  float rank1_energy = 1;    ///< share of the largest squared singular value: the energy that the best factorisation keeps
  float interreflected_share = 0;  ///< share of interreflection in the reflected light
  float distant_share = 0;         ///< share that comes over hops longer than a cell, which T and S cannot represent
};

/// A displacement map downsampled to several levels of detail, with scaling functions that keep its appearance (asset kind
/// `displacement`, Wu 2019): f_low(x, wi, wo) = T(x) S(wi, wo) f'_low(x, wi, wo). Where one product is not enough, the sum of
/// several products T_k S_k takes its place.
struct Displacement {
  int width = 0;   ///< of the original, texels
  int height = 0;  ///< of the original, texels
  float texel_size_um = 0;
  BaseBrdf base;
  std::optional<BaseTable> table;  ///< the numbers of a base of kind `table`; nothing for others
  int channels = 1;                ///< of colours, T and S: 1, or 3 for linear red, green and blue
  int lobe_count = 0;              ///< lobes of each cell, 1 to kMaxLobes
  int angular = 0;                 ///< N: S has N^2 directions of either kind, the cells of concentric_map.h
  int more_terms = 0;              ///< terms of the scaling function beyond T S, 0 to kMostScaleTerms - 1
  int level_count = 0;
  DisplacementLevel levels[kMaxDisplacementLevels];
};

}  // namespace glint
