#include <nlohmann/json.hpp>

#include "common/filed_memory.h"
#include "common/files.h"
#include "common/memory_needs.h"
#include "glint-ingest/ingest_options.h"
#include "glint-ingest/normals_output.h"
#include "glint-ingest/udim_ingest.h"
#include "glint/bake/common/slopes.h"
#include "glint/formats/asset_writer.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool({"glint-ingest",
                   "Turns any image of normals or heights into an asset. Wrong inputs are refused, not clamped.",
                   "glint-ingest flakes.png -o flakes.glint --convention directx\n"
                   "  glint-ingest 'rock.<UDIM>.exr' -o 'rock.<UDIM>.map.glint'"});
  const apps::InputFile input(tool, apps::kUdimImages, "IMAGE", apps::UdimSets::taken);
  const apps::OutputFile output(tool, apps::OutputFormat::asset, apps::kUdimMaps, input);
  const apps::IngestOptions options(tool);
  const apps::UdimIngest set(tool, input, output, options);

  return tool.run(argc, argv, [&] {
    if (input.isSet()) return set.run();
    const apps::FiledMemory memory(tool, output.path(), apps::kLeastBytes, "any image");
    const apps::Image image = options.read(tool, input.path(), true);
    const bake::IngestOptions values = options.values(tool, input.path(), image);
    const formats::Provenance provenance = tool.provenance();
    bake::IngestReport report;
    const auto writeNormals = [&](std::span<const Vec2> normals) {
      apps::writeNormals({output.path(), provenance, output.writeOptions()}, image.width, image.height, options.texelSize(),
                         normals, report.slopes);
    };
    if (!options.readsHeights()) {
      const bake::IngestedNormals result = bake::ingestNormals(apps::pixelArray(image), values);
      report = result.report;
      writeNormals(result.normals);
    } else {
      const bake::IngestedHeights result = bake::ingestHeights(apps::pixelArray(image), values);
      report = result.report;
      if (options.writesHeights()) {
        const HeightMap map{image.width, image.height, options.texelSize(), result.heights};
        formats::writeAsset(output.path(), map, provenance, output.writeOptions());
      } else {
        std::pmr::vector<Vec2> normals(result.heights.size());
        bake::normalsFromHeights(image.width, image.height, result.heights, normals, values.boundary);
        writeNormals(normals);
      }
    }
    options.warnAbout(tool, input.path(), values.no_data, values.boundary, report);
    memory.warnAbout(tool);
    tool.setResult(apps::reportJson(report));
    tool.summary(apps::reportText(input.path(), image, report));
  });
}
