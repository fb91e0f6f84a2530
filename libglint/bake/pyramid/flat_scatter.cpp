#include "glint/bake/pyramid/flat_scatter.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "glint/bake/common/simd.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/query/detail/common/footprint_weights.h"

namespace glint::bake {
namespace {

constexpr int kChunk = 128;  // texels that one call of splat takes

/// The bins that texels are added to.
struct Target {
  float* bins;
  std::uint8_t* touched;
  int pitch;
  int tiles;
  float bins_per_unit;   // bins in half the square
  float tiles_per_unit;  // tiles in half the square
};

using Float4 = float __attribute__((vector_size(16), aligned(4), may_alias));

/// Adds `count` <= kChunk neighbouring texels with weights row_weight * weights[k] to 3x3 bins each.
GLINT_MULTIVERSION void splat(const Vec2* normals, const float* weights, float row_weight, int count, const Target& target) {
  // Find the bins and tiles of all texels, in a loop of which the compiler makes vectors; then add texel by texel.
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
    // Quadratic B-spline weights of the bins before, at and after the normal; the fourth lane adds 0.
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

/// Texels [begin, end) along one axis.
struct Range {
  int begin, end;
  int size() const { return end - begin; }
};
/// Texels whose centres lie within `reach` of `centre`: of the map only, if it does not repeat.
Range texelsWithin(float centre, float reach, int size, Boundary boundary) {
  int begin = static_cast<int>(std::ceil(centre - reach - 0.5f)), end = static_cast<int>(std::floor(centre + reach - 0.5f)) + 1;
  if (boundary == Boundary::clamp) begin = std::max(begin, 0), end = std::min(end, size);
  return {begin, std::max(begin, end)};
}

/// Weights of texels along one axis, not normalised.
struct AxisWeights {
  Range range;
  std::vector<float> weights;
  bool folded;  ///< whether the texels are the whole map, with weights summed over its periods
};

/// Weights of a Gaussian up to its reach. If the Gaussian is longer than the map, the weights are folded, so that no texel is
/// visited twice.
AxisWeights gaussianWeights(float centre, float sigma, int size, Boundary boundary, float reach) {
  const Range range = texelsWithin(centre, reach * sigma, size, boundary);
  const bool folded = range.size() > size;
  AxisWeights axis = {folded ? Range{0, size} : range, {}, folded};
  axis.weights.assign(static_cast<std::size_t>(axis.range.size()), 0.0f);
  for (int i = range.begin; i < range.end; ++i) {
    const float d = (static_cast<float>(i) + 0.5f - centre) / sigma;
    axis.weights[static_cast<std::size_t>(folded ? wrapIndex(i, size) : i - range.begin)] += std::exp(-0.5f * d * d);
  }
  return axis;
}

/// Equal weights of all texels.
AxisWeights evenWeights(int size) { return {{0, size}, std::vector<float>(static_cast<std::size_t>(size), 1.0f), true}; }

Target targetOf(DirectionBins& bins) {
  const float half = 0.5f * static_cast<float>(bins.resolution());
  return {bins.origin(),
          bins.touched(),
          bins.pitch(),
          bins.tilesPerAxis(),
          half * static_cast<float>(bins.subdivision()),
          0.5f * static_cast<float>(bins.tilesPerAxis())};
}

/// Adds texels to bins with the product of the weights along x and y, normalised.
/// @param columnsOfRow  columnsOfRow(j): columns that have weight in row j
template <class ColumnsOfRow>
void scatter(const NormalMap& map, const AxisWeights& x, const AxisWeights& y, const ColumnsOfRow& columnsOfRow,
             DirectionBins& bins, DirectionBins& band) {
  // Sum all weights, to normalise them.
  double total = 0;
  for (int j = y.range.begin; j < y.range.end; ++j) {
    const Range r = columnsOfRow(j);
    double row = 0;
    for (int i = r.begin; i < r.end; ++i) row += x.weights[i - x.range.begin];
    total += row * y.weights[j - y.range.begin];
  }

  // Add rows of texels in pieces that do not cross the border of the map.
  const bool banded = y.range.size() * static_cast<std::int64_t>(x.range.size()) > 2 * kBandTexels;
  const Target target = targetOf(banded ? band : bins);
  const auto flush = [&] {
    band.addTo(bins);
    band.clear();
  };
  int in_band = 0;
  for (int j = y.range.begin; j < y.range.end; ++j) {
    const Range r = columnsOfRow(j);
    const auto row_weight = static_cast<float>(y.weights[j - y.range.begin] / total);
    const Vec2* row = map.normals.data() + static_cast<std::size_t>(wrapIndex(j, map.height)) * map.width;
    for (int i = r.begin; i < r.end;) {
      const int column = wrapIndex(i, map.width);
      const int count = std::min({r.end - i, map.width - column, kChunk});
      splat(row + column, x.weights.data() + (i - x.range.begin), row_weight, count, target);
      i += count;
      in_band += count;
      if (banded && in_band >= kBandTexels) flush(), in_band = 0;
    }
  }
  if (banded) flush();
}

}  // namespace

void scatterFlatFootprint(const NormalMap& map, Boundary boundary, Vec2 centre, float sigma, DirectionBins& bins,
                          DirectionBins& band) {
  const float reach = kPyramidReach * sigma;
  const AxisWeights x = gaussianWeights(centre.x, sigma, map.width, boundary, kPyramidReach);
  const AxisWeights y = gaussianWeights(centre.y, sigma, map.height, boundary, kPyramidReach);
  const auto insideCircle = [&](int j) {
    if (x.folded || y.folded) return x.range;
    const float dy = static_cast<float>(j) + 0.5f - centre.y;
    const Range r = texelsWithin(centre.x, std::sqrt(std::max(0.0f, reach * reach - dy * dy)), map.width, boundary);
    return Range{std::max(r.begin, x.range.begin), std::min(r.end, x.range.end)};
  };
  scatter(map, x, y, insideCircle, bins, band);
}

double shareInTile(float centre, float sigma, int size) {
  const auto sum = [](const AxisWeights& axis) {
    double total = 0;
    for (const float weight : axis.weights) total += double{weight};
    return total;
  };
  // A map that is long enough holds the whole footprint.
  const int reach = static_cast<int>(std::ceil(kTileReach * sigma)) + 1;
  const float nearest = std::floor(centre);
  const AxisWeights all =
      gaussianWeights(static_cast<float>(reach) + (centre - nearest), sigma, 2 * reach + 1, Boundary::clamp, kTileReach);
  return sum(gaussianWeights(centre, sigma, size, Boundary::clamp, kTileReach)) / sum(all);
}

void scatterFlatTile(const NormalMap& tile, Vec2 centre, float sigma, DirectionBins& bins, DirectionBins& band) {
  const AxisWeights x = gaussianWeights(centre.x, sigma, tile.width, Boundary::clamp, kTileReach);
  const AxisWeights y = gaussianWeights(centre.y, sigma, tile.height, Boundary::clamp, kTileReach);
  scatter(
      tile, x, y, [&](int) { return x.range; }, bins, band);
}

void scatterFlatMap(const NormalMap& map, DirectionBins& bins, DirectionBins& band) {
  const AxisWeights x = evenWeights(map.width), y = evenWeights(map.height);
  scatter(
      map, x, y, [&](int) { return x.range; }, bins, band);
}

}  // namespace glint::bake
