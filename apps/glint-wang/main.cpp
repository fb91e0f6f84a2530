#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/input_asset.h"
#include "common/memory_needs.h"
#include "common/tool.h"
#include "glint-wang/wang_options.h"
#include "glint/bake/common/slopes.h"
#include "glint/bake/ingest/normal_bounds.h"
#include "glint/formats/asset_writer.h"

using namespace glint;

namespace {
/// Writes a part of the plane.
void writeMap(apps::Tool& tool, const apps::OutputFile& output, const WangTiles& tiles, const apps::WangOptions& options) {
  apps::requireMemoryFor(tool, "a map of", options.mapWidth(), options.mapHeight(), apps::BytesPerTexel::kExplicit,
                         "give a smaller --explicit");
  const auto normals =
      bake::explicitPlane(tiles, options.originX(), options.originY(), options.mapWidth(), options.mapHeight());
  NormalMap map;
  map.width = options.mapWidth(), map.height = options.mapHeight();
  map.texel_size_um = tiles.texel_size_um;
  map.normals = normals;
  map.slopes = bake::mapSlopes(map);
  const auto bounds = bake::buildNormalBounds(map.width, map.height, map.normals);
  bake::attachBounds(map, bounds);
  formats::writeAsset(output.path(), map, tool.provenance(), output.writeOptions());
  tool.setResult({{"width", map.width}, {"height", map.height}});
}
}  // namespace

int main(int argc, char** argv) {
  apps::Tool tool({"glint-wang",
                   "Cuts a map into Wang tiles, which cover a plane without end: a surface of any size from a small file. Also "
                   "writes a part of such a plane as a map.",
                   "glint-wang flakes.glint -o flakes.wang.glint --size 512"});
  const apps::InputFile input(tool, "asset of kind normals, from glint-ingest; with --explicit of kind wang-tiles", "MAP");
  const apps::OutputFile output(tool, apps::OutputFormat::asset,
                                "asset (.glint) of kind wang-tiles; with --explicit of normals");
  const apps::WangOptions options(tool);

  return tool.run(argc, argv, [&] {
    const formats::Asset asset = apps::openInput(tool, input.path());
    if (options.wantsMap()) return writeMap(tool, output, asset.get<WangTiles>(), options);
    apps::refuseTiles(asset, input.path());
    const auto& map = asset.get<NormalMap>();
    const bake::WangOptions values = options.values(tool, input.path());
    apps::requireMemoryFor(tool, "tiles of", values.size, values.size, apps::BytesPerTexel::kTile, "give a smaller --size");
    const bake::WangTilesData tiles = bake::buildWangTiles(map, values, tool.progress("tiles"));
    formats::writeAsset(output.path(), tiles.view(), tool.provenance(), output.writeOptions());
    apps::warnOfLargeTiles(tool, input.path(), map, tiles);
    tool.setResult(apps::wangJson(tiles));
    tool.summary(apps::wangText(tiles));
  });
}
