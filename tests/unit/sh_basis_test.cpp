#include "glint/query/light/sh_basis.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "glint/bake/sh/gauss_legendre.h"
#include "glint/bake/sh/lobes.h"
#include "glint/bake/sh/rotation.h"
#include "glint/model/error.h"
#include "glint/query/light/sh_lobe_table.h"

namespace glint::sh_basis_test {
namespace {

constexpr double kPi = std::numbers::pi;

template <class T>
std::vector<T> harmonics(int order, double x, double y, double z) {
  std::vector<T> memory(ShRecurrence<T>::size(order)), out(shCount(order)), scratch(ShAccumulator<T>::scratchSize(order));
  const ShRecurrence<T> recurrence(order, memory);
  ShAccumulator<T> sum(recurrence, order, out, scratch);
  sum.add(x, y, z, 1);
  sum.flush();
  return out;
}

/// Polar angles all over the sphere, and closer and closer to both poles and the equator.
std::vector<double> hardAngles() {
  std::vector<double> angles;
  for (int k = 0; k <= 60; ++k) angles.push_back(kPi * k / 60);
  for (const double small : {1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 0.01, 0.03}) {
    angles.push_back(small);
    angles.push_back(kPi - small);
    angles.push_back(kPi / 2 + small);
  }
  return angles;
}

/// Largest relative error of the sum over m of (y_l^m)^2 = (2l + 1) / (4 pi), over all bands.
template <class T>
double worstAdditionError(int order, double theta, double phi) {
  const std::vector<T> y =
      harmonics<T>(order, std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
  double worst = 0;
  for (int l = 0; l <= order; ++l) {
    double sum = 0;
    for (int m = -l; m <= l; ++m) sum += static_cast<double>(y[shIndex(l, m)]) * y[shIndex(l, m)];
    worst = std::max(worst, std::fabs(sum * 4 * kPi / (2 * l + 1) - 1));
  }
  return worst;
}

TEST(ShBasis, SquaresOfABandSumToItsSizeAtOrder300InEveryDirection) {
  // Rounding of 300 steps of a recurrence, 1.2e-12 at 0.001 of a radian from a pole and below 1e-12 elsewhere; functions that
  // were lost to under- or overflow would be wrong by far more.
  constexpr double kTolerance = 2e-12;
  for (const double theta : hardAngles()) EXPECT_LT(worstAdditionError<double>(300, theta, 0.7), kTolerance) << theta;
}

TEST(ShBasis, SquaresOfABandSumToItsSizeAtOrder1000) {
  constexpr double kTolerance = 1e-11;
  for (const double theta : {0.0, 1e-6, 0.01, 0.2, 0.7, 1.5, kPi / 2, 3.1})
    EXPECT_LT(worstAdditionError<double>(1000, theta, 2), kTolerance);
}

TEST(ShBasis, FloatKeepsFourDigitsToItsOrder) {
  constexpr double kTolerance = 2e-4;  // 128^1.5 roundings of 6e-8, most near the poles
  for (const double theta : hardAngles()) EXPECT_LT(worstAdditionError<float>(128, theta, 0.7), kTolerance) << theta;
}

TEST(ShBasis, FirstBandsAreTheTextbooks) {
  const double x = 0.48, y = -0.6, z = 0.64;
  const std::vector<double> v = harmonics<double>(3, x, y, z);
  constexpr double kRounding = 1e-14;
  EXPECT_NEAR(v[shIndex(0, 0)], std::sqrt(1 / (4 * kPi)), kRounding);
  EXPECT_NEAR(v[shIndex(1, 0)], std::sqrt(3 / (4 * kPi)) * z, kRounding);
  EXPECT_NEAR(v[shIndex(1, 1)], std::sqrt(3 / (4 * kPi)) * x, kRounding);
  EXPECT_NEAR(v[shIndex(1, -1)], std::sqrt(3 / (4 * kPi)) * y, kRounding);
  EXPECT_NEAR(v[shIndex(2, 0)], std::sqrt(5 / (16 * kPi)) * (3 * z * z - 1), kRounding);
  EXPECT_NEAR(v[shIndex(2, 2)], std::sqrt(15 / (16 * kPi)) * (x * x - y * y), kRounding);
  EXPECT_NEAR(v[shIndex(2, -2)], std::sqrt(15 / (4 * kPi)) * x * y, kRounding);
  EXPECT_NEAR(v[shIndex(3, 3)], std::sqrt(35 / (32 * kPi)) * x * (x * x - 3 * y * y), kRounding);
}

TEST(ShBasis, IsOrthonormal) {
  constexpr int kOrder = 12;
  const bake::GaussLegendre rule = bake::gaussLegendre(kOrder + 1);
  std::vector<double> products(shCount(kOrder) * shCount(kOrder));
  for (std::size_t j = 0; j < rule.nodes.size(); ++j) {
    for (int k = 0; k < 2 * kOrder + 1; ++k) {
      const double phi = 2 * kPi * k / (2 * kOrder + 1), s = std::sqrt(1 - rule.nodes[j] * rule.nodes[j]);
      const auto y = harmonics<double>(kOrder, s * std::cos(phi), s * std::sin(phi), rule.nodes[j]);
      for (std::size_t a = 0; a < y.size(); ++a)
        for (std::size_t b = 0; b < y.size(); ++b)
          products[a * y.size() + b] += y[a] * y[b] * rule.weights[j] * 2 * kPi / (2 * kOrder + 1);
    }
  }
  for (std::size_t a = 0; a < shCount(kOrder); ++a)
    for (std::size_t b = 0; b < shCount(kOrder); ++b) ASSERT_NEAR(products[a * shCount(kOrder) + b], a == b, 1e-13);
}

TEST(ShBasis, DirectionsAddUpWhateverTheBatch) {
  constexpr int kOrder = 40;
  std::vector<double> memory(ShRecurrence<double>::size(kOrder)), out(shCount(kOrder)), expected(shCount(kOrder));
  std::vector<double> scratch(ShAccumulator<double>::scratchSize(kOrder));
  const ShRecurrence<double> recurrence(kOrder, memory);
  ShAccumulator<double> sum(recurrence, kOrder, out, scratch);
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int d = 0; d < 7; ++d) {
    const double x = normal(random), y = normal(random), z = normal(random), weight = normal(random);
    sum.add(x, y, z, weight);
    const auto one = harmonics<double>(kOrder, x, y, z);
    for (std::size_t k = 0; k < one.size(); ++k) expected[k] += weight * one[k];
  }
  sum.flush();
  for (std::size_t k = 0; k < out.size(); ++k) ASSERT_NEAR(out[k], expected[k], 1e-12);
}

TEST(GaussLegendre, IsExactForPolynomials) {
  for (const int n : {1, 2, 5, 64, 400}) {
    const bake::GaussLegendre rule = bake::gaussLegendre(n, 0, 1);
    for (const int degree : {0, 1, n, 2 * n - 1}) {
      double sum = 0;
      for (std::size_t k = 0; k < rule.nodes.size(); ++k) sum += rule.weights[k] * std::pow(rule.nodes[k], degree);
      EXPECT_NEAR(sum * (degree + 1), 1, 1e-12) << n << " nodes, degree " << degree;
    }
  }
}

TEST(ShRotationY, TurnsEveryHarmonicAsEvaluationDoes) {
  constexpr int kOrder = 20;
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  for (const double angle : {0.0, 1e-5, 0.4, kPi / 2, 2.5, kPi}) {
    std::vector<double> before(shCount(kOrder)), after(shCount(kOrder));
    for (double& c : before) c = normal(random);
    bake::ShRotationY rotation(angle, kOrder, kOrder);
    for (int l = 0; l <= kOrder; ++l) {
      ASSERT_EQ(rotation.band(), l);
      for (int m = 0; m <= l; ++m) {
        for (int k = 0; k <= l; ++k) {
          const std::size_t place = static_cast<std::size_t>(m * (l + 1) + k);
          after[shIndex(l, m)] += rotation.cosines()[place] * before[shIndex(l, k)];
          if (m > 0 && k > 0) after[shIndex(l, -m)] += rotation.sines()[place] * before[shIndex(l, -k)];
        }
      }
      if (l < kOrder) rotation.next();
    }
    for (int sample = 0; sample < 10; ++sample) {
      const double x = normal(random), y = normal(random), z = normal(random);
      const auto here = harmonics<double>(kOrder, x, y, z);
      const auto there =
          harmonics<double>(kOrder, x * std::cos(angle) + z * std::sin(angle), y, z * std::cos(angle) - x * std::sin(angle));
      double turned = 0, expected = 0;
      for (std::size_t k = 0; k < here.size(); ++k) turned += after[k] * here[k], expected += before[k] * there[k];
      EXPECT_NEAR(turned, expected, 1e-10) << angle;
    }
  }
}

TEST(ShRotationY, IsOrthogonalAtOrder300) {
  constexpr int kOrder = 300;
  for (const double angle : {1e-3, 0.1, 1.0, kPi / 2, 3.0}) {
    bake::ShRotationY rotation(angle, kOrder, 80);
    while (rotation.band() < kOrder) rotation.next();
    for (const int m : {0, 1, 40, 80}) {
      double sum = 0;
      for (int k = 0; k <= kOrder; ++k) sum += std::pow(rotation.cosines()[static_cast<std::size_t>(m * (kOrder + 1) + k)], 2);
      EXPECT_NEAR(sum, 1, 1e-10) << "angle " << angle << " row " << m;
    }
  }
}

/// Plain quadrature of the lobe with many more nodes than needed.
double zonalByQuadrature(double sigma, int l) {
  constexpr int kSteps = 20000;
  const double reach = std::min(kPi / 2, 12 * sigma);
  double sum = 0;
  for (int k = 0; k < kSteps; ++k) {
    const double a = reach * (k + 0.5) / kSteps;
    const double lobe = std::exp(-std::pow(std::sin(a) / sigma, 2) / 2) / (2 * kPi * sigma * sigma);
    sum += lobe * std::legendre(static_cast<unsigned>(l), std::cos(a)) * std::sin(a);
  }
  return sum * reach / kSteps * 2 * kPi * std::sqrt((2 * l + 1) / (4 * kPi));
}

TEST(ShLobes, ZonalCoefficientsEqualQuadrature) {
  constexpr double kTolerance = 1e-6;  // of the target; the midpoint rule itself is right to about 1e-7
  for (const double sigma : {0.002, 0.02, 0.2, 1.0}) {
    const std::vector<double> f = bake::zonalLobe(sigma, 300);
    for (const int l : {0, 1, 2, 7, 60, 150, 300}) {
      const double scale = std::sqrt((2 * l + 1) / (4 * kPi));
      EXPECT_NEAR(f[static_cast<std::size_t>(l)], zonalByQuadrature(sigma, l), kTolerance * scale) << sigma << " band " << l;
    }
  }
}

TEST(ShLobes, NarrowLobesAreGaussiansOfTheBand) {
  // exp(-l (l + 1) sigma^2 / 2) but for terms of sigma^2.
  const std::vector<double> f = bake::zonalLobe(0.01, 200);
  for (const int l : {0, 10, 100, 200}) {
    const double gauss = std::sqrt((2 * l + 1) / (4 * kPi)) * std::exp(-0.5 * l * (l + 1) * 1e-4);
    EXPECT_NEAR(f[static_cast<std::size_t>(l)] / gauss, 1, 5e-4) << l;
  }
}

TEST(ShLobes, TurningKeepsTheNormAtOrder300) {
  constexpr double kTolerance = 1e-6;
  const std::vector<double> f = bake::zonalLobe(0.005, 300);
  double norm = 0;
  for (const double v : f) norm += v * v;
  for (const double theta : hardAngles()) {
    const auto y = harmonics<double>(300, std::sin(theta), 0, std::cos(theta));
    double turned = 0;
    for (int l = 0; l <= 300; ++l)
      for (int m = -l; m <= l; ++m) turned += std::pow(zonalFactor(l, f[static_cast<std::size_t>(l)]) * y[shIndex(l, m)], 2);
    EXPECT_NEAR(turned / norm, 1, kTolerance) << theta;
  }
}

TEST(ShLobes, TableHoldsTurnedLobes) {
  const bake::ShLobesData data =
      bake::buildShLobes({.sigma_r = 0.05f, .order = 20, .grid = {9, 16}, .precision = ShPrecision::f32});
  const ShLobes lobes = data.view();
  for (const int row : {0, 3, 8}) {
    for (const int column : {0, 5, 15}) {
      const double theta = kPi * row / 8, phi = 2 * kPi * column / 16;
      const auto y = harmonics<double>(20, std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      const float* stored =
          static_cast<const float*>(lobes.coefficients) + static_cast<std::size_t>(row * 16 + column) * shCount(20);
      for (int l = 0; l <= 20; ++l)
        for (int m = -l; m <= l; ++m)
          ASSERT_NEAR(stored[shIndex(l, m)], zonalFactor(l, lobes.zonal[static_cast<std::size_t>(l)]) * y[shIndex(l, m)], 1e-6);
    }
  }
}

TEST(ShLobes, TableIsExactAtItsDirectionsAndCloseBetweenThemForWideLobes) {
  const bake::ShLobesData data = bake::buildShLobes({.sigma_r = 0.2f, .order = 24, .grid = {65, 128}});
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  for (int sample = 0; sample < 20; ++sample) {
    Vec3 d = {normal(random), normal(random), normal(random)};
    d = 1 / std::sqrt(dot(d, d)) * d;
    std::vector<float> out(shCount(24));
    ShLobeTable(data.view()).add(d, 1, 24, out);
    const auto y = harmonics<double>(24, d.x, d.y, d.z);
    double error = 0, norm = 0;
    for (int l = 0; l <= 24; ++l) {
      for (int m = -l; m <= l; ++m) {
        const double exact = zonalFactor(l, data.zonal[static_cast<std::size_t>(l)]) * y[shIndex(l, m)];
        error += std::pow(out[shIndex(l, m)] - exact, 2);
        norm += exact * exact;
      }
    }
    // Linear blending over 2.8 degrees of bands up to 24: (24 * 0.049)^2 / 8 at most, little of it in a lobe of 11 degrees.
    EXPECT_LT(std::sqrt(error / norm), 0.02);
  }
}

TEST(ShLobes, TheSameForAnyOrderOfThreads) {
  const auto a = bake::buildShLobes({.order = 30, .grid = {17, 32}});
  const auto b = bake::buildShLobes({.order = 30, .grid = {17, 32}});
  EXPECT_EQ(a.halves, b.halves);
}

TEST(ShLobes, Order0IsTheMean) {
  const auto data = bake::buildShLobes({.sigma_r = 0.1f, .order = 0, .grid = {2, 3}, .precision = ShPrecision::f32});
  ASSERT_EQ(data.floats.size(), 6u);
  for (const float v : data.floats) EXPECT_FLOAT_EQ(v, data.zonal[0]);
}

TEST(ShLobes, RefusesWhatCannotBe) {
  const auto code = [](const bake::ShLobesOptions& options) {
    try {
      bake::buildShLobes(options);
      return std::string("none");
    } catch (const Error& error) {
      return error.rule();
    }
  };
  EXPECT_EQ(code({.order = -1}), "sh.order");
  EXPECT_EQ(code({.order = 1001}), "sh.order");
  EXPECT_EQ(code({.order = 1000}), "memory.limit");
  EXPECT_EQ(code({.sigma_r = 0}), "sh.sigma_r");
  EXPECT_EQ(code({.grid = {1, 8}}), "sh.grid");
  EXPECT_EQ(code({.order = 1000, .grid = {0, 0}}), "none");
}

}  // namespace
}  // namespace glint::sh_basis_test
