#include <algorithm>
#include <cmath>

#include "glint-bench/lab/sun_light.h"
#include "glint-bench/stability/stability_test.h"

/// Series of spherical harmonics that end too early.
namespace glint::apps {
namespace {

constexpr double kTolerable = 0.01;  // of the brightest answer

void measureOrders(BenchLab&, double order, StabilityCurves& curves) {
  const bake::Environment light = sunLight();
  for (const auto& [series, window] :
       {std::pair{"no window", ShWindow::none}, {"lanczos", ShWindow::lanczos}, {"hann", ShWindow::hann}}) {
    const std::vector<double> answers = sunAnswers(light, static_cast<int>(order), window, {33, 64});
    const auto [darkest, brightest] = std::minmax_element(answers.begin(), answers.end());
    curves.add(series, std::abs(std::min(0.0, *darkest)) / *brightest);
  }
}

}  // namespace

std::vector<StabilityTest> lightTests() {
  return {{"ringing",
           "Spherical harmonics under a small light",
           "A sun of 1.5 degrees of radius in darkness, facets of sigma_r .05. The figure is the most negative light over the "
           "brightest, over views in the plane of the sun. Answers below 0 are cut, so that the surface is black there.",
           "order of the series",
           "negative light over the brightest",
           kTolerable,
           "Take order 60 for facets of sigma_r .05, a window below it, and a lamp of glint-query light for small lights.",
           {5, 10, 20, 30, 60, 100},
           {10, 30},
           measureOrders}};
}

}  // namespace glint::apps
