// The two ways to shadow an exact light integral by samples, and their noise (Gamboa 2018, section 5.1).

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

#include "glint/math/vec.h"
#include "glint/query/light/sh_transfer.h"

namespace glint::shadow_estimators_test {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr int kRuns = 4000;
constexpr int kSamples = 16;  // of a pixel

/// Light and BRDF together: one lobe about an axis 40 degrees from the normal, and a little from everywhere.
float lit(Vec3 wi) {
  const float cosine = 0.6428f * wi.x + 0.7660f * wi.z;
  return 0.2f + 20 * std::exp(60 * (cosine - 1));
}

/// Means and mean squares of the errors of both estimators over many pixels.
struct Noise {
  double ratio_mean = 0, control_mean = 0, ratio_square = 0, control_square = 0;
  double truth = 0;
};

/// @param hidden  whether a direction is in shadow
Noise measure(const std::function<bool(Vec3)>& hidden) {
  // The truth by quadrature over the hemisphere.
  double open = 0, seen = 0;
  constexpr int kSteps = 400;
  for (int a = 0; a < kSteps; ++a) {
    for (int b = 0; b < 2 * kSteps; ++b) {
      const float z = (static_cast<float>(a) + 0.5f) / kSteps, phi = kPi * (static_cast<float>(b) + 0.5f) / kSteps;
      const float s = std::sqrt(1 - z * z);
      const Vec3 wi = {s * std::cos(phi), s * std::sin(phi), z};
      const double value = double{lit(wi)} * kPi / kSteps / kSteps;
      open += value;
      if (!hidden(wi)) seen += value;
    }
  }
  Noise noise;
  noise.truth = seen;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (int run = 0; run < kRuns; ++run) {
    RatioEstimator ratio;
    ControlVariateEstimator control;
    for (int k = 0; k < kSamples; ++k) {
      const float z = uniform(random), phi = 2 * kPi * uniform(random), s = std::sqrt(1 - z * z);
      const Vec3 wi = {s * std::cos(phi), s * std::sin(phi), z};
      const float value = 2 * kPi * lit(wi), contribution[3] = {value, value, value};
      ratio.add(contribution, hidden(wi) ? 0.0f : 1.0f);
      control.add(contribution, hidden(wi) ? 0.0f : 1.0f);
    }
    const double by_ratio = ratio.shadowed(0, static_cast<float>(open)) - seen,
                 by_control = control.shadowed(0, static_cast<float>(open)) - seen;
    noise.ratio_mean += by_ratio / kRuns, noise.control_mean += by_control / kRuns;
    noise.ratio_square += by_ratio * by_ratio / kRuns, noise.control_square += by_control * by_control / kRuns;
  }
  return noise;
}

TEST(ShadowEstimators, ControlVariateIsExactWithoutShadowsAndUnbiasedWithThem) {
  const Noise open = measure([](Vec3) { return false; });
  EXPECT_LT(open.control_square, 1e-8);
  for (const float edge : {-0.5f, 0.2f, 0.7f}) {
    const Noise noise = measure([&](Vec3 wi) { return wi.x < edge; });
    const double deviation_of_mean = std::sqrt(noise.control_square / kRuns);
    EXPECT_LT(std::abs(noise.control_mean), 4 * deviation_of_mean) << edge;
  }
}

TEST(ShadowEstimators, RatioHasLessNoiseInDeepShadowAndBothVanishWithoutIt) {
  // Nearly all of the light is hidden: the control variate subtracts a noisy sum of large numbers.
  const Noise deep = measure([](Vec3 wi) { return wi.x > 0; });
  EXPECT_LT(8 * deep.ratio_square, deep.control_square);
  // A wall hides directions without much light: both have little noise, and the control variate has the less.
  const Noise light = measure([](Vec3 wi) { return wi.x < -0.3f; });
  EXPECT_LT(8 * light.control_square, light.ratio_square);
  RecordProperty("deep_ratio_to_control", std::to_string(deep.control_square / deep.ratio_square));
  RecordProperty("light_control_to_ratio", std::to_string(light.ratio_square / light.control_square));
  std::printf("variance, control variate over ratio: deep shadow %.1f, light shadow %.3f\n",
              deep.control_square / deep.ratio_square, light.control_square / light.ratio_square);
}

TEST(ShadowEstimators, WithoutSamplesNothingIsHidden) {
  EXPECT_EQ(ControlVariateEstimator().shadowed(0, 3), 3);
  ControlVariateEstimator dark;
  const float contribution[3] = {4, 1, 0};
  dark.add(contribution, 0);
  EXPECT_EQ(dark.shadowed(0, 3), -1);  // not clamped: it stays unbiased
}

}  // namespace
}  // namespace glint::shadow_estimators_test
