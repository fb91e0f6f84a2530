#pragma once

#include <cmath>
#include <complex>
#include <functional>
#include <numbers>
#include <vector>

#include "glint/math/vec.h"

namespace glint::test {

/// Height of a surface at a point; all lengths in micrometres.
using HeightFunction = std::function<double(double, double)>;

/// Coherent images by direct summation of Deng 2022, Eq. 3: no transform, no grid that the surface shares, no code of the builder.
///
/// D*(x, psi) = 4 / (A_c lambda^2) |sum of G_c(s; x) exp(-i 4 pi / lambda (h(s) + psi.s)) ds^2|^2, with G_c of integral 1 and
/// A_c = 1 / (4 pi sigma_c^2), its integral squared. The sum runs to 6 deviations. It is the trapezoid rule on a smooth function, so
/// it is exact as long as a step turns the phase by less than a turn.
class DirectWave {
 public:
  DirectWave(HeightFunction height, double wavelength_um, double coherence_um, double step_um)
      : height_(std::move(height)), wavelength_(wavelength_um), sigma_(coherence_um), step_(step_um) {}

  /// Mean of D* over a square of psi that begins at `low`, by Gauss' rule of 8 x 8 points: exact to 1e-6 over four deviations of the
  /// spot of a flat surface.
  double mean(double x, double y, Vec2 low, double side) const {
    constexpr int points = kPoints;
    constexpr double kReach = 6;
    const auto n = static_cast<int>(std::ceil(kReach * sigma_ / step_));
    const double k = 4 * std::numbers::pi / wavelength_;
    // Columns of exp(-i k psi_x s_x) factor out of the sum over rows.
    std::vector<std::complex<double>> sums(static_cast<std::size_t>(points) * static_cast<std::size_t>(points));
    std::vector<std::complex<double>> row(static_cast<std::size_t>(points));
    for (int j = -n; j <= n; ++j) {
      std::fill(row.begin(), row.end(), 0.0);
      for (int i = -n; i <= n; ++i) {
        const double u = i * step_, v = j * step_;
        const double window = std::exp(-0.5 * (u * u + v * v) / (sigma_ * sigma_));
        const auto field = std::polar(window, -k * height_(x + u, y + v));
        for (int a = 0; a < points; ++a) row[a] += field * std::polar(1.0, -k * psi(low.x, side, a) * u);
      }
      for (int b = 0; b < points; ++b)
        for (int a = 0; a < points; ++a) sums[b * points + a] += row[a] * std::polar(1.0, -k * psi(low.y, side, b) * j * step_);
    }
    double power = 0;
    for (int b = 0; b < points; ++b)
      for (int a = 0; a < points; ++a) power += 0.25 * weight(a) * weight(b) * std::norm(sums[b * points + a]);
    const double g = step_ * step_ / (2 * std::numbers::pi * sigma_ * sigma_);  // makes G_c integrate to 1
    const double area = 1 / (4 * std::numbers::pi * sigma_ * sigma_);
    return 4 / (area * wavelength_ * wavelength_) * g * g * power;
  }

 private:
  static constexpr int kPoints = 8;
  static constexpr double kPlaces[] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
  static constexpr double kWeights[] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
  static double weight(int k) { return kWeights[k < 4 ? k : 7 - k]; }
  static double psi(double low, double side, int k) { return low + 0.5 * side * (1 + (k < 4 ? kPlaces[k] : -kPlaces[7 - k])); }

  HeightFunction height_;
  double wavelength_, sigma_, step_;
};

}  // namespace glint::test
