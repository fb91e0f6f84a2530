#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/SVD>
#include <cmath>

#include "glint/bake/displace/scaling_function.h"
#include "glint/math/half.h"

namespace glint::bake::displace_scaling_test {
namespace {

/// Effective BRDFs whose ratio is a sum of `rank` known products, on 4 x 2 patches of unequal size.
struct KnownScaling {
  static constexpr int kDark = 8;
  PatchGrid grid{4, 2, 10, 6, 4};
  std::vector<Vec3> directions = angularDirections(6);
  EffectiveBrdf original, low;

  explicit KnownScaling(int rank) {
    const std::size_t n = directions.size();
    for (EffectiveBrdf* brdf : {&original, &low})
      brdf->directions = n, brdf->patches = 8, brdf->channels = 1, brdf->values.resize(8 * n * n);
    for (std::size_t p = 0; p < 8; ++p) {
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t o = 0; o < n; ++o) {
          const float light = 0.3f * directions[i].z * directions[o].z * (1 + 0.2f * static_cast<float>(p % 3));
          const std::size_t k = (p * n + i) * n + o;
          low.values[k] = light;
          original.values[k] = light * ratio(rank, p, directions[i], directions[o]);
        }
      }
    }
  }

  /// R: symmetric in the directions. With the rank kDark, each patch reflects to a place of its own and hardly elsewhere.
  static float ratio(int rank, std::size_t p, Vec3 wi, Vec3 wo) {
    const auto patch = static_cast<float>(p);
    if (rank == kDark) {
      const float x = 0.5f * (wi.x + wo.x) - 0.4f * std::cos(patch), y = 0.5f * (wi.y + wo.y) - 0.4f * std::sin(patch);
      return 0.003f + std::exp(-6 * (x * x + y * y));
    }
    float sum = (1 + 0.05f * patch) * (0.8f + 0.1f * wi.z * wo.z);
    if (rank > 1) sum += 0.2f * std::sin(1 + 2 * patch) * (wi.x * wo.x);
    if (rank > 2) sum += 0.1f * std::cos(3 * patch) * (wi.y * wo.y + 0.3f * wi.z * wo.z);
    return sum;
  }

  /// R as a matrix of patches and pairs of directions that are not grazing.
  Eigen::MatrixXd matrix() const {
    const std::size_t n = directions.size();
    std::vector<std::size_t> used;
    for (std::size_t o = 0; o < n; ++o)
      for (std::size_t i = 0; i <= o; ++i)
        if (directions[i].z >= kGrazingCosine && directions[o].z >= kGrazingCosine) used.push_back(i * n + o);
    Eigen::MatrixXd m(8, static_cast<Eigen::Index>(used.size()));
    for (std::size_t p = 0; p < 8; ++p)
      for (std::size_t k = 0; k < used.size(); ++k)
        m(static_cast<Eigen::Index>(p), static_cast<Eigen::Index>(k)) =
            static_cast<double>(original.patch(p)[used[k]]) / low.patch(p)[used[k]];
    return m;
  }
};

constexpr double kFloats = 2e-6;  // rounding of single precision in R, relative to the energy of all

TEST(ScalingFunction, SingularValuesAreThoseOfTheWholeMatrix) {
  for (const int rank : {1, 2, 3}) {
    const KnownScaling known(rank);
    const ScalingFactors factors = factorScaling(known.original, known.low, known.directions, known.grid);
    const Eigen::VectorXd values = Eigen::JacobiSVD<Eigen::MatrixXd>(known.matrix()).singularValues();
    for (Eigen::Index k = 0; k < 8; ++k)
      EXPECT_NEAR(factors.singular_shares[static_cast<std::size_t>(k)], values(k) * values(k) / values.squaredNorm(), kFloats)
          << rank << " " << k;
    EXPECT_EQ(factors.rank1_energy, factors.singular_shares[0]);
    EXPECT_EQ(factors.terms.size(), 1u);
    // T S leaves no less than the best product, which the singular values tell.
    EXPECT_GE(factors.rank1_residual * factors.rank1_residual + kFloats, 1 - factors.rank1_energy);
  }
}

TEST(ScalingFunction, TermsAreAddedUntilTheToleranceIsMet) {
  for (const int rank : {1, 2, 3}) {
    const KnownScaling known(rank);
    const ScalingFactors factors = factorScaling(known.original, known.low, known.directions, known.grid, 0, 0.001f);
    EXPECT_LE(factors.residual, 0.001f);
    EXPECT_LE(factors.terms.size(), static_cast<std::size_t>(rank) + 1);  // T is not a singular vector itself
    EXPECT_EQ(factors.terms.size() > 1, factors.rank1_residual > 0.001f) << rank;
  }
  const KnownScaling known(3);
  std::size_t before = 1;
  for (const float tolerance : {0.5f, 0.05f, 0.01f, 0.001f}) {
    const ScalingFactors factors = factorScaling(known.original, known.low, known.directions, known.grid, 0, tolerance);
    EXPECT_LE(factors.residual, tolerance);
    EXPECT_GE(factors.terms.size(), before);
    before = factors.terms.size();
  }
  EXPECT_GE(before, 3u);
}

TEST(ScalingFunction, ResidualIsTheErrorOfWhatQueriesAnswer) {
  for (const int rank : {3, KnownScaling::kDark}) {
    const KnownScaling known(rank);
    const std::size_t n = known.directions.size();
    for (const float tolerance : {0.0f, 0.4f, 0.2f, 0.05f}) {
      const ScalingFactors factors = factorScaling(known.original, known.low, known.directions, known.grid, 0, tolerance);
      double error = 0, norm = 0;
      for (std::size_t o = 0; o < n; ++o) {
        for (std::size_t i = 0; i <= o; ++i) {
          if (known.directions[i].z < kGrazingCosine || known.directions[o].z < kGrazingCosine) continue;
          for (std::size_t p = 0; p < 8; ++p) {
            float sum = 0;
            for (const ScalingTerm& term : factors.terms)
              sum += term.spatial[p] * halfToFloat(floatToHalf(term.angular[o * (o + 1) / 2 + i]));
            const double ratio = double{known.original.patch(p)[i * n + o]} / known.low.patch(p)[i * n + o];
            const double wrong = ratio - std::max(0.0f, sum);
            error += wrong * wrong, norm += ratio * ratio;
          }
        }
      }
      EXPECT_NEAR(factors.residual, std::sqrt(error / norm), kFloats) << rank << " " << tolerance;
    }
  }
}

TEST(ScalingFunction, NoSumOfTermsIsNegative) {
  // Terms fitted without this bound go down to -.2 where a patch reflects next to nothing.
  const KnownScaling known(KnownScaling::kDark);
  std::size_t several = 0;
  for (const float tolerance : {0.4f, 0.2f, 0.1f, 0.01f}) {
    const ScalingFactors factors = factorScaling(known.original, known.low, known.directions, known.grid, 0, tolerance);
    several += factors.terms.size() > 2;
    for (std::size_t pair = 0; pair < factors.terms[0].angular.size(); ++pair) {
      for (std::size_t p = 0; p < 8; ++p) {
        float sum = 0;
        for (const ScalingTerm& term : factors.terms) sum += term.spatial[p] * term.angular[pair];
        EXPECT_GE(sum, -1e-6f) << tolerance << " " << pair << " " << p;
      }
    }
  }
  EXPECT_GE(several, 2u);
}

TEST(ScalingFunction, DoesNotDependOnThreads) {
  const KnownScaling known(KnownScaling::kDark);
  const ScalingFactors many = factorScaling(known.original, known.low, known.directions, known.grid, 0, 0.05f);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const ScalingFactors single = factorScaling(known.original, known.low, known.directions, known.grid, 0, 0.05f);
  ASSERT_EQ(many.terms.size(), single.terms.size());
  EXPECT_GT(many.terms.size(), 2u);
  for (std::size_t t = 0; t < many.terms.size(); ++t) {
    EXPECT_EQ(many.terms[t].spatial, single.terms[t].spatial);
    EXPECT_EQ(many.terms[t].angular, single.terms[t].angular);
  }
  EXPECT_EQ(many.residual, single.residual);
  EXPECT_EQ(many.singular_shares, single.singular_shares);
}

TEST(ScalingFunction, TheWholeMapReflectsWhatTheOriginalDoesHoweverManyTerms) {
  for (const int rank : {3, KnownScaling::kDark}) {
    const KnownScaling known(rank);
    const std::size_t n = known.directions.size();
    const std::vector<double> total = known.original.mean(known.grid);
    for (const float tolerance : {0.0f, 0.05f, 0.001f}) {
      const ScalingFactors factors = factorScaling(known.original, known.low, known.directions, known.grid, 0, tolerance);
      for (std::size_t o = 0; o < n; ++o) {
        for (std::size_t i = 0; i <= o; ++i) {
          double given = 0;
          for (std::size_t p = 0; p < 8; ++p)
            for (const ScalingTerm& term : factors.terms)
              given += known.grid.share(static_cast<int>(p)) * term.spatial[p] * term.angular[o * (o + 1) / 2 + i] *
                       known.low.patch(p)[i * n + o];
          EXPECT_NEAR(given, total[i * n + o], 1e-5 * total[i * n + o]);
        }
      }
    }
  }
}

}  // namespace
}  // namespace glint::bake::displace_scaling_test
