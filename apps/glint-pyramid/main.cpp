#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/input_asset.h"
#include "common/tool.h"
#include "glint-pyramid/make_pyramid.h"
#include "glint-pyramid/region_option.h"
#include "glint-pyramid/udim_pyramids.h"
#include "glint-pyramid/wave_options.h"
#include "glint/bake/wang/tile_pyramid.h"
#include "glint/formats/asset_writer.h"

using namespace glint;

namespace {
using apps::kLessMemory;

/// Writes the images of all tiles of a plane.
void makeWangPyramid(apps::Tool& tool, const WangTiles& tiles, const apps::PyramidOptions& options,
                     const formats::Provenance& provenance, const apps::OutputFile& output) {
  options.refuseKeeping("the images of Wang tiles",
                        "leave it out, and give a smaller --stride, or ask the tiles themselves: glint-query takes wang-tiles");
  const bake::PyramidOptions values = options.values();
  tool.requireMemory(bake::wangPyramidBytes(tiles, values, static_cast<double>(tool.maxMemory())), "the NDF images",
                     kLessMemory);
  const bake::WangPyramidData pyramid = bake::buildWangPyramid(tiles, values, tool.progress("images"));
  formats::writeAsset(output.path(), pyramid.view(), provenance, output.writeOptions());
  apps::reportPyramid(tool, pyramid.images);
}
}  // namespace

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-pyramid",
       "Computes the NDF images of a normal map for footprints of every size and position: the level of detail of its "
       "glints, ready to be queried or compressed. With --optics wave it takes heights, and computes their diffraction.",
       "glint-pyramid flakes.glint -o flakes.pyramid.glint --stride 32 --sigma-r 0.005\n"
       "  glint-pyramid 'rock.<UDIM>.map.glint' -o 'rock.<UDIM>.p.glint'"});
  const apps::InputFile input(tool, apps::kPyramidInput, "NORMALS", apps::UdimSets::taken);
  const apps::OutputFile output(tool, apps::OutputFormat::asset, apps::kPyramidOutput, input);
  const apps::PyramidOptions options(tool);
  const apps::WaveOptions wave(tool, options);
  const apps::RegionOption region(tool, wave);

  return tool.run(argc, argv, [&] {
    if (region.given()) return apps::makeShard(tool, input, options, region, output);
    if (apps::makeUdimPyramids(tool, input, output, options, wave)) return;
    const formats::Asset asset = apps::openInput(tool, input.path());
    const formats::Provenance provenance = tool.provenance();
    if (wave.optics() == apps::Optics::wave) return apps::makeWavePyramid(tool, asset, input, wave, provenance, output);
    if (asset.kind() == "wang-tiles") return makeWangPyramid(tool, asset.get<WangTiles>(), options, provenance, output);
    const auto report = apps::makePyramid(tool, asset.get<NormalMap>(), options.values(), options.keep(), output.path(),
                                          provenance, output.writeOptions());
    tool.setResult(report.json);
    tool.summary(report.text);
  });
}
