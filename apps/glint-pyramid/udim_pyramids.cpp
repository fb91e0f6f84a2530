#include "glint-pyramid/udim_pyramids.h"

#include <nlohmann/json.hpp>

#include "common/input_asset.h"
#include "common/udim_loop.h"

namespace glint::apps {

bool makeUdimPyramids(Tool& tool, const InputFile& input, const OutputFile& output, const PyramidOptions& options,
                      const WaveOptions& wave) {
  if (!input.isSet() && !formats::Asset::open(input.path()).info().udim) return false;
  forEachMap(tool, input, output, [&](const MapFiles& files) {
    const formats::Asset asset = openInput(tool, files.input, UdimSets::taken);
    requireTile(asset, files);
    if (wave.optics() == Optics::wave)
      refuseUdim(files.input, "is a tile of a UDIM set, and pyramids of waves are not made of sets");
    const auto& map = asset.get<NormalMap>();
    const bake::PyramidOptions values = options.tileValues();
    tool.requireMemory(bake::pyramidBytes(map, values, static_cast<double>(tool.maxMemory())), "the NDF images", kLessMemory);
    const bake::NdfPyramidData pyramid = bake::buildPyramid(map, values, tool.progress("images"));
    formats::writeAsset(files.output, pyramid.view(), files.provenance, output.writeOptions(asset.info().udim));
    tool.summary(files.output + "\n" + pyramidText(pyramid));
    return pyramidJson(pyramid);
  });
  return true;
}

}  // namespace glint::apps
