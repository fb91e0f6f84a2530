#include "glint-pyramid/region_option.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/input_asset.h"
#include "common/part.h"
#include "common/texel_checks.h"
#include "glint/formats/asset_reader.h"
#include "glint/formats/asset_writer.h"

namespace glint::apps {
namespace {

/// The rows of texels that a shard is made of: those that its images reach, and those whose normals it keeps.
std::vector<std::uint8_t> rowsUsed(const PyramidShape& shape, PyramidRegion region, bool keeps) {
  std::vector<std::uint8_t> rows = bake::rowsReached(shape, region);
  const ImageRows own = regionTexels(shape.height, region);
  if (keeps) std::fill(rows.begin() + own.first, rows.begin() + own.end, std::uint8_t{1});
  return rows;
}

/// The normals of a region.
ShardNormals normalsOf(const NormalMap& map, PyramidRegion region, KeepNormals keep) {
  const ImageRows rows = regionTexels(map.height, region);
  const auto width = static_cast<std::size_t>(map.width);
  return {keep == KeepNormals::i16 ? NearType::i16 : NearType::f32, rows.count(),
          map.normals.subspan(static_cast<std::size_t>(rows.first) * width, static_cast<std::size_t>(rows.count()) * width)};
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
  const PyramidShape shape = bake::pyramidShape(map.width, map.height, values);
  requireNormals(map, input.path(), rowsUsed(shape, region, options.keepsNormals()));
  tool.requireMemory(bake::pyramidBytes(map, values, static_cast<double>(tool.maxMemory()), region), "the NDF images",
                     "divide the map into more regions, or give a larger --stride");
  const formats::Provenance provenance = tool.provenance();
  const bake::NdfPyramidShardData shard = bake::buildPyramidShard(map, values, region, tool.progress("images"));
  NdfPyramidShard view = shard.view();
  if (options.keepsNormals()) view.near_normals = normalsOf(map, region, options.keep());
  formats::writeAsset(output.path(), view, provenance, output.writeOptions());
  nlohmann::json result = pyramidJson(shard.images, region);
  if (view.near_normals) result["near_normals_bytes"] = view.near_normals->normals.size_bytes();
  result["region"] = {{"index", region.index}, {"count", region.count}};
  tool.setResult(result);
  tool.summary(pyramidText(shard.images, region));
}

}  // namespace glint::apps
