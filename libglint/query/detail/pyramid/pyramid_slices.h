#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "glint/math/float4.h"
#include "glint/model/footprint.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/pyramid/box_edge.h"
#include "glint/query/detail/pyramid/footprint_kernel.h"
#include "glint/query/interpolation.h"

namespace glint {

/// One NDF image of a pyramid and its share in an answer.
struct PyramidSlice {
  int level;
  std::uint32_t image;  ///< index in its level, row * columns + column
  float weight;
};

/// The images that answer a footprint, in groups of four of one level. Slice k is in group k / 4. Weights are >= 0 and sum to 1.
/// With Interpolation::trilinear a group has the four corners around a place, x in bit 0, y in bit 1. Else it has four neighbours
/// of one row, and a level has up to four groups.
struct PyramidSlices {
  static constexpr int kMost = 32;
  int levels[kMost / 4];  ///< of each group
  std::uint32_t images[kMost];
  float weights[kMost];
  int count = 0;  ///< a multiple of 4

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

/// Chooses the images that answer a footprint. The constructor computes everything that depends on the shape alone, so that a
/// query has no division by it.
class SliceChooser {
 public:
  GLINT_HD explicit SliceChooser(const PyramidShape& shape, Interpolation interpolation = Interpolation::footprint)
      : interpolation_(interpolation), wraps_(shape.boundary == Boundary::wrap) {
    const auto width = static_cast<float>(shape.width), height = static_cast<float>(shape.height);
    largest_u_ = width * width;
    largest_v_ = height * height;
    const bool trilinear = interpolation == Interpolation::trilinear;
    const float finest = finestSigma(shape), first_ratio = trilinear ? 1 : fadeStart(shape.overlap);
    per_first_variance_ = 1 / (first_ratio * finest * finest);
    last_level_ = shape.footprintLevels() - 1;
    for (int l = 0; l <= last_level_; ++l) setLevel(shape, l, l);
    setLast(shape, trilinear);
    decay_ = shape.endsInMean() ? farDecay() : 0;
  }

  /// Chooses images for a footprint; see Interpolation. Footprints below the finest level get the finest level. Footprints above
  /// the last level get it and the mean of the map (`levelOf`).
  GLINT_HD PyramidSlices choose(const Footprint& p) const {
    const float variance = isotropicVariance(largest_u_, largest_v_, p.covariance);
    const LevelPlace level = levelOf(variance);
    PyramidSlices out;
    if (level.t < 1) addLevel(level.first, 1 - level.t, p.centre, variance, out);
    if (level.t > 0) addLevel(level.first + 1, level.t, p.centre, variance, out);
    return out;
  }

  /// Four neighbouring centres along each axis of a level, on a grid that goes on beyond the map: what answers a footprint on a
  /// plane of tiles.
  struct Centres {
    int column, row;         ///< of the first centres; below 0 before the map, as many as the level has or more beyond it
    float across[4], up[4];  ///< weights, >= 0, which sum to 1
  };
  /// Chooses the levels of a footprint of this variance, texels^2.
  GLINT_HD LevelPlace levelFor(float variance) const { return levelOf(variance); }
  /// Chooses the centres of a level of footprints. Centres must be spread evenly over the map.
  /// @param at        position on the map, [0, 1)^2
  /// @param variance  of the footprint, texels^2
  GLINT_HD Centres centresAround(int level, Vec2 at, float variance) const {
    const LevelCentres& centres = levels_[level];
    const float lacking = (variance < largest_variance_ ? variance : largest_variance_) - centres.variance;
    Centres found;
    const auto along = [&](int axis, float coordinate, int& first, float(&weights)[4]) {
      const float place = coordinate * (centres.last[axis] + 1) - 0.5f, low = std::floor(place);
      first = static_cast<int>(low) - 1;
      FootprintKernel::weights(lacking * centres.per_square_gap[axis], place - low).store(weights);
    };
    along(0, at.x, found.column, found.across);
    along(1, at.y, found.row, found.up);
    return found;
  }

  /// The position of a footprint between the levels.
  /// @param ratio  variance of the footprint over the largest variance that level 0 answers alone; 1 to 4^15
  static GLINT_HD LevelPlace levelPlace(float ratio, Interpolation interpolation) {
    constexpr std::uint32_t kOne = 0x3f800000u;
    constexpr int kPowerOf4 = 24;  // the exponent less its lowest bit
    std::uint32_t bits;
    std::memcpy(&bits, &ratio, sizeof bits);
    // The level is known without waiting for the logarithm.
    const std::uint32_t first = (bits - kOne) >> kPowerOf4;
    bits -= first << kPowerOf4;
    float rest;  // [1, 4)
    std::memcpy(&rest, &bits, sizeof rest);
    constexpr float kPerFade = 1 / (kFadeSizes * kFadeSizes - 1);
    const float t = interpolation == Interpolation::trilinear ? 0.5f * log2Of(rest) : kPerFade * (rest - 1);
    return {static_cast<int>(first), t < 1 ? t : 1.0f};
  }

 private:
  /// The centres of one level. Arrays have an element for x and one for y.
  struct LevelCentres {
    float extent[2];          ///< size of the map, in gaps between centres
    float last[2];            ///< last column and row
    float before[2];          ///< gaps from the border of the map to the first centre
    float step[2];            ///< columns or rows of the level from one centre to the next
    float per_border_gap[2];  ///< 1 / (gap from the last centre across the border to the first)
    float per_square_gap[2];  ///< 1 / (square of the gap between centres, texels^2)
    float variance;           ///< of the footprints, texels^2
    std::int32_t columns;     ///< of the level
    std::int32_t level;
  };

  /// Interpolation::footprint fades from one level to the next where the kernel of the finer level gets too short. The fade ends
  /// at this ratio of the variance that is asked for to the variance of the finer level, which depends on the gap between centres.
  static constexpr float kFadeEnd = 2.5f, kFadeEndPerSquareGap = 1.05f;  // gap in deviations of a footprint
  /// Ratio of the sizes at which the fade ends and begins: as short as changes of 1 % in size allow, which may change a density
  /// by 3 % (Interpolation.IsContinuousInSize measures it).
  static constexpr float kFadeSizes = 1.23f;

  /// Variance that the last level of footprints adds to that of its images, in squares of the gap: as large as the kernel has
  /// exactly, since what is left of the slowest wave of the map depends on it.
  static constexpr float kLastPerSquareGap = 0.7f;

  /// Grids of a dense last level: all its images, every second, and every third.
  static constexpr int kLastGrids = 3;
  static_assert(kLastCentres % 2 == 0 && kLastCentres % 3 == 0);
  /// Squares of its gap that the kernels of such a grid have where it fades in: kernels of less see more than they should.
  static constexpr float kNarrow = 0.2f, kEnough = 0.3f;

  /// Square of the gap between centres, in deviations of a footprint.
  static GLINT_HD float squareGap(float overlap) {
    const float gap = 1 / (kFootprintPerStride * overlap);
    return gap * gap;
  }
  /// The ratio of variances at which the fade begins.
  static GLINT_HD float fadeStart(float overlap) {
    return (kFadeEnd + kFadeEndPerSquareGap * squareGap(overlap)) / (kFadeSizes * kFadeSizes);
  }

  /// Sets the grids of the last level of footprints, and how far it answers alone.
  ///
  /// Where its images are nearer to each other than those of other levels (PyramidShape::gridOf), footprints up to twice its size are
  /// answered from them, and need kernels of all widths: those of every image, of every second, and of every third. The fade to
  /// this level ends about at its size: there the finer level lacks what this level has too much.
  GLINT_HD void setLast(const PyramidShape& shape, bool trilinear) {
    const PyramidGrid& grid = shape.levels[last_level_];
    const float longest = std::sqrt(std::max(largest_u_, largest_v_)), variance = levels_[last_level_].variance;
    const int count = largest_u_ < largest_v_ ? grid.rows : grid.columns;
    const bool dense = !trilinear && count > shape.centresAlong(static_cast<int>(longest), grid.stride);
    last_grids_ = dense ? kLastGrids : 1;
    for (int k = 1; k < last_grids_; ++k) levels_[last_level_ + k] = sparser(levels_[last_level_], k + 1);
    if (shape.endsInMean()) setLevel(shape, last_level_ + 1, last_level_ + last_grids_);
    const float gap = longest / static_cast<float>(count);
    last_square_gap_ = gap * gap;
    const float widest = dense ? kLastGrids * kLastGrids * last_square_gap_ : squareGap(shape.overlap) * variance;
    largest_variance_ = variance + (trilinear ? 0 : kLastPerSquareGap * widest);
    largest_ratio_ = largest_variance_ * per_first_variance_;
    last_variance_ = variance;
    last_end_ = variance + kEnough * last_square_gap_;
    last_begin_ = dense ? last_end_ / (kFadeSizes * kFadeSizes) : largest_variance_;
    per_last_fade_ = 1 / (last_end_ - last_begin_);
  }

  /// Every centre number k, from the first on, along each axis that has many.
  static GLINT_HD LevelCentres sparser(LevelCentres centres, int k) {
    const auto step = static_cast<float>(k);
    for (int axis = 0; axis < 2; ++axis) {
      if (centres.last[axis] + 1 < kLastCentres) continue;
      centres.extent[axis] /= step;
      centres.last[axis] = (centres.last[axis] + 1) / step - 1;
      centres.before[axis] /= step;
      centres.per_square_gap[axis] /= step * step;
      centres.step[axis] = step;
    }
    return centres;
  }

  /// The place of a footprint larger than last_begin_ among the grids of the last level.
  GLINT_HD LevelPlace placeInLast(float variance) const {
    if (variance < last_end_ && last_level_ > 0) return {last_level_ - 1, (variance - last_begin_) * per_last_fade_};
    const float lacking = variance - last_variance_;
    for (int k = 0; k + 1 < last_grids_; ++k) {
      const float gaps_of_next = lacking / (static_cast<float>((k + 2) * (k + 2)) * last_square_gap_);
      if (gaps_of_next < kNarrow) return {last_level_ + k, 0};
      if (gaps_of_next < kEnough) return {last_level_ + k, (gaps_of_next - kNarrow) / (kEnough - kNarrow)};
    }
    return {last_level_ + last_grids_ - 1, 0};
  }

  /// @param at  where in levels_
  GLINT_HD void setLevel(const PyramidShape& shape, int l, int at) {
    const PyramidGrid& grid = shape.levels[l];
    const Vec2 gap = shape.spacing(l);
    const float sigma = kFootprintPerStride * grid.stride;
    LevelCentres& to = levels_[at];
    to.level = l;
    setAxis(0, grid.columns, static_cast<float>(shape.width) / gap.x, gap.x, to);
    setAxis(1, grid.rows, static_cast<float>(shape.height) / gap.y, gap.y, to);
    to.variance = sigma * sigma;
    to.columns = grid.columns;
  }
  static GLINT_HD void setAxis(int axis, int count, float extent, float gap, LevelCentres& to) {
    to.extent[axis] = count > 1 ? extent : 1;  // a single centre is its own neighbour, however little of its gap the map fills
    to.last[axis] = static_cast<float>(count - 1);
    to.before[axis] = 0.5f;
    to.step[axis] = 1;
    to.per_border_gap[axis] = 1 / (to.extent[axis] - to.last[axis]);
    to.per_square_gap[axis] = 1 / (gap * gap);
  }

  /// The level of a footprint of this variance, texels^2.
  ///
  /// Above the last level L of footprints the answer fades into the mean of the map. How fast follows from the unevenness that
  /// a footprint of deviation sigma still sees. On a map of length W that repeats, this is exp(-2 pi^2 sigma^2 / W^2), the
  /// share of the longest wave that a Gaussian keeps. On a map that ends, it falls with 1 / sigma^2 for large sigma
  /// (`farDecay`). The share of level L is the unevenness at sigma over the unevenness at the largest size that L answers.
  GLINT_HD LevelPlace levelOf(float variance) const {
    const float ratio = variance * per_first_variance_, beyond = ratio - largest_ratio_;
    if (!(beyond > 0)) {
      if (variance > last_begin_) return placeInLast(variance);
      const LevelPlace between = levelPlace(ratio > 1 ? ratio : 1, interpolation_);
      return between.first < last_level_ ? between : LevelPlace{last_level_, 0};
    }
    constexpr float kLargest = 1e4f;  // its powers are finite
    const float exponent = decay_ * beyond, x = exponent < kLargest ? exponent : kLargest;
    // 1 / exp(x), or 1 / (1 + x), in plain arithmetic: device code has the same bits.
    const float wave = wraps_ ? 1.0f : 0.0f;
    const float series = 1 + x * (1 + wave * (x / 2) * (1 + x / 3 * (1 + x / 4 * (1 + x / 5 * (1 + x / 6 * (1 + x / 7))))));
    return {last_level_ + last_grids_ - 1, 1 - 1 / series};
  }

  GLINT_HD void addLevel(int level, float share, Vec2 centre, float variance, PyramidSlices& out) const {
    const LevelCentres& centres = levels_[level];
    const Position x = positionOn(centres, 0, centre.x), y = positionOn(centres, 1, centre.y);
    if (interpolation_ == Interpolation::trilinear) return addCorners(level, share, x, y, out);
    const float lacking = (variance < largest_variance_ ? variance : largest_variance_) - centres.variance;
    const Neighbours columns = neighbours(centres, 0, x, lacking), rows = neighbours(centres, 1, y, lacking);
    float row_places[4], row_weights[4];
    rows.places.store(row_places);
    (Float4::all(share) * rows.weights).store(row_weights);
    for (int k = 0; k < 4; ++k)
      if (row_weights[k] > 0)
        addGroup(level, Float4::all(row_places[k]), columns.places, Float4::all(row_weights[k]) * columns.weights, out);
  }

  /// A position on one axis of a level: t after centre number `low`, in gaps.
  struct Position {
    float low;  ///< 0 to the last; on a map that ends, -1 before the first centre
    float t;    ///< 0 to 1
  };
  GLINT_HD Position positionOn(const LevelCentres& centres, int axis, float coordinate) const {
    const float turn = coordinate - std::floor(coordinate);
    const float u = turn >= 0 ? turn < kBelowOne ? turn : float{kBelowOne} : 0.0f;  // numbers that are not finite become 0
    const float at = u * centres.extent[axis] - centres.before[axis], last = centres.last[axis];
    if (!wraps_) {
      const float low = std::floor(at);  // at most the last: the border is half a gap beyond it
      return {low < last ? low : last, at - low};
    }
    const float unrolled = at < 0 ? at + centres.extent[axis] : at, below = std::floor(unrolled);
    const float low = below < last ? below : last;
    const float t = (unrolled - low) * (low < last ? 1.0f : centres.per_border_gap[axis]);
    return {low, t < 1 ? t : 1.0f};
  }

  /// Four neighbouring centres along an axis.
  struct Neighbours {
    Float4 places, weights;
  };
  /// @param lacking  variance that the images lack, texels^2
  GLINT_HD Neighbours neighbours(const LevelCentres& centres, int axis, Position at, float lacking) const {
    const float last = centres.last[axis];
    if (last == 0) return {Float4::zero(), Float4::of(1, 0, 0, 0)};
    const Float4 zero = Float4::zero(), lasts = Float4::all(last), one = Float4::all(1);
    const Float4 weights = FootprintKernel::weights(lacking * centres.per_square_gap[axis], at.t);
    const Float4 places = Float4::all(at.low) + Float4::of(-1, 0, 1, 2);
    if (wraps_) {
      const Float4 count = lasts + one, not_before = places + whereLess(places, zero, count);
      return {not_before - whereLess(lasts, not_before, count), weights};
    }
    // Centres beyond the border of a map that ends count for nothing.
    const Float4 inside = whereLess(places, zero, zero, whereLess(lasts, places, zero, weights));
    return {minOf(places.positive(), lasts), inside * Float4::all(1 / inside.sum())};
  }

  GLINT_HD void addCorners(int level, float share, Position x, Position y, PyramidSlices& out) const {
    const auto pairOf = [&](Position at, int axis, float(&places)[2], float(&parts)[2]) {
      const float last = levels_[level].last[axis];
      places[0] = at.low > 0 ? at.low : 0;
      places[1] = at.low < last ? at.low + 1 : wraps_ ? 0.0f : last;
      parts[0] = 1 - at.t, parts[1] = at.t;
    };
    float columns[2], rows[2], across[2], up[2];
    pairOf(x, 0, columns, across);
    pairOf(y, 1, rows, up);
    addGroup(
        level, Float4::of(rows[0], rows[0], rows[1], rows[1]), Float4::of(columns[0], columns[1], columns[0], columns[1]),
        Float4::all(share) * Float4::of(across[0], across[1], across[0], across[1]) * Float4::of(up[0], up[0], up[1], up[1]),
        out);
  }

  /// @param at  which of levels_
  GLINT_HD void addGroup(int at, Float4 rows, Float4 columns, Float4 weights, PyramidSlices& out) const {
    const LevelCentres& centres = levels_[at];
    out.levels[out.count / 4] = centres.level;
    storeIndices(Float4::all(centres.step[1]) * rows, centres.columns, Float4::all(centres.step[0]) * columns,
                 out.images + out.count);
    weights.store(out.weights + out.count);
    out.count += 4;
  }

  /// Growth of x in levelOf for each unit of variance beyond the last level, in units of the variance where level 0 ends.
  GLINT_HD float farDecay() const {
    constexpr float kTwoPiSquared = 19.739208802178716f;
    // A step in the middle of a map that ends keeps 1 / (sigma^2 / W^2 + 0.047) of its height, to a tenth from sigma = W / 5
    // on.
    constexpr float kClampedOffset = 0.047f;
    const float longest = std::max(largest_u_, largest_v_) * per_first_variance_;
    return wraps_ ? kTwoPiSquared / longest : 1 / (largest_ratio_ + kClampedOffset * longest);
  }

  Interpolation interpolation_;
  bool wraps_;
  float largest_u_, largest_v_;  // texels^2
  float per_first_variance_;     // 1 / (largest variance that level 0 answers alone)
  float largest_variance_;       // that the last level of footprints answers alone, texels^2
  float largest_ratio_;          // largest_variance_ * per_first_variance_
  float last_variance_;          // of the last level of footprints, texels^2
  float last_begin_, last_end_;  // variances between which that level fades in; from the first on placeInLast chooses, texels^2
  float last_square_gap_;        // of the last level along the longer side of the map, texels^2
  float per_last_fade_;          // 1 / (last_end_ - last_begin_)
  float decay_;
  int last_level_;                                       // of footprints
  int last_grids_;                                       // of that level
  LevelCentres levels_[kMaxPyramidLevels + kLastGrids];  // levels of footprints, sparser grids of the last one, and the mean
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
/// The position of a half vector inside its pixel, in [0, 1]^2. Valid for |h.x|, |h.y| <= 1.
inline GLINT_HD Vec2 positionInPixel(const PyramidShape& shape, Vec2 h) {
  const float half = 0.5f * static_cast<float>(shape.resolution);
  const auto position = [&](float coordinate) {
    const float x = (coordinate + 1) * half;
    return x - static_cast<float>(std::min(static_cast<int>(x), shape.resolution - 1));
  };
  return {position(h.x), position(h.y)};
}

/// Splits a range of half vectors at the borders of angular blocks: visitor(block, BlockBox). Nothing outside [-1, 1]^2. Blocks
/// beside the range are visited where an edge depends on their pixels.
template <class Visitor>
GLINT_HD void forEachBlock(const PyramidShape& shape, const Box2& range, Pixels pixels, Visitor&& visitor) {
  const float half = 0.5f * static_cast<float>(shape.resolution);
  const auto pixel = [&](float h) { return std::clamp((h + 1) * half, 0.0f, 2 * half); };
  const float x0 = pixel(range.low.x), x1 = pixel(range.high.x), y0 = pixel(range.low.y), y1 = pixel(range.high.y);
  if (!(x0 < x1 && y0 < y1)) return;
  const int blocks = shape.blocksPerAxis(), reach = pixels == Pixels::smooth ? 1 : 0;
  // An edge that cuts a pixel depends on this pixel and on `reach` pixels on either side.
  const auto first = [&](float begin, float end) {
    const auto lowest = [&](float edge) {
      const float cut = std::floor(edge);
      return edge > cut ? static_cast<int>(cut) - reach : static_cast<int>(cut);
    };
    return std::max(std::min(lowest(begin), lowest(end)), 0) / kBlockSize;
  };
  const auto last = [&](float begin, float end) {
    const auto highest = [&](float edge) {
      const float cut = std::ceil(edge);
      return static_cast<int>(cut) - 1 + (edge < cut ? reach : 0);
    };
    return std::min(std::max(highest(begin), highest(end)) / kBlockSize, blocks - 1);
  };
  for (int by = first(y0, y1); by <= last(y0, y1); ++by) {
    const auto oy = static_cast<float>(by * kBlockSize);
    for (int bx = first(x0, x1); bx <= last(x0, x1); ++bx) {
      const auto ox = static_cast<float>(bx * kBlockSize);
      visitor(by * blocks + bx,
              BlockBox{BoxEdge(x0 - ox, pixels), BoxEdge(x1 - ox, pixels), BoxEdge(y0 - oy, pixels), BoxEdge(y1 - oy, pixels)});
    }
  }
}

/// Area of a range of half vectors in pixels, including parts outside the square. A sum over pixels divided by it is the mean.
inline GLINT_HD float areaInPixels(const PyramidShape& shape, const Box2& range) {
  const float half = 0.5f * static_cast<float>(shape.resolution);
  return range.area() * half * half;
}

}  // namespace glint
