#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/input_asset.h"
#include "common/tool.h"
#include "glint-displace/displace_options.h"
#include "glint/formats/asset_writer.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-displace",
       "Downsamples a displacement map and keeps its appearance: normals become lobes for each cell, and "
       "shadowing, masking and interreflections become factors for pairs of directions.",
       "glint-displace weave.glint -o weave.displaced.glint --factor 16 --base diffuse:0.8",
       "A measured material as the base, from a table in the form of the MERL database:\n"
       "  glint-displace weave.glint -o weave.displaced.glint --factor 16 --base-table gold-metallic-paint.binary"});
  const apps::InputFile input(tool, "asset of kind heights, from glint-ingest --kind height --to heights", "HEIGHTS");
  const apps::OutputFile output(tool, apps::OutputFormat::asset, "asset (.glint) of kind displacement");
  apps::DisplaceOptions options(tool);

  return tool.run(argc, argv, [&] {
    const formats::Asset asset = apps::openInput(tool, input.path());
    const auto& map = asset.get<HeightMap>();
    bake::DisplaceOptions values = options.values(map);
    apps::requireDisplaceMemory(tool, map, values);
    values.seed = tool.seed();
    const formats::Provenance provenance = tool.provenance();
    const bake::DisplacementData data = bake::displace(map, values, tool.progress("levels"));
    formats::writeAsset(output.path(), data.view(), provenance, output.writeOptions());
    apps::warnAbout(tool, data, values.scale_tolerance);
    tool.setResult(apps::displacementJson(data));
    tool.summary(apps::displacementText(data));
  });
}
