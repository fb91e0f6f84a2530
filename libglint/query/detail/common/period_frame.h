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

/// std::round for device code, which does not have it everywhere. Rounds halves up.
inline GLINT_HD double nearestInteger(double x) { return std::floor(x + 0.5); }

/// A pair of periods of a map, chosen so that a footprint is short when it is measured in them.
///
/// A long footprint winds round a periodic map. Its answer depends only on the waves exp(2 pi i k . x), k whole, that it does
/// not average out: waves whose fronts run along the footprint. If the footprint winds round often enough, all such waves are
/// multiples of one wave, and the footprint covers the closed line along the front of that wave evenly. So it can be shortened
/// along this line to whole turns, whatever its direction. Its width and its drift across the line stay.
struct PeriodFrame {
  /// Waves shorter than 1 / kFinest of the map count as averaged out where longer waves are.
  static constexpr double kFinest = 64;
  /// Variance along a wave from which on a Gaussian averages it out. Half of it may be variance of waves above kFinest.
  static constexpr double kEven = 2;

  double across[2], along[2];                ///< the wave that is not averaged out, and a wave that counts turns
  double across_period[2], along_period[2];  ///< periods: each is a step of 1 of its own wave and of 0 of the other
  double across_variance = 0;                ///< variance along the wave `across`, plus variance of waves above kFinest
  double turns_variance = 0;                 ///< variance of its turns, for each position across

  /// Finds the wave along which a footprint has the least variance (Gauss's reduction of a quadratic form).
  /// @param sigma  in units of the map's sides: the footprint's covariance is a a^T + b b^T
  GLINT_HD explicit PeriodFrame(const AxisPair& sigma) {
    const auto variance = [&](const double(&k)[2], const double(&q)[2]) {
      return dot(k, sigma.a) * dot(q, sigma.a) + dot(k, sigma.b) * dot(q, sigma.b) + dot(k, q) / (kFinest * kFinest);
    };
    double k[2] = {1, 0}, q[2] = {0, 1};
    if (variance(q, q) < variance(k, k)) swapWaves(k, q);
    constexpr int kMostSteps = 100;  // each step but the last halves a variance
    for (int step = 0; step < kMostSteps; ++step) {
      const double times = nearestInteger(variance(k, q) / variance(k, k));
      q[0] -= times * k[0], q[1] -= times * k[1];
      if (!(variance(q, q) < variance(k, k))) break;
      swapWaves(k, q);
    }
    across_variance = variance(k, k);
    turns_variance = variance(q, q) - variance(k, q) * variance(k, q) / across_variance;
    // Every wave that makes a basis with the first counts turns. Takes the shortest.
    const double rest = nearestInteger(dot(k, q) / dot(k, k));
    for (int i = 0; i < 2; ++i) across[i] = k[i], along[i] = q[i] - rest * k[i];
    const double turn = across[0] * along[1] - across[1] * along[0];  // 1 or -1
    across_period[0] = along[1] * turn, across_period[1] = -along[0] * turn;
    along_period[0] = -across[1] * turn, along_period[1] = across[0] * turn;
  }

  static GLINT_HD double dot(const double (&p)[2], const double (&q)[2]) { return p[0] * q[0] + p[1] * q[1]; }
  /// The vector of s steps across and t turns.
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

/// Half axes of a parallelogram that stands for a Gaussian of the same covariance. A Gaussian that does not wind round the map
/// keeps the given axes. A longer one gets two sides along the line on which it winds, of one turn at most: a Gaussian that
/// long covers the line evenly, and so does one whole turn. Between half a turn and a whole turn the parallelogram rotates from
/// one position to the other, so that it changes smoothly with the covariance.
/// @param texels  the covariance is a a^T + b b^T
GLINT_DEVICE_CALL inline GLINT_HD AxisPair woundBox(const AxisPair& texels, int width, int height) {
  constexpr double kTurn = 1.0 / 12, kRoot = 1.7320508075688772;  // variance of one even turn; half its length in deviations
  const double w = width, h = height;
  const AxisPair sigma = texels.scaled(1 / w, 1 / h);
  const double u = sigma.a[0] * sigma.a[0] + sigma.b[0] * sigma.b[0], v = sigma.a[1] * sigma.a[1] + sigma.b[1] * sigma.b[1];
  if (4 * std::max(u, v) <= kTurn) return texels.scaled(kRoot, kRoot);
  // Deviation of the coordinate across, and deviation of turns at a fixed coordinate across.
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
  // Weights of the two shortest waves: where one replaces the other as the shortest, the result must not jump.
  const double slope = PeriodFrame::dot(across, along) / (wide * wide), rest = (slope - nearestInteger(slope)) * wide;
  const auto pull = [&](double deviation) {
    const double t = std::clamp(2 * deviation / turn - 1, 0.0, 1.0), smooth = t * t * (3 - 2 * t);
    return smooth / std::max(1 - smooth, 1e-9);
  };
  const double first = pull(turns), second = pull(wide * turns / std::hypot(rest, turns));
  if (first == 0 && second == 0) return texels.scaled(kRoot, kRoot);
  // In coordinates where the covariance is the identity, parallelograms are squares, which repeat after a quarter turn. So
  // angles are averaged modulo a quarter turn.
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

/// Boxes up to this number of texels, or up to kFewestBoxMaps times the map if that is more, are answered without shortening if
/// they reach at most kMostBoxPeriods along u and v from their centre.
inline constexpr double kMostBoxTexels = 1 << 22, kFewestBoxMaps = 16, kMostBoxMaps = 256, kMostBoxPeriods = 256;

/// Half axes, texels, of a box on a periodic map. A box too long to be summed is shortened to whole turns along the line on
/// which it winds round the map; direction, width and drift stay. Its weights change by less than 3 % of the footprint, about
/// its last turn (tests/unit/long_footprints_test.cpp).
GLINT_DEVICE_CALL inline GLINT_HD AxisPair shortenedBox(const AxisPair& texels, int width, int height) {
  const double w = width, h = height;
  const double maps = std::clamp(kMostBoxTexels / (w * h), double{kFewestBoxMaps}, double{kMostBoxMaps});
  AxisPair half = texels.scaled(1 / w, 1 / h);
  const double reach_u = std::fabs(half.a[0]) + std::fabs(half.b[0]), reach_v = std::fabs(half.a[1]) + std::fabs(half.b[1]);
  if (std::max(reach_u, reach_v) <= kMostBoxPeriods && 4 * std::fabs(half.cross()) <= maps) return texels;
  // More turns would need more digits of the direction than there are.
  constexpr double kLongest = 1e9;
  for (double* axis : {half.a, half.b}) {
    const double scale = std::min(1.0, kLongest / std::max(std::hypot(axis[0], axis[1]), 1.0));
    axis[0] *= scale, axis[1] *= scale;
  }
  const double root = std::sqrt(1.0 / 3);  // deviation of a box of half width 1
  const PeriodFrame frame(half.scaled(root, root));
  constexpr double kFourTurns =
      16;  // variance from which on a box averages a wave out to some percent: four turns of deviation
  if (frame.across_variance >= kFourTurns) return {{0.5 * w, 0}, {0, 0.5 * h}};
  // Both axes keep their extent across. The axis that is shorter across gets all turns: the other, if wide, averages out the
  // waves that drift and turns together would leave.
  const double by_a = PeriodFrame::dot(frame.across, half.a), by_b = PeriodFrame::dot(frame.across, half.b);
  const bool a_wider = std::fabs(by_a) >= std::fabs(by_b);
  constexpr double kThinnest = 1e-9;  // least width across, where axes longer than kLongest were scaled down
  const double wide = std::max(std::fabs(a_wider ? by_a : by_b), kThinnest), narrow = a_wider ? by_b : by_a;
  const double period = std::hypot(frame.along_period[0], frame.along_period[1]);
  const double turns = std::min({maps / (2 * wide), 2 * kMostBoxPeriods / period, std::sqrt(12 * frame.turns_variance)});
  frame.vector(wide, 0, half.a);
  frame.vector(narrow, 0.5 * std::max(1.0, std::floor(turns)), half.b);
  return half.scaled(w, h);
}

}  // namespace glint
