#include "glint/bake/slopes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "glint/bake/simd.h"
#include "glint/query/slope_sums.h"

namespace glint::bake {
namespace {

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

[[gnu::flatten]] GLINT_MULTIVERSION SlopeSums rowSums(const Vec2* normals, std::size_t count) {
  return slopeSums(normals, count);
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
  std::vector<SlopeSums> rows(static_cast<std::size_t>(map.height));
  const auto width = static_cast<std::size_t>(map.width);
  tbb::parallel_for(std::size_t{0}, rows.size(),
                    [&](std::size_t j) { rows[j] = rowSums(map.normals.data() + j * width, width); });
  SlopeSums total;
  for (const SlopeSums& row : rows) total.add(row);  // in order of rows, so that the sum does not depend on threads
  return total.moments(static_cast<double>(map.width) * map.height);
}

}  // namespace glint::bake
