#pragma once

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "glint/model/ndf_cp.h"

namespace glint::test {

/// An IEEE half, by its definition.
inline double decodeHalf(std::uint16_t bits) {
  const int exponent = (bits >> 10) & 31;
  const double fraction = (bits & 1023) / 1024.0;
  const double magnitude = exponent == 0 ? std::ldexp(fraction, -14) : std::ldexp(1 + fraction, exponent - 15);
  return bits >> 15 ? -magnitude : magnitude;
}

/// Element of an array that is stored as the first type that applies.
inline double basisElement(const NdfCp& c, std::uint64_t i) { return c.basis[i]; }

inline double coefficientElement(const NdfCp& c, std::uint64_t i) {
  if (c.coefficient_type == CoefficientType::f32) return static_cast<const float*>(c.coefficients)[i];
  if (c.coefficient_type == CoefficientType::f16) return decodeHalf(static_cast<const std::uint16_t*>(c.coefficients)[i]);
  return static_cast<const std::int8_t*>(c.coefficients)[i];
}

/// Value of basis column k at a pixel, in stored units: differences of the prefix sums.
inline double basisValue(const NdfCp& c, const NdfCluster& cluster, int k, int x, int y) {
  const auto along = [&](std::uint64_t first, int columns, int column, int i) {
    const double before = i > 0 ? basisElement(c, first + static_cast<std::uint64_t>(i - 1) * columns + column) : 0;
    return basisElement(c, first + static_cast<std::uint64_t>(i) * columns + column) - before;
  };
  const bool tucker = c.method == CompressionMethod::tucker;
  const int rx = tucker ? cluster.rank_x : cluster.columns, ry = tucker ? cluster.rank_y : cluster.columns;
  const std::uint64_t y_first = cluster.first_basis + static_cast<std::uint64_t>(kBlockSize) * rx;
  if (c.method != CompressionMethod::pca) {
    const int pair = tucker ? c.core[cluster.first_scale + k] : 0;
    return along(cluster.first_basis, rx, tucker ? pair % 16 : k, x) * along(y_first, ry, tucker ? pair / 16 : k, y);
  }
  const auto sum = [&](int i, int j) {
    return i < 0 || j < 0 ? 0.0
                          : basisElement(c, cluster.first_basis + static_cast<std::uint64_t>(j * kBlockSize + i) * rx + k);
  };
  return sum(x, y) - sum(x - 1, y) - sum(x, y - 1) + sum(x - 1, y - 1);
}

/// Coefficient k of a slice.
inline double coefficientValue(const NdfCp& c, const NdfCluster& cluster, int slice, int k) {
  const int wide = cluster.columns - cluster.narrow_columns, half = (cluster.narrow_columns + 1) / 2;
  const std::uint64_t row = cluster.first_coefficient + static_cast<std::uint64_t>(slice) * (wide + half);
  if (k < wide) return coefficientElement(c, row + k);
  const int j = k - wide;
  const int byte = static_cast<const std::uint8_t*>(c.coefficients)[row + wide + (j < half ? j : j - half)];
  const int bits = j < half ? byte & 15 : byte >> 4;
  return bits < 8 ? bits : bits - 16;
}

/// Pixel of a slice of spots, before its image's scale.
inline double spotValue(const NdfCp& c, const NdfCluster& cluster, int slice, int x, int y) {
  const auto* bytes = static_cast<const std::uint8_t*>(c.coefficients) + cluster.first_coefficient;
  const std::uint8_t* counts = bytes + spotCountsOffset(cluster.slice_count);
  const auto* spots = reinterpret_cast<const NdfSpot*>(bytes + firstSpotOffset(cluster.slice_count));
  for (int s = 0; s < slice; ++s) spots += counts[s];
  const double sigma = c.shape.sigma_r * 0.5 * c.shape.resolution;
  const auto share = [&](int pixel, int place) {
    const double centre = static_cast<double>(place) / kSpotSteps - kSpotReach;
    return 0.5 *
           (std::erf((pixel + 1 - centre) / (sigma * std::sqrt(2.0))) - std::erf((pixel - centre) / (sigma * std::sqrt(2.0))));
  };
  double sum = 0;
  for (int k = 0; k < counts[slice]; ++k) sum += spots[k].weight * share(x, spots[k].x) * share(y, spots[k].y);
  const double rest = decodeHalf(static_cast<std::uint16_t>(counts[cluster.slice_count + slice] << 6));
  return sum * c.scales[cluster.first_scale] + rest * c.scales[cluster.first_scale + 1];
}

/// All pixels of an image, [resolution][resolution], densities. Plain loops after the comments of ndf_cp.h.
inline std::vector<double> decodeImage(const NdfCp& c, std::uint32_t image) {
  const int n = c.shape.resolution;
  const int blocks = c.shape.blocksPerAxis();
  std::vector<double> pixels(static_cast<std::size_t>(n) * n, 0.0);
  const int slot = c.image_slots[image];
  for (int place = 0; place < c.places; ++place) {
    const int b = c.place_blocks[place];
    const NdfCluster& cluster = c.clusters[static_cast<std::size_t>(c.image_regions[image]) * c.places + place];
    const std::uint64_t* mask = c.masks.data() + cluster.first_word;
    if (!(mask[slot / 64] >> (slot % 64) & 1)) continue;
    int slice = 0;
    for (int s = 0; s < slot; ++s) slice += mask[s / 64] >> (s % 64) & 1;
    for (int y = 0; y < kBlockSize; ++y) {
      for (int x = 0; x < kBlockSize; ++x) {
        double value = cluster.columns == 0 ? spotValue(c, cluster, slice, x, y) : 0;
        for (int k = 0; k < cluster.columns; ++k)
          value += c.scales[cluster.first_scale + k] * coefficientValue(c, cluster, slice, k) * basisValue(c, cluster, k, x, y);
        pixels[(b / blocks * kBlockSize + y) * n + b % blocks * kBlockSize + x] = c.image_scales[image] * value;
      }
    }
  }
  return pixels;
}

/// Floors of the pixels of an image, in the units of decodeImage.
inline std::vector<double> decodeFloors(const NdfCp& c, std::uint32_t image) {
  const int n = c.shape.resolution, blocks = c.shape.blocksPerAxis();
  std::vector<double> floors(static_cast<std::size_t>(n) * n, 0.0);
  for (int place = 0; place < c.places; ++place) {
    const int b = c.place_blocks[place];
    const std::size_t cluster = static_cast<std::size_t>(c.image_regions[image]) * c.places + place;
    const double unit = c.image_scales[image] * decodeHalf(c.clusters[cluster].floor_unit);
    for (int y = 0; y < kBlockSize; ++y)
      for (int x = 0; x < kBlockSize; ++x)
        floors[(b / blocks * kBlockSize + y) * n + b % blocks * kBlockSize + x] =
            unit * decodeHalf(static_cast<std::uint16_t>(c.floors[cluster * 16 + y / 4 * 4 + x / 4] << 6));
  }
  return floors;
}

/// Densities of an image as a reader shows them: less their floors, not negative, and of integral 1 unless all are 0.
inline std::vector<double> decodeDensities(const NdfCp& c, std::uint32_t image) {
  std::vector<double> pixels = decodeImage(c, image);
  const std::vector<double> floors = decodeFloors(c, image);
  double sum = 0;
  for (std::size_t p = 0; p < pixels.size(); ++p) {
    pixels[p] = std::max(0.0, pixels[p] - floors[p]);
    sum += pixels[p] * 4 / static_cast<double>(pixels.size());
  }
  for (double& pixel : pixels) pixel = sum > 0 ? pixel / sum : 0;
  return pixels;
}

/// The same from the pyramid itself (f32 pixels).
inline std::vector<double> storedImage(const NdfPyramid& p, int level, std::size_t image) {
  const int n = p.shape.resolution;
  const int blocks = p.shape.blocksPerAxis();
  const PyramidLevel& l = p.levels[level];
  std::vector<double> pixels(static_cast<std::size_t>(n) * n, 0.0);
  std::uint64_t block = l.mask_ranks[image * p.shape.maskWords()];
  for (int b = 0; b < blocks * blocks; ++b) {
    if (!(l.masks[image * p.shape.maskWords() + b / 64] >> (b % 64) & 1)) continue;
    const float* source = static_cast<const float*>(l.pixels) + block++ * kBlockPixels;
    for (int i = 0; i < kBlockPixels; ++i)
      pixels[(b / blocks * kBlockSize + i / kBlockSize) * n + b % blocks * kBlockSize + i % kBlockSize] =
          static_cast<double>(p.value_scale) * source[i];
  }
  return pixels;
}

/// Textbook alternating least squares in double, with the three factors updated in turn from random starts.
/// @param slices  [count][stride]
/// @return squared error
double referenceCp(const float* slices, int count, int stride, int rank, double min_improvement, int max_sweeps, unsigned seed);

/// Squared singular values of a matrix, largest first.
/// @param columns  column-major, `rows` elements each
std::vector<double> squaredSingularValues(const std::vector<double>& columns, int rows);

/// Squared distance of vectors from the span of others.
/// @param basis    column-major, `rows` elements each
/// @param vectors  the same
double squaredResidual(const std::vector<double>& basis, const std::vector<double>& vectors, int rows);

}  // namespace glint::test
