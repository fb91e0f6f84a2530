#include "glint/bake/slopes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace glint::bake {
namespace {

/// Variance of slopes that rounded normals alone can have: a map that is flat to float precision counts as flat.
constexpr double kRoundingVariance = 1e-13;

/// Calls visit(i, slopes) for each texel of row j.
template <class Visit>
void visitSlopes(int width, int height, std::span<const float> heights, int j, const Visit& visit) {
  const auto row = [&](int y) { return heights.data() + static_cast<std::size_t>(y) * width; };
  const float* here = row(j);
  const float* below = row(j == 0 ? height - 1 : j - 1);
  const float* above = row(j == height - 1 ? 0 : j + 1);
  for (int i = 0; i < width; ++i) {
    const float left = here[i == 0 ? width - 1 : i - 1];
    const float right = here[i == width - 1 ? 0 : i + 1];
    visit(i, Vec2{0.5f * (right - left), 0.5f * (above[i] - below[i])});
  }
}

}  // namespace

Vec2 normalFromSlopes(float dh_dx, float dh_dy) {
  const float scale = -1 / std::sqrt(1 + dh_dx * dh_dx + dh_dy * dh_dy);
  return {scale * dh_dx, scale * dh_dy};
}

std::vector<Vec2> normalsFromHeights(int width, int height, std::span<const float> heights) {
  std::vector<Vec2> normals(heights.size());
  tbb::parallel_for(0, height, [&](int j) {
    Vec2* line = normals.data() + static_cast<std::size_t>(j) * width;
    visitSlopes(width, height, heights, j, [&](int i, Vec2 slope) { line[i] = normalFromSlopes(slope.x, slope.y); });
  });
  return normals;
}

SlopeMoments slopeMoments(int width, int height, std::span<const float> heights) {
  std::vector<SlopeMoments> rows(static_cast<std::size_t>(height));
  tbb::parallel_for(0, height, [&](int j) {
    SlopeMoments& sum = rows[static_cast<std::size_t>(j)];
    visitSlopes(width, height, heights, j, [&](int, Vec2 slope) {
      sum.variance_x += slope.x * slope.x;
      sum.variance_y += slope.y * slope.y;
      sum.steepest = std::max(sum.steepest, std::sqrt(dot(slope, slope)));
    });
  });
  SlopeMoments total;
  for (const SlopeMoments& row : rows) {  // in order of rows, so that the sum does not depend on threads
    total.variance_x += row.variance_x;
    total.variance_y += row.variance_y;
    total.steepest = std::max(total.steepest, row.steepest);
  }
  total.variance_x /= static_cast<double>(heights.size());
  total.variance_y /= static_cast<double>(heights.size());
  return total;
}

MapSlopes mapSlopes(const NormalMap& map) {
  struct Sums {
    double p = 0, q = 0, pp = 0, pq = 0, qq = 0;
  };
  std::vector<Sums> rows(static_cast<std::size_t>(map.height));
  tbb::parallel_for(0, map.height, [&](int j) {
    Sums& sum = rows[static_cast<std::size_t>(j)];
    for (int i = 0; i < map.width; ++i) {
      const Vec2 n = map.at(i, j);
      const double scale = -1 / std::sqrt(std::max(1e-12, 1.0 - dot(n, n))), p = scale * n.x, q = scale * n.y;
      sum.p += p, sum.q += q, sum.pp += p * p, sum.pq += p * q, sum.qq += q * q;
    }
  });
  Sums total;
  for (const Sums& row : rows) {  // in order of rows, so that the sum does not depend on threads
    total.p += row.p, total.q += row.q, total.pp += row.pp, total.pq += row.pq, total.qq += row.qq;
  }
  const double count = static_cast<double>(map.width) * map.height, p = total.p / count, q = total.q / count;
  const auto variance = [](double v) { return v > kRoundingVariance ? v : 0; };
  const double pp = variance(total.pp / count - p * p), qq = variance(total.qq / count - q * q);
  const double most = std::sqrt(pp * qq), pq = std::clamp(total.pq / count - p * q, -most, most);
  return {{static_cast<float>(p), static_cast<float>(q)},
          {static_cast<float>(pp), static_cast<float>(pq), static_cast<float>(qq)}};
}

}  // namespace glint::bake
