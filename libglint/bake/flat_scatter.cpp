#include "glint/bake/flat_scatter.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "glint/bake/simd.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/query/footprint_weights.h"

namespace glint::bake {
namespace {

constexpr int kChunk = 128;  // texels binned at once

struct Target {
  float* bins;
  std::uint8_t* touched;
  int pitch;
  int tiles;
  float bins_per_unit;   // bins in half the square
  float tiles_per_unit;  // tiles in half the square
};

using Float4 = float __attribute__((vector_size(16), aligned(4), may_alias));

/// Adds `count` <= kChunk neighbouring texels with weights row_weight * weights[k].
GLINT_MULTIVERSION void splat(const Vec2* normals, const float* weights, float row_weight, int count, const Target& target) {
  float fx[kChunk], fy[kChunk];
  std::int32_t offset[kChunk], tile[kChunk];
  for (int k = 0; k < count; ++k) {
    const float x = (normals[k].x + 1) * target.bins_per_unit, y = (normals[k].y + 1) * target.bins_per_unit;
    const int ix = static_cast<int>(x), iy = static_cast<int>(y);
    fx[k] = x - static_cast<float>(ix);
    fy[k] = y - static_cast<float>(iy);
    offset[k] = (iy - 1) * target.pitch + ix - 1;
    const int tx = std::min(static_cast<int>((normals[k].x + 1) * target.tiles_per_unit), target.tiles - 1);
    const int ty = std::min(static_cast<int>((normals[k].y + 1) * target.tiles_per_unit), target.tiles - 1);
    tile[k] = ty * target.tiles + tx;
  }
  for (int k = 0; k < count; ++k) {
    const float w = row_weight * weights[k];
    const float x = fx[k], y = fy[k], rx = 1 - x, ry = 1 - y;
    // Quadratic B-spline weights of the bins before, at and after the facet; the fourth lane adds 0.
    const Float4 across = {0.5f * w * rx * rx, w * (0.5f + x * rx), 0.5f * w * x * x, 0};
    float* bin = target.bins + offset[k];
    Float4* row0 = reinterpret_cast<Float4*>(bin);
    Float4* row1 = reinterpret_cast<Float4*>(bin + target.pitch);
    Float4* row2 = reinterpret_cast<Float4*>(bin + 2 * static_cast<std::ptrdiff_t>(target.pitch));
    *row0 += across * (0.5f * ry * ry);
    *row1 += across * (0.5f + y * ry);
    *row2 += across * (0.5f * y * y);
    target.touched[tile[k]] = 1;
  }
}

/// Half-open range of texel centres within `reach` of `centre`, limited to the map when it does not repeat.
struct Range {
  int begin, end;
};
Range texelsWithin(float centre, float reach, int size, Boundary boundary) {
  int begin = static_cast<int>(std::ceil(centre - reach - 0.5f)), end = static_cast<int>(std::floor(centre + reach - 0.5f)) + 1;
  if (boundary == Boundary::clamp) begin = std::max(begin, 0), end = std::min(end, size);
  return {begin, end};
}

std::vector<float> gaussianWeights(Range range, float centre, float sigma) {
  std::vector<float> weights;
  for (int i = range.begin; i < range.end; ++i) {
    const float d = (static_cast<float>(i) + 0.5f - centre) / sigma;
    weights.push_back(std::exp(-0.5f * d * d));
  }
  return weights;
}

Target targetOf(DirectionBins& bins) {
  const float half = 0.5f * static_cast<float>(bins.resolution());
  return {bins.origin(),
          bins.touched(),
          bins.pitch(),
          bins.tilesPerAxis(),
          half * static_cast<float>(bins.subdivision()),
          0.5f * static_cast<float>(bins.tilesPerAxis())};
}

}  // namespace

void scatterFlatFootprint(const NormalMap& map, Boundary boundary, Vec2 centre, float sigma, DirectionBins& bins,
                          DirectionBins& band) {
  const float reach = kPyramidReach * sigma;
  const Range rows = texelsWithin(centre.y, reach, map.height, boundary);
  const Range columns = texelsWithin(centre.x, reach, map.width, boundary);
  const std::vector<float> wx = gaussianWeights(columns, centre.x, sigma), wy = gaussianWeights(rows, centre.y, sigma);

  const auto columnsOfRow = [&](int j) {  // the part of a row inside the circle
    const float dy = static_cast<float>(j) + 0.5f - centre.y;
    const Range r = texelsWithin(centre.x, std::sqrt(std::max(0.0f, reach * reach - dy * dy)), map.width, boundary);
    return Range{std::max(r.begin, columns.begin), std::min(r.end, columns.end)};
  };
  double total = 0;
  for (int j = rows.begin; j < rows.end; ++j) {
    const Range r = columnsOfRow(j);
    double row = 0;
    for (int i = r.begin; i < r.end; ++i) row += wx[i - columns.begin];
    total += row * wy[j - rows.begin];
  }

  const bool banded = (rows.end - rows.begin) * static_cast<std::int64_t>(columns.end - columns.begin) > 2 * kBandTexels;
  const Target target = targetOf(banded ? band : bins);
  const auto flush = [&] {
    band.addTo(bins);
    band.clear();
  };
  int in_band = 0;
  for (int j = rows.begin; j < rows.end; ++j) {
    const Range r = columnsOfRow(j);
    const auto row_weight = static_cast<float>(wy[j - rows.begin] / total);
    const Vec2* row = map.normals.data() + static_cast<std::size_t>(wrapIndex(j, map.height)) * map.width;
    for (int i = r.begin; i < r.end;) {
      const int column = wrapIndex(i, map.width);
      const int count = std::min({r.end - i, map.width - column, kChunk});
      splat(row + column, wx.data() + (i - columns.begin), row_weight, count, target);
      i += count;
    }
    in_band += r.end - r.begin;
    if (banded && in_band >= kBandTexels) flush(), in_band = 0;
  }
  if (banded) flush();
}

}  // namespace glint::bake
