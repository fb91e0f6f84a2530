#include "glint/bake/displace/scaling_function.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace glint::bake {
namespace {

/// Where a denominator is below this share of what a flat surface with a BRDF of 1 has, S is 1: there is no light to scale.
constexpr double kDark = 1e-6;
constexpr double kMostScale = 1000;   // S stays finite in half precision
constexpr double kRidge = 1e-9;       // of the trace: keeps the least squares of a pair solvable where patches are dark
constexpr Eigen::Index kBlock = 512;  // pairs whose columns of R are held at a time

/// What the scaling function of one channel is computed from.
struct ScalingProblem {
  const EffectiveBrdf& original;
  const EffectiveBrdf& low;
  std::span<const Vec3> directions;
  const PatchGrid& grid;
  std::size_t channel;
  std::vector<double> total, total_low;  ///< [directions][directions], of the whole map

  ScalingProblem(const EffectiveBrdf& of_original, const EffectiveBrdf& of_low, std::span<const Vec3> all, const PatchGrid& cut,
                 std::size_t c)
      : original(of_original),
        low(of_low),
        directions(all),
        grid(cut),
        channel(c),
        total(of_original.mean(cut, c)),
        total_low(of_low.mean(cut, c)) {}

  std::size_t patches() const { return low.patches; }
  std::size_t place(std::size_t i, std::size_t o) const { return i * directions.size() + o; }
  bool grazing(std::size_t i, std::size_t o) const {
    return directions[i].z < kGrazingCosine || directions[o].z < kGrazingCosine;
  }
  double dark(std::size_t i, std::size_t o) const { return kDark * directions[i].z * directions[o].z; }
  double lightOf(std::size_t p, std::size_t k) const { return grid.share(static_cast<int>(p)) * original.patch(p, channel)[k]; }
  double denominator(std::size_t p, std::size_t k) const { return grid.share(static_cast<int>(p)) * low.patch(p, channel)[k]; }
};

/// Lists the pairs (i, o), i <= o, of directions that are not grazing and in which every patch of the downsampled surface
/// reflects light.
std::vector<std::pair<std::size_t, std::size_t>> usablePairs(const ScalingProblem& problem) {
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t o = 0; o < problem.directions.size(); ++o) {
    for (std::size_t i = 0; i <= o; ++i) {
      if (problem.grazing(i, o)) continue;
      bool lit = true;
      for (std::size_t p = 0; p < problem.patches(); ++p)
        lit &= problem.low.patch(p, problem.channel)[problem.place(i, o)] > problem.dark(i, o);
      if (lit) pairs.emplace_back(i, o);
    }
  }
  return pairs;
}

/// T of each patch: its light over the light that it would have with R of the whole map.
std::vector<float> spatialFactors(const ScalingProblem& problem) {
  double mean = 0;
  std::vector<double> spatial(problem.patches());
  for (std::size_t p = 0; p < spatial.size(); ++p) {
    double wanted = 0, given = 0;
    for (std::size_t i = 0; i < problem.directions.size(); ++i) {
      for (std::size_t o = 0; o < problem.directions.size(); ++o) {
        const std::size_t k = problem.place(i, o);
        if (problem.grazing(i, o) || problem.total_low[k] <= 0) continue;
        wanted += problem.original.patch(p, problem.channel)[k];
        given += problem.total[k] / problem.total_low[k] * problem.low.patch(p, problem.channel)[k];
      }
    }
    spatial[p] = given > 0 ? wanted / given : 1;
    mean += problem.grid.share(static_cast<int>(p)) * spatial[p];
  }
  std::vector<float> out;
  for (const double t : spatial) out.push_back(static_cast<float>(mean > 0 ? t / mean : 1));
  return out;
}

/// The angular factors of one pair of directions, for given spatial factors.
/// @param basis  [patches][terms]: spatial factors
Eigen::VectorXd pairFactors(const ScalingProblem& problem, const Eigen::MatrixXd& basis, std::size_t i, std::size_t o) {
  const Eigen::Index terms = basis.cols();
  const std::size_t k = problem.place(i, o);
  Eigen::VectorXd weights(basis.rows()), wanted(basis.rows());
  for (Eigen::Index p = 0; p < basis.rows(); ++p) {
    weights(p) = problem.denominator(static_cast<std::size_t>(p), k);
    wanted(p) = problem.lightOf(static_cast<std::size_t>(p), k);
  }
  Eigen::VectorXd factors = Eigen::VectorXd::Zero(terms);
  const double given = weights.dot(basis.col(0));
  // With one term: what the map reflects over what it would reflect with T alone.
  factors(0) = given <= problem.dark(i, o) ? 1 : std::min(kMostScale, problem.total[k] / given);
  if (terms == 1 || given <= problem.dark(i, o)) return factors;
  // With more: least squares, and a multiplier that keeps the light of the whole map.
  Eigen::MatrixXd normal = basis.transpose() * weights.asDiagonal() * basis;
  normal.diagonal().array() += kRidge * normal.trace();
  const Eigen::LDLT<Eigen::MatrixXd> solver(normal);
  const Eigen::VectorXd reflected = basis.transpose() * weights;
  const Eigen::VectorXd best = solver.solve(basis.transpose() * wanted), towards = solver.solve(reflected);
  const double reach = reflected.dot(towards);
  const Eigen::VectorXd all = best + (problem.total[k] - reflected.dot(best)) / reach * towards;
  const bool usable = reach > 0 && all.allFinite() && all(0) >= 0 && all.cwiseAbs().maxCoeff() <= kMostScale;
  return usable ? all : factors;
}

/// The angular factors of all pairs.
std::vector<ScalingTerm> termsFor(const ScalingProblem& problem, const Eigen::MatrixXd& basis) {
  std::vector<ScalingTerm> terms(static_cast<std::size_t>(basis.cols()));
  for (std::size_t t = 0; t < terms.size(); ++t)
    for (Eigen::Index p = 0; p < basis.rows(); ++p)
      terms[t].spatial.push_back(static_cast<float>(basis(p, static_cast<Eigen::Index>(t))));
  for (std::size_t o = 0; o < problem.directions.size(); ++o) {
    for (std::size_t i = 0; i <= o; ++i) {
      const Eigen::VectorXd factors = pairFactors(problem, basis, i, o);
      for (std::size_t t = 0; t < terms.size(); ++t)
        terms[t].angular.push_back(static_cast<float>(factors(static_cast<Eigen::Index>(t))));
    }
  }
  return terms;
}

/// Products of R, and of R minus the terms, with their own transposes: [patches][patches]. Their eigenvalues are the squares of
/// the singular values, and their traces the squares of the norms.
struct Grams {
  Eigen::MatrixXd ratios, errors;
};

Grams gramsOf(const ScalingProblem& problem, std::span<const std::pair<std::size_t, std::size_t>> pairs,
              std::span<const ScalingTerm> terms) {
  const auto patches = static_cast<Eigen::Index>(problem.patches());
  Grams grams{Eigen::MatrixXd::Zero(patches, patches), Eigen::MatrixXd::Zero(patches, patches)};
  for (std::size_t first = 0; first < pairs.size(); first += static_cast<std::size_t>(kBlock)) {
    const Eigen::Index count = std::min(kBlock, static_cast<Eigen::Index>(pairs.size() - first));
    Eigen::MatrixXd ratios(patches, count), errors(patches, count);
    for (Eigen::Index k = 0; k < count; ++k) {
      const auto [i, o] = pairs[first + static_cast<std::size_t>(k)];
      const std::size_t at = problem.place(i, o), pair = o * (o + 1) / 2 + i;
      for (Eigen::Index row = 0; row < patches; ++row) {
        const auto p = static_cast<std::size_t>(row);
        const double ratio =
            static_cast<double>(problem.original.patch(p, problem.channel)[at]) / problem.low.patch(p, problem.channel)[at];
        double sum = 0;
        for (const ScalingTerm& term : terms) sum += static_cast<double>(term.spatial[p]) * term.angular[pair];
        ratios(row, k) = ratio, errors(row, k) = ratio - sum;
      }
    }
    grams.ratios.noalias() += ratios * ratios.transpose();
    grams.errors.noalias() += errors * errors.transpose();
  }
  return grams;
}

float residualOf(const Grams& grams) {
  const double norm = grams.ratios.trace();
  return static_cast<float>(norm > 0 ? std::sqrt(grams.errors.trace() / norm) : 0);
}

/// Sets the shares of the singular values.
void addSingularValues(const Grams& grams, ScalingFactors& factors) {
  const double norm = grams.ratios.trace();
  if (!(norm > 0)) return;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(grams.ratios, Eigen::EigenvaluesOnly);
  const Eigen::Index patches = grams.ratios.rows();
  for (Eigen::Index k = 0; k < std::min<Eigen::Index>(patches, kMostScaleTerms); ++k)
    factors.singular_shares[static_cast<std::size_t>(k)] =
        static_cast<float>(std::clamp(solver.eigenvalues()(patches - 1 - k) / norm, 0.0, 1.0));
  factors.rank1_energy = factors.singular_shares[0];
}

/// Adds terms until the residual is at most the tolerance.
void addTerms(const ScalingProblem& problem, std::span<const std::pair<std::size_t, std::size_t>> pairs,
              const Eigen::MatrixXd& errors, float tolerance, ScalingFactors& factors) {
  // Of the errors only the part that T cannot take, so that no spatial factor is a mixture of others.
  const Eigen::Index patches = errors.rows();
  const Eigen::VectorXd first =
      Eigen::Map<const Eigen::VectorXf>(factors.terms[0].spatial.data(), patches).cast<double>().normalized();
  const Eigen::MatrixXd across = Eigen::MatrixXd::Identity(patches, patches) - first * first.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(across * errors * across);
  const Eigen::Index most = std::min<Eigen::Index>(patches, kMostScaleTerms);
  for (Eigen::Index count = 2; count <= most && factors.residual > tolerance; ++count) {
    Eigen::MatrixXd basis(patches, count);
    for (Eigen::Index p = 0; p < patches; ++p) basis(p, 0) = factors.terms[0].spatial[static_cast<std::size_t>(p)];
    for (Eigen::Index t = 1; t < count; ++t) {
      // The sign of a singular vector is chosen by its largest element, so that it does not hang on the solver.
      Eigen::VectorXd vector = std::sqrt(static_cast<double>(patches)) * solver.eigenvectors().col(patches - t);
      Eigen::Index largest = 0;
      vector.cwiseAbs().maxCoeff(&largest);
      basis.col(t) = vector(largest) < 0 ? Eigen::VectorXd(-vector) : vector;
    }
    std::vector<ScalingTerm> terms = termsFor(problem, basis);
    const float residual = residualOf(gramsOf(problem, pairs, terms));
    if (residual >= factors.residual) continue;  // weights of light may favour other pairs than the residual does
    factors.terms = std::move(terms);
    factors.residual = residual;
  }
}

}  // namespace

ScalingFactors factorScaling(const EffectiveBrdf& original, const EffectiveBrdf& low, std::span<const Vec3> directions,
                             const PatchGrid& grid, std::size_t channel, float tolerance) {
  const ScalingProblem problem(original, low, directions, grid, channel);
  const std::vector<float> spatial = spatialFactors(problem);
  Eigen::MatrixXd basis(static_cast<Eigen::Index>(spatial.size()), 1);
  for (std::size_t p = 0; p < spatial.size(); ++p) basis(static_cast<Eigen::Index>(p), 0) = spatial[p];
  ScalingFactors factors;
  factors.terms = termsFor(problem, basis);
  const auto pairs = usablePairs(problem);
  if (pairs.empty()) return factors;
  const Grams grams = gramsOf(problem, pairs, factors.terms);
  addSingularValues(grams, factors);
  factors.rank1_residual = factors.residual = residualOf(grams);
  if (tolerance > 0) addTerms(problem, pairs, grams.errors, tolerance, factors);
  return factors;
}

}  // namespace glint::bake
