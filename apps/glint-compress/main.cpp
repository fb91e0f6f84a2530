#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/udim_loop.h"
#include "glint-compress/compress_map.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool({"glint-compress",
                   "Compresses a pyramid of NDF images, so that densities and range means are still answered in constant time "
                   "from the compressed data.",
                   "glint-compress flakes-pyramid.glint -o flakes-cp.glint --method tucker --tolerance 0.1"});
  const apps::InputFile input(
      tool,
      "pyramid of NDF images (.glint), of kind ndf-pyramid, wang-pyramid or wave-pyramid; or those of a "
      "UDIM set, 'name.<UDIM>.p.glint'",
      "PYRAMID", apps::UdimSets::taken);
  const apps::OutputFile output(tool, apps::OutputFormat::asset,
                                "asset (.glint) of compressed NDF images; with <UDIM>, one for each tile", input);
  const apps::CompressOptions options(tool);

  return tool.run(argc, argv, [&] {
    const auto compress = [&](const apps::MapFiles& files) { return apps::compressMap(tool, options, files, output); };
    apps::forEachMap(tool, input, output, compress, [&](int tile) { return options.readBy(tile); });
  });
}
