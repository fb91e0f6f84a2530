#include "glint/bake/ingest/normal_bounds.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

namespace glint::bake {
namespace {

constexpr NormalBounds kEmpty = {std::numeric_limits<float>::max(), std::numeric_limits<float>::max(),
                                 std::numeric_limits<float>::lowest(), std::numeric_limits<float>::lowest()};

NormalBounds merged(const NormalBounds& a, const NormalBounds& b) {
  return {std::min(a.low_x, b.low_x), std::min(a.low_y, b.low_y), std::max(a.high_x, b.high_x), std::max(a.high_y, b.high_y)};
}

/// Bounds the normals of texels 2 i .. 2 i + 2 in rows 2 j .. 2 j + 2, wrapped around the map. At the border of a map of odd
/// size, the square of a node is cut: triangles start inside the map only.
NormalBoundsStorage finestLevel(int width, int height, std::span<const Vec2> normals) {
  NormalBoundsStorage level;
  level.columns = (width + 1) / 2;
  level.rows = (height + 1) / 2;
  level.nodes.resize(static_cast<std::size_t>(level.columns) * level.rows);
  tbb::parallel_for(tbb::blocked_range<int>(0, level.rows, 16), [&](const tbb::blocked_range<int>& rows) {
    for (int row = rows.begin(); row < rows.end(); ++row) {
      NormalBounds* nodes = level.nodes.data() + static_cast<std::size_t>(row) * level.columns;
      std::fill(nodes, nodes + level.columns, kEmpty);
      const int last_y = std::min(2 * row + 2, height);
      for (int y = 2 * row; y <= last_y; ++y) {
        const Vec2* line = normals.data() + static_cast<std::size_t>(y % height) * width;
        for (int column = 0; column < level.columns; ++column) {
          NormalBounds bounds = nodes[column];
          const int last_x = std::min(2 * column + 2, width);
          for (int x = 2 * column; x <= last_x; ++x) {
            const Vec2 n = line[x < width ? x : 0];
            bounds = merged(bounds, {n.x, n.y, n.x, n.y});
          }
          nodes[column] = bounds;
        }
      }
    }
  });
  return level;
}

/// Joins squares of 2x2 nodes.
NormalBoundsStorage coarserLevel(const NormalBoundsStorage& finer) {
  NormalBoundsStorage level;
  level.columns = (finer.columns + 1) / 2;
  level.rows = (finer.rows + 1) / 2;
  level.nodes.resize(static_cast<std::size_t>(level.columns) * level.rows);
  for (int row = 0; row < level.rows; ++row) {
    for (int column = 0; column < level.columns; ++column) {
      // The extra row and column of a child are inside its parent, or are the extra row and column of the parent.
      NormalBounds bounds = kEmpty;
      for (int y = 2 * row; y < std::min(2 * row + 2, finer.rows); ++y) {
        for (int x = 2 * column; x < std::min(2 * column + 2, finer.columns); ++x) {
          bounds = merged(bounds, finer.nodes[static_cast<std::size_t>(y) * finer.columns + x]);
        }
      }
      level.nodes[static_cast<std::size_t>(row) * level.columns + column] = bounds;
    }
  }
  return level;
}

}  // namespace

std::vector<NormalBoundsStorage> buildNormalBounds(int width, int height, std::span<const Vec2> normals) {
  std::vector<NormalBoundsStorage> levels;
  levels.push_back(finestLevel(width, height, normals));
  while (levels.back().columns > 1 || levels.back().rows > 1) levels.push_back(coarserLevel(levels.back()));
  return levels;
}

void attachBounds(NormalMap& map, const std::vector<NormalBoundsStorage>& levels) {
  map.bounds_level_count = static_cast<int>(std::min<std::size_t>(levels.size(), NormalMap::kMaxBoundsLevels));
  for (int level = 0; level < map.bounds_level_count; ++level) {
    map.bounds[level] = {levels[level].columns, levels[level].rows, levels[level].nodes};
  }
}

}  // namespace glint::bake
