#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "glint/bake/ingest/normal_bounds.h"
#include "glint/bake/synth/synth.h"
#include "glint/model/footprint.h"
#include "glint/model/normal_map.h"

namespace glint::test {

/// A normal map with its bounds, and the memory behind it.
class OwnedMap {
 public:
  OwnedMap(int width, int height, std::vector<Vec2> normals)
      : normals_(std::move(normals)), bounds_(bake::buildNormalBounds(width, height, normals_)) {
    map_.width = width;
    map_.height = height;
    map_.normals = normals_;
    bake::attachBounds(map_, bounds_);
  }
  OwnedMap(const OwnedMap&) = delete;
  OwnedMap& operator=(const OwnedMap&) = delete;

  const NormalMap& map() const { return map_; }
  const std::vector<Vec2>& normals() const { return normals_; }

 private:
  std::vector<Vec2> normals_;
  std::vector<bake::NormalBoundsStorage> bounds_;
  NormalMap map_;
};

inline std::vector<Vec2> synthesised(bake::SynthKind kind, int width, int height, float alpha, float correlation_texels = 4) {
  bake::SynthOptions p = bake::defaultSynthOptions(kind);
  p.width = width;
  p.height = height;
  p.alpha = alpha;
  p.correlation_texels = correlation_texels;
  return bake::synthNormals(p);
}

/// Gaussian random field: a smooth surface whose slopes have variance alpha^2 / 2.
inline std::vector<Vec2> roughSurface(int width, int height, float alpha, float correlation_texels = 4) {
  return synthesised(bake::SynthKind::isotropic, width, height, alpha, correlation_texels);
}

/// Independent normals, uniform in a disk of the given radius.
inline std::vector<Vec2> randomNormals(int width, int height, float radius, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(-1, 1);
  std::vector<Vec2> normals(static_cast<std::size_t>(width) * height);
  for (Vec2& n : normals) {
    do n = {unit(random), unit(random)};
    while (dot(n, n) > 1);
    n = radius * n;
  }
  return normals;
}

/// The map repeated `times` along u and v.
inline std::vector<Vec2> repeated(const std::vector<Vec2>& normals, int width, int height, int times) {
  std::vector<Vec2> out;
  for (int j = 0; j < times * height; ++j)
    for (int i = 0; i < times * width; ++i) out.push_back(normals[static_cast<std::size_t>(j % height) * width + i % width]);
  return out;
}

/// Pixel means of an image [resolution][resolution] over [-1, 1]^2 as a distribution.
struct ImageMoments {
  double integral = 0;
  double mean_x = 0, mean_y = 0;
  double variance_x = 0, variance_y = 0;
};

inline ImageMoments momentsOf(const std::vector<float>& image, int resolution) {
  ImageMoments m;
  const double pixel = 2.0 / resolution;
  const auto centre = [&](std::size_t k) { return -1 + (static_cast<double>(k) + 0.5) * pixel; };
  for (std::size_t y = 0; y < static_cast<std::size_t>(resolution); ++y) {
    for (std::size_t x = 0; x < static_cast<std::size_t>(resolution); ++x) {
      const double mass = image[y * resolution + x] * pixel * pixel;
      m.integral += mass;
      m.mean_x += mass * centre(x);
      m.mean_y += mass * centre(y);
      m.variance_x += mass * centre(x) * centre(x);
      m.variance_y += mass * centre(y) * centre(y);
    }
  }
  m.mean_x /= m.integral;
  m.mean_y /= m.integral;
  m.variance_x = m.variance_x / m.integral - m.mean_x * m.mean_x;
  m.variance_y = m.variance_y / m.integral - m.mean_y * m.mean_y;
  return m;
}

/// ||a - b|| / ||b||.
inline double relL2(const std::vector<float>& a, const std::vector<float>& b) {
  double difference = 0, norm = 0;
  for (std::size_t k = 0; k < b.size(); ++k) {
    difference += (double{a[k]} - b[k]) * (double{a[k]} - b[k]);
    norm += double{b[k]} * b[k];
  }
  return std::sqrt(difference / norm);
}

/// Half the integral of |a - b| over [-1, 1]^2.
inline double totalVariation(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < b.size(); ++k) sum += std::abs(double{a[k]} - b[k]);
  return 0.5 * sum * 4 / static_cast<double>(b.size());
}

/// Centre of pixel k of an NDF image.
inline Vec2 pixelCentre(std::size_t k, int resolution) {
  const float pixel = 2.0f / static_cast<float>(resolution);
  return {-1 + (static_cast<float>(k % static_cast<std::size_t>(resolution)) + 0.5f) * pixel,
          -1 + (static_cast<float>(k / static_cast<std::size_t>(resolution)) + 0.5f) * pixel};
}

/// The whole NDF image of a pyramid or a compressed pyramid: means of the density over pixels.
template <class Model>
std::vector<float> imageOf(const Model& model, const Footprint& p, int resolution) {
  std::vector<float> image(static_cast<std::size_t>(resolution) * resolution);
  for (std::size_t k = 0; k < image.size(); ++k) image[k] = model.pixelMean(p, pixelCentre(k, resolution));
  return image;
}

}  // namespace glint::test
