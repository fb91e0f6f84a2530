#include "glint/bake/wave/compress_wave.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include "glint/bake/compressed/slices.h"
#include "glint/math/half.h"
#include "glint/model/error.h"

namespace glint::bake {
namespace {

float valueOf(std::uint16_t pixel) { return halfToFloat(pixel); }
float valueOf(float pixel) { return pixel; }

/// Bytes of the arrays of a wave pyramid, as a file stores them.
double storedBytes(const WavePyramid& wave) {
  const double pixel = wave.grey.precision == BlockPrecision::f16 ? 2 : 4;
  double bytes = 0;
  for (int l = 0; l < wave.grey.shape.level_count; ++l) {
    const PyramidLevel& level = wave.grey.levels[l];
    bytes += static_cast<double>(level.masks.size_bytes() + level.mask_ranks.size_bytes() + level.block_means.size_bytes());
    bytes += static_cast<double>(level.block_means.size()) * kBlockPixels * pixel * (1 + wave.channels);
  }
  return bytes;
}

}  // namespace

ChannelImages::ChannelImages(const WavePyramid& wave, int first, int count)
    : wave_(wave), first_(first), count_(count), levels_(static_cast<std::size_t>(wave.grey.shape.level_count)) {
  for (int l = 0; l < wave.grey.shape.level_count; ++l)
    wave.grey.precision == BlockPrecision::f16 ? addLevel<std::uint16_t>(l) : addLevel<float>(l);
}

template <class Pixel>
void ChannelImages::addLevel(int l) {
  const PyramidLevel& from = wave_.grey.levels[l];
  const auto words = static_cast<std::size_t>(wave_.grey.shape.maskWords());
  const std::size_t images = wave_.grey.shape.levels[l].imageCount(), row = kBlockSize;
  const std::size_t pitch = row * static_cast<std::size_t>(wave_.channels);  // from a row of a block to the next
  if (from.masks.size() != images * words)
    throw Error(ErrorCode::invalid_input, "pyramid.layout", "", "level " + std::to_string(l),
                "the masks do not fit the number of images", "build the pyramid again with glint-pyramid");
  Level& to = levels_[static_cast<std::size_t>(l)];
  std::uint32_t stored = 0;
  for (int c = first_; c < first_ + count_; ++c) {
    std::size_t block = 0;
    for (std::size_t w = 0; w < from.masks.size(); ++w) {
      std::uint64_t mask = 0;
      to.mask_ranks.push_back(stored);
      for (std::uint64_t bits = from.masks[w]; bits != 0; bits &= bits - 1, ++block) {
        const Pixel* pixels = static_cast<const Pixel*>(wave_.pixels[l]) + block * kBlockSize * pitch;
        Pixel values[kBlockPixels];
        for (std::size_t y = 0; y < kBlockSize; ++y)
          std::copy_n(pixels + y * pitch + static_cast<std::size_t>(c) * row, row, values + y * row);
        double sum = 0;
        for (const Pixel value : values) sum += double{valueOf(value)};
        if (sum == 0) continue;
        mask |= std::uint64_t{1} << std::countr_zero(bits);
        ++stored;
        to.block_means.push_back(static_cast<float>(sum / kBlockPixels) * wave_.grey.value_scale);
        const auto* bytes = reinterpret_cast<const std::byte*>(values);
        to.pixels.insert(to.pixels.end(), bytes, bytes + sizeof values);
      }
      to.masks.push_back(mask);
    }
  }
  to.mask_ranks.push_back(stored);
}

NdfPyramid ChannelImages::view() const {
  NdfPyramid images;
  images.shape = channelShape(wave_.grey.shape, count_);
  images.precision = wave_.grey.precision;
  images.value_scale = wave_.grey.value_scale;
  for (std::size_t l = 0; l < levels_.size(); ++l)
    images.levels[l] = {levels_[l].masks, levels_[l].mask_ranks, levels_[l].block_means, levels_[l].pixels.data()};
  return images;
}

WaveCp WaveCpData::view() const {
  WaveCp wave = shape;
  wave.wavelengths_um = wavelengths_um;
  wave.channel_rgb = channel_rgb;
  wave.images = images.view();
  return wave;
}

WaveCpData compressWavePyramid(const WavePyramid& wave, const CompressionOptions& options, CompressionReport* report,
                               const ProgressFn& progress) {
  const ChannelImages channels(wave, 0, wave.channels);
  const NdfPyramid images = channels.view();
  std::size_t count = 0;
  for (int l = 0; l < images.shape.level_count; ++l) count += images.shape.levels[l].imageCount();
  // Regions are bands of rows, and would part the channels before they part the map.
  CompressionOptions shared = options;
  if (options.regions == 0 && count <= SliceIndex::kMostImages) shared.regions = 1;
  WaveCpData data;
  data.images = compressPyramid(images, shared, report, progress);
  if (report != nullptr) report->ratio_to_stored = storedBytes(wave) / static_cast<double>(report->total_bytes);
  data.shape.shape = wave.grey.shape;
  data.shape.meaning = wave.meaning;
  data.shape.channels = wave.channels;
  data.shape.texel_size_um = wave.texel_size_um;
  data.shape.coherence_um = wave.coherence_um;
  data.wavelengths_um.assign(wave.wavelengths_um.begin(), wave.wavelengths_um.end());
  data.channel_rgb.assign(wave.channel_rgb.begin(), wave.channel_rgb.end());
  return data;
}

}  // namespace glint::bake
