#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace glint::bake {

/// A grid of bins over the square [-1, 1]^2 of directions, finer than the pixels of an NDF image by an integer factor.
///
/// A facet is added with quadratic B-spline weights, 3x3 bins: these keep its mass and mean, and spread it by exactly a quarter of
/// a squared bin wherever it lies, which the filter that makes pixels takes off again (`PixelFilter`). Bins are kept all zero
/// between images; only those of touched blocks are ever read or cleared.
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
  int blocksPerAxis() const { return blocks_; }
  /// One flag for each angular block of the image: the centre of a splat fell into it.
  std::vector<std::uint8_t>& touched() { return touched_; }
  const std::vector<std::uint8_t>& touched() const { return touched_; }
  /// Whether a block within `distance` blocks was touched.
  bool touchedNear(int block, int distance) const;

  /// Zeroes what was added, and the flags.
  void clear();
  /// Adds what was added to `other`, which has the same sizes.
  void addTo(DirectionBins& other) const;

 private:
  struct Region {
    int x0, x1, y0, y1;
  };
  /// Bins of a block; blocks at the border also own the margin beside them.
  Region region(int block) const;

  int resolution_, blocks_, subdivision_, margin_, pitch_;
  std::vector<float> bins_;
  std::vector<std::uint8_t> touched_;
};

/// Blurs bins by the intrinsic roughness and averages over pixels, a separable filter.
class PixelFilter {
 public:
  /// @param sigma_pixels  deviation of a facet's lobe, pixels
  /// @param spread        variance that binning added, in squared bins (1/4 for quadratic splats)
  PixelFilter(float sigma_pixels, int subdivision, float spread);

  /// Bins on either side of a pixel that count.
  int radius() const { return radius_; }

  /// One 16x16 block of pixels: mass per pixel, from the bins whose pixel (0, 0) of the block starts at `bins`.
  void filterBlock(const float* bins, int pitch, float* pixels) const;

 private:
  int subdivision_, radius_;
  std::vector<float> taps_;
};

/// Bins per pixel side that keep the error of binning small for a lobe of the given deviation.
int subdivisionFor(float sigma_pixels);

}  // namespace glint::bake
