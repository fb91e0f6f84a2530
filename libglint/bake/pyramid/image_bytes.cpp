#include "glint/bake/pyramid/image_bytes.h"

#include <algorithm>

#include "glint/bake/pyramid/image_packer.h"

namespace glint::bake {

double imageBytes(const PyramidShape& shape, BlockPrecision precision, double most_bytes, const BlockCountFn& blocks,
                  double spread, PyramidRegion region) {
  // Images are packed while others of their level still have their own arrays, which grew by doubling.
  constexpr double kCopies = 2.5;
  constexpr std::size_t kSampledImages = 8;  // of a level
  const double block_bytes = kCopies * (kBlockPixels * (precision == BlockPrecision::f16 ? 2.0 : 4.0) + sizeof(float));
  const double empty_image = static_cast<double>(sizeof(PackedImage)) + static_cast<double>(shape.maskWords()) * 24;
  const double most_blocks = shape.blocksPerImage();
  const auto imagesOf = [&](int l) {
    return static_cast<std::size_t>(regionRows(shape, l, region).count()) * static_cast<std::size_t>(shape.levels[l].columns);
  };
  double full = 0;
  for (int l = 0; l < shape.level_count; ++l)
    full += static_cast<double>(imagesOf(l)) * (empty_image + most_blocks * block_bytes);
  if (full <= most_bytes) return full;

  double counted = 0;
  for (int l = 0; l < shape.footprintLevels(); ++l) {
    const std::size_t count = imagesOf(l);
    if (count == 0) continue;
    const std::size_t before =
        static_cast<std::size_t>(regionRows(shape, l, region).first) * static_cast<std::size_t>(shape.levels[l].columns);
    const std::size_t samples = std::min(kSampledImages, count);
    double sum = 0;
    for (std::size_t k = 0; k < samples; ++k)
      sum += static_cast<double>(blocks(l, before + (2 * k + 1) * count / (2 * samples)));
    const double mean = std::min(most_blocks, spread * sum / static_cast<double>(samples));
    counted += static_cast<double>(count) * (empty_image + mean * block_bytes);
  }
  return counted;
}

}  // namespace glint::bake
