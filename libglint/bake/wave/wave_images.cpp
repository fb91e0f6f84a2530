#include "glint/bake/wave/wave_images.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "glint/bake/common/half_array.h"
#include "glint/bake/common/simd.h"
#include "glint/math/half.h"

namespace glint::bake {
namespace {

GLINT_MULTIVERSION void addScaled(const float* in, float scale, int count, float* out) {
  for (int k = 0; k < count; ++k) out[k] += scale * in[k];
}

template <class T>
void append(std::vector<T>& to, const std::vector<T>& from) {
  to.insert(to.end(), from.begin(), from.end());
}

/// Stores the pixels of a block and their means over the channels.
class BlockStore {
 public:
  BlockStore(BlockPrecision precision, float value_scale, const std::vector<float>& scales, StoredWaveImage& image)
      : halves_(precision == BlockPrecision::f16), value_scale_(value_scale), scales_(scales), image_(image) {}

  /// @param block  [16][channels][16]: densities
  void add(const std::vector<float>& block) {
    const std::size_t channels = scales_.size();
    double total = 0;
    for (std::size_t y = 0; y < kBlockSize; ++y) {
      float sums[kBlockSize] = {};
      for (std::size_t c = 0; c < channels; ++c)
        for (std::size_t x = 0; x < kBlockSize; ++x) {
          const float stored = block[(y * channels + c) * kBlockSize + x] * scales_[c] / value_scale_;
          put(stored, image_.half_channels, image_.float_channels);
          sums[x] += stored;
        }
      for (const float sum : sums)
        total += double{put(sum / static_cast<float>(channels), image_.half_grey, image_.float_grey)};
    }
    image_.block_means.push_back(static_cast<float>(value_scale_ * total / kBlockPixels));
  }

 private:
  /// @return the value that was stored
  float put(float value, std::vector<std::uint16_t>& halves, std::vector<float>& floats) const {
    if (!halves_) return floats.emplace_back(value);
    return halfToFloat(halves.emplace_back(floatToHalf(value)));
  }

  bool halves_;
  float value_scale_;
  const std::vector<float>& scales_;
  StoredWaveImage& image_;
};

/// Adds the stored blocks of an image.
void addStored(const WavePyramidData& pyramid, std::size_t level, std::size_t image, float weight, DenseImage& out) {
  const NdfPyramidData::Level& from = pyramid.grey.levels[level];
  const auto words = static_cast<std::size_t>(pyramid.grey.shape.maskWords());
  const std::size_t values = kBlockPixels * static_cast<std::size_t>(out.channels());
  std::vector<float> decoded(values);
  std::size_t block = from.mask_ranks[image * words];
  for (std::size_t w = 0; w < words; ++w)
    for (std::uint64_t bits = from.masks[image * words + w]; bits != 0; bits &= bits - 1, ++block) {
      const float* pixels = decoded.data();
      if (pyramid.grey.precision == BlockPrecision::f16)
        halvesToFloats(pyramid.half_pixels[level].data() + block * values, values, decoded.data());
      else
        pixels = pyramid.float_pixels[level].data() + block * values;
      out.addBlock(static_cast<int>(64 * w) + std::countr_zero(bits), pixels, weight * pyramid.grey.value_scale);
    }
}

}  // namespace

void DenseImage::add(const float* image, int pixels, const float* weights) {
  const int margin = (size_ - pixels) / 2;
  for (int y = 0; y < pixels; ++y)
    for (int c = 0; c < channels_; ++c)
      if (weights[c] != 0)
        addScaled(image + static_cast<std::ptrdiff_t>(y) * pixels, weights[c], pixels, row(y + margin, c) + margin);
}

DenseImage::Overlap DenseImage::overlapOf(int block) const {
  const int blocks = resolution_ / kBlockSize, margin = (resolution_ - size_) / 2;
  const int left = block % blocks * kBlockSize - margin, bottom = block / blocks * kBlockSize - margin;
  return {left,
          bottom,
          std::max(left, 0),
          std::min(left + kBlockSize, size_),
          std::max(bottom, 0),
          std::min(bottom + kBlockSize, size_)};
}

void DenseImage::addBlock(int block, const float* values, float weight) {
  const Overlap at = overlapOf(block);
  if (at.first_column >= at.end_column) return;
  for (int y = at.first_row; y < at.end_row; ++y)
    for (int c = 0; c < channels_; ++c)
      addScaled(values + ((y - at.bottom) * channels_ + c) * kBlockSize + at.first_column - at.left, weight,
                at.end_column - at.first_column, row(y, c) + at.first_column);
}

void DenseImage::block(int number, float* out) const {
  const Overlap at = overlapOf(number);
  std::fill_n(out, kBlockPixels * channels_, 0.0f);
  if (at.first_column >= at.end_column) return;
  for (int y = at.first_row; y < at.end_row; ++y)
    for (int c = 0; c < channels_; ++c)
      std::copy_n(row(y, c) + at.first_column, at.end_column - at.first_column,
                  out + ((y - at.bottom) * channels_ + c) * kBlockSize + at.first_column - at.left);
}

std::vector<double> DenseImage::integrals() const {
  std::vector<double> sums(static_cast<std::size_t>(channels_), 0.0);
  for (int y = 0; y < size_; ++y)
    for (int c = 0; c < channels_; ++c)
      for (int x = 0; x < size_; ++x) sums[static_cast<std::size_t>(c)] += row(y, c)[x];
  for (double& sum : sums) sum *= 4.0 / (static_cast<double>(resolution_) * resolution_);
  return sums;
}

StoredWaveImage storeImage(const DenseImage& image, BlockPrecision precision, float value_scale) {
  const int blocks = image.resolution() / kBlockSize, channels = image.channels();
  const double pixel_area = 4.0 / (static_cast<double>(image.resolution()) * image.resolution());
  StoredWaveImage stored;
  stored.mask.assign(static_cast<std::size_t>((blocks * blocks + 63) / 64), 0);
  std::vector<std::vector<float>> kept;
  std::vector<double> light(static_cast<std::size_t>(channels), 0.0);
  std::vector<float> block(static_cast<std::size_t>(kBlockPixels) * channels);
  for (int b = 0; b < blocks * blocks; ++b) {
    image.block(b, block.data());
    if (*std::max_element(block.begin(), block.end()) < kWaveFloor) continue;
    stored.mask[static_cast<std::size_t>(b) / 64] |= std::uint64_t{1} << (b % 64);
    for (std::size_t k = 0; k < block.size(); ++k)
      light[k / kBlockSize % static_cast<std::size_t>(channels)] += pixel_area * block[k];
    kept.push_back(block);
  }
  const std::vector<double> wanted = image.integrals();
  std::vector<float> scales;
  for (std::size_t c = 0; c < light.size(); ++c)
    scales.push_back(light[c] > 0 ? static_cast<float>((image.isWhole() ? wanted[c] : 1.0) / light[c]) : 0.0f);
  BlockStore store(precision, value_scale, scales, stored);
  for (const std::vector<float>& values : kept) store.add(values);
  return stored;
}

void appendImages(std::vector<StoredWaveImage>& images, WavePyramidData& pyramid, std::size_t l) {
  NdfPyramidData::Level& level = pyramid.grey.levels[l];
  for (StoredWaveImage& image : images) {
    std::size_t blocks = level.block_means.size();
    for (const std::uint64_t word : image.mask) {
      level.masks.push_back(word);
      level.mask_ranks.push_back(static_cast<std::uint32_t>(blocks));
      blocks += static_cast<std::size_t>(std::popcount(word));
    }
    append(level.block_means, image.block_means);
    append(level.half_pixels, image.half_grey);
    append(level.float_pixels, image.float_grey);
    append(pyramid.half_pixels[l], image.half_channels);
    append(pyramid.float_pixels[l], image.float_channels);
    image = {};
  }
}

void finishLevel(WavePyramidData& pyramid, std::size_t l) {
  NdfPyramidData::Level& level = pyramid.grey.levels[l];
  level.mask_ranks.push_back(static_cast<std::uint32_t>(level.block_means.size()));
}

void buildCoarserLevel(WavePyramidData& pyramid, int l, int half_pixels, ProgressCounter& counter) {
  const PyramidShape& shape = pyramid.grey.shape;
  const PyramidGrid &grid = shape.levels[l], &below = shape.levels[l - 1];
  const double sigma =
      double{kFootprintPerStride} * std::sqrt(double{grid.stride} * grid.stride - double{below.stride} * below.stride);
  const auto columns = gaussianShares(centresAlong(shape, l, 0), centresAlong(shape, l - 1, 0), shape.width, sigma);
  const auto rows = gaussianShares(centresAlong(shape, l, 1), centresAlong(shape, l - 1, 1), shape.height, sigma);
  const auto level = static_cast<std::size_t>(l);
  std::vector<StoredWaveImage> images(grid.imageCount());
  tbb::parallel_for(std::size_t{0}, images.size(), [&](std::size_t k) {
    DenseImage sum(shape.resolution, half_pixels, pyramid.shape.channels);
    const std::vector<float>& along_u = columns[k % static_cast<std::size_t>(grid.columns)];
    const std::vector<float>& along_v = rows[k / static_cast<std::size_t>(grid.columns)];
    for (std::size_t j = 0; j < along_v.size(); ++j)
      for (std::size_t i = 0; i < along_u.size(); ++i)
        if (const float share = along_u[i] * along_v[j]; share > 0)
          addStored(pyramid, level - 1, j * along_u.size() + i, share, sum);
    images[k] = storeImage(sum, pyramid.grey.precision, pyramid.grey.value_scale);
    counter.advance();
  });
  appendImages(images, pyramid, level);
  finishLevel(pyramid, level);
}

std::vector<std::vector<float>> gaussianShares(std::span<const double> targets, std::span<const double> sources, double length,
                                               double sigma) {
  const std::size_t count = sources.size();
  const auto turns = static_cast<int>(std::ceil(kFootprintReach * sigma / length));
  std::vector<std::vector<float>> shares;
  std::vector<double> sums(count);
  for (const double centre : targets) {
    double total = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const double before = k > 0 ? sources[k - 1] : sources[count - 1] - length;
      const double after = k + 1 < count ? sources[k + 1] : sources[0] + length;
      sums[k] = 0;
      for (int turn = -turns; turn <= turns; ++turn) {
        const double x = (sources[k] + turn * length - centre) / sigma;
        if (std::abs(x) <= kFootprintReach) sums[k] += (after - before) * std::exp(-0.5 * x * x);
      }
      total += sums[k];
    }
    std::vector<float>& share = shares.emplace_back();
    for (const double sum : sums) share.push_back(static_cast<float>(sum / total));
  }
  return shares;
}

std::vector<double> centresAlong(const PyramidShape& shape, int level, int axis) {
  const PyramidGrid& grid = shape.levels[level];
  std::vector<double> centres;
  for (int k = 0; k < (axis == 0 ? grid.columns : grid.rows); ++k) {
    const Vec2 centre = shape.centre(level, k, k);
    centres.push_back(axis == 0 ? centre.x : centre.y);
  }
  return centres;
}

}  // namespace glint::bake
