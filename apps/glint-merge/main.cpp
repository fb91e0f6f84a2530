#include <nlohmann/json.hpp>
#include <optional>

#include "common/filed_memory.h"
#include "common/files.h"
#include "common/memory_needs.h"
#include "common/tool.h"
#include "glint-merge/shards.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-merge",
       "Joins the shards that glint-pyramid --region made of one map. The pyramid is the same file, byte for byte, as one run "
       "without --region makes. Images go from file to file, so that memory does not limit the pyramid.",
       "glint-merge flakes.1of2.glint flakes.2of2.glint -o flakes.pyramid.glint",
       "Make the shards before, in any order and on any machines that see the map:\n"
       "  glint-pyramid flakes.glint -o flakes.1of2.glint --region 1/2\n"
       "  glint-pyramid flakes.glint -o flakes.2of2.glint --region 2/2"});
  const apps::InputFiles inputs(tool, "shards of all regions, in any order: assets of kind ndf-pyramid-shard", "SHARDS", true);
  const apps::OutputFile output(tool, apps::OutputFormat::asset, "asset (.glint) of kind ndf-pyramid");
  std::optional<apps::FiledMemory> memory;
  std::optional<apps::Shards> shards;  // opened once, for --skip-unchanged too
  const auto open = [&]() -> const apps::Shards& {
    if (shards) return *shards;
    memory.emplace(tool, output.path(), apps::kLeastBytes, "joining shards");
    return shards.emplace(tool, inputs.paths());
  };
  tool.setRecord([&] { return open().record(); });

  return tool.run(argc, argv, [&] {
    const apps::JoinedPyramid joined = writeJoined(open(), output);
    const PyramidShape& shape = joined.shape;
    nlohmann::json levels = nlohmann::json::array();
    for (int l = 0; l < shape.level_count; ++l)
      levels.push_back(
          {{"stride_texels", shape.levels[l].stride}, {"columns", shape.levels[l].columns}, {"rows", shape.levels[l].rows}});
    nlohmann::json result = {{"regions", open().views().front().region.count}, {"levels", levels}};
    if (joined.near_bytes > 0) result["near_normals_bytes"] = joined.near_bytes;
    tool.setResult(result);
    memory->warnAbout(tool);
  });
}
