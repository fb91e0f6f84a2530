#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "glint/math/vec.h"
#include "glint/model/map_slopes.h"
#include "glint/model/normal_map.h"

namespace glint {

/// Slopes (-nx/nz, -ny/nz) of a normal inside the unit disk; finite also on the rim.
inline GLINT_HD Vec2 slopeOf(Vec2 normal) { return -1 / std::sqrt(std::max(1e-12f, 1 - dot(normal, normal))) * normal; }

/// Sums over the slopes (p, q) of normals, from which the moments of a map follow.
struct SlopeSums {
  double p = 0, q = 0, pp = 0, pq = 0, qq = 0;

  GLINT_HD void add(const SlopeSums& s) { p += s.p, q += s.q, pp += s.pp, pq += s.pq, qq += s.qq; }

  /// Mean and covariance of `count` slopes. A map that is flat to float precision counts as flat.
  GLINT_HD MapSlopes moments(double count) const {
    constexpr double kRoundingVariance = 1e-13;  // variance that rounding of normals alone can cause
    const double mean_p = p / count, mean_q = q / count;
    const auto variance = [&](double v) { return v > kRoundingVariance ? v : 0; };
    const double xx = variance(pp / count - mean_p * mean_p), yy = variance(qq / count - mean_q * mean_q);
    const double most = std::sqrt(xx * yy), xy = std::clamp(pq / count - mean_p * mean_q, -most, most);
    return {{static_cast<float>(mean_p), static_cast<float>(mean_q)},
            {static_cast<float>(xx), static_cast<float>(xy), static_cast<float>(yy)}};
  }
};

/// Sums over the slopes of some normals, in lanes that compilers vectorise.
inline GLINT_HD SlopeSums slopeSums(const Vec2* normals, std::size_t count) {
  constexpr std::size_t kLanes = 8;
  double sums[5][kLanes] = {};
  for (std::size_t first = 0; first < count; first += kLanes) {
    float p[kLanes] = {}, q[kLanes] = {};
    const std::size_t lanes = std::min(kLanes, count - first);
    for (std::size_t k = 0; k < lanes; ++k) p[k] = normals[first + k].x, q[k] = normals[first + k].y;
    for (std::size_t k = 0; k < kLanes; ++k) {
      const float scale = -1 / std::sqrt(std::max(1e-12f, 1 - (p[k] * p[k] + q[k] * q[k])));
      p[k] *= scale, q[k] *= scale;
    }
    for (std::size_t k = 0; k < kLanes; ++k) {
      const double x = p[k], y = q[k];
      sums[0][k] += x, sums[1][k] += y, sums[2][k] += x * x, sums[3][k] += x * y, sums[4][k] += y * y;
    }
  }
  SlopeSums total;
  for (std::size_t k = 0; k < kLanes; ++k) total.add({sums[0][k], sums[1][k], sums[2][k], sums[3][k], sums[4][k]});
  return total;
}

/// Moments of the slopes of a map's normals, from sums over rows that are added in order.
inline MapSlopes slopesOf(const NormalMap& map) {
  const auto width = static_cast<std::size_t>(map.width);
  SlopeSums total;
  for (std::size_t j = 0; j < static_cast<std::size_t>(map.height); ++j)
    total.add(slopeSums(map.normals.data() + j * width, width));
  return total.moments(static_cast<double>(map.width) * map.height);
}

}  // namespace glint
