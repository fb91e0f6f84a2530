#pragma once

#include <cstddef>
#include <vector>

namespace glint::bake {

/// Turns spherical harmonics about the y axis, one band after the other: f'(w) = f(R_y(angle) w).
///
/// In the real basis, the coefficients of cosines (m >= 0) mix with each other only, and so do those of sines (m > 0):
///   c'_m = sum over m' of cosines(m, m') c_m',  s'_m = sum over m' of sines(m, m') s_m'.
/// Entries are sums of Wigner's d_mm'^l. The recurrence over l that computes d is stable for every angle. d underflows only
/// where it is negligible (see ShRecurrence).
class ShRotationY {
 public:
  /// @param angle   radians, in [0, pi]
  /// @param order   highest band
  /// @param rows    rows m = 0 .. rows of the matrices are computed
  ShRotationY(double angle, int order, int rows);

  /// Band l of the current matrices; starts at 0.
  int band() const { return l_; }
  /// Number of rows of a matrix. Matrices are rowCount() x (band() + 1), row by row.
  int rowCount() const;
  const std::vector<double>& cosines() const { return cosines_; }
  const std::vector<double>& sines() const { return sines_; }

  /// Goes on to the next band.
  void next();

 private:
  double seed(int l, int m, int k) const;
  void advance(std::vector<double>& before, const std::vector<double>& current, int sign) const;
  void combine();
  std::size_t at(int m, int k) const {
    return static_cast<std::size_t>(m) * (static_cast<std::size_t>(order_) + 1) + static_cast<std::size_t>(k);
  }

  double cosine_, log_cosine_half_, log_sine_half_;
  int order_;
  int rows_;
  int l_ = 0;
  std::vector<double> log_factorials_;
  std::vector<double> plus_, plus_before_, minus_, minus_before_;  ///< d(m, k) and d(m, -k), m <= rows, k <= order
  std::vector<double> cosines_, sines_;
};

}  // namespace glint::bake
