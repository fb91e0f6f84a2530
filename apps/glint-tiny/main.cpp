#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/input_asset.h"
#include "common/memory_needs.h"
#include "common/tool.h"
#include "glint-tiny/tiny_options.h"
#include "glint/bake/ingest/normal_bounds.h"
#include "glint/formats/asset_writer.h"
#include "glint/model/slope_sums.h"

using namespace glint;

namespace {
/// Writes a part of a plane as an asset of kind normals.
void writeMap(apps::Tool& tool, const TinyExample& tiny, const bake::PlaneWindow& window, const apps::OutputFile& output) {
  apps::requireMemoryFor(tool, "a map of", window.width, window.height, apps::BytesPerTexel::kExplicit,
                         "give a smaller --explicit");
  const formats::Provenance provenance = tool.provenance();
  const std::vector<Vec2> normals = bake::explicitNormals(tiny, window, tool.progress("rows"));
  NormalMap map;
  map.width = window.width, map.height = window.height, map.normals = normals;
  map.slopes = slopesOf(map);
  const auto bounds = bake::buildNormalBounds(map.width, map.height, map.normals);
  bake::attachBounds(map, bounds);
  formats::writeAsset(output.path(), map, provenance, output.writeOptions());
  tool.setResult({{"width", map.width}, {"height", map.height}});
}
}  // namespace

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-tiny",
       "Covers a plane without end by copies of one small example, and computes the NDF of its tiles at every size.",
       "glint-tiny scratches.glint -o scratches.tiny.glint --cut 32 --mode scattered --density 2",
       "--transforms names a JSON object with any of scale, stretch (of x), shear (x by y), rotation_deg, mirror and "
       "heights. Scattered: each is a number, or [low, high], from which each example draws its own; mirror is the "
       "share of mirrored examples. Tiled: numbers only, also offset [x, y], and matrix [[a, b], [c, d]] instead of "
       "the parts. Normals turn as the relief's gradient does; heights is a factor of its heights."});
  const apps::InputFile input(tool, "asset of kind normals, from glint-ingest; with --explicit of kind tiny-example");
  const apps::OutputFile output(tool, apps::OutputFormat::asset,
                                "asset (.glint) of kind tiny-example; with --explicit of kind normals");
  apps::TinyOptions options(tool);
  const apps::ExplicitOptions window(tool, options.options());

  return tool.run(argc, argv, [&] {
    const formats::Asset asset = apps::openInput(tool, input.path());
    if (window.wanted()) return writeMap(tool, asset.get<TinyExample>(), window.window(), output);
    const bake::TinyOptions values = options.values();
    const NormalMap example = options.example(asset.get<NormalMap>());
    const double images = std::max(1.0, static_cast<double>(values.resolution) * values.resolution / (128.0 * 128.0));
    apps::requireMemoryFor(tool, "an example of", example.width, example.height, images * apps::BytesPerTexel::kExample,
                           "give a smaller --cut or --resolution");
    const formats::Provenance provenance = tool.provenance();
    const bake::TinyExampleData tiny = bake::buildTinyExample(example, values, tool.progress("images"));
    formats::writeAsset(output.path(), tiny.view(), provenance, output.writeOptions());
    tool.setResult(apps::tinyJson(tiny));
    tool.summary(apps::tinyText(tiny));
  });
}
