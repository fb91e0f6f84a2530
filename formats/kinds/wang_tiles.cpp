#include "glint/model/wang_tiles.h"

#include <cmath>
#include <string>
#include <vector>

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/shared_fields.h"
#include "glint/formats/kinds/tally.h"
#include "glint/formats/kinds/wang_fields.h"
#include "glint/model/slope_sums.h"

namespace glint::formats {
namespace {

constexpr const char* kSideNames[4] = {"south", "north", "west", "east"};

std::string texelText(const WangTiles& tiles, std::size_t texel) {
  const std::size_t inside = texel % tiles.texelsOfTile(), size = static_cast<std::size_t>(tiles.size);
  return "at tile " + std::to_string(texel / tiles.texelsOfTile()) + ", column " + std::to_string(inside % size) + ", row " +
         std::to_string(inside / size);
}

/// Texel k along a side of a tile, from south or west on.
const Vec2& onSide(const WangTiles& tiles, int tile, int side, int k) {
  const int across = side % 2 == 0 ? 0 : tiles.size - 1;
  return side < 2 ? tiles.at(tile, k, across) : tiles.at(tile, across, k);
}

/// Number of what decides the outermost texels of a side: its colour, or those of its two corners.
int sideKey(const WangTiles& tiles, const WangColors& colors, int side) {
  if (tiles.scheme == WangScheme::edge) return colors[static_cast<std::size_t>(side)];
  constexpr std::size_t kCorners[4][2] = {{0, 1}, {2, 3}, {0, 2}, {1, 3}};
  return colors[kCorners[side][0]] * tiles.colors_h + colors[kCorners[side][1]];
}

/// Compares each side with the first tile that has the same colours there.
void checkSides(const WangTiles& tiles, Findings& findings) {
  const int ends = tiles.scheme == WangScheme::edge ? 1 : 0;  // texels in corners belong to no edge
  for (int side = 0; side < 4; ++side) {
    std::vector<int> first(static_cast<std::size_t>(WangTiles::kMostColors) * WangTiles::kMostColors, -1);
    for (int tile = 0; tile < tiles.tile_count; ++tile) {
      int& known = first[static_cast<std::size_t>(sideKey(tiles, tiles.colorsOfTile(tile), side))];
      if (known < 0) known = tile;
      for (int k = ends; k < tiles.size - ends; ++k) {
        if (onSide(tiles, tile, side, k) == onSide(tiles, known, side, k)) continue;
        findings.add("wang.sides", "/normals",
                     "tile " + std::to_string(tile) + " differs from tile " + std::to_string(known) + " on its " +
                         kSideNames[side] + " side (first at texel " + std::to_string(k) + ")");
        return;
      }
    }
  }
}

void checkTileSlopes(const WangTiles& tiles, Findings& findings) {
  SlopeSums sums;
  for (int tile = 0; tile < tiles.tile_count; ++tile) sums.add(slopeSums(&tiles.at(tile, 0, 0), tiles.texelsOfTile()));
  const MapSlopes actual = sums.moments(static_cast<double>(tiles.normals.size())), &stored = tiles.slopes;
  const Covariance &a = actual.covariance, &b = stored.covariance;
  constexpr float kTolerance = 1e-3f, kSmallest = 1e-6f;  // relative: slopes near the rim lose digits
  const float size = std::sqrt(std::max(0.0f, a.xx + a.yy)) + std::abs(actual.mean.x) + std::abs(actual.mean.y);
  const auto near = [](float x, float y, float scale) { return std::abs(x - y) <= kTolerance * scale + kSmallest; };
  if (!near(actual.mean.x, stored.mean.x, size) || !near(actual.mean.y, stored.mean.y, size) ||
      !near(a.xx, b.xx, size * size) || !near(a.xy, b.xy, size * size) || !near(a.yy, b.yy, size * size))
    findings.add("wang.slopes", "/@slope_covariance", "and slope_mean are not those of the tiles");
}

}  // namespace

template <>
struct KindDescription<WangTiles> {
  static constexpr std::string_view kTitle = "Wang tiles";

  static std::vector<Rule> indexRules() {
    return {errorRule("wang.set", "each combination of colours has the same number of tiles, at least one"),
            errorRule("wang.corners", "scheme corner has one number of colours")};
  }
  static std::vector<Rule> valueRules() {
    return {errorRule("wang.disk", "normals are finite and lie inside the unit disk"),
            errorRule("wang.sides", "tiles with the same colours on a side have the same texels there"),
            errorRule("wang.slopes", "slope_mean and slope_covariance are those of the tiles")};
  }

  static void describe(Fields auto& fields, auto& tiles) {
    describeTileSet(fields, tiles);
    fields.real("seam_cost", tiles.seam_cost, {0, FLT_MAX}, "1",
                "mean difference of normals along seams, over that of neighbouring texels of the input");
    fields.real("ndf_tv", tiles.ndf_tv, {0, 1}, "1", "total variation between the normals of the tiles and of the input");
    fields.real("repetition", tiles.repetition, {0, 1}, "1",
                "largest autocorrelation of the plane at distances of up to four whole tiles");
    describeSlopes(fields, tiles.slopes);
    fields.array("normals", tiles.normals, {"tile_count", "tile_size", "tile_size", "2"}, "1",
                 "(nx, ny) on the unit disk of each tile, bottom row first");
  }

  static void checkIndex(const WangTiles& tiles, Findings& findings) {
    checkSlopes(tiles.slopes, findings);
    checkTileSet(tiles, findings);
  }

  static void checkValues(const WangTiles& tiles, Findings& findings) {
    Tally outside;
    for (std::size_t k = 0; k < tiles.normals.size(); ++k)
      if (!(dot(tiles.normals[k], tiles.normals[k]) < 1)) outside.add(k);  // also where a number is not finite
    report(outside, "wang.disk", "/normals", {"texel is", "texels are"}, "not finite, or not inside the unit disk", findings,
           [&](std::size_t k) { return texelText(tiles, k); });
    if (outside.count() > 0) return;
    checkSides(tiles, findings);
    checkTileSlopes(tiles, findings);
  }
};

template const Kind& kindOf<WangTiles>();

}  // namespace glint::formats
