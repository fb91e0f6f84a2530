#include "common/texel_checks.h"

#include <algorithm>
#include <cmath>

#include "glint/model/counted.h"
#include "glint/model/error.h"
#include "glint/model/texel_name.h"

namespace glint::apps {
namespace {

/// Whether all lie inside the unit disk, which numbers that are not finite do not.
bool areInside(std::span<const Vec2> normals) {
  bool inside = true;
  for (const Vec2 n : normals) inside &= dot(n, n) < 1;
  return inside;
}

void requireTiles(const WangTiles& tiles, const std::string& path) {
  const std::size_t texels = tiles.texelsOfTile();
  for (std::size_t t = 0; t < static_cast<std::size_t>(tiles.tile_count); ++t) {
    if (areInside(tiles.normals.subspan(t * texels, texels))) continue;
    throw Error(ErrorCode::invalid_input, "wang.disk", path, "/normals",
                "tile " + std::to_string(t) + " has normals that are not finite and inside the unit disk",
                "make it again with glint-wang");
  }
}

void requireKept(const NdfPyramidShard& shard, const std::string& path) {
  if (!shard.near_normals || areInside(shard.near_normals->normals)) return;
  throw Error(ErrorCode::invalid_input, "near.disk", path, "/near/normals",
              "has normals that are not finite and inside the unit disk", "make it again with glint-pyramid");
}

void requireHeights(const HeightMap& map, const std::string& path) {
  const auto bad = std::find_if_not(map.heights.begin(), map.heights.end(), [](float h) { return std::isfinite(h); });
  if (bad == map.heights.end()) return;
  throw Error(ErrorCode::invalid_input, "heights.finite", path, "/heights",
              "the texel at " + texelName(map.width, map.height, static_cast<std::size_t>(bad - map.heights.begin())) +
                  " is not finite",
              "make it again with glint-ingest --fix-invalid");
}

}  // namespace

void requireNormals(const NormalMap& map, const std::string& path, std::span<const std::uint8_t> rows) {
  const auto width = static_cast<std::size_t>(map.width), height = static_cast<std::size_t>(map.height);
  TexelTally infinite(map.width, map.height), outside(map.width, map.height);
  for (std::size_t j = 0; j < height; ++j) {
    if ((!rows.empty() && rows[j] == 0) || areInside(map.normals.subspan(j * width, width))) continue;
    for (std::size_t k = j * width; k < (j + 1) * width; ++k) {
      const Vec2 n = map.normals[k];
      if (!std::isfinite(n.x) || !std::isfinite(n.y))
        infinite.add(k);
      else if (!(dot(n, n) < 1))
        outside.add(k);
    }
  }
  const auto refuse = [&](const TexelTally& tally, const char* rule, const Subject& subject, const char* what) {
    if (tally.count() == 0) return;
    throw Error(ErrorCode::invalid_input, rule, path, "/normals",
                counted(tally.count(), subject) + " " + what + " (first at " + tally.firstName() + ")",
                "make it again with glint-ingest");
  };
  refuse(infinite, "normals.finite", {"texel is", "texels are"}, "not finite");
  refuse(outside, "normals.disk", {"normal is", "normals are"}, "not inside the unit disk");
}

void requireTexels(const formats::Asset& asset, const std::string& path) {
  if (const auto* map = std::get_if<NormalMap>(&asset.any())) requireNormals(*map, path);
  if (const auto* tiles = std::get_if<WangTiles>(&asset.any())) requireTiles(*tiles, path);
  if (const auto* shard = std::get_if<NdfPyramidShard>(&asset.any())) requireKept(*shard, path);
  if (const auto* heights = std::get_if<HeightMap>(&asset.any())) requireHeights(*heights, path);
}

}  // namespace glint::apps
