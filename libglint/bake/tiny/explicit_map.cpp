#include "glint/bake/tiny/explicit_map.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace glint::bake {
namespace {

/// Position of the centre of a texel of a map along an axis.
/// @param origin  texel of the plane where the map begins
void locate(std::int64_t origin, int texel, int per_texel, int n, std::int64_t& cell, float& offset) {
  const std::int64_t whole = origin + texel / per_texel, remainder = whole % n;
  const std::int64_t rest = remainder < 0 ? remainder + n : remainder;
  cell = (whole - rest) / n;
  offset = static_cast<float>(rest) + (static_cast<float>(texel % per_texel) + 0.5f) / static_cast<float>(per_texel);
}

}  // namespace

Vec2 exampleNormal(const TinyExample& example, double x, double y) {
  const int n = example.size();
  const bool wraps = example.mode == TinyMode::tiled;
  const auto index = [&](int i) { return wraps ? wrapIndex(i, n) : std::clamp(i, 0, n - 1); };
  const auto at = [&](int i, int j) { return example.normals[rowMajorIndex(index(i), index(j), n)]; };
  if (example.images.shape.surface == Surface::flat)
    return at(static_cast<int>(std::floor(x)), static_cast<int>(std::floor(y)));
  const double left = std::floor(x - 0.5), bottom = std::floor(y - 0.5);
  const auto s = static_cast<float>(x - 0.5 - left), t = static_cast<float>(y - 0.5 - bottom);
  const int i = static_cast<int>(left), j = static_cast<int>(bottom);
  const Vec2 side = s >= t ? at(i + 1, j) : at(i, j + 1);
  return (1 - std::max(s, t)) * at(i, j) + std::fabs(s - t) * side + std::min(s, t) * at(i + 1, j + 1);
}

TinySurface::Seen TinySurface::at(const PlanePoint& point) const {
  if (example_.mode == TinyMode::tiled) {
    double x, y;
    tiled_.place(point, x, y);
    return {exampleNormal(example_, x, y)};
  }
  const SeenPoint seen = scattered_.seenAt(point);
  if (seen.background) return {{}, true};
  return {seen.turn.turned(exampleNormal(example_, double{seen.local.x}, double{seen.local.y}))};
}

std::vector<Vec2> explicitNormals(const TinyExample& example, const PlaneWindow& window, const ProgressFn& progress) {
  const TinySurface surface(example);
  std::vector<Vec2> normals(static_cast<std::size_t>(window.width) * static_cast<std::size_t>(window.height));
  ProgressCounter counter(progress, static_cast<std::size_t>(window.height));
  tbb::parallel_for(0, window.height, [&](int j) {
    PlanePoint point;
    locate(window.y, j, window.per_texel, example.size(), point.cell_y, point.offset.y);
    for (int i = 0; i < window.width; ++i) {
      locate(window.x, i, window.per_texel, example.size(), point.cell_x, point.offset.x);
      normals[rowMajorIndex(i, j, window.width)] = surface.at(point).normal;
    }
    counter.advance();
  });
  return normals;
}

}  // namespace glint::bake
