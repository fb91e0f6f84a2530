#include "glint/query/light/sh_light_query.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "glint/bake/sh/light.h"
#include "glint/bake/sh/lobes.h"
#include "glint/query/light/sh_transfer.h"
#include "support/light_reference.h"

namespace glint::sh_light_query_test {
namespace {

using test::FixedHistogram;
using test::TestLight;

constexpr double kPi = std::numbers::pi;
const Footprint kFootprint = Footprint::isotropic({0.5f, 0.5f}, 8);

FixedHistogram randomHistogram(int bins, float spread, unsigned seed) {
  FixedHistogram histogram;
  std::mt19937 random(seed);
  std::normal_distribution<float> slope(0, spread);
  std::uniform_real_distribution<float> weight(0.1f, 1);
  float total = 0;
  for (int k = 0; k < bins; ++k) {
    const float x = slope(random), y = slope(random), scale = 1 / std::sqrt(1 + x * x + y * y);
    histogram.normals.push_back({scale * x, scale * y});
    histogram.weights.push_back(weight(random));
    total += histogram.weights.back();
  }
  for (float& w : histogram.weights) w /= total;
  return histogram;
}

/// A light table with lobes, ready to be asked.
template <class T>
class Scene {
 public:
  Scene(const bake::Environment& environment, float sigma_r, int order, ShGrid grid)
      : light_(bake::buildShLight(environment, {.order = order, .grid = grid})), sigma_r_(sigma_r) {
    const std::vector<double> f = bake::zonalLobe(sigma_r, order);
    zonal_.assign(f.begin(), f.end());
    memory_.resize(ShRecurrence<T>::size(order));
    recurrence_ = ShRecurrence<T>(order, memory_);
    scratch_.resize(ShLightQuery<T>::scratchSize(order));
  }

  ShLightIntegral ask(const FixedHistogram& histogram, Vec3 wo, const ShLightOptions& options = {},
                      const ShadingFrame& frame = {}) {
    return ShLightQuery<T>(light_.view(), zonal_, recurrence_, sigma_r_)
        .integral(histogram, kFootprint, frame, wo, options, scratch_);
  }

 private:
  bake::ShLightData light_;
  float sigma_r_;
  std::vector<float> zonal_;
  std::vector<T> memory_, scratch_;
  ShRecurrence<T> recurrence_;
};

Vec3 outgoing(double theta, double phi) {
  return {static_cast<float>(std::sin(theta) * std::cos(phi)), static_cast<float>(std::sin(theta) * std::sin(phi)),
          static_cast<float>(std::cos(theta))};
}

/// Mean relative error of the luminance over outgoing directions, against quadrature.
double relativeError(TestLight light, float sigma_r, int order, ShGrid grid, const ShLightOptions& options = {}) {
  const bake::Environment environment = test::testEnvironment(light, 128);
  Scene<float> scene(environment, sigma_r, order, grid);
  const FixedHistogram histogram = randomHistogram(20, 0.3f, 11);
  double error = 0, norm = 0;
  for (const double theta : {0.05, 0.4, 0.8, 1.1}) {
    for (const double phi : {0.3, 2.2, 4.0}) {
      const Vec3 wo = outgoing(theta, phi);
      const auto truth = test::lightIntegralByQuadrature(environment, histogram, sigma_r, wo, 60);
      const ShLightIntegral answer = scene.ask(histogram, wo, options);
      for (std::size_t c = 0; c < 3; ++c) error += std::pow(answer.value[c] - truth[c], 2), norm += truth[c] * truth[c];
    }
  }
  return std::sqrt(error / norm);
}

TEST(ShLightQuery, EqualsQuadratureUnderConstantLight) {
  EXPECT_LT(relativeError(TestLight::constant, 0.1f, 30, {17, 32}), 0.01);
}

TEST(ShLightQuery, EqualsQuadratureUnderABrightSpot) {
  EXPECT_LT(relativeError(TestLight::bright_spot, 0.1f, 40, {17, 32}), 0.02);
}

TEST(ShLightQuery, EqualsQuadratureUnderASynthesisedEnvironment) {
  // Lobes this wide straddle the horizon, with sky above and ground below; their share is taken to first order.
  EXPECT_LT(relativeError(TestLight::studio, 0.1f, 40, {17, 32}), 0.04);
}

TEST(ShLightQuery, ErrorFallsWithTheOrder) {
  double before = 1e9;
  for (const int order : {5, 15, 40}) {
    const double error = relativeError(TestLight::studio, 0.08f, order, {17, 32});
    EXPECT_LT(error, 0.7 * before) << order;
    before = error;
  }
}

TEST(ShLightQuery, BlendingOutgoingDirectionsBeatsTheNearest) {
  const double blended = relativeError(TestLight::studio, 0.1f, 40, {9, 16});
  const double nearest = relativeError(TestLight::studio, 0.1f, 40, {9, 16}, {.nearest = true});
  EXPECT_LT(blended, nearest);
  EXPECT_LT(nearest, 0.1);
}

TEST(ShLightQuery, FloatAndDoubleAgree) {
  const bake::Environment environment = test::testEnvironment(TestLight::studio, 64);
  Scene<float> single(environment, 0.05f, 60, {9, 16});
  Scene<double> exact(environment, 0.05f, 60, {9, 16});
  const FixedHistogram histogram = randomHistogram(30, 0.3f, 4);
  for (const double theta : {0.0, 0.3, 1.0, 1.4}) {
    const ShLightIntegral a = single.ask(histogram, outgoing(theta, 1)), b = exact.ask(histogram, outgoing(theta, 1));
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(a.signed_value[c], b.signed_value[c], 1e-4 * std::fabs(b.signed_value[c]) + 1e-4);
  }
}

/// The tangent frame turned about the vertical, with the light: nothing changes.
TEST(ShLightQuery, TurnsWithTheShadingFrame) {
  const float angle = 0.7f, c = std::cos(angle), s = std::sin(angle);
  const auto turned = [&](Vec3 d) { return Vec3{c * d.x - s * d.y, s * d.x + c * d.y, d.z}; };
  const Vec3 tilt = {0.3f, 0.2f, 0.9f};
  // Light around the axis: the surface's frame can be turned, and the outgoing direction with it.
  const bake::Environment environment = test::makeEnvironment(64, [](Vec3 d, int) { return std::exp(3 * d.z); });
  Scene<double> scene(environment, 0.1f, 30, {17, 32});
  const FixedHistogram histogram = randomHistogram(10, 0.3f, 9);
  const Vec3 wo = test::unit(tilt);
  const ShadingFrame frame = {turned({1, 0, 0}), turned({0, 1, 0}), {0, 0, 1}};
  const float plain = scene.ask(histogram, wo).value[0];
  EXPECT_NEAR(scene.ask(histogram, turned(wo), {}, frame).value[0] / plain, 1, 0.01);
}

TEST(ShLightQuery, TiltedSurfacesSeeTiltedLight) {
  // A mirror-like surface that faces +x, seen along its normal, reflects what is at +x.
  const bake::Environment environment = test::makeEnvironment(64, [](Vec3 d, int c) { return c == 0 ? 2 + d.x : 2 + d.z; });
  Scene<float> scene(environment, 0.05f, 60, {17, 32});
  const FixedHistogram histogram{{{0, 0}}, {1}};
  const ShadingFrame frame = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
  const ShLightIntegral answer = scene.ask(histogram, {1, 0, 0}, {}, frame);
  // 4 times the light, but for what the lobe blurs: 1 - 4 sigma^2 of the linear part and half of sigma^2 of the whole.
  EXPECT_NEAR(answer.value[0] / (4 * 3), 1, 0.02);
  EXPECT_NEAR(answer.value[1] / (4 * 2), 1, 0.02);
}

TEST(ShLightQuery, BelowTheSurfaceThereIsNothing) {
  Scene<float> scene(test::testEnvironment(TestLight::constant, 8), 0.1f, 10, {5, 8});
  const ShLightIntegral answer = scene.ask({{{0, 0}}, {1}}, {0, 0.6f, -0.8f});
  EXPECT_EQ(answer.value[0], 0);
  EXPECT_FALSE(answer.clamped);
}

TEST(ShLightQuery, NegativeSumsAreClampedAndSaid) {
  // A narrow lobe beside a bright spot: the cut series rings below zero somewhere.
  Scene<float> scene(test::testEnvironment(TestLight::bright_spot, 128), 0.005f, 20, {17, 32});
  int negative = 0;
  for (int k = 0; k < 60; ++k) {
    const ShLightIntegral answer = scene.ask({{{0.01f * static_cast<float>(k) - 0.3f, 0}}, {1}}, {0, 0, 1});
    for (int c = 0; c < 3; ++c) {
      EXPECT_GE(answer.value[c], 0);
      EXPECT_EQ(answer.value[c], std::max(0.0f, answer.signed_value[c]));
    }
    EXPECT_EQ(answer.clamped, answer.signed_value[0] < 0 || answer.signed_value[1] < 0 || answer.signed_value[2] < 0);
    negative += answer.clamped;
  }
  EXPECT_GT(negative, 10);
}

/// Deepest trough and highest peak of what a mirror-like facet reflects while it turns past a spot.
std::pair<double, double> ringing(ShWindow window) {
  Scene<float> scene(test::testEnvironment(TestLight::bright_spot, 128), 0.005f, 30, {17, 32});
  double low = 0, high = 0;
  for (int j = -40; j <= 40; ++j) {
    for (int i = -40; i <= 40; ++i) {
      const Vec2 n = {0.02f * static_cast<float>(i), 0.02f * static_cast<float>(j)};
      if (dot(n, n) > 0.45f) continue;
      const double value = scene.ask({{n}, {1}}, {0, 0, 1}, {.window = window, .nearest = true}).signed_value[0];
      low = std::min(low, value), high = std::max(high, value);
    }
  }
  return {low, high};
}

TEST(ShLightQuery, WindowsRingLess) {
  const auto [none_low, none_high] = ringing(ShWindow::none);
  const auto [lanczos_low, lanczos_high] = ringing(ShWindow::lanczos);
  const auto [hann_low, hann_high] = ringing(ShWindow::hann);
  EXPECT_LT(-lanczos_low / lanczos_high, 0.3 * -none_low / none_high);
  EXPECT_LT(-hann_low / hann_high, 0.3 * -none_low / none_high);
  EXPECT_LT(hann_high, none_high);
}

TEST(ShLightQuery, ToleranceBoundsWhatIsLeftOut) {
  const bake::Environment environment = test::testEnvironment(TestLight::studio, 64);
  Scene<double> scene(environment, 0.06f, 80, {9, 16});
  const FixedHistogram histogram = randomHistogram(20, 0.2f, 6);
  for (const float tolerance : {0.3f, 0.03f, 0.003f}) {
    const Vec3 wo = outgoing(0.5, 2);
    const ShLightIntegral whole = scene.ask(histogram, wo), part = scene.ask(histogram, wo, {.tolerance = tolerance});
    EXPECT_LT(part.order, whole.order);
    // Of the mean of the light over half vectors, which is a few units here; facets count 1 / nz.
    const ShLightIntegral mean = scene.ask(histogram, wo, {.order = 0});
    EXPECT_LE(std::fabs(part.signed_value[0] - whole.signed_value[0]), 1.5 * 4 * kPi * tolerance * mean.signed_value[0]);
  }
  EXPECT_EQ(scene.ask(histogram, outgoing(0.5, 2), {.tolerance = 1e9f}).order, 0);
}

TEST(ShLightQuery, OrdersBelowTheTablesAreTaken) {
  Scene<float> scene(test::testEnvironment(TestLight::studio, 32), 0.1f, 12, {5, 8});
  EXPECT_EQ(scene.ask({{{0, 0}}, {1}}, {0, 0, 1}, {.order = 3}).order, 3);
  EXPECT_EQ(scene.ask({{{0, 0}}, {1}}, {0, 0, 1}, {.order = 0}).order, 0);
  EXPECT_EQ(scene.ask({{{0, 0}}, {1}}, {0, 0, 1}).order, 12);
}

TEST(ShTransfer, IsTheMirrorDirectionsFactor) {
  EXPECT_FLOAT_EQ(transferFactor(0.5f, 0.8f, 0.25f), 0.4f);
  EXPECT_EQ(transferFactor(1, 1, 0), 0);
  EXPECT_EQ(transferFactor(1, 1, -0.5f), 0);
}

TEST(RatioEstimator, IsExactWithoutShadowsAndInFullShadow) {
  RatioEstimator open, dark, none;
  const float contributions[2][3] = {{1, 2, 0}, {5, 0.5f, 0}};
  for (const auto& c : contributions) open.add(c, 1), dark.add(c, 0);
  for (int c = 0; c < 3; ++c) {
    EXPECT_FLOAT_EQ(open.shadowed(c, 3), 3);
    EXPECT_EQ(dark.shadowed(c, 3), 0);
    EXPECT_EQ(none.shadowed(c, 3), 3);
  }
}

TEST(RatioEstimator, TendsToShadowedLight) {
  // Light cos(theta)^2 around +z, sampled uniformly over the hemisphere; a wall hides x > 0.3.
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform;
  const auto draw = [&](int, float contribution[3]) {
    const double z = uniform(random), phi = 2 * kPi * uniform(random), s = std::sqrt(1 - z * z);
    for (int c = 0; c < 3; ++c) contribution[c] = static_cast<float>(z * z * 2 * kPi);
    return Vec3{static_cast<float>(s * std::cos(phi)), static_cast<float>(s * std::sin(phi)), static_cast<float>(z)};
  };
  const float unshadowed[3] = {static_cast<float>(2 * kPi / 3), 1, 10};
  float result[3];
  shadowedIntegral(
      unshadowed, 200000, draw, [](Vec3 wi) { return wi.x > 0.3f ? 0.0f : 1.0f; }, result);
  double hidden = 0;  // by quadrature
  constexpr int kSteps = 400;
  for (int a = 0; a < kSteps; ++a) {
    for (int b = 0; b < kSteps; ++b) {
      const double z = (a + 0.5) / kSteps, phi = 2 * kPi * (b + 0.5) / kSteps;
      if (std::sqrt(1 - z * z) * std::cos(phi) > 0.3) hidden += z * z * 2 * kPi / kSteps / kSteps;
    }
  }
  const double share = 1 - hidden / (2 * kPi / 3);
  constexpr double kNoise = 0.005;  // three deviations of 200,000 samples
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(result[c] / unshadowed[c], share, kNoise);
}

}  // namespace
}  // namespace glint::sh_light_query_test
