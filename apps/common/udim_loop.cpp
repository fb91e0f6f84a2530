#include "common/udim_loop.h"

#include <nlohmann/json.hpp>

#include "common/unchanged.h"
#include "glint/formats/udim.h"

namespace glint::apps {
namespace {

/// The record of a tile of a set: it is clamped, whatever the default is, and says which tile it is.
std::string tileCommand(const std::string& command, int tile) {
  nlohmann::json parameters = nlohmann::json::parse(command);
  if (parameters.contains("boundary")) parameters["boundary"] = "clamp";
  parameters["udim"] = tile;
  return parameters.dump();
}

nlohmann::json tileResult(Tool& tool, const MapFiles& files, const std::function<nlohmann::json(const MapFiles&)>& work) {
  try {
    if (tool.skipUnchanged() && isMadeBy(
                                    files.output, files.provenance, [&] { return files.provenance; }, tool.trust()))
      return nlohmann::json::object({{"status", "unchanged"}});
    return {{"status", "ok"}, {"result", work(files)}};
  } catch (const Error& error) {
    if (error.code() == ErrorCode::usage || !error.path().empty()) throw;
    throw Error(error.code(), error.rule(), files.input, error.object(), error.clause(), error.remedy());
  }
}

}  // namespace

void requireTile(const formats::Asset& asset, const MapFiles& files) {
  if (files.tile == 0 || (asset.info().udim && asset.info().udim->tile == files.tile)) return;
  throw Error(ErrorCode::invalid_input, "udim.tile", files.input, "",
              asset.info().udim ? "holds tile " + std::to_string(asset.info().udim->tile) + ", and its name says " +
                                      std::to_string(files.tile)
                                : std::string("is no tile of a UDIM set, but a map of its own"),
              "make the tiles together, from the images on: glint-ingest 'name.<UDIM>.exr' -o 'name.<UDIM>.map.glint'");
}

void requireClamp(const Option& option, Boundary boundary) {
  if (option.given() && boundary == Boundary::wrap)
    throw Error(ErrorCode::usage, "udim.boundary", "", "--boundary", "a tile of a UDIM set does not repeat",
                "leave out --boundary, or give clamp");
}

void forEachMap(Tool& tool, const InputFile& input, const OutputFile& output,
                const std::function<nlohmann::json(const MapFiles&)>& work,
                const std::function<std::vector<std::string>(int tile)>& readBy) {
  if (!input.isSet()) return tool.setResult(work({input.path(), output.path(), tool.provenance(), 0}));
  nlohmann::json tiles = nlohmann::json::array();
  for (const int tile : input.tiles()) {
    MapFiles files = {formats::udimFile(input.path(), tile), formats::udimFile(output.path(), tile), {}, tile};
    std::vector<std::string> read = {files.input};
    if (readBy)
      for (const std::string& other : readBy(tile)) read.push_back(other);
    files.provenance = tool.provenance(read);
    files.provenance.command_json = tileCommand(files.provenance.command_json, tile);
    nlohmann::json result = tileResult(tool, files, work);
    result["tile"] = tile;
    result["path"] = files.output;
    tiles.push_back(std::move(result));
  }
  tool.setResult({{"tiles", std::move(tiles)}});
}

}  // namespace glint::apps
