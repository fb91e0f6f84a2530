#include <nlohmann/json.hpp>

#include "common/files.h"
#include "glint-shlobes/shlobes_options.h"
#include "glint/formats/asset_writer.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-shlobes",
       "Makes tables of spherical harmonics for noise-free glints under large lights: the roughness lobe of a facet "
       "towards every direction (--sigma-r), or an environment or area lights for every outgoing direction (--light).",
       "glint-shlobes --light studio.exr -o studio.glint --order 60", apps::kAreaLightNotes});
  const apps::OutputFile output(tool, apps::OutputFormat::asset, "asset (.glint) of lobes or light");
  const apps::ShLobesOptions options(tool);

  return tool.run(argc, argv, [&] {
    nlohmann::json result;
    if (options.light().empty()) {
      const formats::Provenance provenance = tool.provenance();
      const bake::ShLobesData lobes = bake::buildShLobes(options.lobesOptions(), tool.progress("directions"));
      formats::writeAsset(output.path(), lobes.view(), provenance, output.writeOptions());
      result = apps::lobesJson(lobes.view());
    } else {
      const bake::Environment environment = apps::readLight(tool, options.light(), options.areaLights());
      const formats::Provenance provenance = tool.provenance();
      const bake::ShLightData light = bake::buildShLight(environment, options.lightOptions(), tool.progress("directions"));
      result = apps::lightJson(light.view());
      if (options.gaussians() > 0) result["gaussians"] = apps::gaussiansJson(environment, options.light(), options.gaussians());
      formats::writeAsset(output.path(), light.view(), provenance, output.writeOptions());
    }
    tool.setResult(result);
    tool.summary(apps::tableText(result));
  });
}
