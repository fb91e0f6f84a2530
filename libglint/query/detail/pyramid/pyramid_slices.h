#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "glint/math/float4.h"
#include "glint/model/footprint.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/query/detail/common/footprint_weights.h"

namespace glint {

/// One NDF image of a pyramid and its share in an answer.
struct PyramidSlice {
  int level;
  std::uint32_t image;  ///< index in its level, row * columns + column
  float weight;
};

/// The images that answer a footprint: four neighbouring images in one level, or in each of two levels. Slice k is corner k % 4
/// (x in bit 0, y in bit 1) of level number k / 4. Weights are >= 0 and sum to 1.
struct PyramidSlices {
  static constexpr int kMost = 8;
  int levels[2];  ///< level of slices 0 to 3, and of slices 4 to 7
  std::uint32_t images[kMost];
  float weights[kMost];
  int count = 0;  ///< 4 or 8

  GLINT_HD int level(int k) const { return levels[k / 4]; }
  GLINT_HD PyramidSlice operator[](int k) const { return {level(k), images[k], weights[k]}; }
};

/// Variance (texels^2) of the isotropic Gaussian with the same mean square size as a footprint, at least that of
/// kMinSigmaTexels; a size that is not finite counts as the smallest. A footprint that is longer than the map along its longer
/// axis is first shortened to the map along that axis.
/// @param largest_u, largest_v  squares of the map's width and height
inline GLINT_HD float isotropicVariance(float largest_u, float largest_v, const Covariance& c) {
  constexpr float kLowest = kMinSigmaTexels * kMinSigmaTexels;
  constexpr float kQuarter = 0.25f;  // so that the sum of finite numbers is finite
  if (!std::isfinite(kQuarter * c.xx + kQuarter * c.xy + kQuarter * c.yy)) return kLowest;
  const float xx = std::min(c.xx, std::max(largest_u, c.yy)), yy = std::min(c.yy, std::max(largest_v, c.xx));
  return std::max(0.5f * xx + 0.5f * yy, kLowest);
}
inline GLINT_HD float isotropicVariance(const PyramidShape& shape, const Footprint& p) {
  const auto width = static_cast<float>(shape.width), height = static_cast<float>(shape.height);
  return isotropicVariance(width * width, height * height, p.covariance);
}

/// Deviation of that Gaussian, texels.
inline GLINT_HD float isotropicSigma(const PyramidShape& shape, const Footprint& p) {
  return std::sqrt(isotropicVariance(shape, p));
}

/// Deviation of the footprints of level 0, texels. Narrower footprints are answered from the texels where these are available.
inline GLINT_HD float finestSigma(const PyramidShape& shape) { return kFootprintPerStride * shape.levels[0].stride; }

/// Whether a footprint is narrower than the footprints of level 0.
inline GLINT_HD bool belowFinest(const PyramidShape& shape, const Footprint& p) {
  return isotropicVariance(shape, p) < finestSigma(shape) * finestSigma(shape);
}

/// log2 of a positive, finite number, to 2e-7. Uses plain arithmetic, so that batches and device code get the same bits and
/// choose the same levels.
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

/// A position between two levels of a pyramid.
struct LevelPlace {
  int first;  ///< the finer level
  float t;    ///< 0 to 1: share of the next level; 0 at the last level
};

/// The position of a footprint between the levels of a pyramid.
/// @param ratio  variance of the footprint over the variance of level 0, from 1 to 4^15; it is 4^l at level l
inline GLINT_HD LevelPlace levelPlace(float ratio) {
  constexpr std::uint32_t kOne = 0x3f800000u;
  constexpr int kPowerOf4 = 24;  // the exponent less its lowest bit
  std::uint32_t bits;
  std::memcpy(&bits, &ratio, sizeof bits);
  // The level is known without waiting for the logarithm.
  const std::uint32_t first = (bits - kOne) >> kPowerOf4;
  bits -= first << kPowerOf4;
  float rest;  // [1, 4)
  std::memcpy(&rest, &bits, sizeof rest);
  const float t = 0.5f * log2Of(rest);
  return {static_cast<int>(first), t < 1 ? t : 1.0f};
}

/// Chooses the images that answer a footprint. The constructor computes everything that depends on the shape alone, so that a
/// query has no division by it.
class SliceChooser {
 public:
  /// The centres of one level along x and y, in strides.
  struct LevelCentres {
    float extent[2];   ///< width and height of the map
    float last[2];     ///< last column and row
    float per_gap[2];  ///< 1 / (gap from the last centre across the border to the first); 1 if the stride divides the map
    std::int32_t columns, unused;
  };

  GLINT_HD explicit SliceChooser(const PyramidShape& shape) {
    const auto width = static_cast<float>(shape.width), height = static_cast<float>(shape.height);
    largest_u_ = width * width;
    largest_v_ = height * height;
    per_finest_variance_ = 1 / (finestSigma(shape) * finestSigma(shape));
    largest_ratio_ = 1;
    for (int l = 1; l < shape.footprintLevels(); ++l) largest_ratio_ *= 4;
    wraps_ = shape.boundary == Boundary::wrap;
    decay_ = shape.endsInMean() ? farDecay() : 0;
    for (int l = 0; l < shape.level_count; ++l) {
      const PyramidGrid& grid = shape.levels[l];
      const auto last_column = static_cast<float>(grid.columns - 1), last_row = static_cast<float>(grid.rows - 1);
      // A single column has itself as its neighbour, however little of its stride the map fills.
      const float across = grid.columns > 1 ? width / grid.stride : 1, up = grid.rows > 1 ? height / grid.stride : 1;
      levels_[l] = {{across, up}, {last_column, last_row}, {1 / (across - last_column), 1 / (up - last_row)}, grid.columns, 0};
    }
    levels_[shape.level_count] = levels_[shape.level_count - 1];  // with weight 0
  }

  /// Chooses images trilinearly: bilinear between centres, linear in log2 of the footprint's size between levels. Footprints
  /// below the finest level get the finest level. Footprints above the last level get it and the mean of the map (`levelOf`).
  GLINT_HD PyramidSlices choose(const Footprint& p) const {
    const LevelPlace level = levelOf(isotropicVariance(largest_u_, largest_v_, p.covariance));
    const LevelCentres &finer = levels_[level.first], &coarser = levels_[level.first + 1];
    const Neighbours at = neighbours(finer, coarser, p.centre);
    PyramidSlices out;
    out.levels[0] = level.first;
    out.levels[1] = level.first + 1;
    setCorners(interleaveLow(at.low, at.high), interleaveLow(at.rest, at.t), finer.columns, 1 - level.t, out.images,
               out.weights);
    setCorners(interleaveHigh(at.low, at.high), interleaveHigh(at.rest, at.t), coarser.columns, level.t, out.images + 4,
               out.weights + 4);
    out.count = level.t > 0 ? 8 : 4;
    return out;
  }

  // Parts of `choose` for batches, which choose images for several footprints at once in vectors.

  /// The level of a footprint of this variance, texels^2.
  ///
  /// Above the last level L of footprints the answer fades into the mean of the map. How fast follows from the unevenness that
  /// a footprint of deviation sigma still sees. On a map of length W that repeats, this is exp(-2 pi^2 sigma^2 / W^2), the
  /// share of the longest wave that a Gaussian keeps. On a map that ends, it falls with 1 / sigma^2 for large sigma
  /// (`farDecay`). The share of level L is the unevenness at sigma over the unevenness at sigma_L.
  GLINT_HD LevelPlace levelOf(float variance) const {
    const float ratio = variance * per_finest_variance_, coarse = ratio > 1 ? ratio : 1;
    LevelPlace level = levelPlace(coarse < largest_ratio_ ? coarse : largest_ratio_);
    constexpr float kLargest = 1e4f;  // its powers are finite
    const float beyond = coarse - largest_ratio_, exponent = decay_ * beyond, x = exponent < kLargest ? exponent : kLargest;
    // 1 / exp(x), or 1 / (1 + x), in plain arithmetic: batches and device code have the same bits.
    const float wave = wraps_ ? 1.0f : 0.0f;
    const float series = 1 + x * (1 + wave * (x / 2) * (1 + x / 3 * (1 + x / 4 * (1 + x / 5 * (1 + x / 6 * (1 + x / 7))))));
    level.t = beyond > 0 ? 1 - 1 / series : level.t;
    return level;
  }
  /// @param level  0 to level_count, which repeats the last level
  GLINT_HD const LevelCentres& centres(int level) const { return levels_[level]; }

 private:
  /// Neighbouring centres and the position t between them, 0 to 1; rest = 1 - t. Lanes: x and y of one level, x and y of
  /// another level.
  struct Neighbours {
    Float4 low, high, t, rest;
  };

  GLINT_HD Neighbours neighbours(const LevelCentres& a, const LevelCentres& b, Vec2 centre) const {
    const Float4 zero = Float4::zero(), one = Float4::all(1), below_one = Float4::all(kBelowOne);
    // Wraps into [0, 1); numbers that are not finite become 0.
    const Float4 uv = Float4::of(centre.x, centre.y, centre.x, centre.y);
    const Float4 wrapped = minOf((uv - floorOf(uv)).positive(), below_one);
    const Float4 extent = Float4::ofPairs(a.extent, b.extent), last = Float4::ofPairs(a.last, b.last);
    const Float4 at = wrapped * extent - Float4::all(0.5f);
    Float4 low, high, t;
    if (wraps_) {
      const Float4 unrolled = at + whereLess(at, zero, extent);
      low = minOf(floorOf(unrolled), last);
      high = whereLess(low, last, low + one);
      t = minOf((unrolled - low) * whereLess(low, last, one, Float4::ofPairs(a.per_gap, b.per_gap)), one);
    } else {
      const Float4 clamped = minOf(at.positive(), last);
      low = floorOf(clamped);
      high = minOf(low + one, last);
      t = clamped - low;
    }
    return {low, high, t, one - t};
  }

  /// Sets the images and weights of the four corners of one level.
  /// @param places, parts  centres and their shares; lanes: low and high along x, low and high along y
  static GLINT_HD void setCorners(Float4 places, Float4 parts, std::int32_t columns, float level_weight, std::uint32_t* images,
                                  float* weights) {
    storeIndices(places.lanes2233(), columns, places.lanes0101(), images);
    (Float4::all(level_weight) * parts.lanes0101() * parts.lanes2233()).store(weights);
  }

  /// Growth of x in levelOf for each unit of variance beyond the last level, in units of the variance of level 0.
  GLINT_HD float farDecay() const {
    constexpr float kTwoPiSquared = 19.739208802178716f;
    // A step in the middle of a map that ends keeps 1 / (sigma^2 / W^2 + 0.047) of its height, to a tenth from sigma = W / 5
    // on.
    constexpr float kClampedOffset = 0.047f;
    const float longest = std::max(largest_u_, largest_v_) * per_finest_variance_;
    return wraps_ ? kTwoPiSquared / longest : 1 / (largest_ratio_ + kClampedOffset * longest);
  }

  float largest_u_, largest_v_;  // texels^2
  float per_finest_variance_;
  float largest_ratio_;  // variance of the last level of footprints over the variance of level 0
  float decay_;
  bool wraps_;
  LevelCentres levels_[kMaxPyramidLevels + 1];
};

/// A box of pixels within one angular block: [x0, x1] x [y0, y1] in [0, 16]^2.
struct BlockBox {
  float x0, y0, x1, y1;
};

/// The pixel that contains a half vector: number of its block, and its column and row in the block. Valid for |h.x|, |h.y| <=
/// 1.
struct PixelPlace {
  int block, x, y;
};
inline GLINT_HD PixelPlace pixelPlace(const PyramidShape& shape, Vec2 h) {
  const float half = 0.5f * static_cast<float>(shape.resolution);
  const int x = std::min(static_cast<int>((h.x + 1) * half), shape.resolution - 1);
  const int y = std::min(static_cast<int>((h.y + 1) * half), shape.resolution - 1);
  // Shifts instead of divisions, since neither is negative.
  static_assert(kBlockSize == 16);
  return {(y >> 4) * (shape.resolution >> 4) + (x >> 4), x & 15, y & 15};
}

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

/// Area of a range of half vectors in pixels, including parts outside the square. A sum over pixels divided by it is the mean.
inline GLINT_HD float areaInPixels(const PyramidShape& shape, const Box2& range) {
  const float half = 0.5f * static_cast<float>(shape.resolution);
  return range.area() * half * half;
}

}  // namespace glint
