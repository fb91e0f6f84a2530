#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

#include "glint/query/bin_map_ndf.h"

namespace glint::test {

/// Shares of the footprint, from sums of areas that are exact to double or float rounding of each texel.
inline constexpr double kWeightTolerance = 1e-6;

struct Point {
  double x, y;
};

/// Part of a polygon with a x + b y <= c.
inline std::vector<Point> clipped(const std::vector<Point>& polygon, double a, double b, double c) {
  std::vector<Point> kept;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Point p = polygon[k], q = polygon[(k + 1) % polygon.size()];
    const double dp = c - a * p.x - b * p.y, dq = c - a * q.x - b * q.y;
    if (dp >= 0) kept.push_back(p);
    if ((dp >= 0) != (dq >= 0)) kept.push_back({p.x + dp / (dp - dq) * (q.x - p.x), p.y + dp / (dp - dq) * (q.y - p.y)});
  }
  return kept;
}

inline double areaOf(const std::vector<Point>& polygon) {
  double twice = 0;
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Point p = polygon[k], q = polygon[(k + 1) % polygon.size()];
    twice += (p.x - polygon[0].x) * (q.y - polygon[0].y) - (p.y - polygon[0].y) * (q.x - polygon[0].x);
  }
  return 0.5 * std::abs(twice);
}

/// Corners of a box footprint on the endless plane, texels.
inline std::vector<Point> cornersOf(const Footprint& p, int width, int height) {
  const Point c = {double{p.centre.x} * width, double{p.centre.y} * height};
  std::vector<Point> corners;
  for (const auto& [s, t] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
    corners.push_back(
        {c.x + s * double{p.axis_a.x} + t * double{p.axis_b.x}, c.y + s * double{p.axis_a.y} + t * double{p.axis_b.y}});
  return corners;
}

/// Share of the footprint in every bin, by cutting the parallelogram at the sides of every texel.
inline std::map<std::uint32_t, double> bruteWeights(const NormalMap& map, int bins, const Footprint& p) {
  const std::vector<Point> polygon = cornersOf(p, map.width, map.height);
  double low_x = 1e30, low_y = 1e30, high_x = -1e30, high_y = -1e30;
  for (const Point q : polygon) {
    low_x = std::min(low_x, q.x), high_x = std::max(high_x, q.x);
    low_y = std::min(low_y, q.y), high_y = std::max(high_y, q.y);
  }
  const double total = areaOf(polygon);
  std::map<std::uint32_t, double> weights;
  for (int y = static_cast<int>(std::floor(low_y)); y < high_y; ++y) {
    const std::vector<Point> row = clipped(clipped(polygon, 0, 1, y + 1), 0, -1, -y);
    for (int x = static_cast<int>(std::floor(low_x)); x < high_x; ++x) {
      const std::vector<Point> part = clipped(clipped(row, 1, 0, x + 1), -1, 0, -x);
      if (part.size() < 3) continue;
      const auto wrapped = [](int i, int n) { return ((i % n) + n) % n; };
      const Vec2 n = map.at(wrapped(x, map.width), wrapped(y, map.height));
      const auto bin = [&](float v) { return std::min(static_cast<int>((v + 1) * 0.5f * static_cast<float>(bins)), bins - 1); };
      weights[static_cast<std::uint32_t>(bin(n.y) * bins + bin(n.x))] += areaOf(part) / total;
    }
  }
  return weights;
}

/// Compares the weights around h with brute force: the right 21 bins, at the border of the square too.
inline void expectWeights(const NormalMap& map, const BinMapNdf& ndf, const Footprint& p, Vec2 h) {
  const int bins = ndf.map().bins_per_axis;
  auto expected = bruteWeights(map, bins, p);
  const BinWeights weights = ndf.weights(p, h);
  ASSERT_LE(weights.count, BinWeights::kMost);
  const int column = std::min(static_cast<int>((h.x + 1) * 0.5f * static_cast<float>(bins)), bins - 1);
  const int row = std::min(static_cast<int>((h.y + 1) * 0.5f * static_cast<float>(bins)), bins - 1);
  for (int k = 0; k < weights.count; ++k) {
    const int dx = static_cast<int>(weights.bins[k]) % bins - column, dy = static_cast<int>(weights.bins[k]) / bins - row;
    EXPECT_TRUE(std::abs(dx) <= 2 && std::abs(dy) <= 2 && std::abs(dx * dy) < 4) << dx << " " << dy;
    EXPECT_NEAR(weights.weights[k], expected[weights.bins[k]], kWeightTolerance) << "bin " << weights.bins[k];
    expected.erase(weights.bins[k]);
  }
  for (const auto& [bin, weight] : expected) {
    const int dx = static_cast<int>(bin) % bins - column, dy = static_cast<int>(bin) / bins - row;
    if (std::abs(dx) <= 2 && std::abs(dy) <= 2 && std::abs(dx * dy) < 4) {
      EXPECT_NEAR(weight, 0, kWeightTolerance) << "bin " << bin << " was not found";
    }
  }
}

}  // namespace glint::test
