#include "glint/bake/compressed/cp.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "glint/bake/compressed/kernels.h"

namespace glint::bake {
namespace {

constexpr int kSize = kBlockSize;

// Weight of the ridge (third factor) and of the proximal term (first two factors), relative to the mean diagonal of the normal
// equations. It bounds the coefficients of nearly parallel columns.
constexpr float kRegularisation = 1e-3f;

// Step of the extrapolation: its start, its growth after a good sweep, its limit, and its shrinkage after a sweep whose
// extrapolation was taken back.
constexpr float kFirstStep = 0.5f;
constexpr float kStepGrowth = 1.2f;
constexpr float kMostStep = 2;
constexpr float kStepShrink = 0.5f;

// Squared relative errors below this drown in the rounding of float sums.
constexpr double kErrorFloor = 1e-10;

/// Eigenvectors of a symmetric 16x16 matrix as columns of `axes`, largest eigenvalue first.
void sortedAxes(const double* moments, float* axes) {
  using Matrix = Eigen::Matrix<double, kSize, kSize, Eigen::RowMajor>;
  const Eigen::SelfAdjointEigenSolver<Matrix> solver{Matrix(Eigen::Map<const Matrix>(moments))};
  for (int k = 0; k < kSize; ++k)
    for (int i = 0; i < kSize; ++i) axes[i * kSize + k] = static_cast<float>(solver.eigenvectors()(i, kSize - 1 - k));
}

/// Alternating least squares over X and Y; the third factor is always the best one for X and Y.
class CpSolver {
 public:
  CpSolver(const CpTensor& tensor, int rank)
      : tensor_(tensor),
        rank_(rank),
        stride_(paddedColumns(rank)),
        x_(kSize * stride_),
        y_(kSize * stride_),
        khatri_rao_(kBlockPixels * stride_),
        projection_(static_cast<std::size_t>(std::max(kBlockPixels, tensor.slices ? tensor.count : 0)) * stride_),
        third_(projection_.size()),
        back_(kBlockPixels * stride_),
        overlap_x_(square()),
        overlap_y_(square()),
        inverse_(square()),
        moments_(square()),
        third_gram_(square()),
        scratch_(square()),
        solved_(kSize * stride_) {}

  /// Starts with the pairs of axes that have the most energy as columns of X and Y.
  void start(const TuckerAxes& axes, const std::vector<int>& pairs) {
    for (int r = 0; r < rank_; ++r) {
      for (int i = 0; i < kSize; ++i) {
        x_[i * stride_ + r] = axes.u[i * kSize + pairs[r] / kSize];
        y_[i * stride_ + r] = axes.v[i * kSize + pairs[r] % kSize];
      }
    }
  }

  CpFactors run(const CpLimits& limits) {
    std::vector<float> best_x = x_;
    std::vector<float> best_y = y_;
    double best_error = solveThird();
    float step = kFirstStep;
    int sweep = 0;
    while (sweep < limits.max_iterations && best_error > kErrorFloor * tensor_.energy) {
      ++sweep;
      // Solve X and Y, and extrapolate; without extrapolation if the error would rise.
      updateFactors();
      const std::vector<float> plain_x = x_;
      const std::vector<float> plain_y = y_;
      extrapolate(best_x, step, x_);
      extrapolate(best_y, step, y_);
      double error = solveThird();
      const bool taken_back = !(error < best_error);
      if (taken_back) {
        x_ = plain_x;
        y_ = plain_y;
        error = solveThird();
      }
      // Keep the best factors so far, and stop where a sweep improves too little.
      step = taken_back ? step * kStepShrink : std::min(kMostStep, step * kStepGrowth);
      if (!(error < best_error)) break;
      const double improvement = (std::sqrt(best_error) - std::sqrt(error)) / std::sqrt(tensor_.energy);
      best_x = x_;
      best_y = y_;
      best_error = error;
      // A sweep without extrapolation improves less than the sweeps after it, so it does not end the search.
      if (improvement < limits.min_improvement && !taken_back) break;
    }
    return pack(best_x, best_y, best_error, sweep);
  }

 private:
  std::size_t square() const { return static_cast<std::size_t>(stride_) * stride_; }

  /// out = A^T A of a matrix with `stride_` columns.
  void gramOf(const float* a, int rows, float* out) const {
    multiply({a, 1, stride_}, a, stride_, out, stride_, stride_, stride_, rows);
  }

  /// Solves the third factor for the current X and Y: its inverse normal matrix and its Gram matrix, not the factor itself.
  /// @return squared error; infinity where the normal equations are not positive
  double solveThird() {
    // M = T (X o Y) and M^T M, from the slices or from their Gram matrix.
    khatriRao(x_.data(), y_.data(), stride_, khatri_rao_.data());
    gramOf(x_.data(), kSize, overlap_x_.data());
    gramOf(y_.data(), kSize, overlap_y_.data());
    if (tensor_.slices) {
      multiply({tensor_.slices, kSliceStride, 1}, khatri_rao_.data(), stride_, projection_.data(), stride_, tensor_.count,
               stride_, kBlockPixels);
      gramOf(projection_.data(), tensor_.count, moments_.data());
    } else {
      multiply({tensor_.gram, kBlockPixels, 1}, khatri_rao_.data(), stride_, projection_.data(), stride_, kBlockPixels, stride_,
               kBlockPixels);
      multiply({khatri_rao_.data(), 1, stride_}, projection_.data(), stride_, moments_.data(), stride_, stride_, stride_,
               kBlockPixels);
    }
    // H = (X^T X * Y^T Y + ridge)^-1, with an elementwise product.
    for (std::size_t i = 0; i < square(); ++i) inverse_[i] = overlap_x_[i] * overlap_y_[i];
    for (int r = 0; r < rank_; ++r) inverse_[r * (stride_ + 1)] += kRegularisation;
    if (!invertPositive(inverse_.data(), rank_, stride_)) return std::numeric_limits<double>::infinity();
    // The third factor is Z = M H, so Z^T Z = H (M^T M) H.
    multiply({moments_.data(), stride_, 1}, inverse_.data(), stride_, scratch_.data(), stride_, stride_, stride_, stride_);
    multiply({inverse_.data(), stride_, 1}, scratch_.data(), stride_, third_gram_.data(), stride_, stride_, stride_, stride_);
    // Squared error = energy - 2 <T, model> + |model|^2.
    double captured = 0;
    for (int i = 0; i < rank_; ++i)
      for (int j = 0; j < rank_; ++j) {
        const int k = i * stride_ + j;
        captured += 2.0 * inverse_[k] * moments_[k] - static_cast<double>(third_gram_[k]) * overlap_x_[k] * overlap_y_[k];
      }
    return std::max(0.0, tensor_.energy - captured);
  }

  /// Computes back_ = T^T Z, [256][stride].
  void contractThird() {
    if (tensor_.slices) {
      multiply({projection_.data(), stride_, 1}, inverse_.data(), stride_, third_.data(), stride_, tensor_.count, stride_,
               stride_);
      multiply({tensor_.slices, 1, kSliceStride}, third_.data(), stride_, back_.data(), stride_, kBlockPixels, stride_,
               tensor_.count);
    } else {
      multiply({projection_.data(), stride_, 1}, inverse_.data(), stride_, back_.data(), stride_, kBlockPixels, stride_,
               stride_);
    }
  }

  /// Updates X, then Y, for the third factor of solveThird().
  void updateFactors() {
    contractThird();
    contractY(back_.data(), y_.data(), stride_, solved_.data());
    solveFactor(overlap_y_.data(), x_);
    gramOf(x_.data(), kSize, overlap_x_.data());
    contractX(back_.data(), x_.data(), stride_, solved_.data());
    solveFactor(overlap_x_.data(), y_);
  }

  /// factor = (solved_ + mu factor) (third_gram * overlap + mu)^-1 with an elementwise product, then columns of norm 1. mu is
  /// the weight of the proximal term. Where the matrix has no inverse, the factor stays.
  void solveFactor(const float* overlap, std::vector<float>& factor) {
    float trace = 0;
    for (std::size_t i = 0; i < square(); ++i) scratch_[i] = third_gram_[i] * overlap[i];
    for (int r = 0; r < rank_; ++r) trace += scratch_[r * (stride_ + 1)];
    const float weight = kRegularisation * trace / static_cast<float>(rank_) + std::numeric_limits<float>::min();
    for (int r = 0; r < rank_; ++r) scratch_[r * (stride_ + 1)] += weight;
    if (!invertPositive(scratch_.data(), rank_, stride_)) return;
    for (std::size_t i = 0; i < factor.size(); ++i) solved_[i] += weight * factor[i];
    multiply({solved_.data(), stride_, 1}, scratch_.data(), stride_, factor.data(), stride_, kSize, stride_, stride_);
    normalise(factor);
  }

  void normalise(std::vector<float>& factor) const {
    for (int r = 0; r < rank_; ++r) {
      float sum = 0;
      for (int i = 0; i < kSize; ++i) sum += factor[i * stride_ + r] * factor[i * stride_ + r];
      const float scale = sum > 0 ? 1 / std::sqrt(sum) : 0;
      for (int i = 0; i < kSize; ++i) factor[i * stride_ + r] *= scale;
    }
  }

  /// next += step (next - previous), then columns of norm 1.
  void extrapolate(const std::vector<float>& previous, float step, std::vector<float>& next) const {
    for (std::size_t i = 0; i < next.size(); ++i) next[i] += step * (next[i] - previous[i]);
    normalise(next);
  }

  CpFactors pack(const std::vector<float>& x, const std::vector<float>& y, double error, int sweeps) const {
    CpFactors factors{rank_, {}, {}, error, sweeps};
    for (int i = 0; i < kSize; ++i) {
      factors.x.insert(factors.x.end(), x.begin() + i * stride_, x.begin() + i * stride_ + rank_);
      factors.y.insert(factors.y.end(), y.begin() + i * stride_, y.begin() + i * stride_ + rank_);
    }
    return factors;
  }

  const CpTensor& tensor_;
  int rank_;
  int stride_;
  std::vector<float> x_, y_;       // [16][stride]
  std::vector<float> khatri_rao_;  // [256][stride]
  std::vector<float> projection_;  // M = T (X o Y): [L][stride], or Gram times (X o Y): [256][stride]
  std::vector<float> third_;       // Z: [L][stride]
  std::vector<float> back_;        // T^T Z: [256][stride]
  std::vector<float> overlap_x_, overlap_y_, inverse_, moments_, third_gram_, scratch_;  // [stride][stride]
  std::vector<float> solved_;                                                            // [16][stride]
};

}  // namespace

void TuckerAnalysis::addMoments(const float* slices, int count) {
  // A slice is padded by a row of zeros, so a panel is one matrix of 17 * count rows of 16 values.
  static_assert(kSliceStride == kBlockPixels + kSize);
  const auto addTo = [&](const float* rows, double* moments) {
    float sums[kBlockPixels] = {};
    addGram(rows, kSize, count * (kSize + 1), kSize, sums, kSize);
    for (int i = 0; i < kBlockPixels; ++i) moments[i] += sums[i];
  };
  // Along x, then along y with every slice transposed.
  addTo(slices, moments_x_);
  for (int s = 0; s < count; ++s)
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) work_[s * kSliceStride + x * kSize + y] = slices[s * kSliceStride + y * kSize + x];
  for (int s = 0; s < count; ++s) std::fill_n(work_.begin() + s * kSliceStride + kBlockPixels, kSize, 0.0f);
  addTo(work_.data(), moments_y_);
}

void TuckerAnalysis::solveAxes() {
  sortedAxes(moments_x_, axes_.u);
  sortedAxes(moments_y_, axes_.v);
}

void TuckerAnalysis::addEnergies(const float* slices, int count) {
  multiply({slices, kSize, 1}, axes_.u, kSize, work_.data(), kSize, count * (kSize + 1), kSize, kSize);
  float sums[kBlockPixels] = {};
  float core[kBlockPixels];
  for (int s = 0; s < count; ++s) {
    multiply({axes_.v, 1, kSize}, work_.data() + s * kSliceStride, kSize, core, kSize, kSize, kSize, kSize);
    for (int i = 0; i < kBlockPixels; ++i) sums[i] += core[i] * core[i];
  }
  for (int b = 0; b < kSize; ++b)
    for (int a = 0; a < kSize; ++a) axes_.energy[a][b] += sums[b * kSize + a];
}

CpFactors decomposeCp(const CpTensor& tensor, const TuckerAxes& axes, const CpLimits& limits) {
  std::vector<int> pairs(kBlockPixels);
  std::iota(pairs.begin(), pairs.end(), 0);
  const auto energy = [&](int pair) { return axes.energy[pair / kSize][pair % kSize]; };
  std::stable_sort(pairs.begin(), pairs.end(), [&](int p, int q) { return energy(p) > energy(q); });
  int rank = std::min({limits.rank, kSize * tensor.count, kBlockPixels});
  while (rank > 0 && !(energy(pairs[rank - 1]) > kErrorFloor * tensor.energy)) --rank;
  if (rank == 0) return {};
  CpSolver solver(tensor, rank);
  solver.start(axes, pairs);
  return solver.run(limits);
}

}  // namespace glint::bake
