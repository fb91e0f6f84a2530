#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "glint/math/vec.h"
#include "glint/query/light/sh_basis.h"

namespace glint {

/// The band limit of a sum of turned lobes, without its coefficients (Gamboa 2018, section 4.2): the norm of band l is
///   |D_l| = zonalFactor(l, f_l) |Y_l|,  |Y_l|^2 = sum over m of (sum over b of w_b y_l^m(n_b))^2.
///
/// By the addition theorem |Y_l|^2 is (2l + 1)^2 / (4 pi) times the mean over all axes a of (sum over b of w_b P_l(a .
/// n_b))^2. The mean is taken over kAxes axes, spread evenly over a hemisphere: a single sum of Legendre polynomials for each
/// axis and bin, so O(kAxes * order) for each bin instead of the O(order^2) of its harmonics. The estimate scatters by about
/// 30 %; `last` allows for kSafety times that.
///
/// Works in double, because the norms that matter are 1e-6 of the whole. Allocates nothing; takes 25 KB.
class ShBandLimit {
 public:
  static constexpr int kAxes = 24;
  static constexpr int kMostOrder = 128;  ///< highest band that can be looked at; beyond, nothing is known
  /// Norms count for so many times their estimate.
  static constexpr double kSafety = 3;

  /// @param order  highest band, at most kMostOrder
  GLINT_HD explicit ShBandLimit(int order) : order_(std::min(order, int{kMostOrder})) {
    for (int k = 0; k < kAxes; ++k) {
      const double height = (k + 0.5) / kAxes, radius = std::sqrt(1 - height * height), angle = kGoldenAngle * k;
      x_[k] = radius * std::cos(angle), y_[k] = radius * std::sin(angle), z_[k] = height;
    }
    for (int l = 0; l <= order_; ++l)
      for (double& sum : sums_[l]) sum = 0;
  }

  GLINT_HD int order() const { return order_; }

  /// Adds a lobe.
  /// @param normal  unit
  GLINT_HD void add(Vec3 normal, double weight) {
    // A float normal is off its length by 1e-7, which at high bands is more than what is looked for.
    const double nx = normal.x, ny = normal.y, nz = normal.z, scale = 1 / std::sqrt(nx * nx + ny * ny + nz * nz);
    double cosine[kAxes], before[kAxes], current[kAxes];  // P_(l - 1) and P_l, times the weight
    for (int k = 0; k < kAxes; ++k) {
      cosine[k] = scale * (x_[k] * nx + y_[k] * ny + z_[k] * nz);
      before[k] = 0, current[k] = weight;
      sums_[0][k] += weight;
    }
    for (int l = 1; l <= order_; ++l) {
      const double rise = (2.0 * l - 1) / l, fall = (l - 1.0) / l;
      for (int k = 0; k < kAxes; ++k) {
        const double next = rise * cosine[k] * current[k] - fall * before[k];
        before[k] = current[k], current[k] = next;
        sums_[l][k] += next;
      }
    }
  }

  /// Estimate of |Y_l|.
  GLINT_HD double norm(int l) const {
    double squares = 0;
    for (const double sum : sums_[l]) squares += sum * sum;
    return (2 * l + 1) * std::sqrt(squares / (4 * std::numbers::pi * kAxes));
  }

  /// Last band whose norm, by kSafety times its estimate, is above epsilon times the norm of band 0: coefficients of
  /// the bands beyond are smaller, unless the estimate falls to a third of the norm.
  /// @param zonal  f_l of the lobe, at least order() + 1 numbers
  GLINT_HD int last(std::span<const float> zonal, double epsilon) const {
    const double least = epsilon * zonalFactor(0, zonal.data()[0]) * norm(0);
    for (int l = order_; l > 0; --l)
      if (kSafety * std::fabs(zonalFactor(l, zonal.data()[l])) * norm(l) > least) return l;
    return 0;
  }

 private:
  static constexpr double kGoldenAngle = 2.399963229728653;

  int order_;
  double x_[kAxes], y_[kAxes], z_[kAxes];  // axes
  double sums_[kMostOrder + 1][kAxes];
};

}  // namespace glint
