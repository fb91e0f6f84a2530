#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/tool.h"
#include "glint/bake/wang/wang_tiles.h"
#include "glint/formats/asset_reader.h"

namespace glint::apps {

/// The options of glint-wang: how tiles are made of a map, and the part of the plane that becomes a map.
class WangOptions {
 public:
  explicit WangOptions(Tool& tool);

  /// Whether a part of the plane was asked for instead of tiles.
  bool wantsMap() const { return explicit_option_->given(); }
  int mapWidth() const { return explicit_[0]; }
  int mapHeight() const { return explicit_[1]; }
  std::int64_t originX() const { return origin(0); }
  std::int64_t originY() const { return origin(1); }

  /// How tiles are made. Valid after parsing.
  /// @param path  of the map, for messages
  bake::WangOptions values(const Tool& tool, const std::string& path) const;

 private:
  void check();
  void readColors();
  std::int64_t origin(std::size_t axis) const { return origin_.empty() ? 0 : static_cast<std::int64_t>(origin_[axis]); }

  bake::WangOptions values_;
  std::string colors_ = "2";
  int tiles_ = 0;
  std::vector<int> explicit_;
  std::vector<double> origin_;
  const Option* explicit_option_;
  const Option* colors_option_;
  const Option* tiles_option_;
};

/// Sizes of the set, and how well it was made.
nlohmann::json wangJson(const bake::WangTilesData& tiles);
std::string wangText(const bake::WangTilesData& tiles);

/// Points those who give tiles, which cannot be cut again, to --explicit.
/// @throws Error unsupported
void refuseTiles(const formats::Asset& asset, const std::string& path);

/// Warns of tiles that are large for the map.
void warnOfLargeTiles(Tool& tool, const std::string& path, const NormalMap& map, const bake::WangTilesData& tiles);

}  // namespace glint::apps
