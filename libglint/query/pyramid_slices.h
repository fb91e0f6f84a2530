#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "glint/model/footprint.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/query/float4.h"
#include "glint/query/footprint_weights.h"

namespace glint {

/// One NDF image of a pyramid and its share in an answer.
struct PyramidSlice {
  int level;
  std::uint32_t image;  ///< index in its level, row * columns + column
  float weight;
};

/// The images that answer a footprint: four neighbours in one level or in each of two: corner k % 4 (x in bit 0, y in bit 1) of step
/// k / 4. Weights are >= 0 and sum to 1.
struct PyramidSlices {
  static constexpr int kMost = 8;
  PyramidSlice slices[kMost];
  int count = 0;
};

/// Variance (texels^2) of the isotropic Gaussian with the same mean square size as a footprint, which is first shortened to the
/// map along u and v and widened to kMinSigmaTexels; a size that is not finite counts as the smallest.
inline GLINT_HD float isotropicVariance(const PyramidShape& shape, const Footprint& p) {
  constexpr float kLowest = kMinSigmaTexels * kMinSigmaTexels;
  const auto width = static_cast<float>(shape.width), height = static_cast<float>(shape.height);
  if (!std::isfinite(p.covariance.xx + p.covariance.xy + p.covariance.yy)) return kLowest;
  const float variance = 0.5f * (std::min(p.covariance.xx, width * width) + std::min(p.covariance.yy, height * height));
  return std::max(variance, kLowest);
}

/// Its deviation, texels.
inline GLINT_HD float isotropicSigma(const PyramidShape& shape, const Footprint& p) {
  return std::sqrt(isotropicVariance(shape, p));
}

/// Footprint of level 0, texels. Narrower ones are answered from the texels themselves where these are at hand.
inline GLINT_HD float finestSigma(const PyramidShape& shape) { return kFootprintPerStride * shape.levels[0].stride; }

/// Whether a footprint is narrower than those of level 0.
inline GLINT_HD bool belowFinest(const PyramidShape& shape, const Footprint& p) {
  return isotropicVariance(shape, p) < finestSigma(shape) * finestSigma(shape);
}

/// Neighbouring centres, and the position between them. Lanes: along x and y of one level, along x and y of another.
struct CentreNeighbours {
  float low[4], high[4], t[4];
};

/// @param u, v  in [0, 1)
inline GLINT_HD CentreNeighbours centreNeighbours(const PyramidShape& shape, const PyramidGrid& a, const PyramidGrid& b,
                                                  float u, float v) {
  const auto width = static_cast<float>(shape.width), height = static_cast<float>(shape.height);
  const Float4 extent = Float4::of(width, height, width, height), x = Float4::of(u, v, u, v) * extent;
  const Float4 stride = Float4::of(a.stride, a.stride, b.stride, b.stride);
  const Float4 count = Float4::of(static_cast<float>(a.columns), static_cast<float>(a.rows), static_cast<float>(b.columns),
                                  static_cast<float>(b.rows));
  const Float4 zero = Float4::zero(), half = Float4::all(0.5f), one = Float4::all(1), last = count - one;
  Float4 low, high, t;
  if (shape.boundary == Boundary::clamp) {
    const Float4 at = (x / stride - half).positive(), clamped = whereLess(last, at, last, at);
    low = floorOf(clamped);
    high = whereLess(low, last, low + one, last);
    t = clamped - low;
  } else {
    const Float4 unrolled = x + whereLess(x, half * stride, extent, zero);
    const Float4 at = unrolled / stride - half, below = floorOf(at);
    // From the last centre round to the first; this gap is shorter when the stride does not divide the map.
    const Float4 gap = extent - last * stride, round = ((unrolled - (count - half) * stride) / gap).positive();
    low = whereLess(below, last, below, last);
    high = whereLess(below, last, below + one, zero);
    t = whereLess(below, last, at - below, whereLess(one, round, one, round));
  }
  CentreNeighbours out;
  low.store(out.low);
  high.store(out.high);
  t.store(out.t);
  return out;
}

/// log2 of a positive, finite number, to 2e-7. Plain arithmetic, so that batches and device code choose the same levels to the bit.
inline GLINT_HD float log2Of(float x) {
  constexpr std::uint32_t kSqrtHalf = 0x3f3504f3u;
  std::uint32_t bits;
  std::memcpy(&bits, &x, sizeof bits);
  const auto exponent = static_cast<std::int32_t>(bits - kSqrtHalf) >> 23;
  const std::uint32_t mantissa_bits = bits - (static_cast<std::uint32_t>(exponent) << 23);
  float mantissa;  // [sqrt(1/2), sqrt(2))
  std::memcpy(&mantissa, &mantissa_bits, sizeof mantissa);
  const float s = (mantissa - 1) / (mantissa + 1), z = s * s;  // log((1 + s) / (1 - s)) = 2 (s + s^3 / 3 + ...)
  constexpr float kTwoOverLn2 = 2.885390081777927f;
  const float series = 1 + z * (1.0f / 3 + z * (1.0f / 5 + z * (1.0f / 7 + z * (1.0f / 9))));
  return static_cast<float>(exponent) + kTwoOverLn2 * s * series;
}

/// Trilinear choice of images: bilinear between centres, linear in log2 of the footprint's size between levels. Footprints
/// below the finest or above the coarsest level get that level.
inline GLINT_HD PyramidSlices selectSlices(const PyramidShape& shape, const Footprint& p) {
  const float finest = finestSigma(shape);
  const float octave = 0.5f * log2Of(isotropicVariance(shape, p) / (finest * finest));
  const float level = std::clamp(octave, 0.0f, static_cast<float>(shape.level_count - 1));
  const int first = std::min(static_cast<int>(level), shape.level_count - 1);
  const float t = level - static_cast<float>(first);
  const float u = wrapUnit(p.centre.x), v = wrapUnit(p.centre.y);
  const PyramidGrid& finer = shape.levels[first];
  const PyramidGrid& coarser = shape.levels[std::min(first + 1, shape.level_count - 1)];
  const CentreNeighbours at = centreNeighbours(shape, finer, coarser, u, v);
  PyramidSlices out;
  const int steps = t > 0 ? 2 : 1;
  for (int step = 0; step < steps; ++step) {
    const float level_weight = step == 0 ? 1 - t : t, tx = at.t[2 * step], ty = at.t[2 * step + 1];
    const std::int32_t columns = step == 0 ? finer.columns : coarser.columns;
    for (int k = 0; k < 4; ++k) {
      const auto column = static_cast<std::int32_t>(k & 1 ? at.high[2 * step] : at.low[2 * step]);
      const auto row = static_cast<std::int32_t>(k & 2 ? at.high[2 * step + 1] : at.low[2 * step + 1]);
      out.slices[4 * step + k] = {first + step, static_cast<std::uint32_t>(row * columns + column),
                                  level_weight * (k & 1 ? tx : 1 - tx) * (k & 2 ? ty : 1 - ty)};
    }
  }
  out.count = 4 * steps;
  return out;
}

/// A box of pixels within one angular block: [x0, x1] x [y0, y1] in [0, 16]^2.
struct BlockBox {
  float x0, y0, x1, y1;
};

/// The pixel that holds a half vector: its block, and its place there. Valid for |h.x|, |h.y| <= 1.
struct PixelPlace {
  int block, x, y;
};
inline GLINT_HD PixelPlace pixelPlace(const PyramidShape& shape, Vec2 h) {
  const float half = 0.5f * static_cast<float>(shape.resolution);
  const int x = std::min(static_cast<int>((h.x + 1) * half), shape.resolution - 1);
  const int y = std::min(static_cast<int>((h.y + 1) * half), shape.resolution - 1);
  return {y / kBlockSize * shape.blocksPerAxis() + x / kBlockSize, x % kBlockSize, y % kBlockSize};
}

inline GLINT_HD bool insideSquare(Vec2 h) { return std::fabs(h.x) <= 1 && std::fabs(h.y) <= 1; }

/// Splits a range of half vectors at the borders of angular blocks: visitor(block, BlockBox). Nothing outside [-1, 1]^2.
template <class Visitor>
GLINT_HD void forEachBlock(const PyramidShape& shape, const Box2& range, Visitor&& visitor) {
  const float half = 0.5f * static_cast<float>(shape.resolution);
  const auto pixel = [&](float h) { return std::clamp((h + 1) * half, 0.0f, 2 * half); };
  const float x0 = pixel(range.low.x), x1 = pixel(range.high.x), y0 = pixel(range.low.y), y1 = pixel(range.high.y);
  if (!(x0 < x1 && y0 < y1)) return;
  const int blocks = shape.blocksPerAxis();
  const auto last = [&](float end) { return std::min(static_cast<int>(std::ceil(end / kBlockSize)), blocks); };
  for (int by = static_cast<int>(y0) / kBlockSize; by < last(y1); ++by) {
    for (int bx = static_cast<int>(x0) / kBlockSize; bx < last(x1); ++bx) {
      const auto ox = static_cast<float>(bx * kBlockSize), oy = static_cast<float>(by * kBlockSize);
      visitor(by * blocks + bx,
              BlockBox{std::max(x0 - ox, 0.0f), std::max(y0 - oy, 0.0f), std::min(x1 - ox, static_cast<float>(kBlockSize)),
                       std::min(y1 - oy, static_cast<float>(kBlockSize))});
    }
  }
}

/// Pixels of a range of half vectors: what a sum over pixels is divided by to become a mean. Parts outside the square count.
inline GLINT_HD float areaInPixels(const PyramidShape& shape, const Box2& range) {
  const float half = 0.5f * static_cast<float>(shape.resolution);
  return range.area() * half * half;
}

}  // namespace glint
