#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/model/ndf_pyramid.h"

namespace glint::bake {

/// A grid of bins over the square [-1, 1]^2 of directions, finer than the pixels of an NDF image by an integer factor.
///
/// A facet is added with quadratic B-spline weights, 3x3 bins: these keep its mass and mean, and spread it alike wherever it
/// lies, which the filter that makes pixels allows for (`PixelFilter`). Bins are kept all zero between images; only
/// those of touched tiles are ever cleared.
class DirectionBins {
 public:
  /// @param resolution  pixels along each axis of the image
  /// @param subdivision bins along each side of a pixel
  /// @param margin      bins kept around the square
  DirectionBins(int resolution, int subdivision, int margin);

  int resolution() const { return resolution_; }
  int subdivision() const { return subdivision_; }
  int margin() const { return margin_; }
  /// Bins from one row to the next.
  int pitch() const { return pitch_; }
  /// Bin (0, 0) of the square; rows and columns down to -margin may be read.
  float* origin() { return bins_.data() + static_cast<std::size_t>(margin_) * pitch_ + margin_; }
  /// Bins along each side of a tile: a quarter of an angular block.
  int tileSize() const { return kBlockSize / 4 * subdivision_; }
  int tilesPerAxis() const { return tiles_; }
  /// One flag for each tile: the centre of a splat fell into it.
  std::uint8_t* touched() { return touched_.data(); }
  /// Whether anything was added within `distance` bins of an angular block.
  bool touchedNear(int block_x, int block_y, int distance) const;

  /// Zeroes what was added, and the flags.
  void clear();
  /// Adds what was added to `other`, which has the same sizes.
  void addTo(DirectionBins& other) const;

 private:
  /// Calls visitor(first bin, count) for every row of bins that may hold something; each bin once.
  template <class Visitor>
  void forEachTouchedRow(Visitor&& visitor) const;

  int resolution_, subdivision_, tiles_, margin_, pitch_;
  std::vector<float> bins_;
  std::vector<std::uint8_t> touched_;
};

/// Filters are cut at this many deviations, 6e-5 of the mass on either axis, and normalised.
inline constexpr double kFilterReach = 4;

/// How facets are added to bins: with the weights of 3 or 4 bins along either axis.
enum class Spline : std::uint8_t { quadratic, cubic };

/// Blurs bins by the intrinsic roughness and averages over pixels, a separable filter: the one that comes closest to the blur
/// of the facets themselves, given that they were added with the weights of a B-spline.
class PixelFilter {
 public:
  /// @param sigma_pixels  deviation of a facet's lobe, pixels
  PixelFilter(float sigma_pixels, int subdivision, Spline spline);

  int subdivision() const { return subdivision_; }
  /// Bins on either side of a pixel that count.
  int radius() const { return radius_; }
  /// Bins around the square that filters may read.
  int margin() const;

  /// Adds one 16x16 block of pixels: mass per pixel (beside narrow lobes a little may be negative), from the bins whose pixel
  /// (0, 0) of the block starts at `bins`.
  void addBlock(const float* bins, int pitch, float* pixels) const;

 private:
  int subdivision_, radius_;
  std::vector<float>
      taps_;  // taps_[t]: share of the bin t - radius from the left side of the pixel, t < subdivision + 2 radius
};

/// Bins per pixel side that keep the error of binning small for a lobe of the given deviation.
int subdivisionFor(float sigma_pixels);

}  // namespace glint::bake
