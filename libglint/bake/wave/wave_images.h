#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "glint/bake/wave/wave_pyramid.h"

namespace glint::bake {

/// A dense image: density of every pixel, [y][channel][x], of a square around psi = 0.
class DenseImage {
 public:
  DenseImage(int resolution, int half_pixels, int channels)
      : resolution_(resolution),
        size_(2 * half_pixels),
        channels_(channels),
        values_(static_cast<std::size_t>(size_) * size_ * channels) {}

  int size() const { return size_; }
  int channels() const { return channels_; }
  float* row(int y, int channel) { return values_.data() + (static_cast<std::size_t>(y) * channels_ + channel) * size_; }
  const float* row(int y, int channel) const {
    return values_.data() + (static_cast<std::size_t>(y) * channels_ + channel) * size_;
  }

  /// Adds weight times an image of one wavelength to all channels.
  /// @param image    [pixels][pixels] around psi = 0, pixels <= size()
  /// @param weights  [channels]
  void add(const float* image, int pixels, const float* weights);
  /// Adds weight times the channels of a stored block.
  /// @param values  [16][channels][16]
  void addBlock(int block, const float* values, float weight);

  /// Copies a block. @param out [16][channels][16], 0 outside the square
  void block(int number, float* out) const;
  /// Integral over psi of each channel.
  std::vector<double> integrals() const;
  /// Whether the square is all of [-1, 1]^2.
  bool isWhole() const { return size_ == resolution_; }
  int resolution() const { return resolution_; }

 private:
  /// A block and the part of it inside the square, in pixels of the square.
  struct Overlap {
    int left, bottom;
    int first_column, end_column, first_row, end_row;
  };
  Overlap overlapOf(int block) const;

  int resolution_, size_, channels_;
  std::vector<float> values_;
};

/// The stored form of one image.
struct StoredWaveImage {
  std::vector<std::uint64_t> mask;
  std::vector<float> block_means;
  std::vector<std::uint16_t> half_grey, half_channels;
  std::vector<float> float_grey, float_channels;
};

/// Packs an image: keeps the blocks that reach kWaveFloor, and raises each channel to the light of the whole image, which is 1 unless
/// the image reaches the border of [-1, 1]^2.
StoredWaveImage storeImage(const DenseImage& image, BlockPrecision precision, float value_scale);

/// Appends images to a level, in order.
/// @param level  of pyramid.grey.levels, pyramid.half_pixels and pyramid.float_pixels
void appendImages(std::vector<StoredWaveImage>& images, WavePyramidData& pyramid, std::size_t level);

/// Closes the running counts of a level.
void finishLevel(WavePyramidData& pyramid, std::size_t level);

/// Makes level `level` of footprints from the level below it: Gaussians of the variance that is missing.
void buildCoarserLevel(WavePyramidData& pyramid, int level, int half_pixels, ProgressCounter& counter);

/// Footprints end at this many deviations.
inline constexpr double kFootprintReach = 4;

/// Centres of the footprints of a level along u (axis 0) or v, texels.
std::vector<double> centresAlong(const PyramidShape& shape, int level, int axis);

/// Shares of sources in targets along a periodic axis: Gaussians of the distance times the stretch of the axis that a source stands
/// for. They sum to 1 for each target.
/// @param targets, sources  positions, rising, in [0, length)
/// @return [targets][sources]
std::vector<std::vector<float>> gaussianShares(std::span<const double> targets, std::span<const double> sources, double length,
                                               double sigma);

}  // namespace glint::bake
