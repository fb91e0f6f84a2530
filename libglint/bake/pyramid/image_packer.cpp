#include "glint/bake/pyramid/image_packer.h"

#ifdef __x86_64__
#include <immintrin.h>
#endif

#include <algorithm>
#include <array>
#include <bit>

#include "glint/bake/common/simd.h"
#include "glint/math/half.h"

namespace glint::bake {
namespace {

/// Sum of the pixels of a block: first of each column, with one lane of a vector for each, then of the columns.
GLINT_MULTIVERSION float sumBlock(const float* pixels) {
  float columns[kBlockSize] = {};
  for (int y = 0; y < kBlockSize; ++y)
    for (int x = 0; x < kBlockSize; ++x) columns[x] += pixels[y * kBlockSize + x];
  float sum = 0;
  for (const float c : columns) sum += c;
  return sum;
}

void toHalfPortably(const float* from, float scale, std::uint16_t* to, float* rounded) {
  for (int k = 0; k < kBlockPixels; ++k) {
    to[k] = floatToHalf(scale * from[k]);
    rounded[k] = halfToFloat(to[k]);
  }
}

#ifdef __x86_64__
/// toHalfPortably with the processor's own conversion, which gives the same bits.
__attribute__((target("avx,f16c"))) void toHalfByInstruction(const float* from, float scale, std::uint16_t* to,
                                                             float* rounded) {
  const __m256 scales = _mm256_set1_ps(scale), largest = _mm256_set1_ps(65504);
  for (int k = 0; k < kBlockPixels; k += 8) {
    const __m256 values = _mm256_min_ps(_mm256_mul_ps(scales, _mm256_loadu_ps(from + k)), largest);
    const __m128i halves = _mm256_cvtps_ph(values, _MM_FROUND_TO_NEAREST_INT);
    _mm_storeu_si128(reinterpret_cast<__m128i*>(to + k), halves);
    _mm256_storeu_ps(rounded + k, _mm256_cvtph_ps(halves));
  }
}
#endif

/// Converts scale * from, which is not negative, to half precision.
/// @param rounded  [kBlockPixels]: the halves, converted back to float
void toHalf(const float* from, float scale, std::uint16_t* to, float* rounded) {
#ifdef __x86_64__
  static const bool has_instruction = __builtin_cpu_supports("avx") && __builtin_cpu_supports("f16c");
  if (has_instruction) return toHalfByInstruction(from, scale, to, rounded);
#endif
  toHalfPortably(from, scale, to, rounded);
}

}  // namespace

ImagePacker::ImagePacker(const PyramidShape& shape, BlockPrecision precision, float value_scale)
    : shape_(shape), precision_(precision), value_scale_(value_scale) {
  const float pixels_per_unit = 0.5f * static_cast<float>(shape.resolution);
  to_stored_ = pixels_per_unit * pixels_per_unit / value_scale;
}

PackedImage ImagePacker::pack(std::span<const Layer> layers, float inverse_mass) const {
  PackedImage image;
  image.mask.assign(shape_.maskWords(), 0);
  const int blocks = shape_.blocksPerAxis();
  std::vector<std::array<float, kBlockPixels>> stored;
  float excess = 0;  // mass that is added by setting negative pixels to 0
  for (int b = 0; b < blocks * blocks; ++b) {
    std::array<float, kBlockPixels> pixels = {};
    bool empty = true;
    for (const auto& [bins, filter] : layers) {
      if (!bins->touchedNear(b % blocks, b / blocks, filter->radius() + 1)) continue;
      const int size = kBlockSize * bins->subdivision();
      filter->addBlock(bins->origin() + static_cast<std::ptrdiff_t>(b / blocks) * size * bins->pitch() + b % blocks * size,
                       bins->pitch(), pixels.data());
      empty = false;
    }
    if (empty) continue;
    const float mass = sumBlock(pixels.data());
    for (float& pixel : pixels) pixel = std::max(pixel, 0.0f);
    const float kept = sumBlock(pixels.data());
    excess += kept - mass;
    if (kept * inverse_mass <= kBlockMassThreshold) continue;
    image.mask[b / 64] |= std::uint64_t{1} << (b % 64);
    stored.push_back(pixels);
  }
  // Normalise to the mass with the excess, so that the image integrates to 1.
  const float scale = inverse_mass / (1 + excess * inverse_mass);
  image.means.reserve(stored.size());
  (precision_ == BlockPrecision::f16 ? image.half_pixels.reserve(stored.size() * kBlockPixels)
                                     : image.float_pixels.reserve(stored.size() * kBlockPixels));
  for (const auto& pixels : stored) store(pixels.data(), scale, image);
  return image;
}

void ImagePacker::store(const float* pixels, float inverse_mass, PackedImage& image) const {
  float stored[kBlockPixels];
  if (precision_ == BlockPrecision::f16) {
    image.half_pixels.resize(image.half_pixels.size() + kBlockPixels);
    toHalf(pixels, to_stored_ * inverse_mass, image.half_pixels.data() + image.half_pixels.size() - kBlockPixels, stored);
  } else {
    for (int k = 0; k < kBlockPixels; ++k) stored[k] = to_stored_ * inverse_mass * pixels[k];
    image.float_pixels.insert(image.float_pixels.end(), stored, stored + kBlockPixels);
  }
  image.means.push_back(value_scale_ * sumBlock(stored) / kBlockPixels);
}

NdfPyramidData::Level packLevel(std::vector<PackedImage>& images, BlockPrecision precision) {
  NdfPyramidData::Level level;
  std::size_t blocks = 0;
  for (const PackedImage& image : images) {
    for (const std::uint64_t word : image.mask) {
      level.mask_ranks.push_back(static_cast<std::uint32_t>(blocks));
      blocks += static_cast<std::size_t>(std::popcount(word));
    }
  }
  level.mask_ranks.push_back(static_cast<std::uint32_t>(blocks));
  level.block_means.reserve(blocks);
  (precision == BlockPrecision::f16 ? level.half_pixels.reserve(blocks * kBlockPixels)
                                    : level.float_pixels.reserve(blocks * kBlockPixels));
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  for (PackedImage& image : images) {
    append(level.masks, image.mask);
    append(level.block_means, image.means);
    append(level.half_pixels, image.half_pixels);
    append(level.float_pixels, image.float_pixels);
    image = {};  // frees the memory of the image, so that the level is in memory once
  }
  return level;
}

PixelFilter flatFilter(const PyramidOptions& options) {
  const float sigma_pixels = 0.5f * options.sigma_r * static_cast<float>(options.resolution);
  return {sigma_pixels, subdivisionFor(sigma_pixels), Spline::quadratic};
}

float valueScaleFor(int resolution) {
  // The largest half is 65504: images of more than 256 pixels are scaled down.
  return resolution > 256 ? static_cast<float>(resolution * resolution) / (256 * 256) : 1;
}

}  // namespace glint::bake
