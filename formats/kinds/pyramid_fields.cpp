#include "glint/formats/kinds/pyramid_fields.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "glint/formats/kinds/tally.h"
#include "glint/formats/number_text.h"
#include "glint/math/half.h"

namespace glint::formats {
namespace {

constexpr double kIntegralTolerance = 1e-3;
/// block_means may be taken before pixels are rounded to half precision (2^-11 relative each, 2^-25 near zero).
constexpr double kMeanTolerance = 1e-3;
constexpr double kMeanFloor = 0x1p-24;

std::string levelObject(int l, const char* dataset) { return "/" + levelPath("level_{l}/", l) + dataset; }

/// Sum of the pixels of a block, and the number of pixels that are negative or not finite.
struct BlockSum {
  double sum = 0;
  int bad = 0;
};

/// @param valueOf  valueOf(k): pixel k of the block
template <class ValueOf>
BlockSum sumBlock(const ValueOf& valueOf) {
  constexpr int kLanes = 4;  // sums that do not wait for each other
  double sums[kLanes] = {};
  BlockSum block;
  for (int k = 0; k < kBlockPixels; k += kLanes) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const float value = valueOf(k + lane);
      block.bad += value >= 0 && value <= std::numeric_limits<float>::max() ? 0 : 1;
      sums[lane] += double{value};
    }
  }
  block.sum = (sums[0] + sums[1]) + (sums[2] + sums[3]);
  return block;
}

/// The values of all halves: looking them up takes a third of the time of converting them.
std::span<const float> halfValues() {
  static const std::vector<float> values = [] {
    std::vector<float> all(1 << 16);
    for (std::size_t bits = 0; bits < all.size(); ++bits) all[bits] = ieeeHalfToFloat(static_cast<std::uint16_t>(bits));
    return all;
  }();
  return values;
}

/// Sum of stored block b of a level.
BlockSum sumBlock(const PyramidLevel& level, BlockPrecision precision, std::size_t b) {
  if (precision == BlockPrecision::f32) {
    const float* pixels = static_cast<const float*>(level.pixels) + b * kBlockPixels;
    return sumBlock([&](int k) { return pixels[k]; });
  }
  const std::uint16_t* pixels = static_cast<const std::uint16_t*>(level.pixels) + b * kBlockPixels;
  const float* values = halfValues().data();
  return sumBlock([&](int k) { return values[pixels[k]]; });
}

/// Checks the pixels of one level against its means. Returns the sum of the pixels of each block.
std::vector<double> checkBlocks(const NdfPyramid& pyramid, int l, Findings& findings) {
  const PyramidLevel& level = pyramid.levels[l];
  std::vector<double> sums(level.block_means.size());
  Tally bad_pixels, bad_means;  // by block
  for (std::size_t b = 0; b < sums.size(); ++b) {
    const BlockSum block = sumBlock(level, pyramid.precision, b);
    for (int k = 0; k < block.bad; ++k) bad_pixels.add(b);
    sums[b] = block.sum;
    const double mean = sums[b] * pyramid.value_scale / kBlockPixels;
    const double tolerance = kMeanTolerance * std::abs(mean) + kMeanFloor * pyramid.value_scale;
    if (!(std::abs(mean - level.block_means[b]) <= tolerance)) bad_means.add(b);
  }
  const auto image = [&](std::size_t block) { return imageOf(pyramid, l, block); };
  report(bad_pixels, "pyramid.pixels", levelObject(l, "pixels"), {"pixel is", "pixels are"}, "negative or not finite", findings,
         image);
  report(bad_means, "pyramid.block_means", levelObject(l, "block_means"), {"mean differs", "means differ"}, "from the pixels'",
         findings, image);
  return sums;
}

}  // namespace

float storedPixel(const void* pixels, BlockPrecision precision, std::size_t index) {
  return precision == BlockPrecision::f16 ? ieeeHalfToFloat(static_cast<const std::uint16_t*>(pixels)[index])
                                          : static_cast<const float*>(pixels)[index];
}

std::string imageOf(const NdfPyramid& pyramid, int l, std::size_t block) {
  const std::span<const std::uint32_t> ranks = pyramid.levels[l].mask_ranks;
  const auto word = static_cast<std::size_t>(std::upper_bound(ranks.begin(), ranks.end(), block) - ranks.begin()) - 1;
  const PyramidGrid& grid = pyramid.shape.levels[l];
  return "in the image at " + texelName(grid.columns, grid.rows, word / static_cast<std::size_t>(pyramid.shape.maskWords()));
}

void checkPyramidIndex(const NdfPyramid& pyramid, Findings& findings) {
  checkShape(pyramid.shape, findings);
  checkPyramidMasks(pyramid, findings);
}

void checkPyramidMasks(const NdfPyramid& pyramid, Findings& findings) {
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

void checkPyramidValues(const NdfPyramid& pyramid, Findings& findings, bool loses_light) {
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
      if (std::abs(integral - 1) <= kIntegralTolerance || (loses_light && integral > 0 && integral < 1)) continue;
      ++bad;
      if (!(std::abs(integral - 1) <= std::abs(worst - 1))) worst = integral;
    }
    if (bad > 0) {
      findings.add("pyramid.integral", levelObject(l, "pixels"),
                   counted(bad, {"image does", "images do"}) + " not integrate to 1 (worst " + numberText(worst) + ")");
    }
  }
}

}  // namespace glint::formats
