#include <nlohmann/json.hpp>

#include "common/filed_memory.h"
#include "common/files.h"
#include "common/input_asset.h"
#include "common/memory_needs.h"
#include "common/tool.h"
#include "glint-binmap/bin_map_options.h"
#include "glint/bake/bin_map/bin_map.h"
#include "glint/formats/asset_writer.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-binmap",
       "Lists the texels of a normal map by the direction of their normals, so that the glints inside any parallelogram "
       "are found at once: a preparation of milliseconds in the memory of the map.",
       "glint-binmap flakes.glint -o flakes.bins.glint --alpha 0.01"});
  const apps::InputFile input(tool, "asset of kind normals, from glint-ingest", "NORMALS");
  const apps::OutputFile output(tool, apps::OutputFormat::asset, "asset (.glint) of kind bin-map");
  apps::BinMapOptions options(tool);

  return tool.run(argc, argv, [&] {
    const apps::FiledMemory memory(tool, output.path(), options.leastBytes(), "any bin map");
    const formats::Asset asset = apps::openInput(tool, input.path());
    const formats::Provenance provenance = tool.provenance();
    const auto& map = asset.get<NormalMap>();
    const apps::BuiltBinMap built = options.build(map, tool.progress("passes"));
    formats::writeAsset(output.path(), built.data.view(), provenance, output.writeOptions());
    memory.warnAbout(tool);
    tool.setResult(apps::binMapJson(built));
    tool.summary(apps::binMapText(built));
  });
}
