#include "glint/bake/compress_model.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "glint/bake/compress_kernels.h"
#include "glint/model/error.h"

namespace glint::bake {
namespace {

// Below this no reciprocal exists in float; a density so small is an empty cluster.
constexpr float kSmallestPeak = 1e-30f;

// Eigenvalues that float cannot tell from rounding, relative to the largest.
constexpr float kEigenvalueFloor = 4e-7f;

// Ranks at which cp is tried for a tolerance. Each costs a decomposition.
constexpr int kCpRanks[] = {1, 2, 4, 8, 16, 32, 64};

/// Slices of a cluster, divided by its peak, a panel at a time: visit(panel, slices).
template <class Visit>
void forEachPanel(const SliceIndex& index, std::size_t cluster, float peak, Visit visit) {
  const int count = index.sliceCount(cluster);
  std::vector<float> panel(static_cast<std::size_t>(std::min(count, kPanelSlices)) * kSliceStride, 0.0f);
  for (int first = 0; first < count; first += kPanelSlices) {
    const int slices = std::min(kPanelSlices, count - first);
    index.load(cluster, first, slices, 1 / peak, panel.data());
    visit(panel.data(), slices);
  }
}

/// Sum over the slices of slice slice^T, [256][256]. 131 kflop per slice.
std::vector<float> gramMatrix(const SliceIndex& index, std::size_t cluster, float peak) {
  std::vector<float> gram(static_cast<std::size_t>(kBlockPixels) * kBlockPixels, 0.0f);
  forEachPanel(index, cluster, peak, [&](const float* panel, int slices) {
    addGram(panel, kSliceStride, slices, kBlockPixels, gram.data(), kBlockPixels);
  });
  for (int i = 0; i < kBlockPixels; ++i)
    for (int j = i + 1; j < kBlockPixels; ++j) gram[i * kBlockPixels + j] = gram[j * kBlockPixels + i];
  return gram;
}

struct Components {
  std::vector<float> images;    // [K][256]
  std::vector<float> energies;  // [K], falling
};

/// Eigenvectors of a Gram matrix of images, largest eigenvalue first.
Components componentsOfGram(const std::vector<float>& gram) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXf> solver(
      Eigen::Map<const Eigen::MatrixXf>(gram.data(), kBlockPixels, kBlockPixels));
  Components result;
  const float floor = kEigenvalueFloor * solver.eigenvalues()[kBlockPixels - 1];
  for (int k = kBlockPixels - 1; k >= 0 && solver.eigenvalues()[k] > floor; --k) {
    result.energies.push_back(solver.eigenvalues()[k]);
    result.images.insert(result.images.end(), solver.eigenvectors().col(k).data(),
                         solver.eigenvectors().col(k).data() + kBlockPixels);
  }
  return result;
}

/// The same from fewer slices than pixels, through the Gram matrix of the slices.
Components componentsOfSlices(const float* panel, int slices) {
  const int stride = paddedColumns(slices);
  std::vector<float> transposed(static_cast<std::size_t>(kBlockPixels) * stride, 0.0f);
  for (int s = 0; s < slices; ++s)
    for (int p = 0; p < kBlockPixels; ++p) transposed[p * stride + s] = panel[s * kSliceStride + p];
  std::vector<float> gram(static_cast<std::size_t>(slices) * stride);
  multiply({panel, kSliceStride, 1}, transposed.data(), stride, gram.data(), stride, slices, stride, kBlockPixels);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXf> solver(
      Eigen::Map<const Eigen::MatrixXf, 0, Eigen::OuterStride<>>(gram.data(), slices, slices, Eigen::OuterStride<>(stride)));
  Components result;
  const float floor = kEigenvalueFloor * solver.eigenvalues()[slices - 1];
  int count = 0;
  while (count < slices && solver.eigenvalues()[slices - 1 - count] > floor) ++count;
  // Row k of `weights`: eigenvector / singular value. Images = weights T.
  std::vector<float> weights(static_cast<std::size_t>(count) * slices);
  for (int k = 0; k < count; ++k) {
    const float energy = solver.eigenvalues()[slices - 1 - k];
    result.energies.push_back(energy);
    for (int s = 0; s < slices; ++s) weights[k * slices + s] = solver.eigenvectors()(s, slices - 1 - k) / std::sqrt(energy);
  }
  result.images.resize(static_cast<std::size_t>(count) * kBlockPixels);
  multiply({weights.data(), slices, 1}, panel, kSliceStride, result.images.data(), kBlockPixels, count, kBlockPixels, slices);
  return result;
}

}  // namespace

ClusterStatistics measureCluster(const SliceIndex& index, std::size_t cluster) {
  ClusterStatistics statistics;
  float slice[kSliceStride];
  for (int s = 0; s < index.sliceCount(cluster); ++s) {
    index.load(cluster, s, 1, 1, slice);
    // Squares of the largest floats do not overflow in double, and a NaN or infinity stays in the sum.
    double energy = 0;
    float peak = 0;
    for (int p = 0; p < kBlockPixels; ++p) {
      energy += static_cast<double>(slice[p]) * slice[p];
      peak = std::max(peak, std::abs(slice[p]));
    }
    if (!std::isfinite(energy))
      throw Error(ErrorCode::invalid_input, "pyramid.finite", "",
                  "image " + std::to_string(index.image(index.firstSlice(cluster) + s)), "a density is not finite",
                  "build the pyramid again with glint-pyramid");
    statistics.energy += energy;
    statistics.peak = std::max(statistics.peak, peak);
  }
  return statistics;
}

ClusterModel::ClusterModel(const SliceIndex& index, std::size_t cluster, const ClusterStatistics& statistics,
                           const CompressionOptions& options, double negligible)
    : method_(options.method),
      type_(options.coefficient_type),
      cluster_(cluster),
      slice_count_(index.sliceCount(cluster)),
      peak_(statistics.peak),
      energy_(0) {
  if (slice_count_ == 0 || peak_ < kSmallestPeak) {
    choices_.push_back({0, 0, statistics.energy, 0});
    return;
  }
  const double square = static_cast<double>(peak_) * peak_;
  energy_ = statistics.energy / square;
  if (options.tolerance > 0) addChoice(0, 0, energy_);
  if (method_ == CompressionMethod::tucker) decomposeTucker(index, options);
  if (method_ == CompressionMethod::pca) decomposePca(index, options, negligible / square);
  if (method_ == CompressionMethod::cp) decomposeCpRanks(index, options, negligible / square);
  if (options.tolerance > 0) keepHull();
}

void ClusterModel::addChoice(int rank_x, int rank_y, double error) {
  const int columns = method_ == CompressionMethod::tucker ? rank_x * rank_y : rank_x;
  const int basis_elements = method_ == CompressionMethod::pca  ? kBlockPixels * rank_x
                             : method_ == CompressionMethod::cp ? 2 * kBlockSize * rank_x
                                                                : kBlockSize * (rank_x + rank_y);
  const std::uint64_t bytes = static_cast<std::uint64_t>(basis_elements) * basisElementBytes(method_, type_) +
                              static_cast<std::uint64_t>(columns) *
                                  (static_cast<std::uint64_t>(slice_count_) * coefficientElementBytes(type_) + sizeof(float));
  choices_.push_back({rank_x, rank_y, std::max(0.0, error) * peak_ * peak_, bytes});
}

void ClusterModel::keepHull() {
  std::stable_sort(choices_.begin(), choices_.end(), [](const RankChoice& a, const RankChoice& b) {
    return a.bytes != b.bytes ? a.bytes < b.bytes : a.error < b.error;
  });
  std::vector<RankChoice> hull;
  for (const RankChoice& next : choices_) {
    if (!hull.empty() && next.error >= hull.back().error) continue;
    const auto gain = [](const RankChoice& a, const RankChoice& b) {
      return (a.error - b.error) / static_cast<double>(b.bytes - a.bytes);
    };
    while (hull.size() > 1 && gain(hull[hull.size() - 2], hull.back()) <= gain(hull.back(), next)) hull.pop_back();
    hull.push_back(next);
  }
  choices_ = std::move(hull);
}

TuckerAxes ClusterModel::analyseAxes(const SliceIndex& index) const {
  TuckerAnalysis analysis;
  forEachPanel(index, cluster_, peak_, [&](const float* panel, int slices) { analysis.addMoments(panel, slices); });
  analysis.solveAxes();
  forEachPanel(index, cluster_, peak_, [&](const float* panel, int slices) { analysis.addEnergies(panel, slices); });
  return analysis.axes();
}

void ClusterModel::decomposeTucker(const SliceIndex& index, const CompressionOptions& options) {
  axes_ = analyseAxes(index);
  // captured[ry] grows with rank_x: the energy of the leading rank_x x ry corner of the core.
  double captured[kBlockSize + 1] = {};
  RankChoice best{0, 0, std::numeric_limits<double>::infinity(), 0};
  for (int rx = 1; rx <= kBlockSize; ++rx) {
    double row = 0;
    for (int ry = 1; ry <= kBlockSize; ++ry) {
      row += axes_.energy[rx - 1][ry - 1];
      captured[ry] += row;
      const double error = std::max(0.0, energy_ - captured[ry]);
      if (options.tolerance > 0) addChoice(rx, ry, error);
      // Fewer columns win where more bring nothing.
      const bool better = error < best.error - kEigenvalueFloor * energy_ || best.rank_x == 0;
      if (rx * ry <= options.rank && better) best = {rx, ry, error, 0};
    }
  }
  if (!(options.tolerance > 0)) addChoice(best.rank_x, best.rank_y, best.error);
}

void ClusterModel::decomposePca(const SliceIndex& index, const CompressionOptions& options, double negligible) {
  Components components;
  if (slice_count_ < kBlockPixels)
    forEachPanel(index, cluster_, peak_,
                 [&](const float* panel, int slices) { components = componentsOfSlices(panel, slices); });
  else
    components = componentsOfGram(gramMatrix(index, cluster_, peak_));
  const int available = static_cast<int>(components.energies.size());
  double error = energy_;
  int rank = 0;
  if (options.tolerance > 0) {
    while (rank < available && error > negligible) {
      error -= components.energies[rank++];
      addChoice(rank, 0, error);
    }
  } else {
    while (rank < std::min(available, options.rank)) error -= components.energies[rank++];
    addChoice(rank, 0, error);
  }
  // A copy, so that the memory of the columns that are not kept is freed.
  components_.assign(components.images.begin(), components.images.begin() + static_cast<std::ptrdiff_t>(rank) * kBlockPixels);
}

void ClusterModel::decomposeCpRanks(const SliceIndex& index, const CompressionOptions& options, double negligible) {
  const TuckerAxes axes = analyseAxes(index);
  CpTensor tensor;
  tensor.count = slice_count_;
  tensor.energy = energy_;
  std::vector<float> data;
  if (slice_count_ > CpTensor::kMostSlices) {
    data = gramMatrix(index, cluster_, peak_);
    tensor.gram = data.data();
  } else {
    data.resize(static_cast<std::size_t>(slice_count_) * kSliceStride);
    index.load(cluster_, 0, slice_count_, 1 / peak_, data.data());
    tensor.slices = data.data();
  }
  CpLimits limits{options.rank, options.min_improvement, options.max_iterations};
  if (!(options.tolerance > 0)) {
    factors_.push_back(decomposeCp(tensor, axes, limits));
    addChoice(factors_.back().rank, 0, factors_.back().error);
    return;
  }
  for (const int rank : kCpRanks) {
    limits.rank = rank;
    CpFactors factors = decomposeCp(tensor, axes, limits);
    const bool last = factors.rank < rank || factors.error <= negligible;
    addChoice(factors.rank, 0, factors.error);
    factors_.push_back(std::move(factors));
    if (last) break;
  }
}

ClusterBasis ClusterModel::basis(int choice) const {
  const RankChoice& c = choices_[choice];
  ClusterBasis basis{c.rank_x, c.rank_y, {}, {}};
  if (c.rank_x == 0) return basis;
  switch (method_) {
    case CompressionMethod::cp: {
      const auto found = std::find_if(factors_.begin(), factors_.end(), [&](const CpFactors& f) { return f.rank == c.rank_x; });
      basis.x = found->x;
      basis.y = found->y;
      break;
    }
    case CompressionMethod::tucker:
      for (int i = 0; i < kBlockSize; ++i) {
        basis.x.insert(basis.x.end(), axes_.u + i * kBlockSize, axes_.u + i * kBlockSize + c.rank_x);
        basis.y.insert(basis.y.end(), axes_.v + i * kBlockSize, axes_.v + i * kBlockSize + c.rank_y);
      }
      break;
    case CompressionMethod::pca:
      basis.x.resize(static_cast<std::size_t>(kBlockPixels) * c.rank_x);
      for (int k = 0; k < c.rank_x; ++k)
        for (int p = 0; p < kBlockPixels; ++p) basis.x[p * c.rank_x + k] = components_[k * kBlockPixels + p];
      break;
  }
  return basis;
}

}  // namespace glint::bake
