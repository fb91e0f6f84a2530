#include <algorithm>
#include <bit>
#include <cmath>

#include "glint/formats/kinds/pyramid_shape.h"
#include "glint/formats/number_text.h"
#include "glint/math/half.h"
#include "glint/model/texel_name.h"

namespace glint::formats {
namespace {

constexpr double kIntegralTolerance = 1e-3;
/// block_means may be taken before pixels are rounded to half precision (2^-11 relative each, 2^-25 near zero).
constexpr double kMeanTolerance = 1e-3;
constexpr double kMeanFloor = 0x1p-24;

std::string levelObject(int l, const char* dataset) { return "/" + levelPath("level_{l}/", l) + dataset; }

float pixel(const NdfPyramid& pyramid, const PyramidLevel& level, std::size_t index) {
  return pyramid.precision == BlockPrecision::f16 ? ieeeHalfToFloat(static_cast<const std::uint16_t*>(level.pixels)[index])
                                                  : static_cast<const float*>(level.pixels)[index];
}

/// "the image at column 3, row 7 from the top" that a stored block of a level belongs to.
std::string imageOf(const NdfPyramid& pyramid, int l, std::size_t block) {
  const std::span<const std::uint32_t> ranks = pyramid.levels[l].mask_ranks;
  const auto word = static_cast<std::size_t>(std::upper_bound(ranks.begin(), ranks.end(), block) - ranks.begin()) - 1;
  const PyramidGrid& grid = pyramid.shape.levels[l];
  return "the image at " + texelName(grid.columns, grid.rows, word / static_cast<std::size_t>(pyramid.shape.maskWords()));
}

/// Checks the pixels of one level against its means. Returns the sum of the pixels of each block.
std::vector<double> checkBlocks(const NdfPyramid& pyramid, int l, Findings& findings) {
  const PyramidLevel& level = pyramid.levels[l];
  std::vector<double> sums(level.block_means.size());
  std::size_t bad_pixels = 0;
  std::size_t bad_means = 0;
  std::size_t first_pixel = 0;
  std::size_t first_mean = 0;
  for (std::size_t b = 0; b < sums.size(); ++b) {
    for (std::size_t k = b * kBlockPixels; k < (b + 1) * kBlockPixels; ++k) {
      const float value = pixel(pyramid, level, k);
      if (!(std::isfinite(value) && value >= 0) && bad_pixels++ == 0) first_pixel = b;
      sums[b] += value;
    }
    const double mean = sums[b] * pyramid.value_scale / kBlockPixels;
    const double tolerance = kMeanTolerance * std::abs(mean) + kMeanFloor * pyramid.value_scale;
    if (!(std::abs(mean - level.block_means[b]) <= tolerance) && bad_means++ == 0) first_mean = b;
  }
  if (bad_pixels > 0) {
    findings.add(
        "pyramid.pixels", levelObject(l, "pixels"),
        std::to_string(bad_pixels) + " pixels are negative or not finite (first in " + imageOf(pyramid, l, first_pixel) + ")");
  }
  if (bad_means > 0) {
    findings.add(
        "pyramid.block_means", levelObject(l, "block_means"),
        std::to_string(bad_means) + " means differ from the pixels' (first in " + imageOf(pyramid, l, first_mean) + ")");
  }
  return sums;
}

}  // namespace

PackedAsset pack(const NdfPyramid& pyramid) {
  PackedAsset packed{"ndf-pyramid", {}, {}};
  const PyramidShape& shape = pyramid.shape;
  packShape(shape, packed);
  packed.text("precision", pyramid.precision == BlockPrecision::f16 ? "f16" : "f32");
  packed.real("value_scale", pyramid.value_scale);
  for (int l = 0; l < shape.level_count; ++l) {
    const PyramidLevel& level = pyramid.levels[l];
    const auto path = [&](const char* dataset) { return levelPath("level_{l}/", l) + dataset; };
    const auto rows = static_cast<std::uint64_t>(shape.levels[l].rows);
    const auto columns = static_cast<std::uint64_t>(shape.levels[l].columns);
    const auto words = static_cast<std::uint64_t>(shape.maskWords());
    const std::uint64_t blocks = level.block_means.size();
    packed.array(path("masks"), ElementType::u64, {rows, columns, words}, level.masks.data(), level.masks.size());
    packed.array(path("mask_ranks"), ElementType::u32, {rows * columns * words + 1}, level.mask_ranks.data(),
                 level.mask_ranks.size());
    packed.array(path("block_means"), ElementType::f32, {blocks}, level.block_means.data(), blocks);
    // The pixels are a bare pointer: the running count is the only witness of how many there are.
    packed.array(path("pixels"), pyramid.precision == BlockPrecision::f16 ? ElementType::f16 : ElementType::f32,
                 {blocks, kBlockSize, kBlockSize}, level.pixels,
                 std::uint64_t{level.mask_ranks.empty() ? 0 : level.mask_ranks.back()} * kBlockPixels);
  }
  return packed;
}

void unpack(const Content& content, NdfPyramid& pyramid) {
  unpackShape(content, pyramid.shape);
  pyramid.precision = content.is("precision", "f16") ? BlockPrecision::f16 : BlockPrecision::f32;
  pyramid.value_scale = content.real("value_scale");
  for (int l = 0; l < pyramid.shape.level_count; ++l) {
    const auto path = [&](const char* dataset) { return levelPath("level_{l}/", l) + dataset; };
    PyramidLevel& level = pyramid.levels[l];
    level.masks = content.array<std::uint64_t>(path("masks"));
    level.mask_ranks = content.array<std::uint32_t>(path("mask_ranks"));
    level.block_means = content.array<float>(path("block_means"));
    level.pixels = content.dataset(path("pixels")).data;
  }
}

void checkIndex(const NdfPyramid& pyramid, Findings& findings) {
  checkShape(pyramid.shape, findings);
  const auto words = static_cast<std::size_t>(pyramid.shape.maskWords());
  const int tail_bits = pyramid.shape.blocksPerImage() % 64;
  const std::uint64_t beyond = tail_bits == 0 ? 0 : ~std::uint64_t{0} << tail_bits;
  for (int l = 0; l < pyramid.shape.level_count; ++l) {
    const PyramidLevel& level = pyramid.levels[l];
    std::uint64_t count = 0;
    std::uint64_t stray = 0;
    bool counts_hold = true;
    for (std::size_t word = 0; word < level.masks.size(); ++word) {
      counts_hold &= level.mask_ranks[word] == count;
      count += static_cast<std::uint64_t>(std::popcount(level.masks[word]));
      if ((word + 1) % words == 0) stray |= level.masks[word] & beyond;
    }
    counts_hold &= level.mask_ranks.back() == count && count == level.block_means.size();
    if (stray != 0) findings.add("pyramid.masks", levelObject(l, "masks"), "has bits beyond the blocks of an image");
    if (!counts_hold) {
      findings.add("pyramid.mask_ranks", levelObject(l, "mask_ranks"), "is not the running count of the bits in masks");
    }
  }
}

void checkData(const NdfPyramid& pyramid, Findings& findings) {
  const auto words = static_cast<std::size_t>(pyramid.shape.maskWords());
  const double pixel_area = 4.0 / (static_cast<double>(pyramid.shape.resolution) * pyramid.shape.resolution);
  for (int l = 0; l < pyramid.shape.level_count; ++l) {
    const PyramidLevel& level = pyramid.levels[l];
    const std::vector<double> sums = checkBlocks(pyramid, l, findings);
    std::size_t bad = 0;
    double worst = 1;
    for (std::size_t first = 0; first + words < level.mask_ranks.size(); first += words) {
      double integral = 0;
      for (std::uint32_t b = level.mask_ranks[first]; b < level.mask_ranks[first + words]; ++b) integral += sums[b];
      integral *= pyramid.value_scale * pixel_area;
      if (std::abs(integral - 1) <= kIntegralTolerance) continue;
      ++bad;
      if (!(std::abs(integral - 1) <= std::abs(worst - 1))) worst = integral;
    }
    if (bad > 0) {
      findings.add("pyramid.integral", levelObject(l, "pixels"),
                   std::to_string(bad) + " images do not integrate to 1 (worst " + numberText(worst) + ")");
    }
  }
}

}  // namespace glint::formats
