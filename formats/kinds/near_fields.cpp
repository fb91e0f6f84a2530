#include "glint/formats/kinds/near_fields.h"

#include <algorithm>
#include <cmath>

#include "glint/formats/kinds/tally.h"
#include "glint/formats/number_text.h"

namespace glint::formats {
namespace {

bool holds(const NormalBounds& b, float x, float y) { return b.low_x <= x && x <= b.high_x && b.low_y <= y && y <= b.high_y; }

/// Whether a node of the finest level holds its 2x2 texels and one more row and column, wrapped.
bool holdsTexels(const NearNormals& map, const NormalBounds& node, int i, int j) {
  for (int y = 2 * j; y <= std::min(2 * j + 2, map.height); ++y) {
    for (int x = 2 * i; x <= std::min(2 * i + 2, map.width); ++x) {
      const Vec2 n = map.at(x % map.width, y % map.height);
      if (!holds(node, n.x, n.y)) return false;
    }
  }
  return true;
}

/// Whether a node holds its 2x2 nodes of the level below.
bool holdsChildren(const NearNormals& map, int below, const NormalBounds& node, int i, int j) {
  const NearBoundsLevel& children = map.bounds[below];
  for (int y = 2 * j; y < std::min(2 * j + 2, children.rows); ++y) {
    for (int x = 2 * i; x < std::min(2 * i + 2, children.columns); ++x) {
      const NormalBounds child = map.node(below, rowMajorIndex(x, y, children.columns));
      if (!holds(node, child.low_x, child.low_y) || !holds(node, child.high_x, child.high_y)) return false;
    }
  }
  return true;
}

}  // namespace

void checkBounds(const NearNormals& normals, std::string_view rule, std::string_view path, Findings& findings) {
  for (int k = 0; k < normals.bounds_level_count; ++k) {
    const NearBoundsLevel& level = normals.bounds[k];
    TexelTally loose(level.columns, level.rows);
    for (int j = 0; j < level.rows; ++j) {
      for (int i = 0; i < level.columns; ++i) {
        const std::size_t index = rowMajorIndex(i, j, level.columns);
        const NormalBounds node = normals.node(k, index);
        if (!(k == 0 ? holdsTexels(normals, node, i, j) : holdsChildren(normals, k - 1, node, i, j))) loose.add(index);
      }
    }
    report(loose, rule, "/" + levelPath(path, k), {"node does", "nodes do"}, "not hold all texels below", findings);
  }
}

void checkNearIndex(const std::optional<NearNormals>& near, Findings& findings) {
  if (!near) return;
  int exponent = 0;
  const bool power = std::frexp(near->step, &exponent) == 0.5f;
  if (near->coded() ? !(power && double{near->step} <= kMostStep) : near->step != 1)
    findings.add("near.step", "/@near_step",
                 "is " + numberText(near->step) + (near->coded() ? ", not a power of two up to 2^-15" : ", not 1"));
  if (near->bounds_level_count == 0) return;
  const int last = near->bounds_level_count - 1;
  const NearBoundsLevel& top = near->bounds[last];
  if (top.columns != 1 || top.rows != 1)
    findings.add("near.bounds_levels", "/" + levelPath("near/bounds/level_{l}", last),
                 "has " + std::to_string(top.columns) + " x " + std::to_string(top.rows) + " nodes, not one");
}

void checkNearDisk(const NearNormals& near, Findings& findings, const std::string& fault) {
  TexelTally outside(near.width, near.height);
  const std::size_t texels = rowMajorIndex(0, near.height, near.width);
  for (std::size_t k = 0; k < texels; ++k) {
    const Vec2 n = near.normal(k);
    if (!(dot(n, n) < 1)) outside.add(k);
  }
  report(outside, "near.disk", "/near/normals", {"normal is", "normals are"}, fault, findings);
}

void checkNearValues(const std::optional<NearNormals>& near, Findings& findings) {
  if (!near) return;
  checkNearDisk(*near, findings);
  checkBounds(*near, "near.bounds", "near/bounds/level_{l}", findings);
}

}  // namespace glint::formats
