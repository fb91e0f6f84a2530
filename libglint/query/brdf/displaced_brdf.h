#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "glint/math/concentric_map.h"
#include "glint/math/half.h"
#include "glint/math/half_vector.h"
#include "glint/math/rgb.h"
#include "glint/math/tangents.h"
#include "glint/model/displacement.h"
#include "glint/query/brdf/base_brdf.h"
#include "glint/query/brdf/base_table.h"
#include "glint/query/brdf/smith.h"
#include "glint/query/brdf/vmf_lobe.h"
#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/common/sampling.h"

namespace glint {

/// The parts of the prefiltered model that are evaluated.
enum class DisplacedVariant : std::uint8_t {
  full,    ///< T S f'_low
  lobes,   ///< f'_low alone: no shadowing, no interreflections
  single,  ///< one Beckmann lobe from the moments of the slopes with Smith's shadowing, as LEADR mapping does
};

/// Two neighbouring levels and the weight of the second.
struct LevelBlend {
  int first = 0;
  int second = 0;
  float weight = 0;
};

/// A direction drawn at a shading point.
struct DirectionSample {
  Vec3 direction;
  float pdf = 0;  ///< per solid angle; 0 if nothing was drawn
};

/// The prefiltered BRDF of a downsampled displacement map (Wu 2019, Eq. 11 and 18), in the map's tangent frame.
///
/// f'_low(wi, wo) = n_z / (cos(wi) cos(wo)) * integral of f cos(n', wi) cos(n', wo) D(n') over the normals n' of the cell, with
/// the cosines in front taken at the facet n of the downsampled surface. Unlike Eq. 5 it counts the area that normals show to
/// wo: so it is reciprocal, and with one normal it equals the base BRDF. Renderers use it on the downsampled surface, with
/// their own visibility; visibility at smaller scale is in S. Where the asset has no colours, all channels are the same.
///
/// Directions are unit vectors away from the surface. Those that are longer or not finite, behind the facet or within kHorizon
/// of its plane get 0. Coordinates are periodic; those that are not finite count as 0.
///
/// Refers to the asset, which must outlive it. Thread-safe, allocates nothing.
class DisplacedBrdf {
 public:
  GLINT_HD explicit DisplacedBrdf(const Displacement& asset) : asset_(asset) {}
  explicit DisplacedBrdf(const Displacement&& asset) = delete;

  GLINT_HD const Displacement& asset() const { return asset_; }

  /// Levels for a footprint of this diameter: linear in its logarithm between the factors of the levels, clamped; NaN counts as
  /// 0.
  GLINT_HD LevelBlend levelsFor(float diameter_texels) const {
    int first = 0;
    while (first + 1 < asset_.level_count && static_cast<float>(asset_.levels[first + 1].factor) <= diameter_texels) ++first;
    const int second = std::min(first + 1, asset_.level_count - 1);
    if (first == second) return {first, second, 0};
    const float low = static_cast<float>(asset_.levels[first].factor), high = static_cast<float>(asset_.levels[second].factor);
    const float place = std::log(std::max(low, diameter_texels) / low) / std::log(high / low);
    return {first, second, std::clamp(place, 0.0f, 1.0f)};
  }

  /// The two levels around a fractional level: 1.25 is three parts of level 1 and one part of level 2. Clamped; NaN counts as
  /// 0.
  GLINT_HD LevelBlend levelsAt(float level) const {
    const float place = level > 0 ? std::min(level, static_cast<float>(asset_.level_count - 1)) : 0.0f;
    const int first = static_cast<int>(place);
    const float weight = place - static_cast<float>(first);
    return {first, weight > 0 ? first + 1 : first, weight};
  }

  /// Normal of the downsampled surface: the normal of one of the two triangles of the cell.
  GLINT_HD Vec3 normal(int level, Vec2 uv) const {
    const DisplacementLevel& l = asset_.levels[level];
    const Place p = place(l, uv);
    const int i1 = p.i + 1 == l.columns ? 0 : p.i + 1, j1 = p.j + 1 == l.rows ? 0 : p.j + 1;
    const auto height = [&](int i, int j) { return l.heights[rowMajorIndex(i, j, l.columns)]; };
    const float h00 = height(p.i, p.j), h10 = height(i1, p.j), h01 = height(p.i, j1), h11 = height(i1, j1);
    const float along_x = static_cast<float>(l.columns) / static_cast<float>(asset_.width),
                along_y = static_cast<float>(l.rows) / static_cast<float>(asset_.height);
    const bool lower = p.x + p.y < 1;
    const float sx = along_x * (lower ? h10 - h00 : h11 - h01), sy = along_y * (lower ? h01 - h00 : h11 - h10);
    const float square = 1 + sx * sx + sy * sy;
    // Heights of a file are not checked: where they are NaN or too large, the surface counts as flat.
    if (!(square <= std::numeric_limits<float>::max())) return {0, 0, 1};
    const float z = 1 / std::sqrt(square);
    return {-sx * z, -sy * z, z};
  }

  /// BRDF at a point of the downsampled surface, per steradian; 0 if a direction is behind its facet.
  GLINT_HD Rgb evaluate(int level, Vec2 uv, Vec3 wi, Vec3 wo, DisplacedVariant variant = DisplacedVariant::full) const {
    const Vec3 n = normal(level, uv);
    const float ci = dot(n, wi), co = dot(n, wo);
    if (!(isDirection(wi) && isDirection(wo) && ci > kHorizon && co > kHorizon)) return {};
    const DisplacementLevel& l = asset_.levels[level];
    const std::size_t cell = place(l, uv).cell;
    const float facet = n.z / (ci * co);
    if (variant == DisplacedVariant::single) return finitePositive(facet * singleLobe(l, cell, wi, wo));
    const Rgb reflected = facet * timesCosines(l, cell, wi, wo);
    return finitePositive(variant == DisplacedVariant::full ? scale(level, uv, wi, wo) * reflected : reflected);
  }

  /// Light reflected from wi to wo (BRDF times cosine), blended between levels. Each level uses the facet of its own surface.
  GLINT_HD Rgb reflected(const LevelBlend& blend, Vec2 uv, Vec3 wi, Vec3 wo,
                         DisplacedVariant variant = DisplacedVariant::full) const {
    const auto at = [&](int level) {
      const float cosine = dot(normal(level, uv), wi);
      return isDirection(wi) && cosine > 0 ? cosine * evaluate(level, uv, wi, wo, variant) : Rgb{};
    };
    const Rgb first = at(blend.first);
    return blend.weight > 0 ? (1 - blend.weight) * first + blend.weight * at(blend.second) : first;
  }

  /// Draws wi at a blend of levels: chooses one level by its weight. The pdf is the pdf of the blend.
  GLINT_HD DirectionSample sample(const LevelBlend& blend, Vec2 uv, Vec3 wo, Vec2 xi) const {
    if (!(blend.weight > 0)) return sample(blend.first, uv, wo, xi);
    const bool second = xi.x < blend.weight;
    xi.x = second ? xi.x / blend.weight : (xi.x - blend.weight) / (1 - blend.weight);
    const DirectionSample drawn = sample(second ? blend.second : blend.first, uv, wo, xi);
    return drawn.pdf > 0 ? DirectionSample{drawn.direction, pdf(blend, uv, drawn.direction, wo)} : DirectionSample{};
  }

  /// Density of `sample` at a blend of levels, per solid angle.
  GLINT_HD float pdf(const LevelBlend& blend, Vec2 uv, Vec3 wi, Vec3 wo) const {
    const float first = pdf(blend.first, uv, wi, wo);
    return blend.weight > 0 ? (1 - blend.weight) * first + blend.weight * pdf(blend.second, uv, wi, wo) : first;
  }

  /// Draws wi for a view wo: a lobe by its amplitude times the mean of its colour, then a cosine around its centre (diffuse),
  /// or a normal of the widened lobe to reflect at (ggx). A table chooses between the two by its diffuse share.
  /// @param xi  uniform in [0, 1)^2; others are clamped, NaN counts as 0
  GLINT_HD DirectionSample sample(int level, Vec2 uv, Vec3 wo, Vec2 xi) const {
    if (!isDirection(wo)) return {};
    xi = clampUnit(xi);
    const DisplacementLevel& l = asset_.levels[level];
    const std::size_t first = place(l, uv).cell * static_cast<std::size_t>(asset_.lobe_count);
    float left = xi.x * totalShare(l, first);
    std::size_t lobe = first;
    float share = lobeShare(l, lobe);
    for (const std::size_t last = first + static_cast<std::size_t>(asset_.lobe_count) - 1;
         lobe < last && l.lobes[lobe + 1].amplitude > 0 && left >= share; share = lobeShare(l, ++lobe))
      left -= share;
    float unit = clampUnit(left / std::max(share, 1e-20f));
    const float even = cosineShare();
    const bool by_cosine = unit < even;
    unit = clampUnit(by_cosine ? unit / even : (unit - even) / std::max(1 - even, 1e-20f));
    const Vec3 axis = lobeCentre(l.lobes[lobe]);
    const float angle = 2 * kPi * xi.y;
    Vec3 wi;
    if (by_cosine) {
      wi = around(axis, std::sqrt(1 - unit), angle);
    } else {
      const float a = spreadRoughness(lobeAlpha(l, lobe), l.lobes[lobe].kappa);
      const Vec3 h = around(axis, std::sqrt((1 - unit) / (1 + (a * a - 1) * unit)), angle);
      const float c = dot(h, wo);
      if (c <= 0) return {};
      wi = 2 * c * h - wo;
    }
    return isDirection(wi) ? DirectionSample{wi, pdf(level, uv, wi, wo)} : DirectionSample{};
  }

  /// Density of `sample` per solid angle. Directions below the horizon can be drawn; `evaluate` is 0 there.
  GLINT_HD float pdf(int level, Vec2 uv, Vec3 wi, Vec3 wo) const {
    if (!(isDirection(wi) && isDirection(wo))) return 0;
    const DisplacementLevel& l = asset_.levels[level];
    const std::size_t first = place(l, uv).cell * static_cast<std::size_t>(asset_.lobe_count);
    const float even = cosineShare();
    const Vec3 sum = wi + wo;
    const float length = std::sqrt(std::max(1e-20f, dot(sum, sum)));
    const Vec3 h = (1 / length) * sum;
    float density = 0;
    for (std::size_t k = first; k < first + static_cast<std::size_t>(asset_.lobe_count); ++k) {
      const Vec3 axis = lobeCentre(l.lobes[k]);
      float of_lobe = even > 0 ? even * kInversePi * std::max(0.0f, dot(axis, wi)) : 0.0f;
      const float c = dot(axis, h);
      if (even < 1 && c > 0)
        of_lobe += (1 - even) * ggxDensity(c, spreadRoughness(lobeAlpha(l, k), l.lobes[k].kappa)) * c / (2 * length);
      density += lobeShare(l, k) * of_lobe;
    }
    return finitePositive(density / totalShare(l, first));
  }

  /// Density of the original's normals towards a half vector, by the lobes of a cell: per unit projected area. Its integral
  /// over the disk is 1 minus the share of lobes below the horizon; 0 outside the disk.
  /// @param least_variance  lobes are widened to at least this variance, radians^2: for pixels that are wider than lobes
  GLINT_HD float normalDensity(int level, Vec2 uv, Vec2 h, float least_variance = 0) const {
    const float z2 = 1 - dot(h, h);
    if (z2 <= 0) return 0;
    const Vec3 n = {h.x, h.y, std::sqrt(z2)};
    const DisplacementLevel& l = asset_.levels[level];
    const std::size_t first = place(l, uv).cell * static_cast<std::size_t>(asset_.lobe_count);
    float density = 0;
    for (std::size_t k = first; k < first + static_cast<std::size_t>(asset_.lobe_count); ++k) {
      const VmfLobe& lobe = l.lobes[k];
      const float kappa = least_variance * lobe.kappa > 1 ? 1 / least_variance : lobe.kappa;
      density += lobe.amplitude * vmfDensity(dot(lobeCentre(lobe), n), kappa);
    }
    return finitePositive(density);
  }

  /// The scaling function R: T S, and the further terms where the asset has them. Not negative.
  GLINT_HD Rgb scale(int level, Vec2 uv, Vec3 wi, Vec3 wo) const {
    Rgb sum = spatialScale(level, uv) * angularScale(level, wi, wo);
    for (int term = 1; term <= asset_.more_terms; ++term)
      sum = sum + spatialScale(level, uv, term) * angularScale(level, wi, wo, term);
    return {std::max(0.0f, sum.r), std::max(0.0f, sum.g), std::max(0.0f, sum.b)};
  }

  /// T, linear between the centres of its patches; periodic.
  /// @param term  0: T; 1 to more_terms: the spatial factor of a further term
  GLINT_HD Rgb spatialScale(int level, Vec2 uv, int term = 0) const {
    const DisplacementLevel& l = asset_.levels[level];
    const float* values = term == 0 ? l.spatial_scale.data()
                                    : l.spatial_terms.data() + static_cast<std::size_t>(term - 1) * l.spatial_scale.size();
    const auto axis = [](float coordinate, int n, int& low, int& high) {
      const float x = wrapUnit(coordinate) * static_cast<float>(n) - 0.5f;
      const float whole = std::floor(x);
      low = (static_cast<int>(whole) + n) % n, high = (low + 1) % n;
      return x - whole;
    };
    // Patches begin at vertex 0, over the centre of texel 0.
    int i0, i1, j0, j1;
    const float fx = axis(uv.x - 0.5f / static_cast<float>(asset_.width), l.spatial_columns, i0, i1);
    const float fy = axis(uv.y - 0.5f / static_cast<float>(asset_.height), l.spatial_rows, j0, j1);
    const auto at = [&](int i, int j) { return color(values, rowMajorIndex(i, j, l.spatial_columns)); };
    return (1 - fy) * ((1 - fx) * at(i0, j0) + fx * at(i1, j0)) + fy * ((1 - fx) * at(i0, j1) + fx * at(i1, j1));
  }

  /// S, linear in both directions on the concentric map.
  /// @param term  0: S; 1 to more_terms: the angular factor of a further term
  GLINT_HD Rgb angularScale(int level, Vec3 wi, Vec3 wo, int term = 0) const {
    const DisplacementLevel& l = asset_.levels[level];
    const std::uint16_t* scales = term == 0
                                      ? l.angular_scale.data()
                                      : l.angular_terms.data() + static_cast<std::size_t>(term - 1) * l.angular_scale.size();
    const GridPlace a = gridPlace(wi, asset_.angular), b = gridPlace(wo, asset_.angular);
    const auto channels = static_cast<std::size_t>(asset_.channels);
    float sum[3] = {};
    for (int i = 0; i < 4; ++i) {
      for (int o = 0; o < 4; ++o) {
        const auto low = static_cast<std::size_t>(std::min(a.cell[i], b.cell[o]));
        const auto high = static_cast<std::size_t>(std::max(a.cell[i], b.cell[o]));
        const std::uint16_t* values = &scales[(high * (high + 1) / 2 + low) * channels];
        for (std::size_t c = 0; c < channels; ++c) sum[c] += a.weight[i] * b.weight[o] * halfToFloat(values[c]);
      }
    }
    return color(sum, 0);
  }

  /// Integral of f cos(wi) cos(wo) D over the normals of a cell: f'_low without the terms of the downsampled facet.
  GLINT_HD Rgb timesCosines(const DisplacementLevel& l, std::size_t cell, Vec3 wi, Vec3 wo) const {
    const std::size_t first = cell * static_cast<std::size_t>(asset_.lobe_count);
    if (asset_.base.kind == BaseBrdf::Kind::table) return tableTimesCosines(l, first, wi, wo);
    const bool diffuse = asset_.base.kind == BaseBrdf::Kind::diffuse;
    const float cosine = dot(wi, wo);
    const Vec3 sum = wi + wo;
    const float length = std::sqrt(std::max(1e-20f, dot(sum, sum)));
    const Vec3 h = (1 / length) * sum;
    const float factor =
        diffuse ? asset_.base.albedo * kInversePi : conductorFresnel(0.5f * length, asset_.base.eta, asset_.base.k);
    Rgb total;
    for (std::size_t k = first; k < first + static_cast<std::size_t>(asset_.lobe_count) && l.lobes[k].amplitude > 0; ++k) {
      const VmfLobe& lobe = l.lobes[k];
      const Vec3 axis = lobeCentre(lobe);
      float value = 0;
      if (diffuse) {
        const LobeMoments moments = lobeMoments(lobe.kappa);
        value = lobeCosines(moments, lobeFacing(moments, axis, wi), lobeFacing(moments, axis, wo), cosine);
      } else {
        value = ggxLobe(lobeAlpha(l, k), axis, lobe.kappa, wi, wo, h);
      }
      total = total + lobe.amplitude * value * lobeColor(l, k);
    }
    return {factor * std::max(0.0f, total.r), factor * std::max(0.0f, total.g), factor * std::max(0.0f, total.b)};
  }

 private:
  /// A cell and a position in it, (x, y) in [0, 1]^2.
  struct Place {
    int i, j;
    float x, y;
    std::size_t cell;
  };

  GLINT_HD Place place(const DisplacementLevel& l, Vec2 uv) const {
    const auto axis = [](float coordinate, int texels, int cells, float& part) {
      const float x = wrapUnit(coordinate) * static_cast<float>(texels) - 0.5f;
      float in_cells = x * static_cast<float>(cells) / static_cast<float>(texels);
      if (in_cells < 0) in_cells += static_cast<float>(cells);
      const int cell = std::clamp(static_cast<int>(in_cells), 0, cells - 1);
      part = std::clamp(in_cells - static_cast<float>(cell), 0.0f, 1.0f);
      return cell;
    };
    Place p{};
    p.i = axis(uv.x, asset_.width, l.columns, p.x);
    p.j = axis(uv.y, asset_.height, l.rows, p.y);
    p.cell = static_cast<std::size_t>(p.j) * static_cast<std::size_t>(l.columns) + static_cast<std::size_t>(p.i);
    return p;
  }

  /// Element k of an array of colours.
  GLINT_HD Rgb color(const float* values, std::size_t k) const {
    return asset_.channels == 1 ? Rgb::grey(values[k]) : Rgb{values[3 * k], values[3 * k + 1], values[3 * k + 2]};
  }

  GLINT_HD Rgb lobeColor(const DisplacementLevel& l, std::size_t lobe) const {
    return l.lobe_colors.empty() ? Rgb::grey(1) : color(l.lobe_colors.data(), lobe);
  }

  GLINT_HD float lobeAlpha(const DisplacementLevel& l, std::size_t lobe) const {
    return l.lobe_alphas.empty() ? asset_.base.alpha : l.lobe_alphas[lobe];
  }

  /// Relative frequency with which `sample` chooses a lobe of a cell.
  GLINT_HD float lobeShare(const DisplacementLevel& l, std::size_t lobe) const {
    const Rgb c = lobeColor(l, lobe);
    return l.lobes[lobe].amplitude * (c.r + c.g + c.b);
  }

  GLINT_HD float totalShare(const DisplacementLevel& l, std::size_t first) const {
    float total = 1e-20f;
    for (std::size_t k = first; k < first + static_cast<std::size_t>(asset_.lobe_count); ++k) total += lobeShare(l, k);
    return total;
  }

  /// Share of the samples that are drawn by the cosine around a lobe's centre.
  GLINT_HD float cosineShare() const {
    if (asset_.base.kind == BaseBrdf::Kind::table) return std::clamp(asset_.table->diffuse_share, 0.0f, 1.0f);
    return asset_.base.kind == BaseBrdf::Kind::diffuse ? 1.0f : 0.0f;
  }

  /// timesCosines of a base that is a table.
  /// @param first  the first lobe of the cell
  GLINT_HD Rgb tableTimesCosines(const DisplacementLevel& l, std::size_t first, Vec3 wi, Vec3 wo) const {
    const TablePair pair = tablePair(wi, wo);
    Rgb total;
    for (std::size_t k = first; k < first + static_cast<std::size_t>(asset_.lobe_count) && l.lobes[k].amplitude > 0; ++k) {
      const VmfLobe& lobe = l.lobes[k];
      total = total + lobe.amplitude * (lobeColor(l, k) * tableLobe(asset_.table->values.data(), asset_.channels, pair,
                                                                    lobeCentre(lobe), lobe.kappa, wi, wo));
    }
    return {std::max(0.0f, total.r), std::max(0.0f, total.g), std::max(0.0f, total.b)};
  }

  /// singleLobe of a base that is a table: a von Mises-Fisher lobe of the slopes' mean and mean variance.
  GLINT_HD Rgb singleTableLobe(const MapSlopes& m, Vec3 wi, Vec3 wo) const {
    const float z = 1 / std::sqrt(1 + dot(m.mean, m.mean));
    const float kappa = 1 / std::clamp(0.5f * (m.covariance.xx + m.covariance.yy), 1 / kMaxKappa, 1.0f);
    const Vec3 centre = {-m.mean.x * z, -m.mean.y * z, z};
    const float amplitude = 1 / (vmfMeanCosine(kappa) * z);  // normals cover the area of the cell
    return amplitude * SmithMasking(m, 1e-4f).g2(wi, wo) *
           tableLobe(asset_.table->values.data(), asset_.channels, tablePair(wi, wo), centre, kappa, wi, wo);
  }

  /// The direction at this cosine and azimuth around an axis.
  static GLINT_HD Vec3 around(Vec3 axis, float cosine, float angle) {
    const Tangents frame = tangentsOf(axis);
    const float sine = std::sqrt(std::max(0.0f, 1 - cosine * cosine));
    return sine * std::cos(angle) * frame.s + sine * std::sin(angle) * frame.t + cosine * axis;
  }

  /// Integral of f cos(wi) cos(wo) D for one Beckmann lobe with the cell's slope moments and mean base, shadowed by its own
  /// Smith term (Dupuy et al. 2013).
  GLINT_HD Rgb singleLobe(const DisplacementLevel& l, std::size_t cell, Vec3 wi, Vec3 wo) const {
    if (wi.z <= 0 || wo.z <= 0) return {};
    const std::size_t first = cell * static_cast<std::size_t>(asset_.lobe_count);
    Rgb color;
    float width = 0, area = 1e-20f;
    for (std::size_t k = first; k < first + static_cast<std::size_t>(asset_.lobe_count); ++k) {
      const float amplitude = l.lobes[k].amplitude, alpha = lobeAlpha(l, k);
      color = color + amplitude * lobeColor(l, k);
      width += amplitude * alpha * alpha;
      area += amplitude;
    }
    if (asset_.base.kind == BaseBrdf::Kind::table) return (1 / area) * (color * singleTableLobe(l.slopes[cell], wi, wo));
    return singleLobe(l.slopes[cell], width / area, wi, wo) / area * color;
  }

  /// @param width  squared alpha of the base
  GLINT_HD float singleLobe(const MapSlopes& m, float width, Vec3 wi, Vec3 wo) const {
    const bool diffuse = asset_.base.kind == BaseBrdf::Kind::diffuse;
    const float widening = diffuse ? 1e-8f : 0.5f * width;
    const float xx = m.covariance.xx + widening, yy = m.covariance.yy + widening, xy = m.covariance.xy;
    const float shadowing = SmithMasking(m, std::sqrt(widening)).g2(wi, wo);
    if (!diffuse) {
      const Vec3 sum = wi + wo;
      const float length = std::sqrt(std::max(1e-20f, dot(sum, sum)));
      const Vec3 h = (1 / length) * sum;
      if (h.z <= 0) return 0;
      const float sx = -h.x / h.z - m.mean.x, sy = -h.y / h.z - m.mean.y;
      const float determinant = std::max(1e-20f, xx * yy - xy * xy);
      const float exponent = (yy * sx * sx - 2 * xy * sx * sy + xx * sy * sy) / determinant;
      const float h2 = h.z * h.z;
      const float density = std::exp(-0.5f * exponent) * 0.5f * kInversePi / (std::sqrt(determinant) * h2 * h2);
      return 0.25f * conductorFresnel(0.5f * length, asset_.base.eta, asset_.base.k) * density * shadowing;
    }
    // Gauss-Hermite quadrature of the slopes: five points along each column of the Cholesky factor.
    constexpr float kNode[5] = {-2.85697001387f, -1.35562617997f, 0, 1.35562617997f, 2.85697001387f};
    constexpr float kWeight[5] = {0.0112574113f, 0.2220759220f, 0.5333333333f, 0.2220759220f, 0.0112574113f};
    const float l11 = std::sqrt(std::max(0.0f, xx)), l21 = xy / l11, l22 = std::sqrt(std::max(0.0f, yy - l21 * l21));
    float total = 0;
    for (int a = 0; a < 5; ++a) {
      for (int b = 0; b < 5; ++b) {
        const float sx = m.mean.x + l11 * kNode[a], sy = m.mean.y + l21 * kNode[a] + l22 * kNode[b];
        const float ci = std::max(0.0f, wi.z - sx * wi.x - sy * wi.y), co = std::max(0.0f, wo.z - sx * wo.x - sy * wo.y);
        total += kWeight[a] * kWeight[b] * ci * co / std::sqrt(1 + sx * sx + sy * sy);
      }
    }
    return asset_.base.albedo * kInversePi * total * shadowing;
  }

  const Displacement& asset_;
};

}  // namespace glint
