#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/input_asset.h"
#include "common/memory_needs.h"
#include "common/tool.h"
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
  const apps::InputFile input(tool, "asset of kind normals or heights, from glint-ingest", "MAP");
  const apps::OutputFile output(tool, apps::OutputFormat::asset, "asset (.glint) of kind slope-moments");
  apps::MomentsOptions options(tool);
  const apps::TextureOutput textures(tool);

  return tool.run(argc, argv, [&] {
    const formats::Asset asset = apps::openInput(tool, input.path());
    const auto [width, height] = apps::mapSize(asset, input.path());
    apps::requireMemoryFor(tool, "moments of", width, height,
                           textures.wanted() ? apps::BytesPerTexel::kTextures : apps::BytesPerTexel::kMoments);
    const bake::SlopeMomentsOptions values = options.values(width, height);
    if (textures.wanted()) textures.check(tool, SlopeMoments::chainLength(width, height));
    const formats::Provenance provenance = tool.provenance();
    const bake::SlopeMomentsData moments = apps::momentsOf(asset, values, tool.progress("moments"));
    nlohmann::json result = apps::momentsJson(moments);
    std::string text = apps::momentsText(moments);
    if (textures.wanted()) {
      const std::vector<bake::LobeError> errors = apps::writeTextures(tool, textures, asset, values, options.meanAlpha());
      result["lobe_errors"] = apps::errorsJson(errors);
      text += apps::errorsText(errors);
    }
    // Last, so that Make takes nothing for made when textures fail.
    formats::writeAsset(output.path(), moments.view(), provenance, output.writeOptions());
    tool.setResult(result);
    tool.summary(text);
  });
}
