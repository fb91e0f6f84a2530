#include "common/ndf_models.h"
#include "common/tool.h"
#include "glint-query/distribution_command.h"
#include "glint/formats/asset_reader.h"

using namespace glint;

int main(int argc, char** argv) {
  apps::Tool tool(
      {"glint-query",
       "Asks an asset how the normals inside a footprint are distributed: the density towards a half vector, its mean over "
       "a range of them, or a picture of the whole distribution; or how much light a displacement reflects.",
       "glint-query flakes.pyramid.glint --uv 0.3 0.7 --sigma 20 --half 0.1 -0.05"});
  apps::NdfAsset asset(tool);
  apps::DistributionCommand command(tool);

  return tool.run(argc, argv, [&] {
    constexpr formats::OpenOptions checks = {.verify_hashes = true, .check_values = true};
    // An asset of another kind is opened, and checked, with its own options.
    const bool displacement = formats::Asset::open(asset.path()).kind() == "displacement";
    if (displacement) return command.run(formats::Asset::open(asset.path(), checks).get<Displacement>());
    asset.open(checks);
    command.run(asset);
  });
}
