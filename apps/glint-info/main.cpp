#include <nlohmann/json.hpp>

#include "common/files.h"
#include "glint-info/summary.h"
#include "glint/formats/asset_reader.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool({"glint-info",
                   "Says what an asset is: kind, sizes, bytes of each part, how it was made, and statistics of what it holds.",
                   "glint-info flakes.glint"});
  const apps::InputFile input(tool, "asset (.glint)", "FILE");
  return tool.run(argc, argv, [&] {
    const formats::Asset asset = formats::Asset::open(input.path());
    for (const std::string& warning : asset.info().warnings) tool.warn(input.path() + ": " + warning);
    const nlohmann::ordered_json summary = apps::summarize(asset);
    tool.setResult(nlohmann::json(summary));
    tool.print(apps::summaryText(input.path(), summary));
  });
}
