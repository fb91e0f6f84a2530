#include "glint/bake/displace/displace.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "glint/bake/displace/downsample_heights.h"
#include "glint/bake/displace/low_brdf.h"
#include "glint/bake/displace/ordered_sums.h"
#include "glint/bake/displace/scaling_function.h"
#include "glint/bake/displace/vmf_fit.h"
#include "glint/math/half.h"
#include "glint/model/counted.h"
#include "glint/model/error.h"
#include "glint/model/texel_name.h"

namespace glint::bake {
namespace {

constexpr std::size_t kProgressUnits = 100;  // units of progress for each level
constexpr float kLeastAlpha = 0.05f;

void require(bool holds, const char* parameter, const std::string& range) {
  if (!holds) throw Error(ErrorCode::usage, "displace.range", "", parameter, "is not " + range, "see the help text");
}

void checkOptions(const DisplaceOptions& o) {
  require(!o.factors.empty() && o.factors.size() <= kMaxDisplacementLevels, "--factors", "a list of 1 to 8 numbers");
  for (std::size_t k = 0; k < o.factors.size(); ++k)
    require(o.factors[k] >= 2 && (k == 0 || o.factors[k] > o.factors[k - 1]), "--factors", "2 or more and ascending");
  require(o.lobes >= 1 && o.lobes <= kMaxLobes, "--lobes", "1 to 6");
  require(o.angular >= 3 && o.angular <= kMostAngular, "--angular", "3 to 45");
  require(o.spatial >= 1 && o.spatial <= 16, "--spatial", "1 to 16");
  require(o.scale_tolerance >= 0 && o.scale_tolerance <= 1, "--scale-tolerance", "0 to 1");
  require((o.base.kind == BaseBrdf::Kind::table) == (o.table != nullptr), "--base", "a table, or anything else without one");
  require(o.bounces >= 1 && o.bounces <= kAllBounces, "--bounces", "1 to 64");
  if (o.base.kind == BaseBrdf::Kind::diffuse) {
    require(o.base.albedo > 0 && o.base.albedo <= 1, "--base",
            "an albedo above 0 and at most 1: a base may neither absorb all light nor gain any");
  } else if (o.base.kind == BaseBrdf::Kind::ggx) {
    require(o.base.alpha >= kLeastAlpha && o.base.alpha <= 1, "--base", "a roughness of 0.05 to 1");
    require(o.base.eta > 0 && o.base.eta <= 100 && o.base.k >= 0 && o.base.k <= 100, "--base",
            "a refractive index above 0 and an extinction of 0 or more, both at most 100");
  }
}

/// Refuses a map with bad values.
/// @param count  number of values, `each` of them for a texel
/// @param bad    bad(k): whether value k is bad
template <class Bad>
void requireTexels(const HeightMap& map, std::size_t count, std::size_t each, const char* rule, const char* what,
                   const std::string& range, const char* remedy, Bad bad) {
  TexelTally found(map.width, map.height);
  for (std::size_t k = 0; k < count; ++k)
    if (bad(k)) found.add(k / each);
  if (found.count() == 0) return;
  throw Error(ErrorCode::invalid_input, rule, "", what,
              counted(found.count(), {"value is", "values are"}) + " not " + range + " (first at " + found.firstName() + ")",
              remedy);
}

void checkTexture(const HeightMap& map, const DisplaceOptions& options) {
  const BaseTexture& t = options.texture;
  const auto channels = static_cast<std::size_t>(t.channels);
  require(t.channels == 1 || (t.channels == 3 && !t.colors.empty()), "texture.channels", "1, or 3 of colours");
  const auto requireSize = [&](std::size_t count, std::size_t wanted, const char* what) {
    if (count == 0 || count == wanted) return;
    throw Error(ErrorCode::invalid_input, "displace.texture", "", what,
                "does not have one value for each texel of the heights, " + std::to_string(map.width) + " x " +
                    std::to_string(map.height),
                "crop or resample it to the size of the heights");
  };
  requireSize(t.colors.size(), map.heights.size() * channels, "colours");
  requireSize(t.roughness.size(), map.heights.size(), "roughness");
  requireTexels(map, t.colors.size(), channels, "displace.texture", "colours", "0 to 1",
                "a base may not gain light: scale the image to 0..1",
                [&](std::size_t k) { return !(t.colors[k] >= 0 && t.colors[k] <= 1); });
  if (!t.colors.empty() && std::none_of(t.colors.begin(), t.colors.end(), [](float c) { return c > 0; }))
    throw Error(ErrorCode::invalid_input, "displace.texture", "", "colours", "are all black: nothing is reflected",
                "give an image with some light in it");
  if (t.roughness.empty()) return;
  if (options.base.kind != BaseBrdf::Kind::ggx)
    throw Error(ErrorCode::usage, "displace.texture", "", "roughness",
                options.table ? "the roughness of a table is in its numbers" : "a diffuse base has no roughness",
                "take a ggx base");
  requireTexels(map, t.roughness.size(), 1, "displace.texture", "roughness",
                "0.05 to 1 when multiplied by the base's " + fmt::format("{}", options.base.alpha),
                "raise the darkest texels of the image", [&](std::size_t k) {
                  return !(options.base.alpha * t.roughness[k] >= kLeastAlpha && options.base.alpha * t.roughness[k] <= 1);
                });
}

void checkMap(const HeightMap& map, const DisplaceOptions& options) {
  for (std::size_t k = 0; k < map.heights.size(); ++k) {
    if (std::isfinite(map.heights[k])) continue;
    throw Error(ErrorCode::invalid_input, "heights.finite", "", "heights",
                "the texel at " + texelName(map.width, map.height, k) + " is not finite",
                "make the map again with glint-ingest --fix-invalid");
  }
  if (std::min(map.width, map.height) < 2)
    throw Error(
        ErrorCode::invalid_input, "displace.factor", "", "heights",
        "the map of " + std::to_string(map.width) + " x " + std::to_string(map.height) + " texels has no cell of two texels",
        "take a map of 2 x 2 texels or more");
  for (std::size_t k = 1; k < options.factors.size(); ++k) {
    const int coarse = options.factors[k], fine = options.factors[k - 1];
    if (CellGrid::of(map.width, map.height, coarse) == CellGrid::of(map.width, map.height, fine))
      throw Error(ErrorCode::usage, "displace.factor", "", "--factors",
                  "the factors " + std::to_string(fine) + " and " + std::to_string(coarse) + " have the same cells on this map",
                  "leave out one of them");
  }
  for (const int factor : options.factors) {
    if (factor <= std::min(map.width, map.height)) continue;
    throw Error(ErrorCode::invalid_input, "displace.factor", "", "factor " + std::to_string(factor),
                "is larger than the map of " + std::to_string(map.width) + " x " + std::to_string(map.height) + " texels",
                "take a factor of 2 to " + std::to_string(std::min(map.width, map.height)));
  }
  const HeightSurface surface(map.width, map.height, map.heights);
  TexelTally steep(map.width, map.height);
  for (std::size_t f = 0; f < surface.facetCount(); ++f) {
    const Vec2 slope = surface.slope(f);
    if (dot(slope, slope) > kSteepestSlope * kSteepestSlope) steep.add(f / 2);
  }
  if (steep.count() > 0) {
    throw Error(
        ErrorCode::invalid_input, "displace.steep", "", "heights",
        counted(steep.count(), {"facet is", "facets are"}) + " steeper than 80 degrees (first at " + steep.firstName() + ")",
        "heights are in texels: scale them with glint-ingest --height-scale, or smooth the map");
  }
}

/// Normals and base BRDFs of the facets of one cell.
struct CellFacets {
  std::vector<WeightedNormal> normals;
  std::vector<float> colors;  ///< [facets][channels]; empty where colours do not vary
  std::vector<float> widths;  ///< [facets]: squares of alphas; empty where alphas do not vary
};

/// Collects the facets of one cell, and computes the moments of their slopes.
void collectCell(const HeightSurface& surface, const FacetBase& base, const CellGrid& grid, int column, int row,
                 CellFacets& facets, MapSlopes& moments) {
  facets.normals.clear(), facets.colors.clear(), facets.widths.clear();
  const int i0 = grid.firstColumn(column), i1 = grid.firstColumn(column + 1), j0 = grid.firstRow(row),
            j1 = grid.firstRow(row + 1);
  const float share = 0.5f / (static_cast<float>(i1 - i0) * static_cast<float>(j1 - j0));
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (int j = j0; j < j1; ++j) {
    for (int i = i0; i < i1; ++i) {
      for (std::size_t half = 0; half < 2; ++half) {
        const std::size_t facet = 2 * (static_cast<std::size_t>(j) * surface.width() + static_cast<std::size_t>(i)) + half;
        const Vec2 s = surface.slope(facet);
        const Vec3 n = surface.normal(facet);
        facets.normals.push_back({n, share / n.z});
        if (base.colored()) {
          const Color color = base.color(facet);
          facets.colors.insert(facets.colors.end(), color.begin(), color.begin() + base.channels());
        }
        if (base.rough()) facets.widths.push_back(base.of(facet).alpha * base.of(facet).alpha);
        x += s.x, y += s.y, xx += s.x * s.x, xy += s.x * s.y, yy += s.y * s.y;
      }
    }
  }
  x *= share, y *= share;
  moments.mean = {static_cast<float>(x), static_cast<float>(y)};
  moments.covariance.xx = static_cast<float>(std::max(0.0, share * xx - x * x));
  moments.covariance.xy = static_cast<float>(share * xy - x * y);
  moments.covariance.yy = static_cast<float>(std::max(0.0, share * yy - y * y));
}

/// Downsamples the heights.
/// @return heights in units of `factor` texels
std::vector<float> lowHeights(const HeightMap& map, const CellGrid& grid, int factor) {
  double mean = 0;
  for (const float h : map.heights) mean += h;
  mean /= static_cast<double>(map.heights.size()) * factor;
  // What the heights should rise by over a cell.
  std::vector<Vec2> rises = meanSlopes(map.heights, grid);
  const float across = grid.cellWidth() / static_cast<float>(factor), up = grid.cellHeight() / static_cast<float>(factor);
  for (Vec2& rise : rises) rise = {across * rise.x, up * rise.y};
  const auto heights = heightsFromSlopes(grid.columns, grid.rows, rises, mean);
  return {heights.begin(), heights.end()};
}

PatchGrid patchGrid(const HeightMap& map, int factor, int spatial) {
  const CellGrid cells = CellGrid::of(map.width, map.height, factor);
  return {std::min(spatial, cells.columns),
          std::min(spatial, cells.rows),
          cells.columns,
          cells.rows,
          factor,
          map.width,
          map.height};
}

/// Whether two grids cut the map along the same lines.
bool samePatches(const PatchGrid& a, const PatchGrid& b) {
  if (a.columns != b.columns || a.rows != b.rows) return false;
  for (int c = 0; c <= a.columns; ++c)
    if (a.firstColumn(c) != b.firstColumn(c)) return false;
  for (int r = 0; r <= a.rows; ++r)
    if (a.firstRow(r) != b.firstRow(r)) return false;
  return true;
}

/// Appends a term of all channels, with zeros for channels that do not have it.
void appendTerm(std::span<const ScalingFactors> factors, std::size_t term, std::vector<float>& spatial,
                std::vector<std::uint16_t>& angular) {
  const auto append = [&](auto member, std::size_t count, auto push) {
    for (std::size_t k = 0; k < count; ++k)
      for (const ScalingFactors& f : factors) push(term < f.terms.size() ? (f.terms[term].*member)[k] : 0.0f);
  };
  append(&ScalingTerm::spatial, factors[0].terms[0].spatial.size(), [&](float t) { spatial.push_back(t); });
  append(&ScalingTerm::angular, factors[0].terms[0].angular.size(), [&](float s) { angular.push_back(floatToHalf(s)); });
}

/// Computes the scaling functions of all channels. The measures of the level are those of the worst channel.
/// @return number of terms
std::size_t factorChannels(const EffectiveBrdf& original, const EffectiveBrdf& low, std::span<const Vec3> directions,
                           const PatchGrid& grid, float tolerance, DisplacementLevel& shape, DisplacementData::Level& level) {
  std::vector<ScalingFactors> factors;
  std::size_t terms = 1;
  for (std::size_t c = 0; c < original.channels; ++c) {
    factors.push_back(factorScaling(original, low, directions, grid, c, tolerance));
    terms = std::max(terms, factors.back().terms.size());
  }
  appendTerm(factors, 0, level.spatial_scale, level.angular_scale);
  for (std::size_t t = 1; t < terms; ++t) appendTerm(factors, t, level.spatial_terms, level.angular_terms);
  shape.rank1_residual = 0, shape.scale_residual = 0, shape.rank1_energy = 1;
  level.singular_shares.assign(factors[0].singular_shares.begin(), factors[0].singular_shares.end());
  for (const ScalingFactors& f : factors) {
    shape.rank1_residual = std::max(shape.rank1_residual, f.rank1_residual);
    shape.scale_residual = std::max(shape.scale_residual, f.residual);
    if (f.rank1_energy >= shape.rank1_energy) continue;
    shape.rank1_energy = f.rank1_energy;
    level.singular_shares.assign(f.singular_shares.begin(), f.singular_shares.end());
  }
  return terms;
}

/// Builds one level: heights, lobes, and scaling functions.
/// @param original  effective BRDFs of the original surface, on the same patches
/// @param table     BaseTable::values
/// @return terms of the scaling function
std::size_t buildLevel(const HeightMap& map, const DisplaceOptions& options, const PatchGrid& grid,
                       const EffectiveBrdf& original, std::span<const Vec3> directions, std::span<const float> table,
                       DisplacementLevel& shape, DisplacementData::Level& level) {
  const HeightSurface surface(map.width, map.height, map.heights);
  const std::vector<float> heights = lowHeights(map, grid.cells(), grid.factor);
  for (const float h : heights) level.heights.push_back(h * static_cast<float>(grid.factor));
  fitCells(surface, FacetBase(surface, options.base, options.texture, options.channels()), grid.cells(), options.lobes, level);
  const LobeField field{options.base,
                        static_cast<std::size_t>(options.lobes),
                        original.channels,
                        level.lobes,
                        level.lobe_colors,
                        level.lobe_alphas,
                        table};
  const EffectiveBrdf low = lowBrdf(heights, field, directions, grid);
  const std::size_t terms = factorChannels(original, low, directions, grid, options.scale_tolerance, shape, level);
  shape.factor = grid.factor;
  shape.columns = grid.coarse_x, shape.rows = grid.coarse_y;
  shape.spatial_columns = grid.columns, shape.spatial_rows = grid.rows;
  return terms;
}

}  // namespace

Displacement DisplacementData::view() const {
  Displacement out = shape;
  if (out.table) out.table->values = base_table;
  for (std::size_t l = 0; l < levels.size(); ++l) {
    DisplacementLevel& to = out.levels[l];
    const Level& from = levels[l];
    to.heights = from.heights, to.lobes = from.lobes, to.slopes = from.slopes;
    to.lobe_colors = from.lobe_colors, to.lobe_alphas = from.lobe_alphas;
    to.spatial_terms = from.spatial_terms, to.angular_terms = from.angular_terms, to.singular_shares = from.singular_shares;
    to.fit_errors = from.fit_errors, to.spatial_scale = from.spatial_scale, to.angular_scale = from.angular_scale;
  }
  return out;
}

void fitCells(const HeightSurface& surface, const FacetBase& base, const CellGrid& grid, int lobe_count,
              DisplacementData::Level& level) {
  const int columns = grid.columns, rows = grid.rows;
  const std::size_t cells = static_cast<std::size_t>(columns) * rows;
  const auto lobes = static_cast<std::size_t>(lobe_count), channels = static_cast<std::size_t>(base.channels());
  level.lobes.resize(cells * lobes);
  level.lobe_colors.resize(base.colored() ? cells * lobes * channels : 0);
  level.lobe_alphas.resize(base.rough() ? cells * lobes : 0);
  level.slopes.resize(cells);
  level.fit_errors.resize(cells);
  tbb::parallel_for(0, rows, [&](int row) {
    CellFacets facets;
    for (int column = 0; column < columns; ++column) {
      const std::size_t cell = static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column);
      collectCell(surface, base, grid, column, row, facets, level.slopes[cell]);
      const std::span<VmfLobe> out(&level.lobes[cell * lobes], lobes);
      fitLobes(facets.normals, out);
      level.fit_errors[cell] = lobeError(facets.normals, out);
      if (base.colored())
        averageOverLobes(facets.normals, out, facets.colors, {&level.lobe_colors[cell * lobes * channels], lobes * channels});
      if (!base.rough()) continue;
      const std::span<float> alphas(&level.lobe_alphas[cell * lobes], lobes);
      averageOverLobes(facets.normals, out, facets.widths, alphas);
      for (float& alpha : alphas) alpha = alpha > 0 ? std::sqrt(alpha) : base.base().alpha;
    }
  });
}

double displacementPairBytes(int width, int height, const DisplaceOptions& options, int threads) {
  constexpr double kFloat = sizeof(float), kDouble = sizeof(double), kHalf = sizeof(std::uint16_t);
  const auto channels = static_cast<double>(options.channels());
  const double n = static_cast<double>(options.angular) * options.angular, padded = 8 * std::ceil(n / 8);
  const CellGrid finest = CellGrid::of(width, height, options.factors[0]);
  const double patches =
      static_cast<double>(std::min(options.spatial, finest.columns)) * std::min(options.spatial, finest.rows);
  const double sum = channels * padded * padded * kFloat, brdf = channels * patches * n * n * kFloat;
  const auto held = [&](double chunks) {
    return std::min(chunks, std::max(4.0, std::floor(static_cast<double>(kOrderedSumBytes) / sum))) * sum;
  };
  // Chunks of samples and of cells, with one more for each patch, as the estimators cut them.
  const bool glossy = options.base.kind != BaseBrdf::Kind::diffuse;
  const double facets = std::min(2.0 * width * height, glossy ? 0x1p21 : 0x1p18);
  const double cells = std::min(4096.0, static_cast<double>(finest.columns) * finest.rows);
  const double estimating = kDouble * channels * patches * n * n + std::max(held(patches + facets / 8192), brdf) +
                            (glossy ? 3 * kFloat * n * n : 0) + (options.factors.size() > 1 ? brdf : 0);
  const double lowering = 2 * brdf + held(patches + cells / 32) + threads * sum + 4 * kFloat * n * padded;
  const double terms = options.scale_tolerance > 0 ? kMostScaleTerms : 1;
  const double factoring = 2 * brdf + 2 * kDouble * n * n + (channels + 1) * terms * n * n / 2 * kFloat;
  const double stored = static_cast<double>(options.factors.size()) * channels * terms * n * n / 2 * kHalf;
  return std::max({estimating, lowering, factoring}) + stored;
}

DisplacementData displace(const HeightMap& map, const DisplaceOptions& options, const ProgressFn& progress) {
  checkOptions(options);
  checkMap(map, options);
  checkTexture(map, options);
  // Find which facets see which directions, once for all levels.
  const std::vector<Vec3> directions = angularDirections(options.angular);
  const HeightSurface surface(map.width, map.height, map.heights);
  const VisibilityMasks masks(surface, directions);
  DisplacementData data;
  data.shape.width = map.width, data.shape.height = map.height, data.shape.texel_size_um = map.texel_size_um;
  data.shape.base = options.base, data.shape.channels = options.channels();
  data.shape.lobe_count = options.lobes, data.shape.angular = options.angular;
  data.shape.level_count = static_cast<int>(options.factors.size());
  data.levels.resize(options.factors.size());

  // Estimate the light that the original reflects, and factor it for each level.
  EffectiveOptions effective{options.base, options.bounces, options.seed, {}, 0, 0, options.texture, options.table};
  if (options.table) {
    data.base_table = options.table->assetTables(options.channels());
    data.shape.table = BaseTable{options.table->diffuseShare(), {}};
  }
  for (const int factor : options.factors) effective.distant_cells.push_back(static_cast<float>(factor));
  const std::size_t total = kProgressUnits * options.factors.size();
  std::size_t terms = 1;
  EffectiveBrdf original;
  PatchGrid cut;
  for (std::size_t l = 0; l < options.factors.size(); ++l) {
    const PatchGrid grid = patchGrid(map, options.factors[l], options.spatial);
    // Levels whose patches have the same borders share the light paths of the original.
    if (l == 0 || !samePatches(grid, cut)) {
      const auto share = [&](std::size_t done, std::size_t all) {
        if (progress) progress(l * kProgressUnits + done * (kProgressUnits / 2) / all, total);
      };
      original = effectiveBrdf(surface, masks, directions, grid, effective, share);
      cut = grid;
    }
    DisplacementLevel& shape = data.shape.levels[l];
    shape.interreflected_share = static_cast<float>(original.interreflected);
    shape.distant_share = static_cast<float>(original.distant[l]);
    terms = std::max(terms, buildLevel(map, options, grid, original, directions, data.base_table, shape, data.levels[l]));
    if (progress) progress((l + 1) * kProgressUnits, total);
  }
  // All levels have as many terms as the level that needs most of them.
  data.shape.more_terms = static_cast<int>(terms) - 1;
  for (DisplacementData::Level& level : data.levels) {
    level.spatial_terms.resize((terms - 1) * level.spatial_scale.size());
    level.angular_terms.resize((terms - 1) * level.angular_scale.size());
  }
  return data;
}

}  // namespace glint::bake
