#include "glint-moments/moments_options.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>

#include "common/files.h"
#include "common/image_input.h"
#include "common/numbers.h"
#include "common/udim_loop.h"

namespace glint::apps {
namespace {

/// Variance of slopes of a lobe of this perceptual roughness: half of alpha^2, alpha = roughness^2.
float varianceOf(float roughness) { return 0.5f * roughness * roughness * roughness * roughness; }

/// Root mean square, over the texels of a level, of the deviation of slopes along an axis.
double deviationOf(const std::vector<MapSlopes>& level) {
  double sum = 0;
  for (const MapSlopes& s : level) sum += 0.5 * (double{s.covariance.xx} + double{s.covariance.yy});
  return std::sqrt(sum / static_cast<double>(level.size()));
}

}  // namespace

MomentsOptions::MomentsOptions(Tool& tool) : tool_(tool) {
  finest_option_ = &tool.option("--finest", values_.finest_level,
                                "first level that is kept; its texels cover 2^N texels of the map along an axis. Smaller "
                                "footprints are answered as this level's: from 0.6 texels up at 0, 1.2 at 1, 2.3 at 2")
                        .range(0, SlopeMoments::kMaxLevels - 1);
  boundary_option_ = &tool.choice("--boundary", values_.boundary, {{"wrap", Boundary::wrap}, {"clamp", Boundary::clamp}},
                                  "beyond the border of the map");
  tool.choice("--gradient", values_.gradient, {{"central", bake::Gradient::central}, {"sobel", bake::Gradient::sobel}},
              "slopes of heights: central differences, or Sobel's as maketx --bumpslopes has them, which are less steep");
  tool.option(
      "--roughness", roughness_,
      "roughness of the material between the texels, 0 to 1 as glTF and MaterialX have it (alpha is its square): a number, or "
      "an image of the map's size whose first channel it is");
  tool.addCheck([this] { readRoughness(); });
}

void MomentsOptions::readRoughness() {
  if (parseNumber(roughness_, roughness_value_).empty()) {
    if (roughness_value_ >= 0 && roughness_value_ <= 1) return;
    throw Error(ErrorCode::usage, "option.range", {}, "--roughness", fmt::format("{} is out of range", roughness_value_),
                "give a number from 0 to 1, or the name of an image");
  }
  roughness_path_ = roughness_;
  checkRegular(roughness_path_);
  tool_.addInput(roughness_path_);
}

bake::SlopeMomentsOptions MomentsOptions::values(int width, int height, bool of_tile) {
  if (of_tile) {
    requireClamp(*boundary_option_, values_.boundary);
    values_.boundary = Boundary::clamp;
    if (!roughness_path_.empty())
      throw Error(ErrorCode::usage, "udim.roughness", roughness_path_, "--roughness",
                  "is an image of one map, not of a UDIM set", "give a number");
  }
  const int last = SlopeMoments::chainLength(width, height) - 1;
  if (finest_option_->given() && values_.finest_level > last) {
    throw Error(ErrorCode::usage, "option.range", {}, "--finest",
                fmt::format("{} is out of range: a map of {} x {} texels has levels 0 to {}", values_.finest_level, width,
                            height, last),
                fmt::format("give at most {}", last));
  }
  if (!roughness_path_.empty()) {
    facet_variances_ = readUnitChannel(tool_, roughness_path_, width, height, "it is a roughness as glTF has it");
    for (float& value : facet_variances_) value = varianceOf(value);
  } else if (roughness_value_ > 0) {
    facet_variances_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                            varianceOf(static_cast<float>(roughness_value_)));
  }
  if (!facet_variances_.empty()) {
    const double sum = std::accumulate(facet_variances_.begin(), facet_variances_.end(), 0.0);
    mean_alpha_ = static_cast<float>(std::sqrt(2 * sum / static_cast<double>(facet_variances_.size())));
  }
  bake::SlopeMomentsOptions options = values_;
  options.facet_variances = facet_variances_;
  return options;
}

std::pair<int, int> mapSize(const formats::Asset& asset, const std::string& path) {
  if (const auto* normals = std::get_if<NormalMap>(&asset.any())) return {normals->width, normals->height};
  if (const auto* heights = std::get_if<HeightMap>(&asset.any())) return {heights->width, heights->height};
  throw Error(ErrorCode::unsupported, "format.kind", path, "",
              "is of kind " + std::string(asset.kind()) + ", not normals or heights", "give the asset that glint-ingest made");
}

bake::SlopeMomentsData momentsOf(const formats::Asset& asset, const bake::SlopeMomentsOptions& options,
                                 const bake::ProgressFn& progress) {
  if (asset.kind() == "normals") return bake::buildSlopeMoments(asset.get<NormalMap>(), options, progress);
  return bake::buildSlopeMoments(asset.get<HeightMap>(), options, progress);
}

nlohmann::json momentsJson(const bake::SlopeMomentsData& moments) {
  const SlopeMoments& shape = moments.shape;
  nlohmann::json levels = nlohmann::json::array();
  for (int l = 0; l < shape.level_count; ++l)
    levels.push_back({{"level", shape.finest_level + l},
                      {"columns", shape.levels[l].columns},
                      {"rows", shape.levels[l].rows},
                      {"slope_deviation", deviationOf(moments.levels[static_cast<std::size_t>(l)])}});
  return {{"size_bytes", moments.sizeBytes()}, {"levels", std::move(levels)}};
}

std::string momentsText(const bake::SlopeMomentsData& moments) {
  const nlohmann::json json = momentsJson(moments);
  std::string text = "level   texels        slope deviation under a texel\n";
  for (const nlohmann::json& level : json["levels"])
    text += fmt::format("{:<7} {:>6} x {:<6} {:.4f}\n", level["level"].get<int>(), level["columns"].get<int>(),
                        level["rows"].get<int>(), level["slope_deviation"].get<double>());
  return text + fmt::format("{:.2f} MB\n", 1e-6 * json["size_bytes"].get<double>());
}

}  // namespace glint::apps
