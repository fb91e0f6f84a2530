#pragma once

#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/files.h"
#include "common/tool.h"
#include "glint/formats/asset_reader.h"
#include "glint/model/normal_map.h"

namespace glint::apps {

/// The files of one map: of a run, or of one tile of a UDIM set.
struct MapFiles {
  std::string input, output;
  formats::Provenance provenance;
  int tile = 0;  ///< number of the tile; 0: the run has one map
};

/// Calls work for the map of a run, or for each tile of its set in the order of their numbers, and sets what it returns as the result
/// of the run. Tiles that --skip-unchanged leaves alone are no work. Errors that name no file name the tile's.
/// @param readBy  files that a tile is made of besides its own; empty: none
void forEachMap(Tool& tool, const InputFile& input, const OutputFile& output,
                const std::function<nlohmann::json(const MapFiles&)>& work,
                const std::function<std::vector<std::string>(int tile)>& readBy = {});

/// Refuses an asset that is not the tile that the name of its file says.
/// @throws Error invalid_input
void requireTile(const formats::Asset& asset, const MapFiles& files);

/// Refuses --boundary wrap for tiles of a UDIM set: a set ends where it has no tile.
/// @throws Error usage
void requireClamp(const Option& option, Boundary boundary);

}  // namespace glint::apps
