#include "glint/bake/displace/scaling_function.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace glint::bake {
namespace {

/// Where a denominator is below this share of what a flat surface with a BRDF of 1 has, S is 1: there is no light to scale.
constexpr double kDark = 1e-6;
constexpr double kMostScale = 1000;  // S stays finite in half precision

/// Lists the pairs (i, o), i <= o, of directions that are not grazing and in which every patch of the downsampled surface
/// reflects light.
std::vector<std::pair<std::size_t, std::size_t>> usablePairs(const EffectiveBrdf& low, std::span<const Vec3> directions,
                                                             std::size_t channel) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  const std::size_t n = directions.size();
  for (std::size_t o = 0; o < n; ++o) {
    for (std::size_t i = 0; i <= o; ++i) {
      if (directions[i].z < kGrazingCosine || directions[o].z < kGrazingCosine) continue;
      bool lit = true;
      for (std::size_t p = 0; p < low.patches; ++p)
        lit &= low.patch(p, channel)[i * n + o] > kDark * directions[i].z * directions[o].z;
      if (lit) pairs.emplace_back(i, o);
    }
  }
  return pairs;
}

/// Compares R with T S, and finds from the eigenvalues of R R^T how much of R the best matrix of rank 1 keeps.
void measure(const EffectiveBrdf& original, const EffectiveBrdf& low, std::span<const Vec3> directions, std::size_t channel,
             ScalingFactors& factors) {
  const auto pairs = usablePairs(low, directions, channel);
  const std::size_t patches = low.patches;
  if (pairs.empty()) return;
  Eigen::MatrixXd ratios(static_cast<Eigen::Index>(patches), static_cast<Eigen::Index>(pairs.size()));
  double difference = 0, norm = 0;
  for (std::size_t p = 0; p < patches; ++p) {
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      const auto [i, o] = pairs[k];
      const std::size_t at = i * directions.size() + o;
      const double ratio = original.patch(p, channel)[at] / low.patch(p, channel)[at];
      const double product = static_cast<double>(factors.spatial[p]) * factors.angular[o * (o + 1) / 2 + i];
      ratios(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(k)) = ratio;
      difference += (ratio - product) * (ratio - product);
      norm += ratio * ratio;
    }
  }
  const Eigen::MatrixXd gram = ratios * ratios.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(gram, Eigen::EigenvaluesOnly);
  factors.rank1_residual = static_cast<float>(norm > 0 ? std::sqrt(difference / norm) : 0);
  factors.rank1_energy = static_cast<float>(norm > 0 ? std::min(1.0, solver.eigenvalues().maxCoeff() / gram.trace()) : 1);
}

}  // namespace

ScalingFactors factorScaling(const EffectiveBrdf& original, const EffectiveBrdf& low, std::span<const Vec3> directions,
                             const PatchGrid& grid, std::size_t channel) {
  const std::size_t n = directions.size();
  const auto patches = static_cast<std::size_t>(grid.count());
  const std::vector<double> total = original.mean(grid, channel), total_low = low.mean(grid, channel);
  // T of each patch: its light over the light that it would have with R of the whole map.
  ScalingFactors factors;
  double mean = 0;
  std::vector<double> spatial(patches);
  for (std::size_t p = 0; p < patches; ++p) {
    double wanted = 0, given = 0;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t o = 0; o < n; ++o) {
        const std::size_t k = i * n + o;
        if (directions[i].z < kGrazingCosine || directions[o].z < kGrazingCosine || total_low[k] <= 0) continue;
        wanted += original.patch(p, channel)[k];
        given += total[k] / total_low[k] * low.patch(p, channel)[k];
      }
    }
    spatial[p] = given > 0 ? wanted / given : 1;
    mean += grid.share(static_cast<int>(p)) * spatial[p];
  }
  for (double& t : spatial) factors.spatial.push_back(static_cast<float>(mean > 0 ? t / mean : 1));
  // S of each pair: what the map reflects over what it would reflect with T alone.
  for (std::size_t o = 0; o < n; ++o) {
    for (std::size_t i = 0; i <= o; ++i) {
      const std::size_t k = i * n + o;
      double given = 0;
      for (std::size_t p = 0; p < patches; ++p)
        given += grid.share(static_cast<int>(p)) * factors.spatial[p] * low.patch(p, channel)[k];
      const bool dark = given <= kDark * directions[i].z * directions[o].z;
      factors.angular.push_back(static_cast<float>(dark ? 1 : std::min(kMostScale, total[k] / given)));
    }
  }
  measure(original, low, directions, channel, factors);
  return factors;
}

}  // namespace glint::bake
