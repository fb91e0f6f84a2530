#include "glint-shlobes/shlobes_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/numbers.h"

namespace glint::apps {
namespace {

/// "65x128", or "none" for 0 x 0.
ShGrid parseGrid(const std::string& text) {
  ShGrid grid;
  if (text == "none" || (parseProduct(text, grid.rows, grid.columns) && grid.rows > 0 && grid.columns > 0)) return grid;
  throw Error(ErrorCode::usage, "arguments", "", "--grid", "\"" + text + "\" is no grid of directions",
              "give rows x columns, such as 65x128");
}

}  // namespace

ShLobesOptions::ShLobesOptions(Tool& tool) {
  sigma_option_ = &tool.option("--sigma-r", sigma_r_, "lobes: intrinsic roughness, disk units").range(1e-6, 1);
  tool.option("--light", light_,
              "instead of lobes: light, as a 2:1 latitude-longitude image (.exr, .hdr; z up, first column at +x towards +y), "
              "or area lights (.json)")
      .excludes(*sigma_option_)
      .defaultText("none");
  tool.option("--gaussians", gaussians_,
              "--light: fits so many spherical Gaussians to the light as well, and prints them with --json; 0: none")
      .range(0, bake::kMostGaussians)
      .unrecorded();
  tool.option("--order", order_, "highest band of the spherical harmonics").range(0, kMaxShOrder);
  tool.option("--grid", grid_, "directions, ROWSxCOLUMNS; lobes: none for no table").defaultText("65x128; --light: 17x32");
  tool.choice("--precision", precision_, {{"f16", ShPrecision::f16}, {"f32", ShPrecision::f32}}, "type of the coefficients");
  tool.option("--band-limit", band_limit_, "--light: highest band of the environment itself")
      .range(0, 10000)
      .defaultText("3 order + 24; below order 60 the least of 6 order + 24 and 204");
  tool.option("--area-height", area_lights_.height,
              "area lights: pixels of the image that they are drawn to, from pole to pole")
      .range(1, 4096);
  tool.option("--area-samples", area_lights_.samples, "area lights: rays of a pixel along each axis").range(1, 64);
  tool.addCheck([this, &tool] { check(tool); });
}

void ShLobesOptions::check(Tool& tool) {
  grid({});
  max_bytes_ = tool.maxMemory();
  if (light_.empty()) {
    if (!sigma_option_->given())
      throw Error(ErrorCode::usage, "arguments", "", "", "nothing was asked for", "add --sigma-r S for lobes, or --light FILE");
    if (gaussians_ > 0)
      throw Error(ErrorCode::usage, "arguments", "", "--gaussians", "fits light, and there is none", "add --light FILE");
    return;
  }
  checkRegular(light_);
  tool.addInput(light_);
}

ShGrid ShLobesOptions::grid(ShGrid other) const { return grid_.empty() ? other : parseGrid(grid_); }

bake::ShLobesOptions ShLobesOptions::lobesOptions() const {
  bake::ShLobesOptions options;
  options.sigma_r = sigma_r_;
  options.order = order_;
  options.grid = grid(options.grid);
  options.precision = precision_;
  options.max_bytes = max_bytes_;
  return options;
}

bake::ShLightOptions ShLobesOptions::lightOptions() const {
  bake::ShLightOptions options;
  options.order = order_;
  options.grid = grid(options.grid);
  options.band_limit = band_limit_;
  options.precision = precision_;
  options.max_bytes = max_bytes_;
  return options;
}

nlohmann::json lobesJson(const ShLobes& lobes) {
  const std::size_t coefficients = lobes.grid.directionCount() * shCount(lobes.order);
  return {{"kind", "sh-lobes"},
          {"order", lobes.order},
          {"grid_rows", lobes.grid.rows},
          {"grid_columns", lobes.grid.columns},
          {"table_bytes", coefficients * (lobes.precision == ShPrecision::f16 ? 2 : 4)},
          {"last_band_relative", lobes.zonal.back() / lobes.zonal.front() / std::sqrt(2 * lobes.order + 1.0)}};
}

nlohmann::json lightJson(const ShLight& light) {
  const std::size_t coefficients = 3 * light.grid.directionCount() * shCount(light.order);
  return {{"kind", "sh-light"},
          {"order", light.order},
          {"grid_rows", light.grid.rows},
          {"grid_columns", light.grid.columns},
          {"table_bytes", coefficients * (light.precision == ShPrecision::f16 ? 2 : 4)}};
}

nlohmann::json gaussiansJson(const bake::Environment& environment, const std::string& path, int count) {
  if (std::none_of(environment.rgb.begin(), environment.rgb.end(), [](float value) { return value > 0; }))
    throw Error(ErrorCode::invalid_input, "light.black", path, "", "has no light that lobes could be fitted to",
                "give another light, or leave out --gaussians");
  const bake::GaussianFit fit = bake::fitGaussians(environment, {.lobes = count});
  nlohmann::json lobes = nlohmann::json::array();
  for (const SphericalGaussian& g : fit.lobes)
    lobes.push_back({{"axis", {g.axis.x, g.axis.y, g.axis.z}},
                     {"sharpness", g.sharpness},
                     {"amplitude", {g.amplitude.r, g.amplitude.g, g.amplitude.b}}});
  return {{"error", fit.error}, {"lobes", lobes}};
}

std::string tableText(const nlohmann::json& table) {
  std::string text = fmt::format("{} of order {}, {} x {} directions, {:.1f} MB\n", table["kind"].get<std::string>(),
                                 table["order"].get<int>(), table["grid_rows"].get<int>(), table["grid_columns"].get<int>(),
                                 table["table_bytes"].get<double>() / 1e6);
  if (table.contains("gaussians"))
    text += fmt::format("{} spherical Gaussians miss {:.3g} % of the light; --json prints them\n",
                        table["gaussians"]["lobes"].size(), 100 * table["gaussians"]["error"].get<double>());
  if (table.contains("last_band_relative"))
    text += fmt::format("the last band has {:.3g} of the first: where this is not small, light that is sharper rings\n",
                        table["last_band_relative"].get<double>());
  return text;
}

}  // namespace glint::apps
