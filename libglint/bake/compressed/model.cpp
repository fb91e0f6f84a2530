#include "glint/bake/compressed/model.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <string>

#include "glint/bake/compressed/kernels.h"
#include "glint/bake/compressed/quantize.h"
#include "glint/model/error.h"

namespace glint::bake {
namespace {

// A cluster with a smaller peak counts as empty: floats hardly have a reciprocal of the peak.
constexpr float kSmallestPeak = 1e-30f;

// Eigenvalues below this part of the largest are rounding of floats.
constexpr float kEigenvalueFloor = 4e-7f;

// Energies of the core's entries below this part of the whole are rounding of floats.
constexpr double kCoreFloor = 1e-11;

// Largest rank of cp that a tolerance chooses. Decompositions of higher rank are slow.
constexpr int kMostCpRank = 64;

// Most spots of a slice.
constexpr int kMostSpots = 48;
// Number of slices (probes) that are searched for spots first, to see whether a search of all slices is worth its time.
constexpr int kProbes = 24;
// The search for spots ends at gains below this many times the negligible error of a slice.
constexpr double kLeastGain = 40;
// Where columns take less than this part of the bytes of spots, by the estimate from probes, spots are not searched.
constexpr double kProbeMargin = 0.7;

// Bytes of a slice of spots besides its spots: its count, its rest, and its part of the running count of its group.
constexpr double kSpotSliceBytes = 2.25;
// Bytes of any slice besides its coefficients: its block mass.
constexpr double kSliceBytes = 1;

/// Principal components of slices.
struct Components {
  std::vector<float> images;    // [K][256], orthonormal
  std::vector<float> energies;  // [K], falling
};

/// Components from the Gram matrix of the pixels, largest energy first.
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

/// Components of fewer slices than pixels, from the smaller Gram matrix of the slices.
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

ClusterStatistics measureCluster(const SliceIndex& index, const ErrorWeights& weights, std::size_t cluster) {
  ClusterStatistics statistics;
  statistics.factors.resize(kBlockPixels);
  weights.scale(cluster).factors(1, statistics.factors.data());
  float slice[kSliceStride];
  for (int s = 0; s < index.sliceCount(cluster); ++s) {
    const std::uint32_t image = index.sliceImage(cluster, s);
    index.load(cluster, s, 1, statistics.factors.data(), slice);
    // In double, squares of the largest floats do not overflow, so a sum that is not finite shows a value that is not.
    double energy = 0;
    float peak = 0;
    for (int p = 0; p < kBlockPixels; ++p) {
      energy += static_cast<double>(slice[p]) * slice[p];
      peak = std::max(peak, std::abs(slice[p]));
    }
    if (!std::isfinite(energy))
      throw Error(ErrorCode::invalid_input, "pyramid.finite", "", "image " + std::to_string(image), "a density is not finite",
                  "build the pyramid again with glint-pyramid");
    statistics.energy += energy * weights.slice(cluster, index.level(image));
    statistics.peak = std::max(statistics.peak, peak);
  }
  if (statistics.peak >= kSmallestPeak) weights.scale(cluster).factors(statistics.peak, statistics.factors.data());
  return statistics;
}

ClusterModel::ClusterModel(const SliceIndex& index, const ErrorWeights& weights, std::size_t cluster,
                           const ClusterStatistics& statistics, const CompressionOptions& options, CoefficientType type,
                           double negligible)
    : method_(*options.method),
      type_(type),
      cluster_(cluster),
      slice_count_(index.sliceCount(cluster)),
      peak_(statistics.peak),
      energy_(0),
      index_(&index),
      statistics_(&statistics),
      scale_(weights.scale(cluster)),
      min_improvement_(options.min_improvement),
      max_iterations_(options.max_iterations) {
  if (slice_count_ == 0 || peak_ < kSmallestPeak) {
    choices_.push_back({false, 0, statistics.energy, 0});
    return;
  }
  for (int s = 0; s < slice_count_; ++s) slice_weights_.push_back(weights.slice(cluster, index.sliceLevel(cluster, s)));
  const double square = static_cast<double>(peak_) * peak_;
  energy_ = statistics.energy / square;
  if (options.tolerance > 0) choices_.push_back({false, 0, statistics.energy, 0});
  if (method_ == CompressionMethod::tucker) decomposeTucker(options, negligible / square);
  if (method_ == CompressionMethod::pca) decomposePca(options, negligible / square);
  if (method_ == CompressionMethod::cp) boundCpRanks(options, negligible / square);
  if (options.tolerance > 0 && options.spots && type_ == CoefficientType::i8 && method_ != CompressionMethod::cp)
    addSpots(negligible / square);
  if (options.tolerance > 0) {
    std::stable_sort(choices_.begin(), choices_.end(), [](const SizeChoice& a, const SizeChoice& b) {
      return a.bytes != b.bytes ? a.bytes < b.bytes : a.error < b.error;
    });
    all_choices_ = std::move(choices_);
    keepHull();
  }
}

const SizeChoice* ClusterModel::nearestColumns(double error) const {
  const SizeChoice* nearest = nullptr;
  const auto distance = [&](const SizeChoice& choice) { return std::abs(std::log(choice.error / error)); };
  for (const SizeChoice& choice : all_choices_)
    if (!choice.spots && choice.count > 0 && choice.error > 0 && (!nearest || distance(choice) < distance(*nearest)))
      nearest = &choice;
  return nearest;
}

bool ClusterModel::hasColumns() const { return nearestColumns(1) != nullptr; }

ClusterBasis ClusterModel::columnsNear(double error, double& predicted) const {
  const SizeChoice& choice = *nearestColumns(error);
  predicted = choice.error;
  return basisOf(choice);
}

void ClusterModel::correctColumns(double factor) {
  for (SizeChoice& choice : all_choices_)
    if (!choice.spots && choice.count > 0) choice.error *= factor;
  keepHull();
}

/// Loads the slices a panel at a time, and calls visit(panel, number of slices).
/// @param weighted  whether each slice is multiplied by the square root of its weight
template <class Visit>
void ClusterModel::forEachPanel(bool weighted, Visit visit) const {
  std::vector<float> panel(static_cast<std::size_t>(std::min(slice_count_, kPanelSlices)) * kSliceStride, 0.0f);
  for (int first = 0; first < slice_count_; first += kPanelSlices) {
    const int slices = std::min(kPanelSlices, slice_count_ - first);
    index_->load(cluster_, first, slices, statistics_->factors.data(), panel.data());
    for (int s = 0; weighted && s < slices; ++s) {
      const float root = std::sqrt(slice_weights_[first + s]);
      for (int p = 0; p < kBlockPixels; ++p) panel[static_cast<std::size_t>(s) * kSliceStride + p] *= root;
    }
    visit(panel.data(), slices);
  }
}

/// Gram matrix of the pixels: the weighted sum over slices of slice slice^T, [256][256]. 131 kflop for each slice.
std::vector<float> ClusterModel::gramMatrix() const {
  std::vector<float> gram(static_cast<std::size_t>(kBlockPixels) * kBlockPixels, 0.0f);
  forEachPanel(true, [&](const float* panel, int slices) {
    addGram(panel, kSliceStride, slices, kBlockPixels, gram.data(), kBlockPixels);
  });
  for (int i = 0; i < kBlockPixels; ++i)
    for (int j = i + 1; j < kBlockPixels; ++j) gram[i * kBlockPixels + j] = gram[j * kBlockPixels + i];
  return gram;
}

/// Adds the steps of one column: from nothing to narrow coefficients, and from narrow to wide; or straight to wide coefficients
/// where the second of the two steps would gain more per byte than the first.
/// @param coefficients  [slices]
void ClusterModel::addColumnSteps(int column, const float* coefficients, double basis_bytes) {
  const double first_bytes = basis_bytes + sizeof(float);
  if (type_ != CoefficientType::i8) {
    double energy = 0;
    for (int s = 0; s < slice_count_; ++s) energy += static_cast<double>(slice_weights_[s]) * coefficients[s] * coefficients[s];
    steps_.push_back({column, 8, energy, first_bytes + static_cast<double>(slice_count_) * coefficientElementBytes(type_)});
    return;
  }
  const double half = 0.5 * slice_count_;
  const ColumnErrors errors = roundingErrors(coefficients, slice_weights_.data(), slice_count_);
  const Step narrow{column, 4, errors.energy - errors.narrow, first_bytes + half};
  const Step wide{column, 8, errors.narrow - errors.wide, half};
  if (narrow.gain * wide.bytes > wide.gain * narrow.bytes) {
    steps_.push_back(narrow);
    steps_.push_back(wide);
  } else {
    steps_.push_back({column, 8, errors.energy - errors.wide, first_bytes + 2 * half});
  }
}

/// Sorts the steps by gain per byte, and adds a choice after each.
/// @param error  squared error without any column
void ClusterModel::addStepChoices(double error) {
  std::erase_if(steps_, [](const Step& step) { return !(step.gain > 0); });
  std::stable_sort(steps_.begin(), steps_.end(),
                   [](const Step& a, const Step& b) { return a.gain * b.bytes > b.gain * a.bytes; });
  double bytes = kSliceBytes * slice_count_;
  for (std::size_t k = 0; k < steps_.size(); ++k) {
    error -= steps_[k].gain;
    bytes += steps_[k].bytes;
    choices_.push_back(
        {false, static_cast<int>(k) + 1, std::max(0.0, error) * peak_ * peak_, static_cast<std::uint64_t>(std::ceil(bytes))});
  }
}

/// Columns and their bits after the first steps.
std::vector<ClusterColumn> ClusterModel::columnsAfter(int steps) const {
  std::vector<ClusterColumn> columns;
  for (int k = 0; k < steps; ++k) {
    const auto same =
        std::find_if(columns.begin(), columns.end(), [&](const ClusterColumn& c) { return c.index == steps_[k].column; });
    if (same != columns.end())
      same->bits = steps_[k].bits;
    else
      columns.push_back({steps_[k].column, steps_[k].bits});
  }
  std::stable_sort(columns.begin(), columns.end(),
                   [](const ClusterColumn& a, const ClusterColumn& b) { return a.bits > b.bits; });
  return columns;
}

/// Adds choices of spots, unless a few slices show that columns take fewer bytes.
void ClusterModel::addSpots(double negligible) {
  const float sigma = index_->sigmaPixels();
  if (!SpotFinder::suits(sigma)) return;
  const SpotFinder finder(sigma, scale_);
  const auto least = static_cast<float>(kLeastGain * negligible / slice_count_);
  std::vector<float> slice(kSliceStride);
  const auto energyOf = [&] {
    double energy = 0;
    for (int p = 0; p < kBlockPixels; ++p) energy += static_cast<double>(slice[p]) * slice[p];
    return energy;
  };
  // Search the probes for spots, and compare with the bytes of columns that leave the same share of the energy.
  double left = 0, probed = 0;
  std::size_t count = 0;
  int probes = 0;
  for (int s = 0; s < slice_count_; s += std::max(1, slice_count_ / kProbes), ++probes) {
    const float weight = slice_weights_[s];
    index_->load(cluster_, s, 1, statistics_->factors.data(), slice.data());
    probed += weight * energyOf();
    count += finder.find(slice.data(), kMostSpots, least / weight).size();
    left += weight * energyOf();
  }
  const double share = probed > 0 ? left / probed : 1;
  const double spot_bytes = static_cast<double>(sizeof(NdfSpot)) * static_cast<double>(count) / probes * slice_count_;
  const auto as_good = std::find_if(choices_.begin(), choices_.end(),
                                    [&](const SizeChoice& c) { return c.error <= share * energy_ * peak_ * peak_; });
  if (as_good != choices_.end() && static_cast<double>(as_good->bytes) < kProbeMargin * spot_bytes) return;
  // Search all slices.
  std::vector<SliceRest> rests;
  for (int s = 0; s < slice_count_; ++s) {
    index_->load(cluster_, s, 1, statistics_->factors.data(), slice.data());
    rests.push_back({finder.evenMatch(slice.data()), static_cast<float>(energyOf())});
    spots_.push_back(finder.find(slice.data(), kMostSpots, least / slice_weights_[s]));
  }
  addSpotChoices(finder, std::move(rests));
}

/// Adds choices with the spots of all slices that gain most, from few spots to all.
/// @param rests  each slice without spots
void ClusterModel::addSpotChoices(const SpotFinder& finder, std::vector<SliceRest> rests) {
  struct Candidate {
    float weighted_gain;
    float gain;
    float share;
    int slice;
  };
  std::vector<Candidate> candidates;
  for (int s = 0; s < slice_count_; ++s)
    for (const Spot& spot : spots_[s])
      candidates.push_back({spot.gain * slice_weights_[s], spot.gain, spot.weight * finder.evenShare(spot), s});
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.weighted_gain > b.weighted_gain; });
  for (const Candidate& c : candidates) spot_gains_.push_back(c.weighted_gain);
  // The nearest even density lowers the squared error of its slice by its match.
  const auto evened = [&](int slice) {
    const SliceRest& rest = rests[slice];
    return slice_weights_[slice] * static_cast<double>(rest.match) * finder.restDensity(rest.match, rest.energy);
  };
  double error = energy_;
  for (int s = 0; s < slice_count_; ++s) error -= evened(s);
  constexpr std::size_t kChoices = 64;
  const std::size_t stride = candidates.size() / kChoices + 1;
  const double slice_bytes = (kSpotSliceBytes + kSliceBytes) * slice_count_ + 2 * sizeof(float);
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    const int slice = candidates[k].slice;
    error += evened(slice) - candidates[k].weighted_gain;
    rests[slice].match -= candidates[k].share;
    rests[slice].energy -= candidates[k].gain;
    error -= evened(slice);
    // A choice is known by its smallest gain, so spots of equal gain are in it together.
    const bool last = k + 1 == candidates.size();
    if ((k % stride == stride - 1 || last) && (last || candidates[k + 1].weighted_gain < candidates[k].weighted_gain))
      choices_.push_back({true, static_cast<int>(k) + 1, std::max(0.0, error) * peak_ * peak_,
                          static_cast<std::uint64_t>(slice_bytes) + sizeof(NdfSpot) * (k + 1)});
  }
}

/// Keeps the choices on the lower convex hull of (bytes, error).
void ClusterModel::keepHull() {
  choices_.clear();
  for (const SizeChoice& next : all_choices_) {
    if (!choices_.empty() && next.error >= choices_.back().error) continue;
    if (!choices_.empty() && next.bytes == choices_.back().bytes) choices_.pop_back();
    const auto gain = [](const SizeChoice& a, const SizeChoice& b) {
      return (a.error - b.error) / static_cast<double>(b.bytes - a.bytes);
    };
    while (choices_.size() > 1 && gain(choices_[choices_.size() - 2], choices_.back()) <= gain(choices_.back(), next))
      choices_.pop_back();
    choices_.push_back(next);
  }
}

TuckerAxes ClusterModel::analyseAxes() const {
  TuckerAnalysis analysis;
  forEachPanel(true, [&](const float* panel, int slices) { analysis.addMoments(panel, slices); });
  analysis.solveAxes();
  forEachPanel(true, [&](const float* panel, int slices) { analysis.addEnergies(panel, slices); });
  return analysis.axes();
}

/// Projects the slices on orthonormal images.
/// @return coefficients, [images][slices]
std::vector<float> ClusterModel::project(const std::vector<float>& images, int count) const {
  const int stride = paddedColumns(count);
  std::vector<float> transposed(static_cast<std::size_t>(kBlockPixels) * stride, 0.0f);
  for (int k = 0; k < count; ++k)
    for (int p = 0; p < kBlockPixels; ++p) transposed[p * stride + k] = images[k * kBlockPixels + p];
  std::vector<float> result(static_cast<std::size_t>(count) * slice_count_);
  std::vector<float> products(static_cast<std::size_t>(kPanelSlices) * stride);
  int first = 0;
  forEachPanel(false, [&](const float* panel, int slices) {
    multiply({panel, kSliceStride, 1}, transposed.data(), stride, products.data(), stride, slices, stride, kBlockPixels);
    for (int s = 0; s < slices; ++s)
      for (int k = 0; k < count; ++k) result[static_cast<std::size_t>(k) * slice_count_ + first + s] = products[s * stride + k];
    first += slices;
  });
  return result;
}

/// Tucker-2: columns are pairs of axes, and gain the energy of their entries of the core.
void ClusterModel::decomposeTucker(const CompressionOptions& options, double negligible) {
  axes_ = analyseAxes();
  std::vector<int> pairs(kBlockPixels);
  std::iota(pairs.begin(), pairs.end(), 0);
  const auto energy = [&](int pair) { return axes_.energy[pair % kBlockSize][pair / kBlockSize]; };
  std::stable_sort(pairs.begin(), pairs.end(), [&](int p, int q) { return energy(p) > energy(q); });
  // Leave out pairs whose energy is rounding, and with a tolerance, pairs after the error is negligible.
  int count = 0;
  double error = energy_;
  const int most = options.tolerance > 0 ? kBlockPixels : options.rank;
  while (count < most && energy(pairs[count]) > kCoreFloor * energy_ && (count == 0 || error > negligible))
    error -= energy(pairs[count++]);
  if (!(options.tolerance > 0)) {
    for (int k = 0; k < count; ++k) steps_.push_back({pairs[k], 8, energy(pairs[k]), 1});
    choices_.push_back({false, count, std::max(0.0, error) * peak_ * peak_, 0});
    return;
  }
  // Project the slices on the product of each pair, to know how coefficients round.
  std::vector<float> images(static_cast<std::size_t>(count) * kBlockPixels);
  for (int k = 0; k < count; ++k)
    for (int p = 0; p < kBlockPixels; ++p)
      images[k * kBlockPixels + p] = axes_.u[p % kBlockSize * kBlockSize + pairs[k] % kBlockSize] *
                                     axes_.v[p / kBlockSize * kBlockSize + pairs[k] / kBlockSize];
  const std::vector<float> coefficients = project(images, count);
  // Bytes of a column: an entry of the core, and the mean cost of a new function along an axis.
  constexpr double kBasisBytes = 1 + 16;
  for (int k = 0; k < count; ++k)
    addColumnSteps(pairs[k], coefficients.data() + static_cast<std::size_t>(k) * slice_count_, kBasisBytes);
  addStepChoices(energy_);
}

/// Principal components of the slices: columns are images, and gain their eigenvalues.
void ClusterModel::decomposePca(const CompressionOptions& options, double negligible) {
  Components components;
  if (slice_count_ < kBlockPixels)
    forEachPanel(true, [&](const float* panel, int slices) { components = componentsOfSlices(panel, slices); });
  else
    components = componentsOfGram(gramMatrix());
  const int available = static_cast<int>(components.energies.size());
  const int most = options.tolerance > 0 ? available : std::min(available, options.rank);
  double error = energy_;
  int rank = 0;
  while (rank < most && (rank == 0 || error > negligible || !(options.tolerance > 0))) error -= components.energies[rank++];
  // A copy of the components that are kept frees the memory of all others.
  components_.assign(components.images.begin(), components.images.begin() + static_cast<std::ptrdiff_t>(rank) * kBlockPixels);
  if (!(options.tolerance > 0)) {
    for (int k = 0; k < rank; ++k) steps_.push_back({k, 8, components.energies[k], 1});
    choices_.push_back({false, rank, std::max(0.0, error) * peak_ * peak_, 0});
    return;
  }
  const std::vector<float> coefficients = project(components_, rank);
  const double basis_bytes = static_cast<double>(kBlockPixels) * sizeof(std::int32_t);
  for (int k = 0; k < rank; ++k)
    addColumnSteps(k, coefficients.data() + static_cast<std::size_t>(k) * slice_count_, basis_bytes);
  addStepChoices(energy_);
}

/// Bounds the error of cp at each rank, without decomposing. A decomposition starts from a column for each of the largest
/// entries of the core, so it ends with less error than theirs: by about the same factor in all clusters, so that the bounds
/// serve to compare clusters.
void ClusterModel::boundCpRanks(const CompressionOptions& options, double negligible) {
  axes_ = analyseAxes();
  std::vector<double> energies(axes_.energy[0], axes_.energy[0] + kBlockPixels);
  std::sort(energies.begin(), energies.end(), std::greater<>());
  const std::uint64_t column_bytes = 2ull * kBlockSize * sizeof(std::int32_t) + sizeof(float) +
                                     static_cast<std::uint64_t>(slice_count_) * coefficientElementBytes(type_);
  const bool one = !(options.tolerance > 0);
  const int most = one ? options.rank : kMostCpRank;
  double error = energy_;
  for (int rank = 1; rank <= std::min(most, kBlockPixels); ++rank) {
    error -= energies[rank - 1];
    if (!one || rank == most)
      choices_.push_back({false, rank, std::max(0.0, error) * peak_ * peak_,
                          static_cast<std::uint64_t>(kSliceBytes * slice_count_) + column_bytes * rank});
    if (!one && error <= negligible) break;
  }
}

/// Decomposes the cluster by cp.
CpFactors ClusterModel::decompose(int rank) const {
  CpTensor tensor;
  tensor.count = slice_count_;
  tensor.energy = energy_;
  std::vector<float> data;
  if (slice_count_ > CpTensor::kMostSlices) {
    data = gramMatrix();
    tensor.gram = data.data();
  } else {
    forEachPanel(true, [&](const float* panel, int slices) {
      data.insert(data.end(), panel, panel + static_cast<std::ptrdiff_t>(slices) * kSliceStride);
    });
    tensor.slices = data.data();
  }
  return decomposeCp(tensor, axes_, {rank, min_improvement_, max_iterations_});
}

ClusterBasis ClusterModel::basis(int choice) const { return basisOf(choices_[choice]); }

ClusterBasis ClusterModel::basisOf(const SizeChoice& choice) const {
  ClusterBasis basis = scaledBasis(choice);
  if (basis.columns.empty()) return basis;
  // The basis was found in the scaled domain.
  const bool images = method_ == CompressionMethod::pca;
  for (std::size_t k = 0; k < basis.x.size(); ++k) {
    const std::size_t pixel = k / basis.rank_x;
    basis.x[k] /= images ? scale_.x[pixel % kBlockSize] * scale_.y[pixel / kBlockSize] : scale_.x[pixel];
  }
  for (std::size_t k = 0; k < basis.y.size(); ++k) basis.y[k] /= scale_.y[k / basis.rank_y];
  return basis;
}

/// Basis of a choice in the scaled domain.
ClusterBasis ClusterModel::scaledBasis(const SizeChoice& c) const {
  ClusterBasis basis;
  if (c.count == 0) return basis;
  if (c.spots) {
    const float least = spot_gains_[c.count - 1];
    for (int s = 0; s < slice_count_; ++s) {
      const SliceSpots& found = spots_[s];
      const auto end =
          std::find_if(found.begin(), found.end(), [&](const Spot& spot) { return spot.gain * slice_weights_[s] < least; });
      basis.spots.emplace_back(found.begin(), end);
    }
    return basis;
  }
  if (method_ == CompressionMethod::cp) {
    CpFactors factors = decompose(c.count);
    for (int k = 0; k < factors.rank; ++k) basis.columns.push_back({k, 8});
    basis.rank_x = basis.rank_y = factors.rank;
    basis.x = std::move(factors.x);
    basis.y = std::move(factors.y);
    return basis;
  }
  basis.columns = columnsAfter(c.count);
  const int columns = static_cast<int>(basis.columns.size());
  if (method_ == CompressionMethod::tucker) {
    for (const ClusterColumn& column : basis.columns) {
      basis.rank_x = std::max(basis.rank_x, column.index % kBlockSize + 1);
      basis.rank_y = std::max(basis.rank_y, column.index / kBlockSize + 1);
    }
    for (int i = 0; i < kBlockSize; ++i) {
      basis.x.insert(basis.x.end(), axes_.u + i * kBlockSize, axes_.u + i * kBlockSize + basis.rank_x);
      basis.y.insert(basis.y.end(), axes_.v + i * kBlockSize, axes_.v + i * kBlockSize + basis.rank_y);
    }
    return basis;
  }
  basis.rank_x = columns;
  basis.x.resize(static_cast<std::size_t>(kBlockPixels) * columns);
  for (int k = 0; k < columns; ++k)
    for (int p = 0; p < kBlockPixels; ++p) basis.x[p * columns + k] = components_[basis.columns[k].index * kBlockPixels + p];
  return basis;
}

}  // namespace glint::bake
