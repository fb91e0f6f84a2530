#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/model/ndf_pyramid.h"

namespace glint::bake {

/// A grid of bins over the square [-1, 1]^2 of directions, finer than the pixels of an NDF image by an integer factor.
///
/// A facet is added to 3x3 bins with quadratic B-spline weights. These keep its mass and mean, and spread it by the same amount
/// wherever it lies, so that the filter that makes pixels can undo the spread (`PixelFilter`). All bins are zero between
/// images; clear() visits the bins of touched tiles only.
class DirectionBins {
 public:
  /// @param resolution  pixels along each axis of the image
  /// @param subdivision bins along each side of a pixel
  /// @param margin      bins kept around the square
  DirectionBins(int resolution, int subdivision, int margin);

  int resolution() const { return resolution_; }
  int subdivision() const { return subdivision_; }
  int margin() const { return margin_; }
  /// Floats from one row of bins to the next.
  int pitch() const { return pitch_; }
  /// Bin (0, 0) of the square; rows and columns down to -margin may be read.
  float* origin() { return bins_.data() + static_cast<std::size_t>(margin_) * pitch_ + margin_; }
  /// Bins along each side of a tile: a quarter of an angular block.
  int tileSize() const { return kBlockSize / 4 * subdivision_; }
  int tilesPerAxis() const { return tiles_; }
  /// One flag for each tile: whether the centre of a splat lies in it.
  std::uint8_t* touched() { return touched_.data(); }
  /// Whether a splat was added within `distance` bins of an angular block.
  bool touchedNear(int block_x, int block_y, int distance) const;

  /// Clears the bins that splats were added to, and the flags.
  void clear();
  /// Adds all bins and flags to `other`, which has the same sizes.
  void addTo(DirectionBins& other) const;

 private:
  /// Calls visitor(first bin, count) for every row of bins in and around touched tiles; each bin once.
  template <class Visitor>
  void forEachTouchedRow(Visitor&& visitor) const;

  int resolution_, subdivision_, tiles_, margin_, pitch_;
  std::vector<float> bins_;
  std::vector<std::uint8_t> touched_;
};

/// Filters end at this many deviations, beyond which 6e-5 of the mass lie on either axis, and are normalised.
inline constexpr double kFilterReach = 4;

/// The B-spline that spreads facets over bins: over 3 (quadratic) or 4 (cubic) bins along either axis.
enum class Spline : std::uint8_t { quadratic, cubic };

/// Blurs bins by the intrinsic roughness and averages the blur over pixels, with a separable filter. A B-spline has spread the
/// facets over bins before: of all filters, this one comes closest to blurring the facets themselves.
class PixelFilter {
 public:
  /// @param sigma_pixels  deviation of a facet's lobe, pixels
  PixelFilter(float sigma_pixels, int subdivision, Spline spline);

  int subdivision() const { return subdivision_; }
  /// Number of bins on either side of a pixel that the filter reaches.
  int radius() const { return radius_; }
  /// Number of bins around the square that the filter may read.
  int margin() const;

  /// Filters the bins of one block of 16x16 pixels, and adds the mass of each pixel. Beside narrow lobes, masses can be a
  /// little below 0.
  /// @param bins  lower left bin of the block's pixel (0, 0)
  void addBlock(const float* bins, int pitch, float* pixels) const;

 private:
  int subdivision_, radius_;
  /// taps_[t], t < subdivision + 2 radius: share of the bin that lies t - radius bins from the left side of the pixel.
  std::vector<float> taps_;
};

/// Number of bins along a side of a pixel that keeps the error of binning small for a lobe of this deviation.
int subdivisionFor(float sigma_pixels);

}  // namespace glint::bake
