#include "glint-binmap/bin_map_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>

#include "common/memory_needs.h"
#include "common/numbers.h"
#include "glint/model/error.h"

namespace glint::apps {

namespace {

/// Reads A or A:B.
void parseAlpha(const std::string& text, bake::BinMapOptions& options) {
  const std::size_t colon = text.find(':');
  const bool range = colon != std::string::npos;
  const bool read = parseNumber(text.substr(0, colon), options.alpha).empty() &&
                    (!range || parseNumber(text.substr(colon + 1), options.alpha_max).empty());
  if (read && (!range || options.alpha_max != 0)) return;
  throw Error(ErrorCode::usage, "option.value", {}, "--alpha", '"' + text + "\" is neither a number nor a range",
              "give a roughness, as 0.01, or the smallest and the largest, as 0.01:0.16");
}

}  // namespace

BinMapOptions::BinMapOptions(Tool& tool) {
  tool.option("--alpha", alpha_,
              "Beckmann roughness of a facet: sqrt(2) times the deviation of its lobe; or a range A:B, for one asset that is "
              "asked with any roughness between them. The default is the roughness of the other tools' --sigma-r 0.005");
  tool.addCheck([this] { parseAlpha(alpha_, options_); });
  tool.option("--leaf-size", options_.leaf_size, "texels of a cell of the map within a list, on average at least");
}

double BinMapOptions::leastBytes() const {
  constexpr double kBytesPerBin = 4;  // at least: maps of many texels have more
  constexpr int kMostBits = 32;       // of codes, so that a range of roughness counts as its geometric mean
  const float alpha = std::max(options_.alpha, bake::kMinBinAlpha);
  const double bins = bake::binsPerAxis(bake::binAlpha(alpha, std::max(alpha, options_.alpha_max), kMostBits));
  return kLeastBytes + kBytesPerBin * bins * bins;
}

BuiltBinMap BinMapOptions::build(const NormalMap& map, const bake::ProgressFn& progress) const {
  const auto start = std::chrono::steady_clock::now();
  BuiltBinMap built{bake::buildBinMap(map, options_, progress), 0};
  built.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return built;
}

nlohmann::json binMapJson(const BuiltBinMap& built) {
  const BinMap map = built.data.view();
  return {{"alpha", map.alpha},
          {"alpha_min", map.alpha_min},
          {"alpha_max", map.alpha_max},
          {"bins_per_axis", map.bins_per_axis},
          {"blocks", map.blockCount()},
          {"cells", map.cell_starts.size() - 1},
          {"size_bytes", built.data.sizeBytes()},
          {"build_s", built.seconds}};
}

std::string binMapText(const BuiltBinMap& built) {
  const BinMap map = built.data.view();
  return fmt::format("{} x {} bins in {} blocks, {} cells; {:.2f} MB, {:.2f} bytes a texel\n", map.bins_per_axis,
                     map.bins_per_axis, map.blockCount(), map.cell_starts.size() - 1,
                     1e-6 * static_cast<double>(built.data.sizeBytes()),
                     static_cast<double>(built.data.sizeBytes()) / static_cast<double>(map.texels.size()));
}

}  // namespace glint::apps
