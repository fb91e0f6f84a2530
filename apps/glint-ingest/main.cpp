#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/memory_needs.h"
#include "glint-ingest/ingest_options.h"
#include "glint-ingest/udim_ingest.h"
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
                   "glint-ingest flakes.png -o flakes.glint --convention directx\n"
                   "  glint-ingest 'rock.<UDIM>.exr' -o 'rock.<UDIM>.map.glint'"});
  const apps::InputFile input(tool, "image of normals or heights, or those of a UDIM set: 'name.<UDIM>.exr'", "IMAGE",
                              apps::UdimSets::taken);
  const apps::OutputFile output(
      tool, apps::OutputFormat::asset,
      "asset (.glint) of normals or heights; of a UDIM set, one for each tile: 'name.<UDIM>.map.glint'", input);
  const apps::IngestOptions options(tool);
  const apps::UdimIngest set(tool, input, output, options);

  return tool.run(argc, argv, [&] {
    if (input.isSet()) return set.run();
    const apps::Image image = options.read(tool, input.path());
    apps::requireMemoryFor(tool, "a map of", image.width, image.height, apps::BytesPerTexel::kIngest, "scale the image down");
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
        const auto normals = bake::normalsFromHeights(image.width, image.height, result.heights, values.boundary);
        writeNormals(output, image, options.texelSize(), normals, report.slopes, provenance);
      }
    }
    options.warnAbout(tool, input.path(), values.no_data, values.boundary, report);
    tool.setResult(apps::reportJson(report));
    tool.summary(apps::reportText(input.path(), image, report));
  });
}
