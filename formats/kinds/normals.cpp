#include <algorithm>
#include <cmath>

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/shared_fields.h"
#include "glint/formats/kinds/tally.h"
#include "glint/model/slope_sums.h"

namespace glint::formats {
namespace {

/// Nodes of level l of the bounds along an axis of so many texels.
int nodesAlong(int texels, int l) { return static_cast<int>((std::int64_t{texels} + (std::int64_t{2} << l) - 1) >> (l + 1)); }

bool holds(const NormalBounds& b, float x, float y) { return b.low_x <= x && x <= b.high_x && b.low_y <= y && y <= b.high_y; }

/// Whether a node of the finest level holds its 2x2 texels and one more row and column, wrapped.
bool holdsTexels(const NormalMap& map, const NormalBounds& node, int i, int j) {
  for (int y = 2 * j; y <= std::min(2 * j + 2, map.height); ++y) {
    for (int x = 2 * i; x <= std::min(2 * i + 2, map.width); ++x) {
      const Vec2 n = map.at(x % map.width, y % map.height);
      if (!holds(node, n.x, n.y)) return false;
    }
  }
  return true;
}

bool holdsChildren(const NormalBoundsLevel& children, const NormalBounds& node, int i, int j) {
  for (int y = 2 * j; y < std::min(2 * j + 2, children.rows); ++y) {
    for (int x = 2 * i; x < std::min(2 * i + 2, children.columns); ++x) {
      const NormalBounds& child = children.nodes[static_cast<std::size_t>(y) * children.columns + x];
      if (!holds(node, child.low_x, child.low_y) || !holds(node, child.high_x, child.high_y)) return false;
    }
  }
  return true;
}

void checkBounds(const NormalMap& map, Findings& findings) {
  for (int k = 0; k < map.bounds_level_count; ++k) {
    const NormalBoundsLevel& level = map.bounds[k];
    TexelTally loose(level.columns, level.rows);
    for (int j = 0; j < level.rows; ++j) {
      for (int i = 0; i < level.columns; ++i) {
        const std::size_t index = static_cast<std::size_t>(j) * level.columns + i;
        const NormalBounds& node = level.nodes[index];
        if (!(k == 0 ? holdsTexels(map, node, i, j) : holdsChildren(map.bounds[k - 1], node, i, j))) loose.add(index);
      }
    }
    report(loose, "normals.bounds", "/" + levelPath("bounds/level_{l}", k), {"node does", "nodes do"},
           "not hold all texels below", findings);
  }
}

/// Compares the stored slopes with the normals'.
void checkStoredSlopes(const NormalMap& map, Findings& findings) {
  constexpr float kTolerance = 1e-3f;  // relative: slopes near the rim lose digits
  const MapSlopes &stored = *map.slopes, actual = slopesOf(map);
  const float variance = actual.covariance.xx + actual.covariance.yy;
  const auto near = [](float a, float b, float scale) { return std::abs(a - b) <= kTolerance * scale + 1e-6f; };
  const float size = std::sqrt(std::max(0.0f, variance)) + std::abs(actual.mean.x) + std::abs(actual.mean.y);
  if (near(stored.mean.x, actual.mean.x, size) && near(stored.mean.y, actual.mean.y, size) &&
      near(stored.covariance.xx, actual.covariance.xx, size * size) &&
      near(stored.covariance.xy, actual.covariance.xy, size * size) &&
      near(stored.covariance.yy, actual.covariance.yy, size * size))
    return;
  findings.add("normals.slopes", "/@slope_covariance", "and slope_mean are not those of the normals");
}

}  // namespace

template <>
struct KindDescription<NormalMap> {
  static constexpr std::string_view kTitle = "Normal map";

  static std::vector<Rule> indexRules() {
    return {errorRule("normals.bounds_levels", "the coarsest level of bounds is one node")};
  }
  static std::vector<Rule> valueRules() {
    return {errorRule("normals.finite", "normals are finite", "make it again with glint-ingest --fix-invalid"),
            errorRule("normals.disk", "normals lie inside the unit disk",
                      "make it again with glint-ingest, which moves normals on the rim inside"),
            errorRule("normals.bounds", "bounds hold the normals that they cover"),
            errorRule("normals.slopes", "slope_mean and slope_covariance, where there are any, are those of the normals")};
  }

  static void describe(Fields auto& fields, auto& map) {
    describeMap(fields, map);
    fields.optional(map.slopes, [&](auto&& slopes) { describeSlopes(fields, slopes); });
    fields.integer("bounds_level_count", map.bounds_level_count, {0, NormalMap::kMaxBoundsLevels}, "1",
                   "levels of the min-max pyramid; 0 when there is none");
    fields.array("normals", map.normals, {"height", "width", "2"}, "1", "(nx, ny) on the unit disk, bottom row first");
    fields.levels("bounds_level_count", map.bounds_level_count, [&](int l) {
      auto& level = map.bounds[l];
      fields.set(level.columns, nodesAlong(map.width, l));
      fields.set(level.rows, nodesAlong(map.height, l));
      fields.array("bounds/level_{l}", level.nodes, {"ceil_div(height, pow2(l + 1))", "ceil_div(width, pow2(l + 1))", "4"}, "1",
                   "low nx, low ny, high nx, high ny of the texels of each node and one more row and column, wrapped");
    });
  }

  static void checkIndex(const NormalMap& map, Findings& findings) {
    if (map.slopes) checkSlopes(*map.slopes, findings);
    if (map.bounds_level_count == 0) return;
    const NormalBoundsLevel& top = map.bounds[map.bounds_level_count - 1];
    if (top.columns != 1 || top.rows != 1) {
      findings.add("normals.bounds_levels", "/" + levelPath("bounds/level_{l}", map.bounds_level_count - 1),
                   "has " + std::to_string(top.columns) + " x " + std::to_string(top.rows) + " nodes, not one");
    }
  }

  static void checkValues(const NormalMap& map, Findings& findings) {
    TexelTally infinite(map.width, map.height);
    TexelTally outside(map.width, map.height);
    for (std::size_t k = 0; k < map.normals.size(); ++k) {
      const Vec2 n = map.normals[k];
      if (!std::isfinite(n.x) || !std::isfinite(n.y)) {
        infinite.add(k);
      } else if (!(dot(n, n) < 1)) {
        outside.add(k);
      }
    }
    report(infinite, "normals.finite", "/normals", {"texel is", "texels are"}, "not finite", findings);
    report(outside, "normals.disk", "/normals", {"normal is", "normals are"}, "not inside the unit disk", findings);
    checkBounds(map, findings);
    if (map.slopes && infinite.count() == 0 && outside.count() == 0) checkStoredSlopes(map, findings);
  }
};

template const Kind& kindOf<NormalMap>();

}  // namespace glint::formats
