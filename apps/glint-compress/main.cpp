#include <nlohmann/json.hpp>
#include <variant>

#include "common/files.h"
#include "common/input_asset.h"
#include "common/udim_loop.h"
#include "glint-compress/compress_options.h"
#include "glint/bake/wang/tile_pyramid.h"
#include "glint/formats/asset_writer.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool({"glint-compress",
                   "Compresses a pyramid of NDF images, so that densities and range means are still answered in constant time "
                   "from the compressed data.",
                   "glint-compress flakes-pyramid.glint -o flakes-cp.glint --method tucker --tolerance 0.1"});
  const apps::InputFile input(tool,
                              "pyramid of NDF images (.glint), of kind ndf-pyramid or wang-pyramid; or those of a UDIM set, "
                              "'name.<UDIM>.p.glint'",
                              "PYRAMID", apps::UdimSets::taken);
  const apps::OutputFile output(tool, apps::OutputFormat::asset,
                                "asset (.glint) of compressed NDF images; with <UDIM>, one for each tile", input);
  const apps::CompressOptions options(tool);

  return tool.run(argc, argv, [&] {
    apps::forEachMap(tool, input, output, [&](const apps::MapFiles& files) -> nlohmann::json {
      const formats::Asset asset = apps::openInput(tool, files.input, apps::UdimSets::taken);
      apps::requireTile(asset, files);
      // The packed images, and the blocks of all images that are being factored.
      constexpr double kBytesPerByte = 3;
      tool.requireMemory(kBytesPerByte * static_cast<double>(asset.info().file_bytes), "the compression of this pyramid",
                         "make the pyramid with a larger --stride");
      // The map that the pyramid was made from is named, too: --normals of queries must be this map.
      const formats::Provenance provenance = formats::chained(files.provenance, asset.info().provenance);
      bake::CompressionReport report;
      if (asset.kind() == "wang-pyramid") {
        const auto& tiles = asset.get<WangPyramid>();
        const auto data = apps::compress(tiles.images, bake::imageMasses(tiles), options, report, tool);
        formats::writeAsset(files.output, WangCp{tiles.plane, data.view()}, provenance, output.writeOptions());
      } else {
        const auto data = apps::compress(asset.get<NdfPyramid>(), {}, options, report, tool);
        formats::writeAsset(files.output, data.view(), provenance, output.writeOptions(asset.info().udim));
      }
      if (report.unscaled_images > 0)
        tool.warn(std::to_string(report.unscaled_images) +
                  " images decode to half of their energy or less and are not normalised; ask for a higher rank or a smaller "
                  "tolerance");
      tool.summary((files.tile > 0 ? files.output : tool.name()) + ": " + apps::compressionText(report));
      return apps::compressionJson(report);
    });
  });
}
