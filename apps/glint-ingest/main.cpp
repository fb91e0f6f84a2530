#include <nlohmann/json.hpp>

#include "common/files.h"
#include "glint-ingest/ingest_memory.h"
#include "glint-ingest/ingest_options.h"
#include "glint/bake/common/slopes.h"
#include "glint/bake/ingest/normal_bounds.h"
#include "glint/formats/asset_writer.h"

using namespace glint;

namespace {
/// Adds the min-max pyramid and writes the asset.
void writeNormals(const apps::OutputFile& output, const apps::Image& image, float texel_size_um, std::span<const Vec2> normals,
                  const MapSlopes& slopes, const formats::Provenance& provenance) {
  NormalMap map;
  map.width = image.width, map.height = image.height;
  map.texel_size_um = texel_size_um;
  map.normals = normals, map.slopes = slopes;
  const auto bounds = bake::buildNormalBounds(map.width, map.height, map.normals);
  bake::attachBounds(map, bounds);
  formats::writeAsset(output.path(), map, provenance, output.writeOptions());
}
}  // namespace

int main(int argc, char** argv) {
  apps::Tool tool({"glint-ingest",
                   "Turns any image of normals or heights into an asset. Wrong inputs are refused, not clamped.",
                   "glint-ingest flakes.png -o flakes.glint --convention directx"});
  const apps::InputFile input(tool, "image of normals or heights", "IMAGE");
  const apps::OutputFile output(tool, apps::OutputFormat::asset, "asset (.glint) of normals or heights");
  const apps::IngestOptions options(tool);
  return tool.run(argc, argv, [&] {
    const apps::IngestMemory memory(tool, output.path());
    const apps::Image image = options.read(tool, input.path());
    const bake::IngestOptions values = options.values(tool, input.path(), image);
    const formats::Provenance provenance = tool.provenance();
    bake::IngestReport report;
    if (!options.readsHeights()) {
      const bake::IngestedNormals result = bake::ingestNormals(apps::pixelArray(image), values);
      report = result.report;
      writeNormals(output, image, options.texelSize(), result.normals, report.slopes, provenance);
    } else {
      const bake::IngestedHeights result = bake::ingestHeights(apps::pixelArray(image), values);
      report = result.report;
      if (options.writesHeights()) {
        const HeightMap map{image.width, image.height, options.texelSize(), result.heights};
        formats::writeAsset(output.path(), map, provenance, output.writeOptions());
      } else {
        std::pmr::vector<Vec2> normals(result.heights.size());
        bake::normalsFromHeights(image.width, image.height, result.heights, normals, values.boundary);
        writeNormals(output, image, options.texelSize(), normals, report.slopes, provenance);
      }
    }
    options.warnAbout(tool, input.path(), values.no_data, report);
    memory.warnAbout(tool);
    tool.setResult(apps::reportJson(report));
    tool.summary(apps::reportText(input.path(), image, report));
  });
}
