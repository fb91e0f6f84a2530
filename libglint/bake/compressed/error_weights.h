#pragma once

#include <cstddef>
#include <vector>

#include "glint/bake/compressed/slices.h"

namespace glint::bake {

/// Density of a cell of half vectors over all places of a level.
struct CellDensity {
  double mean = 0;
  double mean_square = 0;
  bool lit = false;  ///< whether a pixel exceeds kDarkestSeen at any place

  /// @return the mean square that errors are relative to
  double seenSquare() const;
  /// @return the mean that a bias is relative to
  double seenMean() const;
};

/// A scale for each pixel of a block: x[i] y[j]. Low-rank forms factor in the scaled domain and scale the basis back, which is
/// exact for such a product.
struct BlockScale {
  float x[kBlockSize];
  float y[kBlockSize];

  /// Writes factors[16 j + i] = x[i] y[j] / divisor.
  void factors(float divisor, float* out) const;
};

/// What the squared error of a pixel counts, in each angular block and level.
///
/// With ErrorMetric::seen, the weighted squared errors of all slices of a level add up to the square of the level's seen error
/// (SeenError). With ErrorMetric::l2 every squared error counts 1.
class ErrorWeights {
 public:
  /// @param scale_range  largest ratio of the scales of two cells of a block, >= 1. A product of two functions is far from the
  ///                     best scale in a block with one bright cell. Pixels with a scale that is far too large hide all other
  ///                     pixels in rounding errors
  /// @note O(pixels of the pyramid)
  ErrorWeights(const SliceIndex& index, ErrorMetric metric, double scale_range);

  /// @return scale of the domain in which a cluster is factored: about 1 / sqrt(mean square density), or 1 with l2
  const BlockScale& scale(std::size_t cluster) const { return scales_[cluster]; }

  /// @return mean weight of a squared error in the scaled domain, for slices of a level
  float slice(std::size_t cluster, int level) const { return slices_[cluster * levels_ + level]; }

  /// @return smallest ratio, over the levels of a cluster, of the mean weight of a scaled square to the largest weight; 1 with l2
  float evenness(std::size_t cluster) const { return evenness_[cluster]; }

  /// Writes the exact weights of squared errors in the scaled domain.
  /// @param out  [256]
  void pixels(std::size_t cluster, int level, float* out) const;

  /// @return pixels of a cell along each axis
  int cellPixels() const { return cell_pixels_; }
  /// @return cells of a block
  int cellCount() const { return kBlockPixels / (cell_pixels_ * cell_pixels_); }
  /// @return cell that has a pixel of a block
  int cellOf(int pixel) const {
    const int side = kBlockSize / cell_pixels_;
    return pixel / kBlockSize / cell_pixels_ * side + pixel % kBlockSize / cell_pixels_;
  }
  /// @return lit cells of a block over those of all blocks: what the weighted squares of its cells add up to
  double litShare(int level, std::size_t block) const;
  /// @return densities of the cells of a block, [cells]
  const CellDensity* cells(int level, std::size_t block) const {
    return cells_.data() + (static_cast<std::size_t>(level) * blocks_ + block) * cellCount();
  }

 private:
  void measureCells();
  void chooseScale(std::size_t cluster);
  double cellWeight(int level, const CellDensity& cell) const;

  const SliceIndex& index_;
  ErrorMetric metric_;
  double log_range_;
  int levels_, cell_pixels_;
  std::size_t blocks_;
  std::vector<CellDensity> cells_;     // [levels][blocks][cells]
  std::vector<double> lit_cells_;      // [levels]: number
  std::vector<double> level_weights_;  // [levels]: weight of a pixel whose cell has the density 1
  std::vector<BlockScale> scales_;     // [clusters]
  std::vector<float> slices_;          // [clusters][levels]
  std::vector<float> evenness_;        // [clusters]
};

}  // namespace glint::bake
