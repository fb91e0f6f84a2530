#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <vector>

#include "glint/math/vec.h"

namespace glint::test {

/// The direction of height z and azimuth phi.
inline Vec3 direction(double z, double phi) {
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return {static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi)), static_cast<float>(z)};
}

/// Random numbers and directions above the horizon.
class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}
  float unit() { return std::uniform_real_distribution<float>(0, 1)(random_); }
  Vec2 pair() { return {unit(), unit()}; }
  Vec3 above(double lowest_z = 0.01) { return direction(lowest_z + (1 - lowest_z) * unit(), 2 * std::numbers::pi * unit()); }

 private:
  std::mt19937 random_;
};

/// Integral over solid angle of value(w) for z in [z0, z1], phi in [phi0, phi1], by the midpoints of nz x np equal cells.
template <class Value>
double integrateCells(double z0, double z1, double phi0, double phi1, int nz, int np, const Value& value) {
  double sum = 0;
  for (int i = 0; i < nz; ++i)
    for (int j = 0; j < np; ++j)
      sum += value(direction(z0 + (z1 - z0) * (i + 0.5) / nz, phi0 + (phi1 - phi0) * (j + 0.5) / np));
  return sum * (z1 - z0) * (phi1 - phi0) / (nz * np);
}

template <class Value>
double integrateHemisphere(int nz, const Value& value) {
  return integrateCells(0, 1, 0, 2 * std::numbers::pi, nz, 2 * nz, value);
}

/// Integral over the unit disk of value(Vec2), by midpoints in polar coordinates that thicken towards the rim.
template <class Value>
double integrateDisk(int n, const Value& value) {
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const double tilt = 0.5 * std::numbers::pi * (i + 0.5) / n, r = std::sin(tilt);
    for (int j = 0; j < 4 * n; ++j) {
      const double phi = 2 * std::numbers::pi * (j + 0.5) / (4 * n);
      sum += value(Vec2{static_cast<float>(r * std::cos(phi)), static_cast<float>(r * std::sin(phi))}) * r * std::cos(tilt);
    }
  }
  return sum * std::numbers::pi * std::numbers::pi / (4.0 * n * n);
}

/// Probability that a chi-squared variable is at least this large (Wilson and Hilferty's normal approximation: good to 1e-3 for
/// more than ten degrees of freedom).
inline double chiSquaredTail(double chi_squared, int degrees) {
  const double spread = 2 / (9.0 * degrees), z = (std::cbrt(chi_squared / degrees) - (1 - spread)) / std::sqrt(spread);
  return 0.5 * std::erfc(z / std::numbers::sqrt2);
}

/// p-value of counts against expected counts. Bins that expect fewer than five are taken together.
inline double goodnessOfFit(const std::vector<double>& counts, const std::vector<double>& expected) {
  double chi_squared = 0, rest = 0, rest_expected = 0;
  int bins = 0;
  const auto add = [&](double count, double wanted) { chi_squared += (count - wanted) * (count - wanted) / wanted, ++bins; };
  for (std::size_t k = 0; k < counts.size(); ++k) {
    if (expected[k] >= 5) {
      add(counts[k], expected[k]);
    } else {
      rest += counts[k], rest_expected += expected[k];
    }
  }
  if (rest_expected >= 5) add(rest, rest_expected);
  return bins > 1 ? chiSquaredTail(chi_squared, bins - 1) : 1;
}

}  // namespace glint::test
