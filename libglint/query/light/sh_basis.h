#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "glint/math/vec.h"
#include "glint/model/sh.h"

namespace glint {

/// Factors of the recurrence over bands of the fully normalised associated Legendre functions,
///   P_l^m = a_l^m (z P_(l-1)^m - b_l^m P_(l-2)^m),
/// which depend on l and m only. Row l holds m = 0 .. l, rows follow one another.
///
/// Made once in the caller's memory, used for any direction. The normalisation makes sum over m of (y_l^m)^2 =
/// (2l + 1) / (4 pi).
/// @note In double, sin^m underflows only where every band up to order 1900 is negligible: m > l sin(theta) makes P_l^m fall
///       like (e l sin(theta) / (2 m))^m, and the worst seed that still matters is about exp(-order / e). In float the same
///       holds up to order 200.
template <class T>
class ShRecurrence {
 public:
  /// Elements of the caller's memory.
  static constexpr std::size_t size(int order) { return 2 * rowStart(order + 1) + static_cast<std::size_t>(order) + 1; }

  ShRecurrence() = default;
  /// Fills `memory` of at least size(order) elements, which must outlive the recurrence.
  GLINT_HD ShRecurrence(int order, std::span<T> memory)
      : order_(order), a_(memory.data()), ab_(a_ + rowStart(order + 1)), diagonal_(ab_ + rowStart(order + 1)) {
    T* a = memory.data();
    T* ab = a + rowStart(order + 1);
    T* diagonal = ab + rowStart(order + 1);
    for (int l = 0; l <= order; ++l) {
      diagonal[l] = static_cast<T>(l == 0 ? 1 : std::sqrt((2.0 * l + 1) / (2.0 * l)));
      for (int m = 0; m <= l; ++m) {
        const double ll = static_cast<double>(l) * l, mm = static_cast<double>(m) * m, k = l - 1.0;
        const double factor = m < l ? std::sqrt((4 * ll - 1) / (ll - mm)) : 0;
        const double before = m < l - 1 ? std::sqrt((k * k - mm) / (4 * k * k - 1)) : 0;
        a[rowStart(l) + static_cast<std::size_t>(m)] = static_cast<T>(factor);
        ab[rowStart(l) + static_cast<std::size_t>(m)] = static_cast<T>(factor * before);
      }
    }
  }

  GLINT_HD int order() const { return order_; }
  GLINT_HD const T* a(int l) const { return a_ + rowStart(l); }
  GLINT_HD const T* ab(int l) const { return ab_ + rowStart(l); }
  /// P_m^m = diagonal(m) sin(theta) P_(m-1)^(m-1).
  GLINT_HD T diagonal(int m) const { return diagonal_[m]; }

 private:
  static constexpr std::size_t rowStart(int l) { return static_cast<std::size_t>(l) * (static_cast<std::size_t>(l) + 1) / 2; }

  int order_ = 0;
  const T* a_ = nullptr;
  const T* ab_ = nullptr;
  const T* diagonal_ = nullptr;
};

/// Number of directions that `ShAccumulator` sums at a time.
inline constexpr int kShBatch = 4;

/// Sums weighted spherical harmonics of directions: out[shIndex(l, m)] = sum over d of weight_d y_l^m(d).
///
/// y_l^m = sqrt(2) cos(m phi) P_l^m for m > 0, sqrt(2) sin(|m| phi) P_l^|m| for m < 0, P_l^0 for m = 0 (Gamboa 2018, Eq. 8).
/// O(order^2) for each direction; works on whole rows of m, which compilers turn into vector code.
/// Allocates nothing: the caller gives memory of scratchSize(order) elements.
template <class T>
class ShAccumulator {
 public:
  static constexpr std::size_t scratchSize(int order) { return kShBatch * kArrays * (static_cast<std::size_t>(order) + 2); }

  /// @param order    highest band to sum, at most that of the recurrence
  /// @param out      shCount(order) elements; directions are added to what it holds
  /// @param scratch  at least scratchSize(order) elements
  GLINT_HD ShAccumulator(const ShRecurrence<T>& recurrence, int order, std::span<T> out, std::span<T> scratch)
      : recurrence_(recurrence), order_(order), out_(out.data()), scratch_(scratch.data()) {}

  /// Adds a direction, whose length need not be 1. Sums are complete after flush().
  GLINT_HD void add(Vec3 direction, float weight) { add(direction.x, direction.y, direction.z, weight); }
  GLINT_HD void add(double x, double y, double z, double weight) {
    x_[pending_] = x, y_[pending_] = y, z_[pending_] = z, weight_[pending_] = weight;
    if (++pending_ == kShBatch) flush();
  }

  GLINT_HD void flush() {
    if (pending_ == 0) return;
    for (int d = pending_; d < kShBatch; ++d) x_[d] = y_[d] = 0, z_[d] = 1, weight_[d] = 0;
    pending_ = 0;
    for (int d = 0; d < kShBatch; ++d) startDirection(d);
    for (int l = 0; l <= order_; ++l) addBand(l);
  }

 private:
  static constexpr std::size_t kArrays = 5;  // two bands of P, cosines, sines, seeds

  GLINT_HD T* array(int which, int d) const {
    return scratch_ +
           (static_cast<std::size_t>(which) * kShBatch + static_cast<std::size_t>(d)) * (static_cast<std::size_t>(order_) + 2);
  }

  /// Fills weight cos(m phi), weight sin(m phi) and P_m^m of one direction.
  GLINT_HD void startDirection(int d) {
    const double radius = std::hypot(x_[d], y_[d]), length = std::hypot(radius, z_[d]), sine = radius / length;
    const double cosine_phi = radius > 0 ? x_[d] / radius : 1, sine_phi = radius > 0 ? y_[d] / radius : 0;
    sign_[d] = z_[d] < 0 ? -1 : 1;
    gap_[d] = sine * sine / (1 + std::fabs(z_[d]) / length);
    T* cosines = array(2, d);
    T* sines = array(3, d);
    T* seeds = array(4, d);
    double c = 1, s = 0, seed = 0.5 / std::sqrt(std::numbers::pi);
    for (int m = 0; m <= order_; ++m) {
      if (m > 0) {
        const double turned = c * cosine_phi - s * sine_phi;
        s = s * cosine_phi + c * sine_phi;
        c = turned;
        seed *= static_cast<double>(recurrence_.diagonal(m)) * sine;
      }
      const double factor = (m > 0 ? std::numbers::sqrt2 : 1) * weight_[d];
      cosines[m] = static_cast<T>(factor * c);
      sines[m] = static_cast<T>(factor * s);
      seeds[m] = static_cast<T>(seed);
      array(0, d)[m] = array(1, d)[m] = 0;
    }
  }

  GLINT_HD void addBand(int l) {
    const T* a = recurrence_.a(l);
    const T* ab = recurrence_.ab(l);
    T* cosines_out = out_ + shIndex(l, 0);
    T* sines_out = cosines_out + l;  // of m = 0, which is not stored: from m = 1 on
    // Two arrays hold bands l - 1 and l - 2, by the parity of the band. Band l replaces band l - 2.
    for (int d = 0; d < kShBatch; ++d) {
      // z = sign (1 - gap): near the poles, a rounding error of z would change a band by l^2 times the error.
      const T sign = static_cast<T>(sign_[d]), gap = static_cast<T>(sign_[d] * gap_[d]);
      T* current = array(l & 1, d);
      const T* before = array(~l & 1, d);
      for (int m = 0; m < l; ++m) {
        const T stepped = a[m] * before[m];
        current[m] = (sign * stepped - ab[m] * current[m]) - gap * stepped;
      }
      current[l] = array(4, d)[l];
    }
    sumBand(l, cosines_out, sines_out);
  }

  GLINT_HD void sumBand(int l, T* __restrict cosines_out, T* __restrict sines_out) const {
    const T *p0 = array(l & 1, 0), *p1 = array(l & 1, 1), *p2 = array(l & 1, 2), *p3 = array(l & 1, 3);
    const T *c0 = array(2, 0), *c1 = array(2, 1), *c2 = array(2, 2), *c3 = array(2, 3);
    const T *s0 = array(3, 0), *s1 = array(3, 1), *s2 = array(3, 2), *s3 = array(3, 3);
    static_assert(kShBatch == 4);
    for (int m = 0; m <= l; ++m) cosines_out[m] += p0[m] * c0[m] + p1[m] * c1[m] + p2[m] * c2[m] + p3[m] * c3[m];
    for (int m = 1; m <= l; ++m) sines_out[m] += p0[m] * s0[m] + p1[m] * s1[m] + p2[m] * s2[m] + p3[m] * s3[m];
  }

  const ShRecurrence<T>& recurrence_;
  int order_;
  T* out_;
  T* scratch_;
  int pending_ = 0;
  double x_[kShBatch] = {}, y_[kShBatch] = {}, z_[kShBatch] = {}, sign_[kShBatch] = {}, gap_[kShBatch] = {};
  double weight_[kShBatch] = {};
};

/// Turns a circularly symmetric function from +z to a direction, band by band: g_l^m = sqrt(4 pi / (2l + 1)) f_l
/// y_l^m(direction) (Gamboa 2018, Eq. 10). This is the factor of y_l^m.
GLINT_HD inline double zonalFactor(int l, double f_l) { return std::sqrt(4 * std::numbers::pi / (2 * l + 1)) * f_l; }

}  // namespace glint
