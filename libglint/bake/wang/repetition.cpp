#include "glint/bake/wang/repetition.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "glint/query/wang_layout.h"

namespace glint::bake {
namespace {

/// Half of the distances: the other half has the same correlations.
std::vector<std::pair<int, int>> distances() {
  std::vector<std::pair<int, int>> all;
  for (int j = 0; j <= kRepetitionReach; ++j)
    for (int i = j == 0 ? 1 : -kRepetitionReach; i <= kRepetitionReach; ++i) all.emplace_back(i, j);
  return all;
}

/// Some texels of every tile, at the same positions in each.
struct TileSamples {
  std::size_t per_tile = 0;
  std::vector<Vec2> normals;  ///< [tile_count][per_tile], less their mean
  double mean_square = 0;     ///< of all of them

  const Vec2* of(int tile) const { return normals.data() + static_cast<std::size_t>(tile) * per_tile; }
};

TileSamples samplesOf(const WangTiles& tiles) {
  constexpr int kMostPerAxis = 64;
  TileSamples samples;
  const int per_axis = std::min(tiles.size, kMostPerAxis);
  const auto position = [&](int k) { return static_cast<int>((std::int64_t{2} * k + 1) * tiles.size / (2 * per_axis)); };
  samples.per_tile = rowMajorIndex(0, per_axis, per_axis);
  double x = 0, y = 0;
  for (int t = 0; t < tiles.tile_count; ++t)
    for (int j = 0; j < per_axis; ++j)
      for (int i = 0; i < per_axis; ++i) {
        const Vec2 n = tiles.at(t, position(i), position(j));
        samples.normals.push_back(n);
        x += double{n.x}, y += double{n.y};
      }
  const auto count = static_cast<double>(samples.normals.size());
  const Vec2 mean = {static_cast<float>(x / count), static_cast<float>(y / count)};
  for (Vec2& n : samples.normals) {
    n = n - mean;
    samples.mean_square += double{dot(n, n)} / count;
  }
  return samples;
}

double product(const Vec2* a, const Vec2* b, std::size_t count) {
  float sums[8] = {};
  for (std::size_t k = 0; k < count; ++k) sums[k % 8] += dot(a[k], b[k]);
  double sum = 0;
  for (const float s : sums) sum += double{s};
  return sum / static_cast<double>(count);
}

/// Normals whose mean square is below this (of rounding) count as equal.
constexpr double kSameSquare = 1e-13;

}  // namespace

double planeRepetition(const WangTiles& tiles) {
  constexpr int kCells = 64;  // along each axis
  const TileSamples samples = samplesOf(tiles);
  if (!(samples.mean_square > kSameSquare)) return 0;
  const WangLayout layout(tiles);
  constexpr int kSide = kCells + 2 * kRepetitionReach;
  std::vector<int> plane;
  for (int j = 0; j < kSide; ++j)
    for (int i = 0; i < kSide; ++i) plane.push_back(layout.tileAt(i, j));
  const auto lags = distances();
  std::vector<double> correlations(lags.size());
  tbb::parallel_for(std::size_t{0}, lags.size(), [&](std::size_t lag) {
    double sum = 0;
    for (int j = 0; j < kCells; ++j)
      for (int i = 0; i < kCells; ++i) {
        const int a = plane[rowMajorIndex(i + kRepetitionReach, j, kSide)];
        const int b = plane[rowMajorIndex(i + kRepetitionReach + lags[lag].first, j + lags[lag].second, kSide)];
        sum += product(samples.of(a), samples.of(b), samples.per_tile);
      }
    correlations[lag] = sum / (double{kCells} * kCells * samples.mean_square);
  });
  return *std::max_element(correlations.begin(), correlations.end());
}

double mapRepetition(const PatchSource& map, int size) {
  const bool wraps = map.boundary() == Boundary::wrap;
  const auto lags = distances();
  double x = 0, y = 0, square = 0;
  for (int j = 0; j < map.height(); ++j)
    for (int i = 0; i < map.width(); ++i) {
      const Vec2 n = map.at(i, j);
      x += double{n.x}, y += double{n.y}, square += double{dot(n, n)};
    }
  const double count = static_cast<double>(map.width()) * map.height();
  const Vec2 mean = {static_cast<float>(x / count), static_cast<float>(y / count)};
  const double variance = square / count - double{dot(mean, mean)};
  if (!(variance > kSameSquare)) return 0;
  constexpr int kMostRows = 256;
  const int step_x = std::max(1, map.width() / kMostRows), step_y = std::max(1, map.height() / kMostRows);
  std::vector<double> correlations(lags.size(), 0.0);
  tbb::parallel_for(std::size_t{0}, lags.size(), [&](std::size_t lag) {
    const int dx = size * lags[lag].first, dy = size * lags[lag].second;
    const bool multiple = dx % map.width() == 0 && dy % map.height() == 0;  // on a map that wraps, a shift by nothing
    if (wraps ? multiple : 2 * std::abs(dx) > map.width() || 2 * dy > map.height()) return;
    const int first_x = wraps ? 0 : std::max(0, -dx), last_x = wraps ? map.width() : map.width() - std::max(0, dx);
    const int last_y = wraps ? map.height() : map.height() - dy;
    double sum = 0;
    std::size_t texels = 0;
    for (int j = 0; j < last_y; j += step_y)
      for (int i = first_x; i < last_x; i += step_x, ++texels)
        sum += double{dot(map.at(i, j) - mean, map.at(i + dx, j + dy) - mean)};
    correlations[lag] = sum / (static_cast<double>(texels) * variance);
  });
  return std::max(0.0, *std::max_element(correlations.begin(), correlations.end()));
}

}  // namespace glint::bake
