#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/input_asset.h"
#include "common/tool.h"
#include "glint-pyramid/pyramid_options.h"
#include "glint-pyramid/wave_options.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/formats/asset_writer.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-pyramid",
       "Computes the NDF images of a normal map for footprints of every size and position: the level of detail of its "
       "glints, ready to be queried or compressed. With --optics wave it takes heights, and computes their diffraction.",
       "glint-pyramid flakes.glint -o flakes.pyramid.glint --stride 32 --sigma-r 0.005"});
  const apps::InputFile input(tool, "asset of kind normals, or with --optics wave of kind heights, from glint-ingest",
                              "NORMALS");
  const apps::OutputFile output(tool, apps::OutputFormat::asset, "asset (.glint) of kind ndf-pyramid or wave-pyramid");
  const apps::PyramidOptions options(tool);
  const apps::WaveOptions wave(tool, options);

  return tool.run(argc, argv, [&] {
    const formats::Asset asset = apps::openInput(tool, input.path());
    const formats::Provenance provenance = tool.provenance();
    if (wave.optics() == apps::Optics::wave) return apps::makeWavePyramid(tool, asset, input, wave, provenance, output);
    const auto& map = asset.get<NormalMap>();
    const bake::PyramidOptions values = options.values();
    tool.requireMemory(bake::pyramidBytes(map, values, static_cast<double>(tool.maxMemory())), "the NDF images",
                       "give a larger --stride, or a smaller --resolution or --overlap");
    const bake::NdfPyramidData pyramid = bake::buildPyramid(map, values, tool.progress("images"));
    formats::writeAsset(output.path(), pyramid.view(), provenance, output.writeOptions());
    tool.setResult(apps::pyramidJson(pyramid));
    tool.summary(apps::pyramidText(pyramid));
  });
}
