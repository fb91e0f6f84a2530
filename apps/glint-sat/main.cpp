#include <nlohmann/json.hpp>

#include "common/filed_memory.h"
#include "common/files.h"
#include "common/input_asset.h"
#include "common/memory_needs.h"
#include "common/tool.h"
#include "glint-sat/sat_options.h"
#include "glint/formats/asset_writer.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-sat",
       "Accumulates histograms of the normals of a map over bins of directions: tables that give the histogram of a "
       "footprint of any size at once.",
       "glint-sat flakes.glint -o flakes.sat.glint --bins 9x32 --stride 8"});
  const apps::InputFile input(tool, "asset of kind normals, from glint-ingest", "NORMALS");
  const apps::OutputFile output(tool, apps::OutputFormat::asset, "asset (.glint) of kind histogram-sat");
  apps::SatOptions options(tool);

  return tool.run(argc, argv, [&] {
    const apps::FiledMemory memory(tool, output.path(), apps::kLeastBytes + bake::histogramStatisticsBytes(options.values()),
                                   "any table");
    const formats::Asset asset = apps::openInput(tool, input.path());
    const auto& map = asset.get<NormalMap>();
    const formats::Provenance provenance = tool.provenance();
    const bake::HistogramSatData sat = bake::buildHistogramSat(map, options.values(), tool.progress("tables"));
    formats::writeAsset(output.path(), sat.view(), provenance, output.writeOptions());
    memory.warnAbout(tool);
    tool.setResult(apps::satJson(sat));
    tool.summary(apps::satText(sat));
  });
}
