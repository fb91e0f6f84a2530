#include "glint-binmap/bin_map_options.h"

#include <fmt/format.h>

#include <chrono>
#include <nlohmann/json.hpp>

namespace glint::apps {

BinMapCommand::BinMapCommand(Tool& tool) {
  tool.option("--alpha", options_.alpha, "Beckmann roughness of a facet: sqrt(2) times the deviation of its lobe").required();
  tool.option("--leaf-size", options_.leaf_size, "texels of a cell of a bin's grid, at least on average");
}

BuiltBinMap BinMapCommand::build(const NormalMap& map, const bake::ProgressFn& progress) const {
  const auto start = std::chrono::steady_clock::now();
  BuiltBinMap built{bake::buildBinMap(map, options_, progress), 0};
  built.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return built;
}

nlohmann::json binMapJson(const BuiltBinMap& built) {
  const BinMap map = built.data.view();
  return {{"alpha", map.alpha},
          {"bins_per_axis", map.bins_per_axis},
          {"occupied_bins", map.occupiedBins()},
          {"bins_with_grid", map.grid_cells.size() - 1},
          {"cells", map.cell_starts.size()},
          {"size_bytes", built.data.sizeBytes()},
          {"build_s", built.seconds}};
}

std::string binMapText(const BuiltBinMap& built) {
  const BinMap map = built.data.view();
  return fmt::format("{} x {} bins, {} occupied, {} with a grid; {:.2f} MB, {:.2f} bytes a texel\n", map.bins_per_axis,
                     map.bins_per_axis, map.occupiedBins(), map.grid_cells.size() - 1,
                     1e-6 * static_cast<double>(built.data.sizeBytes()),
                     static_cast<double>(built.data.sizeBytes()) / static_cast<double>(map.texels.size()));
}

}  // namespace glint::apps
