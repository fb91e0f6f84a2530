#include "glint/bake/compressed/quantize.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "glint/query/detail/pyramid/block_mass.h"

namespace glint::bake {
namespace {

// Parts of the largest coefficient that the largest 4-bit integer is tried for.
constexpr float kCuts[] = {1.0f, 0.8f, 0.64f, 0.51f, 0.41f, 0.33f, 0.26f, 0.21f};

/// Largest magnitude of the coefficients.
float largest(const float* coefficients, int count, int stride) {
  float peak = 0;
  for (int s = 0; s < count; ++s) peak = std::max(peak, std::abs(coefficients[static_cast<std::ptrdiff_t>(s) * stride]));
  return peak;
}

/// Squared error of coefficients of integers up to `most` with this step.
double errorOfStep(const float* coefficients, int count, int stride, float step, float most) {
  const float inverse = 1 / step;
  double error = 0;
  // Float sums over runs of 256 terms are exact to 1e-5; double sums over the runs lose nothing.
  for (int first = 0; first < count; first += 256) {
    float sum = 0;
    for (int s = first; s < std::min(count, first + 256); ++s) {
      const float value = coefficients[static_cast<std::ptrdiff_t>(s) * stride];
      const float cut = std::min(most, std::max(-most, value * inverse));
      // Adding and subtracting 1.5 * 2^23 rounds magnitudes below 2^22 to integers, without a call.
      const float rounded = (cut + 0x1.8p23f) - 0x1.8p23f;
      const float e = value - rounded * step;
      sum += e * e;
    }
    error += sum;
  }
  return error;
}

struct NarrowStep {
  float step = 0;
  double error = 0;
};

NarrowStep bestNarrowStep(const float* coefficients, int count, int stride) {
  const float peak = largest(coefficients, count, stride);
  NarrowStep best;
  for (const float cut : kCuts) {
    const float step = peak * cut / kNarrowPeak;
    if (!std::isnormal(step) || !std::isfinite(1 / step)) break;
    const double error = errorOfStep(coefficients, count, stride, step, kNarrowPeak);
    // The error falls and then rises as the step shrinks: the first rise ends the search.
    if (best.step > 0 && error >= best.error) break;
    best = {step, error};
  }
  return best;
}

}  // namespace

ColumnErrors roundingErrors(const float* coefficients, const float* weights, int count) {
  ColumnErrors errors;
  double all_weights = 0;
  for (int s = 0; s < count; ++s) {
    errors.energy += static_cast<double>(weights[s]) * coefficients[s] * coefficients[s];
    all_weights += weights[s];
  }
  const NarrowStep narrow = bestNarrowStep(coefficients, count, 1);
  // Rounding errors of all slices are alike, so each counts the mean of the weights.
  errors.narrow = narrow.step > 0 ? std::min(narrow.error * all_weights / count, errors.energy) : errors.energy;
  const float step = largest(coefficients, count, 1) / kWidePeak;
  const bool usable = std::isnormal(step) && std::isfinite(1 / step);
  const double wide = usable ? errorOfStep(coefficients, count, 1, step, kWidePeak) * all_weights / count : errors.energy;
  errors.wide = std::min(errors.narrow, wide);
  return errors;
}

float narrowStep(const float* coefficients, int count, int stride) { return bestNarrowStep(coefficients, count, stride).step; }

std::uint8_t nearestMassCode(float mass) {
  const std::uint8_t above = blockMassCode(mass);
  return above > 0 && mass - blockMass(above - 1) < blockMass(above) - mass ? above - 1 : above;
}

}  // namespace glint::bake
