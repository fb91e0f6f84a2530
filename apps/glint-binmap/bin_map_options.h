#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "common/tool.h"
#include "glint/bake/bin_map/bin_map.h"

namespace glint::apps {

/// A bin map and how long the work took, without reading and writing files.
struct BuiltBinMap {
  bake::BinMapData data;
  double seconds = 0;
};

/// The options of glint-binmap.
class BinMapOptions {
 public:
  explicit BinMapOptions(Tool& tool);

  /// Memory that a bin map takes beside arrays that may be in files, bytes.
  double leastBytes() const;
  /// @throws what bake::buildBinMap throws
  BuiltBinMap build(const NormalMap& map, const bake::ProgressFn& progress) const;

 private:
  /// A, or A:B. The default is sqrt(2) 0.005, so that all methods answer the same question where nobody says otherwise.
  std::string alpha_ = "0.0070710678";
  bake::BinMapOptions options_;
};

/// Bins, grids, bytes and time of the work.
nlohmann::json binMapJson(const BuiltBinMap& built);
std::string binMapText(const BuiltBinMap& built);

}  // namespace glint::apps
