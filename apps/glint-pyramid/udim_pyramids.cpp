#include "glint-pyramid/udim_pyramids.h"

#include <nlohmann/json.hpp>

#include "common/input_asset.h"
#include "common/udim_loop.h"
#include "glint-pyramid/make_pyramid.h"

namespace glint::apps {

bool makeUdimPyramids(Tool& tool, const InputFile& input, const OutputFile& output, const PyramidOptions& options,
                      const WaveOptions& wave) {
  if (!input.isSet() && !formats::Asset::open(input.path()).info().udim) return false;
  forEachMap(tool, input, output, [&](const MapFiles& files) {
    const formats::Asset asset = openInput(tool, files.input, UdimSets::taken);
    requireTile(asset, files);
    if (wave.optics() == Optics::wave)
      refuseUdim(files.input, "is a tile of a UDIM set, and pyramids of waves are not made of sets");
    const PyramidReport report = makePyramid(tool, asset.get<NormalMap>(), options.tileValues(), options.keep(), files.output,
                                             files.provenance, output.writeOptions(asset.info().udim));
    tool.summary(files.output + "\n" + report.text);
    return report.json;
  });
  return true;
}

}  // namespace glint::apps
