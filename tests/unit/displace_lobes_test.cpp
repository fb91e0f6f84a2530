#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "glint/bake/displace/vmf_fit.h"
#include "glint/math/concentric_map.h"
#include "glint/query/brdf/vmf_lobe.h"

namespace glint::bake::displace_lobes_test {
namespace {

Vec3 unit(Vec3 v) { return (1 / std::sqrt(dot(v, v))) * v; }

/// Some direction of the upper hemisphere.
Vec3 somewhere(int k) { return gridDirection(k * 37 % 225, 15); }

/// Draws from a von Mises-Fisher lobe by its inverse distribution of cosines.
Vec3 drawVmf(Vec3 centre, float kappa, std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double u = uniform(random), angle = 2 * std::numbers::pi * uniform(random);
  const double c = 1 + std::log(u + (1 - u) * std::exp(-2.0 * kappa)) / kappa;
  const double s = std::sqrt(std::max(0.0, 1 - c * c));
  const Vec3 x = unit(std::abs(centre.x) < 0.9f ? Vec3{0, centre.z, -centre.y} : Vec3{-centre.z, 0, centre.x});
  const Vec3 y = {centre.y * x.z - centre.z * x.y, centre.z * x.x - centre.x * x.z, centre.x * x.y - centre.y * x.x};
  return static_cast<float>(s * std::cos(angle)) * x + static_cast<float>(s * std::sin(angle)) * y +
         static_cast<float>(c) * centre;
}

float sum(std::span<const VmfLobe> lobes) {
  float total = 0;
  for (const VmfLobe& lobe : lobes) total += lobe.amplitude;
  return total;
}

TEST(VmfFit, EqualNormalsGiveOneLobeOfTheLargestBandwidth) {
  for (const Vec3 n : {Vec3{0, 0, 1}, unit({0.3f, -0.9f, 0.4f})}) {
    const std::vector<WeightedNormal> normals(100, {n, 0.0125f});
    VmfLobe lobes[kMaxLobes];
    fitLobes(normals, lobes);
    EXPECT_EQ(lobes[0].kappa, kMaxKappa);
    EXPECT_NEAR(lobes[0].mu.x, n.x, 1e-6f);
    EXPECT_NEAR(lobes[0].mu.y, n.y, 1e-6f);
    EXPECT_NEAR(lobes[0].amplitude, 1.25f, 1e-5f);
    for (int k = 1; k < kMaxLobes; ++k) EXPECT_EQ(lobes[k].amplitude, 0);
    EXPECT_LT(lobeError(normals, lobes), 1e-3f);
  }
}

TEST(VmfFit, TwoFacetsGiveTwoLobes) {
  std::vector<WeightedNormal> normals(60, {unit({1, 0, 1}), 0.02f});
  normals.resize(100, {unit({-1, 0, 1}), 0.01f});
  VmfLobe lobes[kMaxLobes];
  fitLobes(normals, lobes);
  EXPECT_NEAR(lobes[0].amplitude, 1.2f, 1e-4f);
  EXPECT_NEAR(lobes[0].mu.x, std::sqrt(0.5f), 1e-5f);
  EXPECT_NEAR(lobes[1].amplitude, 0.4f, 1e-4f);
  EXPECT_NEAR(lobes[1].mu.x, -std::sqrt(0.5f), 1e-5f);
  EXPECT_EQ(lobes[2].amplitude, 0);
  EXPECT_LT(lobeError(normals, lobes), 1e-3f);
}

TEST(VmfFit, FindsTheLobesThatNormalsWereDrawnFrom) {
  std::mt19937 random(2);
  const Vec3 a = unit({0.4f, 0.2f, 1}), b = unit({-0.5f, -0.1f, 1});
  std::vector<WeightedNormal> normals;
  for (int k = 0; k < 4000; ++k) normals.push_back({drawVmf(a, 200, random), 0.75f / 4000});
  for (int k = 0; k < 4000; ++k) normals.push_back({drawVmf(b, 60, random), 0.25f / 4000});
  VmfLobe lobes[2];
  fitLobes(normals, lobes);
  // Deviations of the estimates from 4,000 draws are 1.6 % for kappa, 0.002 for centres.
  EXPECT_NEAR(lobes[0].kappa, 200, 10);
  EXPECT_NEAR(lobes[1].kappa, 60, 4);
  EXPECT_NEAR(lobes[0].amplitude, 0.75f, 0.01f);
  EXPECT_NEAR(lobes[0].mu.x, a.x, 0.01f);
  EXPECT_NEAR(lobes[1].mu.x, b.x, 0.01f);
  EXPECT_LT(lobeError(normals, lobes), 0.03f);
}

TEST(VmfFit, MoreLobesFitScatteredNormalsBetter) {
  std::mt19937 random(3);
  std::vector<WeightedNormal> normals;
  for (int k = 0; k < 512; ++k) {
    const float x = static_cast<float>(k % 16) / 16 - 0.5f;
    normals.push_back({unit({x, 0.3f * x * x, 1}), 1.0f / 512});
  }
  float last = 1;
  for (const std::size_t count : {1u, 2u, 6u}) {
    std::vector<VmfLobe> lobes(count);
    fitLobes(normals, lobes);
    EXPECT_NEAR(sum(lobes), 1, 1e-4f);
    const float error = lobeError(normals, lobes);
    EXPECT_LT(error, last);
    last = error;
  }
  EXPECT_LT(last, 0.1f);
}

TEST(VmfLobe, DensityIntegratesToOne) {
  for (const float kappa : {0.0f, 0.5f, 5.0f, 300.0f, 1e4f, kMaxKappa}) {
    // 2 pi times the integral over cosines, on a scale that follows the lobe.
    double integral = 0;
    const int steps = 20000;
    const double reach = std::min(2.0, 30.0 / std::max(kappa, 1e-3f));
    for (int k = 0; k < steps; ++k) {
      const double t = (k + 0.5) / steps * reach;
      integral += 2 * std::numbers::pi * reach / steps * vmfDensity(static_cast<float>(1 - t), kappa);
    }
    EXPECT_NEAR(integral, 1, kappa > 1e5f ? 0.2 : 2e-3) << kappa;  // at 1e6, 1 - t has two digits left in float
  }
}

TEST(VmfLobe, CosinesAgreeWithDrawnNormals) {
  std::mt19937 random(4);
  for (const float kappa : {5.0f, 50.0f, 2000.0f}) {
    const Vec3 centre = unit({0.3f, -0.2f, 1});
    const LobeMoments moments = lobeMoments(kappa);
    std::vector<Vec3> normals;
    for (int k = 0; k < 20000; ++k) normals.push_back(drawVmf(centre, kappa, random));
    for (int pair = 0; pair < 20; ++pair) {
      const Vec3 wi = somewhere(pair), wo = somewhere(3 * pair + 7);
      double truth = 0;
      for (const Vec3& n : normals) truth += std::max(0.0f, dot(n, wi)) * std::max(0.0f, dot(n, wo));
      truth /= static_cast<double>(normals.size());
      const float value = lobeCosines(moments, lobeFacing(moments, centre, wi), lobeFacing(moments, centre, wo), dot(wi, wo));
      // 0.01: noise of 20,000 draws; 0.02: clamped cosines to first order in their correlation, at kappa 5.
      EXPECT_NEAR(value, truth, kappa < 10 ? 0.02 : 0.01) << kappa << " " << pair;
    }
  }
}

TEST(VmfLobe, GgxOfOneNormalIsTheBase) {
  const BaseBrdf base{BaseBrdf::Kind::ggx, 1, 0.3f, 1.5f, 2};
  const Vec3 n = unit({0.2f, 0.1f, 1});
  for (int pair = 0; pair < 40; ++pair) {
    const Vec3 wi = somewhere(pair), wo = somewhere(5 * pair + 3);
    const Vec3 sum = wi + wo;
    const float length = std::sqrt(dot(sum, sum));
    const float value = conductorFresnel(0.5f * length, 1.5f, 2) * ggxLobe(0.3f, n, kMaxKappa, wi, wo, (1 / length) * sum);
    EXPECT_NEAR(value, baseTimesCosines(base, n, wi, wo), 1e-3f * (1 + value)) << pair;
  }
}

}  // namespace
}  // namespace glint::bake::displace_lobes_test
