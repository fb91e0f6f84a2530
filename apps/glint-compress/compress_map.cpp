#include "glint-compress/compress_map.h"

#include <nlohmann/json.hpp>

#include "common/input_asset.h"
#include "glint/bake/wang/tile_pyramid.h"
#include "glint/bake/wave/compress_wave.h"
#include "glint/formats/asset_writer.h"

namespace glint::apps {

nlohmann::json compressMap(Tool& tool, const CompressOptions& options, const MapFiles& files, const OutputFile& output) {
  const formats::Asset asset = openInput(tool, files.input, UdimSets::taken);
  requireTile(asset, files);
  // The packed images, and the blocks of all images that are being factored.
  constexpr double kBytesPerByte = 3;
  tool.requireMemory(kBytesPerByte * static_cast<double>(asset.info().file_bytes), "the compression of this pyramid",
                     "make the pyramid with a larger --stride");
  // The map that the pyramid was made from is named, too: --normals of queries must be this map.
  const formats::Provenance provenance = formats::chained(files.provenance, asset.info().provenance);
  const std::optional<formats::Asset> normals = options.openNormals(files.tile);
  const auto kept = options.kept(asset, files.input, files.tile, normals);
  bake::CompressionReport report;
  if (asset.kind() == "wang-pyramid") {
    const auto& tiles = asset.get<WangPyramid>();
    const auto data = compress(tiles.images, bake::imageMasses(tiles), options, report, tool);
    formats::writeAsset(files.output, WangCp{tiles.plane, data.view()}, provenance, output.writeOptions());
  } else if (asset.kind() == "wave-pyramid") {
    const auto data = bake::compressWavePyramid(asset.get<WavePyramid>(), options.values(), &report, tool.progress("compress"));
    formats::writeAsset(files.output, data.view(), provenance, output.writeOptions(asset.info().udim));
  } else {
    const auto data = compress(asset.get<NdfPyramid>(), {}, options, report, tool);
    NdfCp compressed = data.view();
    if (kept) compressed.near_normals = kept->view();
    formats::writeAsset(files.output, compressed, provenance, output.writeOptions(asset.info().udim));
  }
  if (report.unscaled_images > 0)
    tool.warn(std::to_string(report.unscaled_images) +
              " images decode to half of their energy or less and are not normalised; ask for a higher rank or a smaller "
              "tolerance");
  tool.summary((files.tile > 0 ? files.output : tool.name()) + ": " + compressionText(report));
  nlohmann::json result = compressionJson(report);
  if (kept) result["near_normals_bytes"] = bake::nearBytes(kept->view());
  return result;
}

}  // namespace glint::apps
