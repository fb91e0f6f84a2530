#pragma once

#include <vector>

#include "glint/bake/compressed/slices.h"

namespace glint::bake {

/// Second moments of a 16x16xL tensor along its first two modes.
struct TuckerAxes {
  float u[kBlockPixels];                       ///< [x][a]: orthonormal columns, most energy first
  float v[kBlockPixels];                       ///< [y][b]
  double energy[kBlockSize][kBlockSize] = {};  ///< [a][b]: sum over slices of (u_a^T slice v_b)^2
};

/// Adds the Gram matrices of panels and, in a second pass, the energies of the core (HOSVD, Tucker-2).
class TuckerAnalysis {
 public:
  /// @param slices  [count][kSliceStride], the padding 0; count <= kPanelSlices
  void addMoments(const float* slices, int count);
  /// Call once, after all moments.
  void solveAxes();
  /// Call for all panels again, after solveAxes().
  void addEnergies(const float* slices, int count);
  const TuckerAxes& axes() const { return axes_; }

 private:
  TuckerAxes axes_;
  double moments_x_[kBlockPixels] = {};
  double moments_y_[kBlockPixels] = {};
  std::vector<float> work_ = std::vector<float>(static_cast<std::size_t>(kPanelSlices) * kSliceStride);
};

/// A 16x16xL tensor as alternating least squares needs it: L slices, or their 256x256 Gram matrix when L is larger than that
/// saves. With the Gram matrix the third factor never appears and a sweep costs the same for any L.
struct CpTensor {
  const float* slices = nullptr;  ///< [count][kSliceStride]; null: use `gram`
  int count = 0;                  ///< L
  const float* gram = nullptr;    ///< [256][256]: sum over slices of slice slice^T
  double energy = 0;              ///< sum of squares

  /// L above which a sweep over the Gram matrix is cheaper.
  static constexpr int kMostSlices = 128;
};

struct CpLimits {
  int rank = 16;
  double min_improvement = 1e-4;  ///< of the relative error, per sweep
  int max_iterations = 500;
};

/// Factors of the first two modes, columns of norm 1. The third follows from them by least squares.
struct CpFactors {
  int rank = 0;
  std::vector<float> x;  ///< [16][rank]
  std::vector<float> y;  ///< [16][rank]
  double error = 0;      ///< squared, of the best third factor (regularised)
  int sweeps = 0;
};

/// Canonical polyadic decomposition by alternating least squares (Deng 2022, Eq. 5).
///
/// Starts from the pairs of HOSVD axes with the largest energy. The third factor is eliminated: each sweep solves it exactly
/// for the current X and Y. X and Y are solved with a proximal term, so that nearly parallel columns stay stable, and
/// extrapolated; a sweep that makes the error worse is taken back and repeated without extrapolation, so the error never rises.
/// @return at most min(rank, 16 L, number of axis pairs that hold energy) columns; none for a tensor of zeros
CpFactors decomposeCp(const CpTensor& tensor, const TuckerAxes& axes, const CpLimits& limits);

}  // namespace glint::bake
