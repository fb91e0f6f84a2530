#pragma once

#include <vector>

#include "glint/bake/compressed/slices.h"

namespace glint::bake {

/// The axes of a 16x16xL tensor along its first two modes (HOSVD), and the energy of each pair of axes.
struct TuckerAxes {
  float u[kBlockPixels];                       ///< [x][a]: orthonormal columns, most energy first
  float v[kBlockPixels];                       ///< [y][b]: the same along y
  double energy[kBlockSize][kBlockSize] = {};  ///< [a][b]: sum over slices of (u_a^T slice v_b)^2
};

/// Finds the axes of a tensor in two passes over its slices: the first sums Gram matrices along each mode, the second sums the
/// energies of pairs of axes (HOSVD, Tucker-2).
class TuckerAnalysis {
 public:
  /// @param slices  [count][kSliceStride], the padding 0; count <= kPanelSlices
  void addMoments(const float* slices, int count);
  /// Computes the axes. Call once, after addMoments() for all panels.
  void solveAxes();
  /// Call for all panels again, after solveAxes(). Parameters as for addMoments().
  void addEnergies(const float* slices, int count);
  const TuckerAxes& axes() const { return axes_; }

 private:
  TuckerAxes axes_;
  double moments_x_[kBlockPixels] = {};
  double moments_y_[kBlockPixels] = {};
  std::vector<float> work_ = std::vector<float>(static_cast<std::size_t>(kPanelSlices) * kSliceStride);
};

/// A 16x16xL tensor for alternating least squares: L slices, or their 256x256 Gram matrix where L is above kMostSlices. With
/// the Gram matrix no sweep computes the third factor, so its cost does not depend on L.
struct CpTensor {
  const float* slices = nullptr;  ///< [count][kSliceStride]; null: use `gram`
  int count = 0;                  ///< L
  const float* gram = nullptr;    ///< [256][256]: sum over slices of slice slice^T
  double energy = 0;              ///< sum of the squares of all values

  /// L above which a sweep over the Gram matrix is cheaper.
  static constexpr int kMostSlices = 128;
};

/// Limits of the search for factors.
struct CpLimits {
  int rank = 16;
  double min_improvement = 1e-4;  ///< least improvement of the relative error by a sweep
  int max_iterations = 500;       ///< most sweeps
};

/// Factors of the first two modes, with columns of norm 1. Least squares give the third factor from these two.
struct CpFactors {
  int rank = 0;
  std::vector<float> x;  ///< [16][rank]
  std::vector<float> y;  ///< [16][rank]
  double error = 0;      ///< squared error with the best third factor (regularised)
  int sweeps = 0;
};

/// Canonical polyadic decomposition by alternating least squares (Deng 2022, Eq. 5).
///
/// Starts from the pairs of HOSVD axes with the largest energy. Each sweep solves the third factor exactly for the current X
/// and Y, then X, then Y. A proximal term keeps nearly parallel columns stable. X and Y are then extrapolated; if that makes
/// the error larger, the extrapolation is taken back, so the error never rises.
/// @return at most min(rank, 16 L, number of axis pairs that hold energy) columns; none for a tensor of zeros
CpFactors decomposeCp(const CpTensor& tensor, const TuckerAxes& axes, const CpLimits& limits);

}  // namespace glint::bake
