#include "glint/bake/common/slopes.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "glint/bake/common/simd.h"
#include "glint/model/slope_sums.h"

namespace glint::bake {
namespace {

/// The neighbours of texel i of `count` along an axis, and the reciprocal of their distance.
struct Neighbours {
  int before, after;
  float scale = 0.5f;

  Neighbours(int i, int count, Boundary boundary) : before(i - 1), after(i + 1) {
    if (i > 0 && after < count) return;
    const bool wrap = boundary == Boundary::wrap;
    if (i == 0) before = wrap ? count - 1 : 0;
    if (after == count) after = wrap ? 0 : i;
    if (!wrap) scale = 1;
  }
};

/// Calls visit(i, slopes) for each texel of row j. Heights are scaled before their differences, which would overflow between
/// heights of 3e38 and -3e38.
template <class Visit>
void visitSlopes(int width, int height, std::span<const float> heights, int j, Boundary boundary, Gradient gradient,
                 const Visit& visit) {
  const auto row = [&](int y) { return heights.data() + static_cast<std::size_t>(y) * width; };
  const Neighbours y(j, height, boundary);
  const float* here = row(j);
  const float* below = row(y.before);
  const float* above = row(y.after);
  for (int i = 0; i < width; ++i) {
    const Neighbours x(i, width, boundary);
    if (gradient == Gradient::central) {
      visit(i, Vec2{x.scale * here[x.after] - x.scale * here[x.before], y.scale * above[i] - y.scale * below[i]});
      continue;
    }
    const auto across = [&](const float* line) { return 0.125f * line[x.after] - 0.125f * line[x.before]; };
    const auto along = [&](int k) { return 0.125f * above[k] - 0.125f * below[k]; };
    visit(i, Vec2{across(below) + 2 * across(here) + across(above), along(x.before) + 2 * along(i) + along(x.after)});
  }
}

/// Whether a normal with these slopes is longer than kRimRadius on the disk. False for NaN.
bool isCliff(Vec2 slope) {
  constexpr float kSteepest = 577.35f;  // r / sqrt(1 - r^2)
  return dot(slope, slope) > kSteepest * kSteepest;
}

/// slopeSums, inlined into each version so that it uses the instructions of that version.
[[gnu::flatten]] GLINT_MULTIVERSION SlopeSums rowSums(const Vec2* normals, std::size_t count) {
  return slopeSums(normals, count);
}

}  // namespace

Vec2 normalFromSlopes(float dh_dx, float dh_dy) {
  if (isCliff({dh_dx, dh_dy})) {
    const double scale = -kRimRadius / std::hypot(static_cast<double>(dh_dx), static_cast<double>(dh_dy));
    return {static_cast<float>(scale * dh_dx), static_cast<float>(scale * dh_dy)};
  }
  const float scale = -1 / std::sqrt(1 + dh_dx * dh_dx + dh_dy * dh_dy);
  return {scale * dh_dx, scale * dh_dy};
}

std::vector<Vec2> normalsFromHeights(int width, int height, std::span<const float> heights, Boundary boundary,
                                     std::size_t* cliffs, Gradient gradient) {
  std::vector<Vec2> normals(heights.size());
  normalsFromHeights(width, height, heights, normals, boundary, cliffs, gradient);
  return normals;
}

void normalsFromHeights(int width, int height, std::span<const float> heights, std::span<Vec2> normals, Boundary boundary,
                        std::size_t* cliffs, Gradient gradient) {
  std::vector<std::size_t> row_cliffs(static_cast<std::size_t>(height));
  tbb::parallel_for(0, height, [&](int j) {
    Vec2* line = normals.data() + static_cast<std::size_t>(j) * width;
    std::size_t steep = 0;
    visitSlopes(width, height, heights, j, boundary, gradient, [&](int i, Vec2 slope) {
      line[i] = normalFromSlopes(slope.x, slope.y);
      steep += isCliff(slope) ? 1 : 0;
    });
    row_cliffs[static_cast<std::size_t>(j)] = steep;
  });
  if (cliffs) *cliffs = std::accumulate(row_cliffs.begin(), row_cliffs.end(), std::size_t{0});
}

void rowSlopes(int width, int height, std::span<const float> heights, int j, Boundary boundary, Gradient gradient,
               std::span<Vec2> slopes) {
  visitSlopes(width, height, heights, j, boundary, gradient,
              [&](int i, Vec2 slope) { slopes[static_cast<std::size_t>(i)] = slope; });
}

Vec2 seamRoughness(int width, int height, std::span<const float> heights) {
  const auto columns = static_cast<std::size_t>(width), rows = static_cast<std::size_t>(height);
  const auto square = [&](std::size_t a, std::size_t b) {
    const double step = static_cast<double>(heights[a]) - heights[b];
    return step * step;
  };
  // Sums of squared steps from each column (row) to the next; from the last to the first, across the seam.
  std::vector<double> between_columns(columns), between_rows(rows);
  for (std::size_t j = 0; j < rows; ++j) {
    const std::size_t here = j * columns, above = (j + 1) % rows * columns;
    for (std::size_t i = 0; i < columns; ++i) {
      between_columns[i] += square(here + i, here + (i + 1) % columns);
      between_rows[j] += square(here + i, above + i);
    }
  }
  const auto ratio = [](const std::vector<double>& squares) {
    if (squares.size() < 3) return 0.0f;
    const double inside = *std::max_element(squares.begin(), squares.end() - 1);
    return inside > 0 ? static_cast<float>(std::sqrt(squares.back() / inside)) : 0.0f;
  };
  return {ratio(between_columns), ratio(between_rows)};
}

SlopeVariances slopeVariances(int width, int height, std::span<const float> heights) {
  std::vector<SlopeVariances> rows(static_cast<std::size_t>(height));
  tbb::parallel_for(0, height, [&](int j) {
    SlopeVariances& sum = rows[static_cast<std::size_t>(j)];
    visitSlopes(width, height, heights, j, Boundary::wrap, Gradient::central, [&](int, Vec2 slope) {
      sum.variance_x += slope.x * slope.x;
      sum.variance_y += slope.y * slope.y;
      sum.steepest = std::max(sum.steepest, std::sqrt(dot(slope, slope)));
    });
  });
  SlopeVariances total;
  for (const SlopeVariances& row : rows) {  // in order of rows, so that the sum does not depend on threads
    total.variance_x += row.variance_x;
    total.variance_y += row.variance_y;
    total.steepest = std::max(total.steepest, row.steepest);
  }
  total.variance_x /= static_cast<double>(heights.size());
  total.variance_y /= static_cast<double>(heights.size());
  return total;
}

MapSlopes mapSlopes(const NormalMap& map) {
  if (map.slopes) return *map.slopes;
  std::vector<SlopeSums> rows(static_cast<std::size_t>(map.height));
  const auto width = static_cast<std::size_t>(map.width);
  tbb::parallel_for(std::size_t{0}, rows.size(),
                    [&](std::size_t j) { rows[j] = rowSums(map.normals.data() + j * width, width); });
  SlopeSums total;
  for (const SlopeSums& row : rows) total.add(row);  // in order of rows, so that the sum does not depend on threads
  return total.moments(static_cast<double>(map.width) * map.height);
}

}  // namespace glint::bake
