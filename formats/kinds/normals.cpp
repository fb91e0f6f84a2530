#include <algorithm>
#include <cmath>

#include "glint/formats/kinds/codec.h"
#include "glint/formats/kinds/texel_tally.h"

namespace glint::formats {
namespace {

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
    report(loose, "normals.bounds", "/" + levelPath("bounds/level_{l}", k), "nodes do not hold what they cover", findings);
  }
}

}  // namespace

PackedAsset pack(const NormalMap& map) {
  PackedAsset packed{"normals", {}, {}};
  packed.integer("width", map.width);
  packed.integer("height", map.height);
  packed.real("texel_size_um", map.texel_size_um);
  packed.integer("bounds_level_count", map.bounds_level_count);
  packed.array("normals", ElementType::f32, {static_cast<std::uint64_t>(map.height), static_cast<std::uint64_t>(map.width), 2},
               map.normals.data(), map.normals.size() * 2);
  for (int k = 0; k < std::min(map.bounds_level_count, NormalMap::kMaxBoundsLevels); ++k) {
    const NormalBoundsLevel& level = map.bounds[k];
    packed.array(levelPath("bounds/level_{l}", k), ElementType::f32,
                 {static_cast<std::uint64_t>(level.rows), static_cast<std::uint64_t>(level.columns), 4}, level.nodes.data(),
                 level.nodes.size() * 4);
  }
  return packed;
}

void unpack(const Content& content, NormalMap& map) {
  map.width = content.integer("width");
  map.height = content.integer("height");
  map.texel_size_um = content.real("texel_size_um");
  map.normals = content.array<Vec2>("normals");
  map.bounds_level_count = content.integer("bounds_level_count");
  for (int k = 0; k < map.bounds_level_count; ++k) {
    const std::string path = levelPath("bounds/level_{l}", k);
    const std::vector<std::uint64_t>& dims = content.dataset(path).dims;
    map.bounds[k] = {static_cast<int>(dims[1]), static_cast<int>(dims[0]), content.array<NormalBounds>(path)};
  }
}

void checkIndex(const NormalMap& map, Findings& findings) {
  if (map.bounds_level_count == 0) return;
  const NormalBoundsLevel& top = map.bounds[map.bounds_level_count - 1];
  if (top.columns != 1 || top.rows != 1) {
    findings.add("normals.bounds_levels", "/" + levelPath("bounds/level_{l}", map.bounds_level_count - 1),
                 "has " + std::to_string(top.columns) + " x " + std::to_string(top.rows) + " nodes, not one");
  }
}

void checkData(const NormalMap& map, Findings& findings) {
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
  report(infinite, "normals.finite", "/normals", "texels are not finite", findings);
  report(outside, "normals.disk", "/normals", "normals are not inside the unit disk", findings);
  checkBounds(map, findings);
}

}  // namespace glint::formats
