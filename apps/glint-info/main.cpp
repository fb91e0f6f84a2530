#include <nlohmann/json.hpp>

#include "common/files.h"
#include "glint-info/summary.h"
#include "glint/formats/asset_reader.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool({"glint-info",
                   "Says what an asset is: kind, sizes, bytes of each part, how it was made, and statistics of what it holds.",
                   "glint-info flakes.glint"});
  const apps::InputFile input(tool, "asset (.glint), or 'name.<UDIM>.glint': all tiles of a UDIM set", "FILE",
                              apps::UdimSets::taken);
  const auto summaryOf = [&](const std::string& path) {
    const formats::Asset asset = formats::Asset::open(path);
    for (const std::string& warning : asset.info().warnings) tool.warn(path + ": " + warning);
    const nlohmann::ordered_json summary = apps::summarize(asset);
    tool.print(apps::summaryText(path, summary));
    return nlohmann::json(summary);
  };
  return tool.run(argc, argv, [&] {
    if (!input.isSet()) return tool.setResult(summaryOf(input.path()));
    nlohmann::json tiles = nlohmann::json::array();
    for (const int tile : input.tiles()) {
      const std::string path = formats::udimFile(input.path(), tile);
      tiles.push_back({{"tile", tile}, {"path", path}, {"status", "ok"}, {"result", summaryOf(path)}});
    }
    tool.setResult({{"tiles", std::move(tiles)}});
  });
}
