#include "glint/bake/compressed/error_weights.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "glint/bake/common/seen_error.h"

namespace glint::bake {
namespace {

/// A function of the column plus a function of the row of a block's cells.
struct SeparableFit {
  std::vector<double> columns, rows;
};

/// Finds the sum that is nearest to given values, [side][side], in least squares.
SeparableFit fitSum(const std::vector<double>& values, int side) {
  SeparableFit fit{std::vector<double>(side, 0.0), std::vector<double>(side, 0.0)};
  double mean = 0;
  for (int j = 0; j < side; ++j) {
    for (int i = 0; i < side; ++i) {
      const double v = values[static_cast<std::size_t>(j) * side + i] / side;
      fit.columns[i] += v;
      fit.rows[j] += v;
      mean += v / side;
    }
  }
  for (double& column : fit.columns) column -= mean;
  return fit;
}

}  // namespace

double CellDensity::seenSquare() const { return std::max(mean_square, kDarkestSeen * kDarkestSeen); }
double CellDensity::seenMean() const { return std::max(mean, kDarkestSeen); }

void BlockScale::factors(float divisor, float* out) const {
  for (int j = 0; j < kBlockSize; ++j)
    for (int i = 0; i < kBlockSize; ++i) out[j * kBlockSize + i] = x[i] * y[j] / divisor;
}

ErrorWeights::ErrorWeights(const SliceIndex& index, ErrorMetric metric, double scale_range)
    : index_(index),
      metric_(metric),
      log_range_(std::log(scale_range)),
      levels_(index.levelCount()),
      cell_pixels_(seenCellPixels(index.resolution())),
      blocks_(static_cast<std::size_t>(index.blockCount())),
      cells_(blocks_ * levels_ * cellCount()),
      lit_cells_(levels_, 0.0),
      level_weights_(levels_, 1.0),
      scales_(index.clusterCount()),
      slices_(index.clusterCount() * levels_, 1.0f),
      evenness_(index.clusterCount(), 1.0f) {
  measureCells();
  tbb::parallel_for(std::size_t{0}, index.clusterCount(), [&](std::size_t c) { chooseScale(c); });
}

/// Sums the densities of every cell over the places of each level.
void ErrorWeights::measureCells() {
  tbb::parallel_for(std::size_t{0}, blocks_, [&](std::size_t block) {
    std::vector<float> slice(kSliceStride);
    for (std::size_t cluster = block; cluster < index_.clusterCount(); cluster += blocks_) {
      for (int s = 0; s < index_.sliceCount(cluster); ++s) {
        index_.load(cluster, s, 1, nullptr, slice.data());
        const int level = index_.sliceLevel(cluster, s);
        CellDensity* cells = cells_.data() + (static_cast<std::size_t>(level) * blocks_ + block) * cellCount();
        for (int p = 0; p < kBlockPixels; ++p) {
          const double d = static_cast<double>(slice[p]) * index_.unit();
          CellDensity& cell = cells[cellOf(p)];
          cell.mean += d;
          cell.mean_square += d * d;
          cell.lit |= d > kDarkestSeen;
        }
      }
    }
  });
  for (int level = 0; level < levels_; ++level) {
    const double pixels = static_cast<double>(index_.levelImages(level)) * cell_pixels_ * cell_pixels_;
    double& lit = lit_cells_[level];
    for (std::size_t k = 0; k < blocks_ * cellCount(); ++k) {
      CellDensity& cell = cells_[static_cast<std::size_t>(level) * blocks_ * cellCount() + k];
      cell.mean /= pixels;
      cell.mean_square /= pixels;
      lit += cell.lit;
    }
    if (metric_ == ErrorMetric::seen) level_weights_[level] = 1 / (std::max(1.0, lit) * pixels);
  }
}

double ErrorWeights::litShare(int level, std::size_t block) const {
  const CellDensity* first = cells(level, block);
  const auto lit = std::count_if(first, first + cellCount(), [](const CellDensity& cell) { return cell.lit; });
  return static_cast<double>(lit) / std::max(1.0, lit_cells_[level]);
}

/// Weight of the squared error of a density.
double ErrorWeights::cellWeight(int level, const CellDensity& cell) const {
  return metric_ == ErrorMetric::seen ? level_weights_[level] / cell.seenSquare() : 1;
}

/// Chooses the scale of a cluster from the levels that have slices in it, and the weights of slices in the scaled domain.
void ErrorWeights::chooseScale(std::size_t cluster) {
  BlockScale& scale = scales_[cluster];
  std::fill_n(scale.x, kBlockSize, 1.0f);
  std::fill_n(scale.y, kBlockSize, 1.0f);
  if (metric_ == ErrorMetric::l2 || index_.sliceCount(cluster) == 0) return;
  std::vector<char> occurs(levels_, 0);
  for (int s = 0; s < index_.sliceCount(cluster); ++s) occurs[index_.sliceLevel(cluster, s)] = 1;
  // The mean square of each cell, averaged over the levels.
  const int side = kBlockSize / cell_pixels_, count = cellCount();
  const std::size_t block = cluster % blocks_;
  std::vector<double> logs(count, 0.0);
  double levels = 0;
  for (int level = 0; level < levels_; ++level) {
    if (!occurs[level]) continue;
    ++levels;
    for (int k = 0; k < count; ++k) logs[k] -= 0.5 * std::log(cells(level, block)[k].seenSquare());
  }
  for (double& value : logs) value /= levels;
  const double least = *std::min_element(logs.begin(), logs.end());
  for (double& value : logs) value = std::min(value, least + log_range_);
  const SeparableFit fit = fitSum(logs, side);
  for (int i = 0; i < kBlockSize; ++i) {
    scale.x[i] = static_cast<float>(std::exp(fit.columns[i / cell_pixels_]));
    scale.y[i] = static_cast<float>(std::exp(fit.rows[i / cell_pixels_]));
  }
  // The mean weight of the scaled squares, over cells that are lit.
  float exact[kBlockPixels];
  for (int level = 0; level < levels_; ++level) {
    if (!occurs[level]) continue;
    pixels(cluster, level, exact);
    double sum = 0, lit = 0, most = 0;
    for (int p = 0; p < kBlockPixels; ++p) {
      const CellDensity& cell = cells(level, block)[cellOf(p)];
      sum += cell.lit ? exact[p] : 0;
      lit += cell.lit;
      most = std::max(most, cell.lit ? double{exact[p]} : 0.0);
    }
    if (lit > 0) evenness_[cluster] = std::min(evenness_[cluster], static_cast<float>(sum / (lit * most)));
    slices_[cluster * levels_ + level] = static_cast<float>(lit > 0 ? sum / lit : exact[0]);
  }
}

void ErrorWeights::pixels(std::size_t cluster, int level, float* out) const {
  const CellDensity* densities = cells(level, cluster % blocks_);
  const BlockScale& scale = scales_[cluster];
  const double unit2 = metric_ == ErrorMetric::seen ? static_cast<double>(index_.unit()) * index_.unit() : 1;
  for (int p = 0; p < kBlockPixels; ++p) {
    const double s = static_cast<double>(scale.x[p % kBlockSize]) * scale.y[p / kBlockSize];
    out[p] = static_cast<float>(cellWeight(level, densities[cellOf(p)]) * unit2 / (s * s));
  }
}

}  // namespace glint::bake
