#include "glint-displace/displace_options.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/memory_needs.h"
#include "common/numbers.h"

namespace glint::apps {
namespace {

/// Above these a level is worth a warning.
constexpr float kResidual = 0.1f;
constexpr float kDistant = 0.02f;
constexpr double kFitError = 0.2;
/// The tables of a base in the asset, their light, and the base at its own resolution; of each channel.
constexpr double kTableBytes = 16e6;

float number(const std::string& text, const std::string& whole) {
  float value = 0;
  if (!parseNumber(text, value).empty())
    throw Error(ErrorCode::usage, "option.base", {}, "--base", "'" + whole + "' has '" + text + "' where a number should be",
                "give diffuse:RHO, ggx:ALPHA or ggx:ALPHA:ETA,K");
  return value;
}

double meanFitError(const bake::DisplacementData::Level& level) {
  double sum = 0;
  for (const float error : level.fit_errors) sum += error;
  return sum / static_cast<double>(level.fit_errors.size());
}

}  // namespace

DisplaceOptions::DisplaceOptions(Tool& tool) : images_(tool), table_(tool) {
  const Option& factor = tool.option("--factor", factor_,
                                     "texels of the map along a side of a downsampled cell; where it does not divide the map, "
                                     "the nearest whole number of cells is taken")
                             .range(2, 65536);
  factors_given_ =
      &tool.option("--factors", factors_, "several levels of detail, e.g. 4,16,64").range(2, 65536).excludes(factor);
  base_given_ =
      &tool.option("--base", base_,
                   "reflectance of the surface: diffuse:RHO (albedo above 0, at most 1), ggx:ALPHA (0.05 to 1; reflects "
                   "all light) or ggx:ALPHA:ETA,K (a conductor)")
           .excludes(table_.option());
  tool.option("--lobes", values_.lobes, "lobes of normals in each cell").range(1, kMaxLobes);
  tool.option("--angular", values_.angular, "directions of light and view: the square of this").range(3, kMostAngular);
  tool.option("--spatial", values_.spatial, "patches of the spatial factor along each axis").range(1, 16);
  tool.option("--scale-tolerance", values_.scale_tolerance,
              "terms are added to the scaling T S until they miss at most this part of it, or are eight; 0: T S alone")
      .range(0, 1);
  tool.option("--bounces", bounces_,
              "reflections of a light path at most; 1: shadowing and masking only; auto: until it escapes");
  tool.usesSeed();
}

BaseBrdf parseBase(const std::string& text) {
  const std::size_t colon = text.find(':');
  const std::string kind = text.substr(0, colon), rest = colon == std::string::npos ? "" : text.substr(colon + 1);
  BaseBrdf base;
  if (kind == "diffuse") {
    base.albedo = number(rest, text);
    return base;
  }
  if (kind != "ggx")
    throw Error(ErrorCode::usage, "option.base", {}, "--base", "'" + text + "' is no known reflectance",
                "give diffuse:RHO, ggx:ALPHA or ggx:ALPHA:ETA,K");
  base.kind = BaseBrdf::Kind::ggx;
  const std::size_t second = rest.find(':');
  base.alpha = number(rest.substr(0, second), text);
  if (second == std::string::npos) return base;
  const std::string conductor = rest.substr(second + 1);
  const std::size_t comma = conductor.find(',');
  base.eta = number(conductor.substr(0, comma), text);
  base.k = number(comma == std::string::npos ? "" : conductor.substr(comma + 1), text);
  return base;
}

bake::DisplaceOptions DisplaceOptions::values(const HeightMap& map) const {
  bake::DisplaceOptions options = values_;
  options.factors = factors_given_->given() ? factors_ : std::vector<int>{factor_};
  options.base = parseBase(images_.colored() && !base_given_->given() ? "diffuse:1" : base_);
  options.texture = images_.read(map.width, map.height);
  options.table = table_.read();
  if (options.table) options.base = options.table->base();
  if (bounces_ == "auto") return options;
  if (!parseNumber(bounces_, options.bounces).empty() || options.bounces < 1 || options.bounces > bake::kAllBounces)
    throw Error(ErrorCode::usage, "option.range", {}, "--bounces", "'" + bounces_ + "' is not a number of reflections",
                fmt::format("give auto, or 1 to {}", bake::kAllBounces));
  return options;
}

void requireDisplaceMemory(const Tool& tool, const HeightMap& map, const bake::DisplaceOptions& options) {
  constexpr int kUsual = 15;  // directions along an axis that BytesPerTexel counts
  const bool fine = options.factors.front() < kFineFactor;
  const bool many = options.angular > kUsual;
  const double directions = static_cast<double>(options.angular) * options.angular;
  const double masks = many ? 4 * (directions - kUsual * kUsual) / 16 : 0;
  bake::DisplaceOptions usual = options;
  usual.angular = kUsual, usual.scale_tolerance = 0;
  const auto pairsOf = [&](const bake::DisplaceOptions& of) {
    return bake::displacementPairBytes(map.width, map.height, of, tool.threads());
  };
  const double texels = static_cast<double>(map.width) * map.height;
  const double table = options.table ? kTableBytes * options.channels() : 0;
  const double counted = texels * (fine ? BytesPerTexel::kDisplaceFinely : BytesPerTexel::kDisplace);
  const double pairs = many ? pairsOf(options) - std::min(pairsOf(usual), counted) : 0;
  tool.requireMemory(counted + texels * masks + pairs + table,
                     fmt::format("a displacement of {} x {} texels in {:.0f} directions", map.width, map.height, directions),
                     many   ? "give a smaller --angular or --spatial, or take a smaller map"
                     : fine ? "give a larger --factor, or take a smaller map"
                            : "take a smaller map");
}

void warnAbout(Tool& tool, const bake::DisplacementData& data, float tolerance) {
  for (std::size_t l = 0; l < data.levels.size(); ++l) {
    const DisplacementLevel& level = data.shape.levels[l];
    const auto warn = [&](const std::string& what) { tool.warn(fmt::format("factor {}: {}", level.factor, what)); };
    if (tolerance > 0 && level.scale_residual > tolerance)
      warn(fmt::format(
          "{} terms of the scaling miss {:.2g} % of it, more than --scale-tolerance allows; take a larger --spatial",
          data.shape.more_terms + 1, 100 * level.scale_residual));
    if (tolerance == 0 && level.scale_residual > kResidual)
      warn(
          fmt::format("the scaling differs between parts of the map: T S misses {:.0f} % of it (the best product would leave "
                      "{:.0f} %); --scale-tolerance adds terms",
                      100 * level.scale_residual, 100 * std::sqrt(1 - level.rank1_energy)));
    if (level.distant_share > kDistant)
      warn(
          fmt::format("{:.1f} % of the reflected light hops farther than a cell; it is kept in the mean but not in its place. "
                      "Take a larger factor, or let the renderer trace it on a finer level",
                      100 * level.distant_share));
    if (const double error = meanFitError(data.levels[l]); error > kFitError)
      warn(fmt::format("lobes miss the distributions of normals by {:.0f} % on average; take more lobes or a smaller factor",
                       100 * error));
  }
}

nlohmann::json displacementJson(const bake::DisplacementData& data) {
  nlohmann::json levels = nlohmann::json::array();
  for (std::size_t l = 0; l < data.levels.size(); ++l) {
    const DisplacementLevel& shape = data.shape.levels[l];
    const bake::DisplacementData::Level& level = data.levels[l];
    levels.push_back({{"factor", shape.factor},
                      {"columns", shape.columns},
                      {"rows", shape.rows},
                      {"mean_fit_error", meanFitError(level)},
                      {"spatial_scale", level.spatial_scale},
                      {"rank1_residual", shape.rank1_residual},
                      {"rank1_energy", shape.rank1_energy},
                      {"singular_shares", level.singular_shares},
                      {"scale_terms", data.shape.more_terms + 1},
                      {"scale_residual", shape.scale_residual},
                      {"interreflected_share", shape.interreflected_share},
                      {"distant_share", shape.distant_share},
                      {"height_bytes", level.heights.size() * sizeof(float)},
                      {"lobe_bytes", level.lobes.size() * sizeof(VmfLobe) +
                                         (level.lobe_colors.size() + level.lobe_alphas.size()) * sizeof(float)},
                      {"scale_bytes", (level.spatial_scale.size() + level.spatial_terms.size()) * sizeof(float) +
                                          (level.angular_scale.size() + level.angular_terms.size()) * 2}});
  }
  return {{"levels", levels}};
}

std::string displacementText(const bake::DisplacementData& data) {
  std::string text =
      fmt::format("{:>6} {:>11} {:>9} {:>9} {:>9} {:>6} {:>9} {:>14} {:>8} {:>9} {:>9}\n", "factor", "cells", "lobe fit",
                  "T S fit", "rank 1", "terms", "terms fit", "interreflected", "distant", "lobe KB", "scale KB");
  const nlohmann::json json = displacementJson(data);
  for (const auto& level : json["levels"])
    text += fmt::format(
        "{:>6} {:>5} x {:<3} {:>8.1f}% {:>8.1f}% {:>8.2f}% {:>6} {:>8.1f}% {:>13.1f}% {:>7.2f}% {:>9.1f} {:>9.1f}\n",
        level["factor"].get<int>(), level["columns"].get<int>(), level["rows"].get<int>(),
        100 * level["mean_fit_error"].get<double>(), 100 * level["rank1_residual"].get<double>(),
        100 * level["rank1_energy"].get<double>(), level["scale_terms"].get<int>(), 100 * level["scale_residual"].get<double>(),
        100 * level["interreflected_share"].get<double>(), 100 * level["distant_share"].get<double>(),
        1e-3 * level["lobe_bytes"].get<double>(), 1e-3 * level["scale_bytes"].get<double>());
  return text;
}

}  // namespace glint::apps
