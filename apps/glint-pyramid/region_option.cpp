#include "glint-pyramid/region_option.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/input_asset.h"
#include "common/part.h"
#include "glint/formats/asset_reader.h"
#include "glint/formats/asset_writer.h"
#include "glint/model/counted.h"
#include "glint/model/texel_name.h"

namespace glint::apps {
namespace {

/// Refuses texels that are no normals, which builders would follow out of their arrays.
void checkNormals(const NormalMap& map, const std::vector<std::uint8_t>& rows, const std::string& path) {
  TexelTally infinite(map.width, map.height), outside(map.width, map.height);
  for (std::size_t j = 0; j < rows.size(); ++j) {
    if (rows[j] == 0) continue;
    for (std::size_t i = 0; i < static_cast<std::size_t>(map.width); ++i) {
      const std::size_t k = j * static_cast<std::size_t>(map.width) + i;
      const Vec2 n = map.normals[k];
      if (!std::isfinite(n.x) || !std::isfinite(n.y))
        infinite.add(k);
      else if (!(dot(n, n) < 1))
        outside.add(k);
    }
  }
  const auto refuse = [&](const TexelTally& tally, const char* rule, const Subject& subject, const char* what) {
    if (tally.count() == 0) return;
    throw Error(ErrorCode::invalid_input, rule, path, "/normals",
                counted(tally.count(), subject) + " " + what + " (first at " + tally.firstName() + ")",
                "make it again with glint-ingest");
  };
  refuse(infinite, "normals.finite", {"texel is", "texels are"}, "not finite");
  refuse(outside, "normals.disk", {"normal is", "normals are"}, "not inside the unit disk");
}

}  // namespace

RegionOption::RegionOption(Tool& tool, const WaveOptions& wave) {
  tool.section("One map on many machines");
  option_ =
      &tool.option(
               "--region", text_,
               "make the images of one band of the map only: I/N is part I of N, from 1/N to N/N. The output is a shard, and "
               "glint-merge joins all N to the pyramid")
           .defaultText("the whole map")
           .recordedIfGiven();
  tool.addCheck([this, &wave] {
    if (!given()) return;
    if (wave.optics() == Optics::wave)
      throw Error(ErrorCode::usage, "cli.usage", "", "--region", "divides pyramids of geometric optics only",
                  "leave --region out");
    const Part part = parsePart(text_, "--region", kMostRegions);
    region_ = {part.index, part.count};
  });
}

void makeShard(Tool& tool, const InputFile& input, const PyramidOptions& options, const RegionOption& option,
               const OutputFile& output) {
  options.refuseKeeping("shards", "leave it out here, and give glint-compress --normals and --keep-normals");
  if (input.isSet()) refuseUdim(input.path(), "is a UDIM set, and --region divides one map");
  const formats::Asset asset = formats::Asset::open(input.path(), {.verify_hashes = !tool.trust(), .hash_in_pieces = true});
  if (asset.info().udim) refuseUdim(input.path(), "is a tile of a UDIM set, and --region divides maps without margins");
  if (asset.kind() == "wang-tiles")
    throw Error(ErrorCode::unsupported, "format.kind", input.path(), "",
                "is of kind wang-tiles, and --region divides maps only", "leave --region out");
  const auto& map = asset.get<NormalMap>();
  const bake::PyramidOptions values = options.values();
  bake::checkPyramidOptions(values);
  const PyramidRegion region = option.region();
  if (!tool.trust())
    checkNormals(map, bake::rowsReached(bake::pyramidShape(map.width, map.height, values), region), input.path());
  tool.requireMemory(bake::pyramidBytes(map, values, static_cast<double>(tool.maxMemory()), region), "the NDF images",
                     "divide the map into more regions, or give a larger --stride");
  const formats::Provenance provenance = tool.provenance();
  const bake::NdfPyramidShardData shard = bake::buildPyramidShard(map, values, region, tool.progress("images"));
  formats::writeAsset(output.path(), shard.view(), provenance, output.writeOptions());
  nlohmann::json result = pyramidJson(shard.images, region);
  result["region"] = {{"index", region.index}, {"count", region.count}};
  tool.setResult(result);
  tool.summary(pyramidText(shard.images, region));
}

}  // namespace glint::apps
