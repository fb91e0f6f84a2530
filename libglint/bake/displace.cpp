#include "glint/bake/displace.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "glint/bake/downsample_heights.h"
#include "glint/bake/low_brdf.h"
#include "glint/bake/scaling_function.h"
#include "glint/bake/vmf_fit.h"
#include "glint/model/error.h"
#include "glint/query/half.h"

namespace glint::bake {
namespace {

constexpr std::size_t kProgressUnits = 100;  // of each level

void require(bool holds, const char* parameter, const std::string& range) {
  if (!holds) throw Error(ErrorCode::usage, "displace.range", "", parameter, "is not " + range, "see the help text");
}

void checkOptions(const DisplaceOptions& o) {
  require(!o.factors.empty() && o.factors.size() <= kMaxDisplacementLevels, "factors", "a list of 1 to 8 numbers");
  for (std::size_t k = 0; k < o.factors.size(); ++k)
    require(o.factors[k] >= 2 && (k == 0 || o.factors[k] > o.factors[k - 1]), "factors", "2 or more and ascending");
  require(o.lobes >= 1 && o.lobes <= kMaxLobes, "lobes", "1 to 6");
  require(o.angular >= 3 && o.angular <= 25, "angular", "3 to 25");
  require(o.spatial >= 1 && o.spatial <= 16, "spatial", "1 to 16");
  require(o.bounces >= 1 && o.bounces <= kAllBounces, "bounces", "1 to 64");
  if (o.base.kind == BaseBrdf::Kind::diffuse) {
    require(o.base.albedo > 0 && o.base.albedo <= 1, "base",
            "an albedo above 0 and at most 1: a base may neither absorb all light nor gain any");
  } else {
    require(o.base.alpha >= 0.05f && o.base.alpha <= 1, "base", "a roughness of 0.05 to 1");
    require(o.base.eta > 0 && o.base.eta <= 100 && o.base.k >= 0 && o.base.k <= 100, "base",
            "a refractive index above 0 and an extinction of 0 or more, both at most 100");
  }
}

std::string place(std::size_t texel, int width) {
  return "column " + std::to_string(texel % static_cast<std::size_t>(width)) + ", row " +
         std::to_string(texel / static_cast<std::size_t>(width));
}

void checkMap(const HeightMap& map, const DisplaceOptions& options) {
  for (std::size_t k = 0; k < map.heights.size(); ++k) {
    if (std::isfinite(map.heights[k])) continue;
    throw Error(ErrorCode::invalid_input, "heights.finite", "", "heights",
                "the texel at " + place(k, map.width) + " is not finite", "repair them with glint-ingest --fix-invalid");
  }
  for (const int factor : options.factors) {
    if (map.width % factor == 0 && map.height % factor == 0) continue;
    throw Error(ErrorCode::invalid_input, "displace.factor", "", "factor " + std::to_string(factor),
                "does not divide " + std::to_string(map.width) + " x " + std::to_string(map.height) + " texels",
                "crop or resample the map, or take a factor that divides both sides");
  }
  const HeightSurface surface(map.width, map.height, map.heights);
  std::size_t steep = 0, first = 0;
  for (std::size_t f = 0; f < surface.facetCount(); ++f) {
    const Vec2 slope = surface.slope(f);
    if (dot(slope, slope) > kSteepestSlope * kSteepestSlope && steep++ == 0) first = f;
  }
  if (steep > 0) {
    throw Error(ErrorCode::invalid_input, "displace.steep", "", "heights",
                std::to_string(steep) + " facets are steeper than 80 degrees (first at " + place(first / 2, map.width) + ")",
                "heights are in texels: scale them with glint-ingest --height-scale, or smooth the map");
  }
}

/// Weighted normals and slope moments of one cell.
void collectCell(const HeightSurface& surface, int factor, int column, int row, std::vector<WeightedNormal>& normals,
                 MapSlopes& moments) {
  normals.clear();
  const float share = 0.5f / (static_cast<float>(factor) * static_cast<float>(factor));
  double x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (int j = row * factor; j < (row + 1) * factor; ++j) {
    for (int i = column * factor; i < (column + 1) * factor; ++i) {
      for (std::size_t half = 0; half < 2; ++half) {
        const std::size_t facet = 2 * (static_cast<std::size_t>(j) * surface.width() + static_cast<std::size_t>(i)) + half;
        const Vec2 s = surface.slope(facet);
        const Vec3 n = surface.normal(facet);
        normals.push_back({n, share / n.z});
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

/// Downsampled heights in cells.
std::vector<float> lowHeights(const HeightMap& map, int factor) {
  double mean = 0;
  for (const float h : map.heights) mean += h;
  mean /= static_cast<double>(map.heights.size()) * factor;
  const auto heights =
      heightsFromSlopes(map.width / factor, map.height / factor, meanSlopes(map.width, map.height, map.heights, factor), mean);
  return {heights.begin(), heights.end()};
}

PatchGrid patchGrid(const HeightMap& map, int factor, int spatial) {
  const int columns = map.width / factor, rows = map.height / factor;
  return {std::min(spatial, columns), std::min(spatial, rows), columns, rows, factor};
}

/// Whether two grids cut the map at the same places.
bool samePatches(const PatchGrid& a, const PatchGrid& b) {
  if (a.columns != b.columns || a.rows != b.rows) return false;
  for (int c = 0; c <= a.columns; ++c)
    if (a.firstColumn(c) != b.firstColumn(c)) return false;
  for (int r = 0; r <= a.rows; ++r)
    if (a.firstRow(r) != b.firstRow(r)) return false;
  return true;
}

/// Everything of one level.
void buildLevel(const HeightMap& map, const DisplaceOptions& options, const PatchGrid& grid, const EffectiveBrdf& original,
                std::span<const Vec3> directions, DisplacementLevel& shape, DisplacementData::Level& level) {
  const HeightSurface surface(map.width, map.height, map.heights);
  const std::vector<float> heights = lowHeights(map, grid.factor);
  for (const float h : heights) level.heights.push_back(h * static_cast<float>(grid.factor));
  fitCells(surface, grid.factor, options.lobes, level);
  const EffectiveBrdf low = lowBrdf(heights, level.lobes, options.lobes, options.base, directions, grid);
  const ScalingFactors factors = factorScaling(original, low, directions, grid);
  level.spatial_scale = factors.spatial;
  for (const float s : factors.angular) level.angular_scale.push_back(floatToHalf(s));
  shape.factor = grid.factor;
  shape.columns = grid.coarse_x, shape.rows = grid.coarse_y;
  shape.spatial_columns = grid.columns, shape.spatial_rows = grid.rows;
  shape.rank1_residual = factors.rank1_residual;
  shape.rank1_energy = factors.rank1_energy;
}

}  // namespace

Displacement DisplacementData::view() const {
  Displacement out = shape;
  for (std::size_t l = 0; l < levels.size(); ++l) {
    DisplacementLevel& to = out.levels[l];
    const Level& from = levels[l];
    to.heights = from.heights, to.lobes = from.lobes, to.slopes = from.slopes;
    to.fit_errors = from.fit_errors, to.spatial_scale = from.spatial_scale, to.angular_scale = from.angular_scale;
  }
  return out;
}

void fitCells(const HeightSurface& surface, int factor, int lobe_count, DisplacementData::Level& level) {
  const int columns = surface.width() / factor, rows = surface.height() / factor;
  const std::size_t cells = static_cast<std::size_t>(columns) * rows;
  const auto lobes = static_cast<std::size_t>(lobe_count);
  level.lobes.resize(cells * lobes);
  level.slopes.resize(cells);
  level.fit_errors.resize(cells);
  tbb::parallel_for(0, rows, [&](int row) {
    std::vector<WeightedNormal> normals;
    for (int column = 0; column < columns; ++column) {
      const std::size_t cell = static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column);
      collectCell(surface, factor, column, row, normals, level.slopes[cell]);
      const std::span<VmfLobe> out(&level.lobes[cell * lobes], lobes);
      fitLobes(normals, out);
      level.fit_errors[cell] = lobeError(normals, out);
    }
  });
}

DisplacementData displace(const HeightMap& map, const DisplaceOptions& options, const ProgressFn& progress) {
  checkOptions(options);
  checkMap(map, options);
  const std::vector<Vec3> directions = angularDirections(options.angular);
  const HeightSurface surface(map.width, map.height, map.heights);
  const VisibilityMasks masks(surface, directions);
  DisplacementData data;
  data.shape.width = map.width, data.shape.height = map.height, data.shape.texel_size_um = map.texel_size_um;
  data.shape.base = options.base;
  data.shape.lobe_count = options.lobes, data.shape.angular = options.angular;
  data.shape.level_count = static_cast<int>(options.factors.size());
  data.levels.resize(options.factors.size());

  EffectiveOptions effective{options.base, options.bounces, options.seed, {}, 0, 0};
  for (const int factor : options.factors) effective.distant_cells.push_back(static_cast<float>(factor));
  const std::size_t total = kProgressUnits * options.factors.size();
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
    buildLevel(map, options, grid, original, directions, shape, data.levels[l]);
    if (progress) progress((l + 1) * kProgressUnits, total);
  }
  return data;
}

}  // namespace glint::bake
