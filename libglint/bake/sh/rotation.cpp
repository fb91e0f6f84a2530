#include "glint/bake/sh/rotation.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace glint::bake {

ShRotationY::ShRotationY(double angle, int order, int rows)
    : cosine_(std::cos(angle)),
      log_cosine_half_(std::log(std::fabs(std::cos(angle / 2)))),
      log_sine_half_(std::log(std::fabs(std::sin(angle / 2)))),
      order_(order),
      rows_(std::min(rows, order)),
      log_factorials_(2 * static_cast<std::size_t>(order) + 1) {
  for (std::size_t n = 2; n < log_factorials_.size(); ++n)
    log_factorials_[n] = log_factorials_[n - 1] + std::log(static_cast<double>(n));
  const std::size_t size = (static_cast<std::size_t>(rows_) + 1) * (static_cast<std::size_t>(order) + 1);
  for (auto* matrix : {&plus_, &plus_before_, &minus_, &minus_before_}) matrix->assign(size, 0.0);
  plus_[0] = minus_[0] = 1;
  combine();
}

int ShRotationY::rowCount() const { return std::min(rows_, l_) + 1; }

/// Starts the recurrence: d_mk^l where |m| or |k| is l. It has one term, sqrt(binomial(2l, l + other)) times powers of
/// cos(angle/2) and sin(angle/2), where `other` is the index that need not be l.
double ShRotationY::seed(int l, int m, int k) const {
  const bool from_m = m == l;  // else |k| == l
  const int other = from_m ? k : k > 0 ? m : -m;
  // d_lk = (-1)^(l - k) d_kl and d_m,-l = (-1)^(l + m) d_-m,l
  const bool negative = from_m ? (l - k) % 2 != 0 : k < 0 && (l + m) % 2 != 0;
  const int cosines = l + other, sines = l - other;
  const auto power = [](int exponent, double log_base) { return exponent == 0 ? 0 : exponent * log_base; };
  const double log_value =
      0.5 * (log_factorials_[2 * static_cast<std::size_t>(l)] - log_factorials_[static_cast<std::size_t>(cosines)] -
             log_factorials_[static_cast<std::size_t>(sines)]) +
      power(cosines, log_cosine_half_) + power(sines, log_sine_half_);
  return negative ? -std::exp(log_value) : std::exp(log_value);
}

/// Replaces d^(l-2) in `before` by d^l, from d^(l-1) in `current`.
/// @param sign  sign of the second index: the matrix has d(m, sign k)
void ShRotationY::advance(std::vector<double>& before, const std::vector<double>& current, int sign) const {
  const int l = l_ + 1;
  const double ll = static_cast<double>(l) * l, p = l - 1.0;
  for (int m = 0; m <= std::min(rows_, l); ++m) {
    for (int k = 0; k <= std::min(order_, l); ++k) {
      double& d = before[at(m, k)];
      if (m == l || k == l) {
        d = seed(l, m, sign * k);
        continue;
      }
      const double mm = static_cast<double>(m) * m, kk = static_cast<double>(k) * k;
      const double factor = l * (2.0 * l - 1) / std::sqrt((ll - mm) * (ll - kk));
      const double centre = l > 1 ? cosine_ - sign * m * k / (p * l) : cosine_;
      const double back = l > 1 ? std::sqrt((p * p - mm) * (p * p - kk)) / (p * (2 * p + 1)) : 0;
      d = factor * (centre * current[at(m, k)] - back * d);
    }
  }
}

/// Computes the matrices of the real basis from d(m, k) and d(m, -k).
void ShRotationY::combine() {
  const std::size_t columns = static_cast<std::size_t>(l_) + 1;
  cosines_.resize(static_cast<std::size_t>(rowCount()) * columns);
  sines_.resize(cosines_.size());
  for (int m = 0; m < rowCount(); ++m) {
    for (int k = 0; k <= l_; ++k) {
      const std::size_t place = static_cast<std::size_t>(m) * columns + static_cast<std::size_t>(k);
      const double plus = plus_[at(m, k)], minus = (k % 2 ? -1 : 1) * minus_[at(m, k)];
      const bool zonal = m == 0 || k == 0;
      cosines_[place] = m == 0 && k == 0 ? plus : zonal ? std::numbers::sqrt2 * plus : plus + minus;
      sines_[place] = zonal ? 0 : plus - minus;
    }
  }
}

void ShRotationY::next() {
  advance(plus_before_, plus_, 1);
  advance(minus_before_, minus_, -1);
  std::swap(plus_before_, plus_);
  std::swap(minus_before_, minus_);
  ++l_;
  combine();
}

}  // namespace glint::bake
