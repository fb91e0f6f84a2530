#include "glint/bake/slopes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "glint/bake/simd.h"

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

/// Sums over slopes (p, q).
struct Sums {
  double p = 0, q = 0, pp = 0, pq = 0, qq = 0;
};

/// Sums over the slopes of some normals, in lanes that compilers vectorise.
GLINT_MULTIVERSION Sums rowSums(const Vec2* normals, std::size_t count) {
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
  Sums total;
  for (std::size_t k = 0; k < kLanes; ++k) {
    total.p += sums[0][k], total.q += sums[1][k];
    total.pp += sums[2][k], total.pq += sums[3][k], total.qq += sums[4][k];
  }
  return total;
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
  std::vector<Sums> rows(static_cast<std::size_t>(map.height));
  const auto width = static_cast<std::size_t>(map.width);
  tbb::parallel_for(std::size_t{0}, rows.size(),
                    [&](std::size_t j) { rows[j] = rowSums(map.normals.data() + j * width, width); });
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
