#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "glint/model/ndf_pyramid.h"

namespace glint::test {

/// A small pyramid in f32, built by brute force, and its owner.
struct TestPyramid {
  PyramidShape shape;
  std::vector<std::uint64_t> masks[kMaxPyramidLevels];
  std::vector<std::uint32_t> mask_ranks[kMaxPyramidLevels];
  std::vector<float> block_means[kMaxPyramidLevels];
  std::vector<float> pixels[kMaxPyramidLevels];
  float value_scale = 1;

  NdfPyramid view() const {
    NdfPyramid p;
    p.shape = shape;
    p.precision = BlockPrecision::f32;
    p.value_scale = value_scale;
    for (int l = 0; l < shape.level_count; ++l) p.levels[l] = {masks[l], mask_ranks[l], block_means[l], pixels[l].data()};
    return p;
  }

  /// Appends an image to a level: dense [resolution][resolution]; blocks of zeros are not stored.
  void addImage(int level, const std::vector<float>& image) {
    const int blocks = shape.blocksPerAxis();
    if (mask_ranks[level].empty()) mask_ranks[level].push_back(0);
    std::vector<std::uint64_t> mask(shape.maskWords(), 0);
    for (int b = 0; b < blocks * blocks; ++b) {
      float block[kBlockPixels];
      double sum = 0;
      for (int p = 0; p < kBlockPixels; ++p) {
        const int y = b / blocks * kBlockSize + p / kBlockSize;
        const int x = b % blocks * kBlockSize + p % kBlockSize;
        block[p] = image[static_cast<std::size_t>(y) * shape.resolution + x];
        sum += std::abs(block[p]);
      }
      if (sum == 0) continue;
      mask[b / 64] |= std::uint64_t{1} << (b % 64);
      pixels[level].insert(pixels[level].end(), block, block + kBlockPixels);
      block_means[level].push_back(static_cast<float>(sum / kBlockPixels));
    }
    masks[level].insert(masks[level].end(), mask.begin(), mask.end());
    for (const std::uint64_t word : mask)
      mask_ranks[level].push_back(mask_ranks[level].back() + static_cast<std::uint32_t>(std::popcount(word)));
  }
};

/// Sizes of the levels of a map, strides doubling.
inline PyramidShape makeShape(int size, int resolution, float stride, int levels) {
  PyramidShape shape;
  shape.width = shape.height = size;
  shape.resolution = resolution;
  shape.sigma_r = 0.005f;
  shape.level_count = levels;
  for (int l = 0; l < levels; ++l, stride *= 2) {
    const int count = static_cast<int>(std::ceil(static_cast<float>(size) / stride));
    shape.levels[l] = {stride, count, count};
  }
  return shape;
}

/// Adds one Gaussian lobe to a dense image, as pixel means (differences of erf), over +-4 sigma.
inline void addLobe(std::vector<float>& image, int resolution, Vec2 h, float sigma, float weight) {
  const float pixel = 2.0f / static_cast<float>(resolution);
  const auto profile = [&](float centre, std::vector<float>& values) {
    const int low = std::max(0, static_cast<int>(std::floor((centre - 4 * sigma + 1) / pixel)));
    const int high = std::min(resolution - 1, static_cast<int>(std::floor((centre + 4 * sigma + 1) / pixel)));
    values.clear();
    for (int i = low; i <= high; ++i) {
      const float a = (-1 + static_cast<float>(i) * pixel - centre) / (sigma * std::numbers::sqrt2_v<float>);
      const float b = a + pixel / (sigma * std::numbers::sqrt2_v<float>);
      values.push_back(0.5f * (std::erf(b) - std::erf(a)) / pixel);
    }
    return low;
  };
  thread_local std::vector<float> px, py;
  const int x0 = profile(h.x, px);
  const int y0 = profile(h.y, py);
  for (std::size_t y = 0; y < py.size(); ++y)
    for (std::size_t x = 0; x < px.size(); ++x) image[(y0 + y) * resolution + x0 + x] += weight * py[y] * px[x];
}

/// Normals of a square map, [size][size].
using NormalField = std::vector<Vec2>;

inline NormalField isotropicNoise(int size, float sigma, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> gaussian(0, sigma);
  NormalField normals(static_cast<std::size_t>(size) * size);
  for (Vec2& n : normals) {
    do n = {gaussian(random), gaussian(random)};
    while (dot(n, n) > 0.9f);
  }
  return normals;
}

/// Square flakes of a few orientations.
inline NormalField flakes(int size, int flake, int orientations, unsigned seed) {
  std::mt19937 random(seed);
  const NormalField palette = isotropicNoise(64, 0.25f, seed + 1);
  const int columns = size / flake + 1;
  std::vector<int> flake_of(static_cast<std::size_t>(columns) * columns);
  for (int& f : flake_of) f = static_cast<int>(random() % static_cast<unsigned>(orientations));
  NormalField normals(static_cast<std::size_t>(size) * size);
  for (int j = 0; j < size; ++j)
    for (int i = 0; i < size; ++i) normals[j * size + i] = palette[flake_of[j / flake * columns + i / flake]];
  return normals;
}

/// Strokes along u: normals spread widely in y and little in x.
inline NormalField brushed(int size, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> gaussian(0, 1);
  NormalField normals(static_cast<std::size_t>(size) * size);
  for (int j = 0; j < size; ++j) {
    float ny = 0;
    for (int i = 0; i < size; ++i) {
      if (i % 97 == 0) ny = 0.25f * gaussian(random);
      normals[j * size + i] = {0.03f * gaussian(random), std::min(0.9f, std::max(-0.9f, ny))};
    }
  }
  return normals;
}

/// All levels, by gathering every texel of every (Gaussian, periodic) footprint.
inline TestPyramid makePyramid(const NormalField& normals, const PyramidShape& shape) {
  TestPyramid pyramid;
  pyramid.shape = shape;
  for (int l = 0; l < shape.level_count; ++l) {
    const PyramidGrid& grid = shape.levels[l];
    const float sigma = kFootprintPerStride * grid.stride;
    const int reach = std::min(shape.width / 2, static_cast<int>(2.5f * sigma) + 1);
    for (int j = 0; j < grid.rows; ++j) {
      for (int i = 0; i < grid.columns; ++i) {
        const int cx = static_cast<int>((static_cast<float>(i) + 0.5f) * grid.stride);
        const int cy = static_cast<int>((static_cast<float>(j) + 0.5f) * grid.stride);
        std::vector<float> image(static_cast<std::size_t>(shape.resolution) * shape.resolution, 0.0f);
        double total = 0;
        for (int dy = -reach; dy < reach; ++dy) {
          for (int dx = -reach; dx < reach; ++dx) {
            const float ox = static_cast<float>(dx) + 0.5f;
            const float oy = static_cast<float>(dy) + 0.5f;
            const float weight = std::exp(-(ox * ox + oy * oy) / (2 * sigma * sigma));
            const int x = (cx + dx + shape.width) % shape.width;
            const int y = (cy + dy + shape.height) % shape.height;
            addLobe(image, shape.resolution, normals[static_cast<std::size_t>(y) * shape.width + x], shape.sigma_r, weight);
            total += weight;
          }
        }
        for (float& value : image) value /= static_cast<float>(total);
        pyramid.addImage(l, image);
      }
    }
  }
  return pyramid;
}

}  // namespace glint::test
