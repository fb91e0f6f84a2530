#include "glint/bake/compressed/slice_errors.h"

#include <algorithm>

namespace glint::bake {
namespace {

/// Sums over the rows of a block, one for each column: the compiler adds them in vectors.
struct ColumnSums {
  float lanes[kBlockSize] = {};
  float sum() const {
    float total = 0;
    for (const float lane : lanes) total += lane;
    return total;
  }
};

struct ScaledErrorSums {
  ColumnSums error, cross, power;
  void add(int x, float weight, float difference, float decoded) {
    error.lanes[x] += weight * difference * difference;
    cross.lanes[x] += weight * difference * decoded;
    power.lanes[x] += weight * decoded * decoded;
  }
  ScaledError total() const { return {error.sum(), cross.sum(), power.sum()}; }
};

}  // namespace

SliceComparer::SliceComparer(const SliceIndex& index, const ErrorWeights& weights, std::size_t cluster,
                             const ClusterStatistics& statistics, std::span<const float> density_scales)
    : index_(index),
      weights_(weights),
      cluster_(cluster),
      density_scales_(density_scales),
      density_(static_cast<double>(statistics.peak) * index.unit()),
      pixel_weights_(static_cast<std::size_t>(index.levelCount())) {
  const BlockScale& scale = weights.scale(cluster);
  for (int p = 0; p < kBlockPixels; ++p) unscale_[p] = 1 / (scale.x[p % kBlockSize] * scale.y[p / kBlockSize]);
  const std::size_t cells = static_cast<std::size_t>(index.levelCount()) * weights.cellCount();
  errors_.cell_sums.assign(cells, 0.0);
  errors_.cell_errors.assign(cells, 0.0);
}

void SliceComparer::setFloors(const ClusterFloors& floors, float density) {
  if (!(density > 0)) return;
  for (int p = 0; p < kBlockPixels; ++p)
    floors_[p] = floors.at(floorCell(p % kBlockSize, p / kBlockSize)) / density / unscale_[p];
}

const float* SliceComparer::pixelWeights(int level) {
  std::vector<float>& pixels = pixel_weights_[level];
  if (pixels.empty()) {
    pixels.resize(kBlockPixels);
    weights_.pixels(cluster_, level, pixels.data());
  }
  return pixels.data();
}

void SliceComparer::add(const float* slice, const float* decoded) {
  const std::uint32_t image = index_.sliceImage(cluster_, static_cast<int>(errors_.slices.size()));
  const int level = index_.level(image), cell_pixels = weights_.cellPixels(), side = kBlockSize / cell_pixels;
  const float density_scale = measuredScale(density_scales_[image]), *pixel_weights = pixelWeights(level);
  double* cell_sums = errors_.cell_sums.data() + static_cast<std::size_t>(level) * weights_.cellCount();
  double* cell_errors = errors_.cell_errors.data() + static_cast<std::size_t>(level) * weights_.cellCount();
  ScaledErrorSums plain, seen;
  ColumnSums sums, positive;
  for (int row = 0; row < side; ++row) {
    ColumnSums densities, squares;
    for (int y = row * cell_pixels; y < (row + 1) * cell_pixels; ++y) {
      for (int x = 0; x < kBlockSize; ++x) {
        const int p = y * kBlockSize + x;
        const float unscale = unscale_[p], d = decoded[p], cut = std::max(0.0f, d - floors_[p]), shown = density_scale * cut;
        plain.add(x, unscale * unscale, slice[p] - d, d);
        seen.add(x, pixel_weights[p], slice[p] - shown, shown);
        sums.lanes[x] += unscale * d;
        positive.lanes[x] += unscale * cut;
        densities.lanes[x] += unscale * shown;
        const float e = unscale * (slice[p] - shown);
        squares.lanes[x] += e * e;
      }
    }
    for (int x = 0; x < kBlockSize; ++x) {
      const int cell = row * side + x / cell_pixels;
      cell_sums[cell] += density_ * densities.lanes[x];
      cell_errors[cell] += density_ * density_ * squares.lanes[x];
    }
  }
  errors_.slices.push_back({plain.total(), seen.total(), density_scale, sums.sum(), positive.sum()});
}

}  // namespace glint::bake
