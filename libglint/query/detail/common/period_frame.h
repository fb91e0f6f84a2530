#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/device.h"

namespace glint {

/// Two vectors of texture space.
struct AxisPair {
  double a[2], b[2];

  GLINT_HD double cross() const { return a[0] * b[1] - a[1] * b[0]; }
  GLINT_HD AxisPair scaled(double x, double y) const { return {{x * a[0], y * a[1]}, {x * b[0], y * b[1]}}; }
};

/// std::round, which device code does not have everywhere; halves go up.
inline GLINT_HD double nearestInteger(double x) { return std::floor(x + 0.5); }

/// The periods of a map in which a footprint is least long.
///
/// A long footprint winds round the map. What it sees depends on the waves exp(2 pi i k . x), k whole, that it does not average
/// out: those with fronts along its way. All of them are multiples of one wave once the footprint winds round often enough, and
/// then it sees the closed line across that wave's normal evenly: so it can be shortened along this line to whole turns,
/// whatever its direction, and keeps its width and its drift across the line.
struct PeriodFrame {
  /// Waves shorter than 1 / kFinest of the map are taken for averaged out where longer ones are.
  static constexpr double kFinest = 64;
  /// Variance of a Gaussian along a wave that it averages out; half of it may be of waves above kFinest.
  static constexpr double kEven = 2;

  double across[2], along[2];                ///< the wave, and one that counts turns
  double across_period[2], along_period[2];  ///< periods: a step of 1 by one wave and of 0 by the other
  double across_variance = 0;                ///< of the footprint by the wave `across`, those of waves above kFinest included
  double turns_variance = 0;                 ///< of its turns at each place across

  /// Shortest wave by the variance of a footprint (Gauss's reduction of a quadratic form).
  /// @param sigma  in units of the map's sides: the footprint's covariance is a a^T + b b^T
  GLINT_HD explicit PeriodFrame(const AxisPair& sigma) {
    const auto variance = [&](const double(&k)[2], const double(&q)[2]) {
      return dot(k, sigma.a) * dot(q, sigma.a) + dot(k, sigma.b) * dot(q, sigma.b) + dot(k, q) / (kFinest * kFinest);
    };
    double k[2] = {1, 0}, q[2] = {0, 1};
    if (variance(q, q) < variance(k, k)) swapWaves(k, q);
    constexpr int kMostSteps = 100;  // each one but the last halves a variance
    for (int step = 0; step < kMostSteps; ++step) {
      const double times = nearestInteger(variance(k, q) / variance(k, k));
      q[0] -= times * k[0], q[1] -= times * k[1];
      if (!(variance(q, q) < variance(k, k))) break;
      swapWaves(k, q);
    }
    across_variance = variance(k, k);
    turns_variance = variance(q, q) - variance(k, q) * variance(k, q) / across_variance;
    // Any wave counts turns that has no part of the other: the shortest one.
    const double rest = nearestInteger(dot(k, q) / dot(k, k));
    for (int i = 0; i < 2; ++i) across[i] = k[i], along[i] = q[i] - rest * k[i];
    const double turn = across[0] * along[1] - across[1] * along[0];  // 1 or -1
    across_period[0] = along[1] * turn, across_period[1] = -along[0] * turn;
    along_period[0] = -across[1] * turn, along_period[1] = across[0] * turn;
  }

  static GLINT_HD double dot(const double (&p)[2], const double (&q)[2]) { return p[0] * q[0] + p[1] * q[1]; }
  /// s steps across and t turns.
  GLINT_HD void vector(double s, double t, double (&result)[2]) const {
    for (int i = 0; i < 2; ++i) result[i] = s * across_period[i] + t * along_period[i];
  }

 private:
  static GLINT_HD void swapWaves(double (&k)[2], double (&q)[2]) {
    for (int i = 0; i < 2; ++i) {
      const double t = k[i];
      k[i] = q[i], q[i] = t;
    }
  }
};

/// Half axes of a parallelogram of some covariance, which stands for a Gaussian: with the axes it is given, or, as soon as it
/// winds round the map, with two sides along its way, and then of one turn at most. A Gaussian that long sees the map evenly
/// along its way, and so does one whole turn. Between half a turn and a whole one the parallelogram turns from the one position
/// to the other, so that it changes smoothly with the covariance.
/// @param texels  the covariance is a a^T + b b^T
GLINT_DEVICE_CALL inline GLINT_HD AxisPair woundBox(const AxisPair& texels, int width, int height) {
  constexpr double kTurn = 1.0 / 12, kRoot = 1.7320508075688772;  // variance of an even turn; deviations of half of one
  const double w = width, h = height;
  const AxisPair sigma = texels.scaled(1 / w, 1 / h);
  const double u = sigma.a[0] * sigma.a[0] + sigma.b[0] * sigma.b[0], v = sigma.a[1] * sigma.a[1] + sigma.b[1] * sigma.b[1];
  if (4 * std::max(u, v) <= kTurn) return texels.scaled(kRoot, kRoot);
  // Deviations of the coordinate across, and of turns where it is known.
  const PeriodFrame frame(sigma);
  const double across[2] = {PeriodFrame::dot(frame.across, sigma.a), PeriodFrame::dot(frame.across, sigma.b)};
  const double along[2] = {PeriodFrame::dot(frame.along, sigma.a), PeriodFrame::dot(frame.along, sigma.b)};
  const double wide = std::hypot(across[0], across[1]), turns = std::fabs(sigma.cross()) / wide, turn = std::sqrt(kTurn);
  AxisPair half;
  if (turns >= turn || frame.turns_variance >= PeriodFrame::kEven) {
    if (wide >= turn || frame.across_variance >= PeriodFrame::kEven) return {{0.5 * w, 0}, {0, 0.5 * h}};
    frame.vector(kRoot * wide, 0, half.a);
    frame.vector(0, 0.5, half.b);
    return half.scaled(w, h);
  }
  // How much each of the two shortest waves decides, which take the place of one another.
  const double slope = PeriodFrame::dot(across, along) / (wide * wide), rest = (slope - nearestInteger(slope)) * wide;
  const auto pull = [&](double deviation) {
    const double t = std::clamp(2 * deviation / turn - 1, 0.0, 1.0), smooth = t * t * (3 - 2 * t);
    return smooth / std::max(1 - smooth, 1e-9);
  };
  const double first = pull(turns), second = pull(wide * turns / std::hypot(rest, turns));
  if (first == 0 && second == 0) return texels.scaled(kRoot, kRoot);
  // In coordinates where the covariance is 1, parallelograms are squares: a mean of angles that are the same after a quarter.
  const double given = 4 * std::atan2((along[0] - slope * across[0]) / turns, across[0] / wide);
  const double other = -4 * std::atan2(rest, turns);
  const double angle =
      0.25 * std::atan2(std::sin(given) + second * std::sin(other), std::cos(given) + first + second * std::cos(other));
  const auto axis = [&](double x, double y, double(&result)[2]) {
    frame.vector(kRoot * wide * x, kRoot * (slope * wide * x + turns * y), result);
  };
  axis(std::cos(angle), std::sin(angle), half.a);
  axis(-std::sin(angle), std::cos(angle), half.b);
  return half.scaled(w, h);
}

/// Boxes of up to so many texels, but at least kFewestBoxMaps times the map, are answered as they are where they reach no
/// further than kMostBoxPeriods along u and v from their centre.
inline constexpr double kMostBoxTexels = 1 << 22, kFewestBoxMaps = 16, kMostBoxMaps = 256, kMostBoxPeriods = 256;

/// Half axes, texels, of a box on a periodic map: those given, or where it is longer than can be summed, shortened along the
/// way on which it winds round the map, to whole turns. Direction, width and drift stay. What it sees changes by less than 3 %
/// of the footprint, about the last of its turns (tests/unit/long_footprints_test.cpp).
GLINT_DEVICE_CALL inline GLINT_HD AxisPair shortenedBox(const AxisPair& texels, int width, int height) {
  const double w = width, h = height;
  const double maps = std::clamp(kMostBoxTexels / (w * h), double{kFewestBoxMaps}, double{kMostBoxMaps});
  AxisPair half = texels.scaled(1 / w, 1 / h);
  const double reach_u = std::fabs(half.a[0]) + std::fabs(half.b[0]), reach_v = std::fabs(half.a[1]) + std::fabs(half.b[1]);
  if (std::max(reach_u, reach_v) <= kMostBoxPeriods && 4 * std::fabs(half.cross()) <= maps) return texels;
  // Directions are not known to so many digits that more turns would matter.
  constexpr double kLongest = 1e9;
  for (double* axis : {half.a, half.b}) {
    const double scale = std::min(1.0, kLongest / std::max(std::hypot(axis[0], axis[1]), 1.0));
    axis[0] *= scale, axis[1] *= scale;
  }
  const double root = std::sqrt(1.0 / 3);  // the covariance of a box
  const PeriodFrame frame(half.scaled(root, root));
  constexpr double kFourTurns = 16;  // of deviation along every wave: even to some percent
  if (frame.across_variance >= kFourTurns) return {{0.5 * w, 0}, {0, 0.5 * h}};
  // Across, both axes as they are. The shorter one there gets all turns: where the other one is wide, it averages out the waves
  // that drift and turns together do not.
  const double by_a = PeriodFrame::dot(frame.across, half.a), by_b = PeriodFrame::dot(frame.across, half.b);
  const bool a_wider = std::fabs(by_a) >= std::fabs(by_b);
  constexpr double kThinnest = 1e-9;  // of what is left of axes that are longer than kLongest
  const double wide = std::max(std::fabs(a_wider ? by_a : by_b), kThinnest), narrow = a_wider ? by_b : by_a;
  const double period = std::hypot(frame.along_period[0], frame.along_period[1]);
  const double turns = std::min({maps / (2 * wide), 2 * kMostBoxPeriods / period, std::sqrt(12 * frame.turns_variance)});
  frame.vector(wide, 0, half.a);
  frame.vector(narrow, 0.5 * std::max(1.0, std::floor(turns)), half.b);
  return half.scaled(w, h);
}

}  // namespace glint
