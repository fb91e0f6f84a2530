#include <algorithm>
#include <cmath>

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/near_fields.h"
#include "glint/formats/kinds/shared_fields.h"
#include "glint/formats/kinds/tally.h"
#include "glint/model/slope_sums.h"

namespace glint::formats {
namespace {

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
    checkBounds(map, "normals.bounds", "bounds/level_{l}", findings);
    if (map.slopes && infinite.count() == 0 && outside.count() == 0) checkStoredSlopes(map, findings);
  }
};

template const Kind& kindOf<NormalMap>();

}  // namespace glint::formats
