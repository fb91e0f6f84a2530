#include "glint/bake/tiny/tile_image.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "glint/math/gaussian.h"
#include "glint/math/half.h"

namespace glint::bake {
namespace {

/// Masses of a lobe in the pixels along one axis.
struct AxisMasses {
  int first = 0;
  std::vector<double> masses;

  AxisMasses(float mean, float sigma, int resolution) {
    const double pixel = 2.0 / resolution, scale = 1 / (std::sqrt(2.0) * double{sigma}),
                 reach = double{kLobeReach} * double{sigma};
    const auto pixelOf = [&](double x) {
      return static_cast<int>(std::floor(std::clamp((x + 1) / pixel, -1.0, resolution + 1.0)));
    };
    first = std::max(pixelOf(double{mean} - reach), 0);
    const int last = std::min(pixelOf(double{mean} + reach), resolution - 1);
    double below = std::erf((first * pixel - 1 - double{mean}) * scale);
    for (int k = first; k <= last; ++k) {
      const double above = std::erf(((k + 1) * pixel - 1 - double{mean}) * scale);
      masses.push_back(0.5 * (above - below));
      below = above;
    }
  }
};

}  // namespace

TileImage::TileImage(int resolution, float sigma)
    : resolution_(resolution),
      sigma_(sigma),
      masses_(static_cast<std::size_t>(resolution) * static_cast<std::size_t>(resolution)) {}

void TileImage::add(Vec2 normal, double weight) {
  const AxisMasses x(normal.x, sigma_, resolution_), y(normal.y, sigma_, resolution_);
  for (std::size_t j = 0; j < y.masses.size(); ++j) {
    double* row = masses_.data() + rowMajorIndex(x.first, y.first + static_cast<int>(j), resolution_);
    const double share = weight * y.masses[j];
    for (std::size_t i = 0; i < x.masses.size(); ++i) row[i] += share * x.masses[i];
  }
  total_ += weight;
}

void TileImage::addImage(const TileImage& image, double weight) {
  if (!(weight > 0 && image.total_ > 0)) return;
  for (std::size_t k = 0; k < masses_.size(); ++k) masses_[k] += weight / image.total_ * image.masses_[k];
  total_ += weight;
}

double TileImage::pixelsOfLobe() const {
  const double side = std::min(double{kLobeReach} * double{sigma_} * resolution_ + 1, 1.0 * resolution_);
  return side * side;
}

void TileImage::clear() {
  std::fill(masses_.begin(), masses_.end(), 0.0);
  total_ = 0;
}

StoredImage storeImage(const TileImage& image, const PyramidShape& shape, BlockPrecision precision, float value_scale) {
  StoredImage stored;
  stored.mask.assign(static_cast<std::size_t>(shape.maskWords()), 0);
  const int blocks = shape.blocksPerAxis(), resolution = shape.resolution;
  const double pixel_area = 4.0 / (1.0 * resolution * resolution), inverse = 1 / image.total();
  const double to_stored = inverse / (pixel_area * double{value_scale});
  for (int b = 0; b < blocks * blocks; ++b) {
    const double* corner = image.masses().data() + rowMajorIndex(b % blocks * kBlockSize, b / blocks * kBlockSize, resolution);
    double mass = 0;
    for (int k = 0; k < kBlockPixels; ++k) mass += corner[rowMajorIndex(k % kBlockSize, k / kBlockSize, resolution)];
    if (mass * inverse <= double{kBlockMassThreshold}) continue;
    stored.mask[static_cast<std::size_t>(b) / 64] |= std::uint64_t{1} << (b % 64);
    double sum = 0;
    for (int k = 0; k < kBlockPixels; ++k) {
      const auto value = static_cast<float>(to_stored * corner[rowMajorIndex(k % kBlockSize, k / kBlockSize, resolution)]);
      if (precision == BlockPrecision::f16) {
        stored.half_pixels.push_back(floatToHalf(value));
        sum += double{halfToFloat(stored.half_pixels.back())};
      } else {
        stored.float_pixels.push_back(value);
        sum += double{value};
      }
    }
    stored.means.push_back(static_cast<float>(double{value_scale} * sum / kBlockPixels));
  }
  return stored;
}

NdfPyramidData::Level joinImages(const std::vector<StoredImage>& images) {
  NdfPyramidData::Level level;
  std::size_t blocks = 0;
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  for (const StoredImage& image : images) {
    for (const std::uint64_t word : image.mask) {
      level.mask_ranks.push_back(static_cast<std::uint32_t>(blocks));
      blocks += static_cast<std::size_t>(std::popcount(word));
    }
    append(level.masks, image.mask);
    append(level.block_means, image.means);
    append(level.half_pixels, image.half_pixels);
    append(level.float_pixels, image.float_pixels);
  }
  level.mask_ranks.push_back(static_cast<std::uint32_t>(blocks));
  return level;
}

}  // namespace glint::bake
