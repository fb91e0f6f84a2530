#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/input_asset.h"
#include "common/memory_needs.h"
#include "common/tool.h"
#include "common/udim_loop.h"
#include "glint-moments/moments_options.h"
#include "glint-moments/texture_output.h"
#include "glint/formats/asset_writer.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-moments",
       "Filters the moments of the slopes of a map (LEAN mapping): the cheapest asset, one lobe for each footprint. Also "
       "writes textures that engines use as they are: moments, normals and roughness of every level.",
       "glint-moments flakes.glint -o flakes.moments.glint"});
  const apps::InputFile input(
      tool, "asset of kind normals or heights, from glint-ingest; or those of a UDIM set, 'name.<UDIM>.map.glint'", "MAP",
      apps::UdimSets::taken);
  const apps::OutputFile output(tool, apps::OutputFormat::asset,
                                "asset (.glint) of kind slope-moments; with <UDIM>, one for each tile", input);
  apps::MomentsOptions options(tool);
  const apps::TextureOutput textures(tool);

  return tool.run(argc, argv, [&] {
    if (input.isSet() && textures.wanted()) apps::refuseUdim(input.path(), "is a UDIM set, and textures are of one map");
    apps::forEachMap(tool, input, output, [&](const apps::MapFiles& files) {
      const formats::Asset asset =
          apps::openInput(tool, files.input, textures.wanted() ? apps::UdimSets::refused : apps::UdimSets::taken);
      apps::requireTile(asset, files);
      const auto [width, height] = apps::mapSize(asset, files.input);
      apps::requireMemoryFor(tool, "moments of", width, height,
                             textures.wanted() ? apps::BytesPerTexel::kTextures : apps::BytesPerTexel::kMoments);
      const bake::SlopeMomentsOptions values = options.values(width, height, asset.info().udim.has_value());
      if (textures.wanted()) textures.check(tool, SlopeMoments::chainLength(width, height));
      const bake::SlopeMomentsData moments = apps::momentsOf(asset, values, tool.progress("moments"));
      nlohmann::json result = apps::momentsJson(moments);
      std::string text = apps::momentsText(moments);
      if (textures.wanted()) {
        const std::vector<bake::LobeError> errors = apps::writeTextures(tool, textures, asset, values, options.meanAlpha());
        result["lobe_errors"] = apps::errorsJson(errors);
        text += apps::errorsText(errors);
      }
      // Last, so that Make takes nothing for made when textures fail.
      formats::writeAsset(files.output, moments.view(), files.provenance, output.writeOptions(asset.info().udim));
      tool.summary(text);
      return result;
    });
  });
}
