#include "glint/bake/displace/scaling_function.h"

#include <tbb/parallel_for.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "glint/bake/displace/ordered_sums.h"
#include "glint/math/half.h"

namespace glint::bake {
namespace {

/// Where a denominator is below this share of what a flat surface with a BRDF of 1 has, S is 1: there is no light to scale.
constexpr double kDark = 1e-6;
constexpr double kMostScale = 1000;   // S stays finite in half precision
constexpr double kRidge = 1e-9;       // of the trace: keeps the least squares of a pair solvable where patches are dark
constexpr Eigen::Index kBlock = 512;  // pairs whose columns of R are held at a time
constexpr std::size_t kRows = 8;      // directions whose pairs are one task

constexpr Eigen::Index kMost = kMostScaleTerms;
using TermVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMost, 1>;  // within the object: no allocation
using TermMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMost, kMost>;

/// What the scaling function of one channel is computed from.
struct ScalingProblem {
  const EffectiveBrdf& original;
  const EffectiveBrdf& low;
  std::span<const Vec3> directions;
  std::size_t channel;
  std::vector<double> shares;            ///< [patches]: of the map
  std::vector<double> total, total_low;  ///< [directions][directions], of the whole map

  ScalingProblem(const EffectiveBrdf& of_original, const EffectiveBrdf& of_low, std::span<const Vec3> all, const PatchGrid& cut,
                 std::size_t c)
      : original(of_original),
        low(of_low),
        directions(all),
        channel(c),
        total(of_original.mean(cut, c)),
        total_low(of_low.mean(cut, c)) {
    for (int p = 0; p < cut.count(); ++p) shares.push_back(cut.share(p));
  }

  std::size_t patches() const { return low.patches; }
  /// Effective BRDFs are symmetric: (o, i) stands for (i, o), and neighbouring i are neighbours in memory.
  std::size_t place(std::size_t i, std::size_t o) const { return o * directions.size() + i; }
  bool grazing(std::size_t i, std::size_t o) const {
    return directions[i].z < kGrazingCosine || directions[o].z < kGrazingCosine;
  }
  double dark(std::size_t i, std::size_t o) const { return kDark * directions[i].z * directions[o].z; }
  double lightOf(std::size_t p, std::size_t k) const { return shares[p] * original.patch(p, channel)[k]; }
  double denominator(std::size_t p, std::size_t k) const { return shares[p] * low.patch(p, channel)[k]; }
  double ratio(std::size_t p, std::size_t k) const {
    return static_cast<double>(original.patch(p, channel)[k]) / low.patch(p, channel)[k];
  }
  /// Whether R is known for a pair of directions: neither is grazing, and all patches of the downsampled surface reflect light.
  bool usable(std::size_t i, std::size_t o) const {
    if (grazing(i, o)) return false;
    bool lit = true;
    for (std::size_t p = 0; p < patches(); ++p) lit &= low.patch(p, channel)[place(i, o)] > dark(i, o);
    return lit;
  }
};

/// T of each patch: its light over the light that it would have with R of the whole map.
std::vector<float> spatialFactors(const ScalingProblem& problem) {
  std::vector<double> spatial(problem.patches());
  tbb::parallel_for(std::size_t{0}, spatial.size(), [&](std::size_t p) {
    double wanted = 0, given = 0;
    for (std::size_t o = 0; o < problem.directions.size(); ++o) {
      for (std::size_t i = 0; i < problem.directions.size(); ++i) {
        const std::size_t k = problem.place(i, o);
        if (problem.grazing(i, o) || problem.total_low[k] <= 0) continue;
        wanted += problem.original.patch(p, problem.channel)[k];
        given += problem.total[k] / problem.total_low[k] * problem.low.patch(p, problem.channel)[k];
      }
    }
    spatial[p] = given > 0 ? wanted / given : 1;
  });
  double mean = 0;
  for (std::size_t p = 0; p < spatial.size(); ++p) mean += problem.shares[p] * spatial[p];
  std::vector<float> out;
  for (const double t : spatial) out.push_back(static_cast<float>(mean > 0 ? t / mean : 1));
  return out;
}

/// Finds the angular factors of pairs of directions for given spatial factors. Holds memory that pairs share.
class PairFit {
 public:
  /// @param basis  [patches][terms]: spatial factors
  PairFit(const ScalingProblem& problem, const Eigen::MatrixXd& basis)
      : problem_(problem),
        basis_(basis),
        weights_(basis.rows()),
        wanted_(basis.rows()),
        weighted_(basis.rows(), basis.cols()) {}

  TermVector factors(std::size_t i, std::size_t o) {
    const std::size_t k = problem_.place(i, o);
    for (Eigen::Index p = 0; p < basis_.rows(); ++p) {
      weights_(p) = problem_.denominator(static_cast<std::size_t>(p), k);
      wanted_(p) = problem_.lightOf(static_cast<std::size_t>(p), k);
    }
    TermVector single = TermVector::Zero(basis_.cols());
    const double given = weights_.dot(basis_.col(0));
    // With one term: what the map reflects over what it would reflect with T alone.
    single(0) = given <= problem_.dark(i, o) ? 1 : std::min(kMostScale, problem_.total[k] / given);
    if (basis_.cols() == 1 || given <= problem_.dark(i, o)) return single;
    const TermVector best = leastSquares(problem_.total[k]);
    const bool usable = best.allFinite() && best(0) >= 0 && best.cwiseAbs().maxCoeff() <= kMostScale;
    return usable ? withoutNegativeSums(single, best) : single;
  }

 private:
  /// Least squares, and a multiplier that keeps the light of the whole map.
  TermVector leastSquares(double total) {
    weighted_ = basis_.array().colwise() * weights_.array();
    TermMatrix normal = basis_.transpose().lazyProduct(weighted_);
    normal.diagonal().array() += kRidge * normal.trace();
    const Eigen::LDLT<TermMatrix> solver(normal);
    const TermVector reflected = basis_.transpose().lazyProduct(weights_), wanted = basis_.transpose().lazyProduct(wanted_);
    const TermVector best = solver.solve(wanted), towards = solver.solve(reflected);
    return best + (total - reflected.dot(best)) / reflected.dot(towards) * towards;
  }

  /// The point nearest to `best` between it and T S at which no patch has a sum below 0. Both keep the light of the map, so the
  /// point does, too, and queries have nothing to cut.
  TermVector withoutNegativeSums(const TermVector& single, const TermVector& best) const {
    double share = 1;
    for (Eigen::Index p = 0; p < basis_.rows(); ++p) {
      const double sum = basis_.row(p).dot(best), least = basis_(p, 0) * single(0);
      if (sum < 0) share = std::min(share, least / (least - sum));
    }
    return single + share * (best - single);
  }

  const ScalingProblem& problem_;
  const Eigen::MatrixXd& basis_;
  Eigen::VectorXd weights_, wanted_;
  Eigen::MatrixXd weighted_;
};

/// Terms, and how far their sum is from R. Sums are those of queries: of factors as they are stored, and not below 0.
struct Fit {
  std::vector<ScalingTerm> terms;
  double error = 0, norm = 0;  ///< |R - sum|^2 and |R|^2

  float residual() const { return static_cast<float>(norm > 0 ? std::sqrt(error / norm) : 0); }
};

/// The angular factors of a pair of directions as an asset has them, in half precision.
std::array<float, kMostScaleTerms> storedFactors(std::span<const ScalingTerm> terms, std::size_t pair) {
  std::array<float, kMostScaleTerms> factors = {};
  for (std::size_t t = 0; t < terms.size(); ++t) factors[t] = halfToFloat(floatToHalf(terms[t].angular[pair]));
  return factors;
}

/// What queries answer for a patch.
double queriedSum(std::span<const ScalingTerm> terms, const std::array<float, kMostScaleTerms>& factors, std::size_t patch) {
  float sum = 0;
  for (std::size_t t = 0; t < terms.size(); ++t) sum += terms[t].spatial[patch] * factors[t];
  return std::max(0.0f, sum);
}

/// Finds the angular factors of all pairs.
/// @note O(directions^2 patches terms^2), in parallel
Fit fitTerms(const ScalingProblem& problem, const Eigen::MatrixXd& basis) {
  const std::size_t n = problem.directions.size();
  Fit fit;
  fit.terms.resize(static_cast<std::size_t>(basis.cols()));
  for (std::size_t t = 0; t < fit.terms.size(); ++t) {
    for (Eigen::Index p = 0; p < basis.rows(); ++p)
      fit.terms[t].spatial.push_back(static_cast<float>(basis(p, static_cast<Eigen::Index>(t))));
    fit.terms[t].angular.resize(n * (n + 1) / 2);
  }
  std::vector<double> errors(n), norms(n);
  tbb::parallel_for(std::size_t{0}, n, [&](std::size_t o) {
    PairFit of_pair(problem, basis);
    for (std::size_t i = 0; i <= o; ++i) {
      const std::size_t pair = o * (o + 1) / 2 + i;
      const TermVector factors = of_pair.factors(i, o);
      for (std::size_t t = 0; t < fit.terms.size(); ++t)
        fit.terms[t].angular[pair] = static_cast<float>(factors(static_cast<Eigen::Index>(t)));
      if (!problem.usable(i, o)) continue;
      const auto stored = storedFactors(fit.terms, pair);
      for (std::size_t p = 0; p < problem.patches(); ++p) {
        const double ratio = problem.ratio(p, problem.place(i, o)), error = ratio - queriedSum(fit.terms, stored, p);
        errors[o] += error * error, norms[o] += ratio * ratio;
      }
    }
  });
  for (std::size_t o = 0; o < n; ++o) fit.error += errors[o], fit.norm += norms[o];
  return fit;
}

/// Products of R, and of R minus the terms, with their own transposes: [patches][patches]. Their eigenvalues are the squares of
/// the singular values, and their traces the squares of the norms.
struct Grams {
  Eigen::MatrixXd ratios, errors;
};

/// The part of the products that pairs (i, o) with first <= o < last make.
Grams partOfGrams(const ScalingProblem& problem, std::span<const ScalingTerm> terms, std::size_t first, std::size_t last) {
  const auto patches = static_cast<Eigen::Index>(problem.patches());
  Grams grams{Eigen::MatrixXd::Zero(patches, patches), Eigen::MatrixXd::Zero(patches, patches)};
  Eigen::MatrixXd ratios(patches, kBlock), errors(patches, kBlock);
  Eigen::Index held = 0;
  const auto flush = [&] {
    grams.ratios.noalias() += ratios.leftCols(held) * ratios.leftCols(held).transpose();
    grams.errors.noalias() += errors.leftCols(held) * errors.leftCols(held).transpose();
    held = 0;
  };
  for (std::size_t o = first; o < last; ++o) {
    for (std::size_t i = 0; i <= o; ++i) {
      if (!problem.usable(i, o)) continue;
      const auto stored = storedFactors(terms, o * (o + 1) / 2 + i);
      for (std::size_t p = 0; p < problem.patches(); ++p) {
        const double ratio = problem.ratio(p, problem.place(i, o));
        const auto row = static_cast<Eigen::Index>(p);
        ratios(row, held) = ratio, errors(row, held) = ratio - queriedSum(terms, stored, p);
      }
      if (++held == kBlock) flush();
    }
  }
  flush();
  return grams;
}

/// @note O(directions^2 patches^2), in parallel
Grams gramsOf(const ScalingProblem& problem, std::span<const ScalingTerm> terms) {
  const auto patches = static_cast<Eigen::Index>(problem.patches());
  const std::size_t n = problem.directions.size(), parts = (n + kRows - 1) / kRows;
  Grams grams{Eigen::MatrixXd::Zero(patches, patches), Eigen::MatrixXd::Zero(patches, patches)};
  addInOrder(
      parts, 2 * sizeof(double) * problem.patches() * (problem.patches() + static_cast<std::size_t>(kBlock)),
      [&](std::size_t part) { return partOfGrams(problem, terms, part * kRows, std::min(n, (part + 1) * kRows)); },
      [&](std::size_t, const Grams& part) { grams.ratios += part.ratios, grams.errors += part.errors; });
  return grams;
}

/// Sets the shares of the singular values.
void addSingularValues(const Grams& grams, ScalingFactors& factors) {
  const double norm = grams.ratios.trace();
  if (!(norm > 0)) return;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(grams.ratios, Eigen::EigenvaluesOnly);
  const Eigen::Index patches = grams.ratios.rows();
  for (Eigen::Index k = 0; k < std::min(patches, kMost); ++k)
    factors.singular_shares[static_cast<std::size_t>(k)] =
        static_cast<float>(std::clamp(solver.eigenvalues()(patches - 1 - k) / norm, 0.0, 1.0));
  factors.rank1_energy = factors.singular_shares[0];
}

/// Spatial factors of all terms that there may be, [patches][terms]: T, and singular vectors of the errors, the largest first.
Eigen::MatrixXd spatialBasis(const std::vector<float>& spatial, const Eigen::MatrixXd& errors) {
  // Of the errors only the part that T cannot take, so that no spatial factor is a mixture of others.
  const Eigen::Index patches = errors.rows();
  const Eigen::VectorXd first = Eigen::Map<const Eigen::VectorXf>(spatial.data(), patches).cast<double>();
  const Eigen::VectorXd unit = first.normalized();
  const Eigen::MatrixXd across = Eigen::MatrixXd::Identity(patches, patches) - unit * unit.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(across * errors * across);
  Eigen::MatrixXd basis(patches, std::min(patches, kMost));
  basis.col(0) = first;
  for (Eigen::Index t = 1; t < basis.cols(); ++t) {
    // The sign of a singular vector is chosen by its largest element, so that it does not hang on the solver.
    const Eigen::VectorXd vector = std::sqrt(static_cast<double>(patches)) * solver.eigenvectors().col(patches - t);
    Eigen::Index largest = 0;
    vector.cwiseAbs().maxCoeff(&largest);
    basis.col(t) = vector(largest) < 0 ? Eigen::VectorXd(-vector) : vector;
  }
  return basis;
}

/// Adds terms until the residual is at most the tolerance.
void addTerms(const ScalingProblem& problem, const Eigen::MatrixXd& errors, float tolerance, ScalingFactors& factors) {
  const Eigen::MatrixXd basis = spatialBasis(factors.terms[0].spatial, errors);
  for (Eigen::Index count = 2; count <= basis.cols() && factors.residual > tolerance; ++count) {
    Fit fit = fitTerms(problem, basis.leftCols(count));
    if (fit.residual() >= factors.residual) continue;  // weights of light may favour other pairs than the residual does
    factors.residual = fit.residual();
    factors.terms = std::move(fit.terms);
  }
}

}  // namespace

ScalingFactors factorScaling(const EffectiveBrdf& original, const EffectiveBrdf& low, std::span<const Vec3> directions,
                             const PatchGrid& grid, std::size_t channel, float tolerance) {
  const ScalingProblem problem(original, low, directions, grid, channel);
  const std::vector<float> spatial = spatialFactors(problem);
  Eigen::MatrixXd basis(static_cast<Eigen::Index>(spatial.size()), 1);
  for (std::size_t p = 0; p < spatial.size(); ++p) basis(static_cast<Eigen::Index>(p), 0) = spatial[p];
  Fit fit = fitTerms(problem, basis);
  ScalingFactors factors;
  factors.rank1_residual = factors.residual = fit.residual();
  factors.terms = std::move(fit.terms);
  const Grams grams = gramsOf(problem, factors.terms);
  addSingularValues(grams, factors);
  if (tolerance > 0) addTerms(problem, grams.errors, tolerance, factors);
  return factors;
}

}  // namespace glint::bake
