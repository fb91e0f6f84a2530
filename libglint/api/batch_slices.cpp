#include "glint/api/batch_slices.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "glint/api/multiversion.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"

namespace glint::api {
namespace {

/// Queries as a structure of arrays. Loops over lanes have no branches, so that compilers turn them into vectors.
struct Lanes {
  alignas(64) float u[kChunk], v[kChunk], xx[kChunk], xy[kChunk], yy[kChunk], hx[kChunk], hy[kChunk];
  alignas(64) float t[kChunk];
};

void load(const FootprintArrays& footprints, const HalfVectorArrays& halves, std::size_t first, int count, Lanes& lanes) {
  for (int k = 0; k < kChunk; ++k) {
    const std::size_t at = first + static_cast<std::size_t>(std::min(k, count - 1));
    const Footprint p = footprints[at];
    const Vec2 h = halves[at];
    lanes.u[k] = p.centre.x;
    lanes.v[k] = p.centre.y;
    lanes.xx[k] = p.covariance.xx;
    lanes.xy[k] = p.covariance.xy;
    lanes.yy[k] = p.covariance.yy;
    lanes.hx[k] = h.x;
    lanes.hy[k] = h.y;
  }
}

/// Computes isotropicVariance, belowFinest and the levels of SliceChooser for every lane.
GLINT_API_MULTIVERSION void chooseLevels(const PyramidShape& shape, const SliceChooser& chooser, Lanes& lanes,
                                         SliceChunk& chunk) {
  constexpr float kLowest = kMinSigmaTexels * kMinSigmaTexels;
  const auto width = static_cast<float>(shape.width), height = static_cast<float>(shape.height);
  const float finest = finestSigma(shape), finest_variance = finest * finest;
  for (int k = 0; k < kChunk; ++k) {
    const float sum = 0.25f * lanes.xx[k] + 0.25f * lanes.xy[k] + 0.25f * lanes.yy[k];
    const float xx = std::min(lanes.xx[k], std::max(width * width, lanes.yy[k]));
    const float yy = std::min(lanes.yy[k], std::max(height * height, lanes.xx[k]));
    const float widened = std::max(0.5f * xx + 0.5f * yy, kLowest);
    const float variance = std::fabs(sum) <= std::numeric_limits<float>::max() ? widened : kLowest;
    const LevelPlace level = chooser.levelOf(variance);
    chunk.below[k] = variance < finest_variance ? 1 : 0;
    chunk.levels[0][k] = level.first;
    chunk.levels[1][k] = std::min(level.first + 1, shape.level_count - 1);  // with weight 0 at the last
    lanes.t[k] = level.t;
  }
}

/// The level of every lane along one axis. It is looked up before the arithmetic: compilers make no vectors of a loop that does
/// both.
struct AxisLevels {
  alignas(64) float extent[kChunk], last[kChunk], per_gap[kChunk];
};

/// Neighbouring centres along one axis. Floats hold them exactly: counts and indices are far below 2^24.
struct Neighbours {
  alignas(64) float low[kChunk], high[kChunk], t[kChunk];
};

/// Finds the neighbours that SliceChooser finds, along one axis.
template <bool kWrap>
inline void findNeighbours(const float* __restrict coordinates, const AxisLevels& axis, Neighbours& __restrict out) {
  for (int k = 0; k < kChunk; ++k) {
    const float wrapped = coordinates[k] - std::floor(coordinates[k]);
    const float u = wrapped >= 0 ? std::min(wrapped, kBelowOne) : 0.0f;
    const float last = axis.last[k], at = u * axis.extent[k] - 0.5f;
    if constexpr (kWrap) {
      const float unrolled = at + (at < 0 ? axis.extent[k] : 0.0f);
      const float below = std::floor(unrolled), low = below < last ? below : last;
      const bool inner = low < last;
      const float t = (unrolled - low) * (inner ? 1.0f : axis.per_gap[k]);
      out.low[k] = low;
      out.high[k] = inner ? low + 1 : 0.0f;
      out.t[k] = t < 1 ? t : 1.0f;
    } else {
      const float t = std::min(std::max(at, 0.0f), last);
      const float low = std::floor(t);
      out.low[k] = low;
      out.high[k] = std::min(low + 1, last);
      out.t[k] = t - low;
    }
  }
}

/// Slices of one corner of one level.
inline void setCorner(int corner, const float* __restrict level_weights, const Neighbours& x, const Neighbours& y,
                      const std::int32_t* columns, float* __restrict weights, std::uint32_t* __restrict images) {
  const float* xs = corner & 1 ? x.high : x.low;
  const float* ys = corner & 2 ? y.high : y.low;
  for (int k = 0; k < kChunk; ++k) {
    const float wx = corner & 1 ? x.t[k] : 1 - x.t[k], wy = corner & 2 ? y.t[k] : 1 - y.t[k];
    weights[k] = level_weights[k] * wx * wy;
    images[k] = static_cast<std::uint32_t>(static_cast<std::int32_t>(ys[k]) * columns[k] + static_cast<std::int32_t>(xs[k]));
  }
}

template <bool kWrap>
inline void chooseImages(const SliceChooser& chooser, const Lanes& lanes, SliceChunk& chunk) {
  for (int step = 0; step < 2; ++step) {
    AxisLevels along_x, along_y;
    alignas(64) std::int32_t columns[kChunk];
    alignas(64) float level_weights[kChunk];
    for (int k = 0; k < kChunk; ++k) {
      const SliceChooser::LevelCentres& centres = chooser.centres(chunk.levels[step][k]);
      along_x.extent[k] = centres.extent[0];
      along_y.extent[k] = centres.extent[1];
      along_x.last[k] = centres.last[0];
      along_y.last[k] = centres.last[1];
      along_x.per_gap[k] = centres.per_gap[0];
      along_y.per_gap[k] = centres.per_gap[1];
      columns[k] = centres.columns;
    }
    for (int k = 0; k < kChunk; ++k) level_weights[k] = step == 0 ? 1 - lanes.t[k] : lanes.t[k];
    Neighbours x, y;
    findNeighbours<kWrap>(lanes.u, along_x, x);
    findNeighbours<kWrap>(lanes.v, along_y, y);
    for (int corner = 0; corner < 4; ++corner)
      setCorner(corner, level_weights, x, y, columns, chunk.weights[4 * step + corner], chunk.images[4 * step + corner]);
  }
}

GLINT_API_MULTIVERSION void chooseWrapping(const SliceChooser& chooser, const Lanes& lanes, SliceChunk& chunk) {
  chooseImages<true>(chooser, lanes, chunk);
}
GLINT_API_MULTIVERSION void chooseClamped(const SliceChooser& chooser, const Lanes& lanes, SliceChunk& chunk) {
  chooseImages<false>(chooser, lanes, chunk);
}

/// Computes insideSquare and pixelPlace for every lane. A lane outside the square gets the pixel in the middle, which can be
/// read.
GLINT_API_MULTIVERSION void choosePixels(const PyramidShape& shape, const Lanes& lanes, SliceChunk& chunk) {
  const float half = 0.5f * static_cast<float>(shape.resolution);
  const int last = shape.resolution - 1, blocks = shape.blocksPerAxis();
  for (int k = 0; k < kChunk; ++k) {
    const bool inside = std::fabs(lanes.hx[k]) <= 1 && std::fabs(lanes.hy[k]) <= 1;
    const float hx = inside ? lanes.hx[k] : 0.0f, hy = inside ? lanes.hy[k] : 0.0f;
    const int x = std::min(static_cast<int>((hx + 1) * half), last), y = std::min(static_cast<int>((hy + 1) * half), last);
    static_assert(kBlockSize == 16);
    chunk.inside[k] = inside ? 1 : 0;
    chunk.blocks[k] = (y >> 4) * blocks + (x >> 4);
    chunk.pixels[k] = (y & 15) * kBlockSize + (x & 15);
  }
}

}  // namespace

void selectChunk(const PyramidShape& shape, const SliceChooser& chooser, const FootprintArrays& footprints,
                 const HalfVectorArrays& halves, std::size_t first, int count, SliceChunk& chunk) {
  Lanes lanes;
  load(footprints, halves, first, count, lanes);
  chooseLevels(shape, chooser, lanes, chunk);
  if (shape.boundary == Boundary::wrap)
    chooseWrapping(chooser, lanes, chunk);
  else
    chooseClamped(chooser, lanes, chunk);
  choosePixels(shape, lanes, chunk);
}

}  // namespace glint::api
