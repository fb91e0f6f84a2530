#include "glint-pyramid/pyramid_options.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "common/numbers.h"
#include "common/udim_loop.h"
#include "glint/bake/pyramid/asked_levels.h"

namespace glint::apps {

PyramidOptions::PyramidOptions(Tool& tool) {
  const Option& stride = tool.option("--stride", values_.stride,
                                     "stride of the finest level, texels; its footprints have a deviation of 0.433 strides")
                             .range(2, 65536);
  tool.option(
          "--finest", finest_,
          "instead of --stride: deviation of the smallest footprint that will be asked, texels; finer levels are left out, and "
          "queries about smaller footprints need the map: glint-query --normals, or --keep-normals here")
      .range(0.05, 28000)
      .excludes(stride)
      .defaultText("none");
  tool.option("--overlap", values_.overlap, "footprints in a stride along each axis; 1: the grid of Deng 2022")
      .range(1, kMostOverlap)
      .defaultText("sqrt(2)");
  tool.option("--resolution", resolution_,
              "pixels of an NDF image along each axis, a multiple of 16 from 32 to 1024; auto: so many that sigma_r is 1.5 "
              "pixels, where densities between the half vectors of a pixel err by 4 % (256 at the default sigma_r: 19 %)");
  const Option& sigma_r =
      tool.option("--sigma-r", values_.sigma_r, "intrinsic roughness: standard deviation of a facet's lobe, disk units");
  const Option& surface = tool.choice("--surface", values_.surface, {{"flat", Surface::flat}, {"smooth", Surface::smooth}},
                                      "each texel is a facet (flat), or normals are interpolated between texels (smooth)");
  const Option& boundary = tool.choice("--boundary", values_.boundary, {{"wrap", Boundary::wrap}, {"clamp", Boundary::clamp}},
                                       "whether the map repeats or ends at its border");
  const Option& levels = tool.option(
      "--levels", levels_,
      "number of levels besides the mean of the map; auto: until levels agree to 1 % or the stride reaches the map");
  tool.option("--coarsest", coarsest_,
              "instead of --levels: deviation of the largest footprint that will be asked, texels; coarser levels are left "
              "out, and "
              "larger footprints are answered by the coarsest level and the mean of the map")
      .range(0.05, 1e6)
      .excludes(levels)
      .defaultText("none");
  tool.choice("--precision", values_.precision, {{"half", BlockPrecision::f16}, {"float", BlockPrecision::f32}},
              "of stored pixels");
  const Option& keep =
      tool.choice("--keep-normals", keep_, {{"none", KeepNormals::none}, {"i16", KeepNormals::i16}, {"f32", KeepNormals::f32}},
                  "keep the normals of the map in the asset, for footprints below the finest level, which queries then answer "
                  "without --normals: in 16 bits (6.7 bytes a texel, errors up to 1.5e-5) or as they are (13.3 bytes)")
          .recordedIfGiven();
  boundary_ = &boundary;
  geometric_ = {{"--sigma-r", &sigma_r}, {"--surface", &surface}, {"--boundary", &boundary}, {"--keep-normals", &keep}};
}

std::string PyramidOptions::geometricOption() const {
  for (const auto& [name, option] : geometric_)
    if (option->given()) return name;
  return {};
}

bake::PyramidOptions PyramidOptions::values() const {
  bake::PyramidOptions options = values_;
  if (finest_ > 0) options.stride = static_cast<float>(bake::strideFor(finest_));
  if (resolution_ == "auto" && options.sigma_r > 0) options.resolution = bake::resolutionFor(options.sigma_r);
  const auto readUnlessAuto = [](const std::string& text, const char* name, const char* what, const char* remedy, int& value) {
    if (text == "auto") return;
    if (!parseNumber(text, value).empty() || value < 1)
      throw Error(ErrorCode::usage, "option.range", {}, name, "'" + text + "' is not a number of " + what, remedy);
  };
  readUnlessAuto(levels_, "--levels", "levels", "give auto, or 1 or more", options.levels);
  if (coarsest_ > 0) options.levels = bake::levelsFor(coarsest_, double{options.stride});
  readUnlessAuto(resolution_, "--resolution", "pixels", "give auto, or a multiple of 16 from 32 to 1024", options.resolution);
  return options;
}

bake::PyramidOptions PyramidOptions::tileValues() const {
  bake::PyramidOptions options = values();
  requireClamp(*boundary_, options.boundary);
  options.boundary = Boundary::clamp;
  return options;
}

void PyramidOptions::refuseKeeping(const std::string& what, const std::string& remedy) const {
  if (keepsNormals()) throw Error(ErrorCode::usage, "cli.usage", "", "--keep-normals", what + " keep no normals", remedy);
}

nlohmann::json pyramidJson(const bake::NdfPyramidData& pyramid, PyramidRegion region) {
  nlohmann::json levels = nlohmann::json::array();
  std::size_t bytes = 0;
  for (int l = 0; l < pyramid.shape.level_count; ++l) {
    const PyramidGrid& grid = pyramid.shape.levels[l];
    const std::size_t blocks = pyramid.levels[l].block_means.size();
    const std::size_t level_bytes = blocks * kBlockPixels * (pyramid.precision == BlockPrecision::f16 ? 2 : 4);
    bytes += level_bytes;
    const int rows = regionRows(pyramid.shape, l, region).count();
    const double places = static_cast<double>(rows) * grid.columns * pyramid.shape.blocksPerImage();
    levels.push_back({{"is_mean", l == pyramid.shape.footprintLevels()},
                      {"stride_texels", grid.stride},
                      {"columns", grid.columns},
                      {"rows", rows},
                      {"blocks", blocks},
                      {"occupied", places > 0 ? static_cast<double>(blocks) / places : 0},
                      {"size_bytes", level_bytes}});
  }
  return {{"levels", levels},
          {"size_bytes", bytes},
          {"resolution", pyramid.shape.resolution},
          {"overlap", pyramid.shape.overlap},
          {"sigma_r", pyramid.shape.sigma_r},
          {"sigma_r_pixels", 0.5f * pyramid.shape.sigma_r * static_cast<float>(pyramid.shape.resolution)}};
}

std::string pyramidText(const bake::NdfPyramidData& pyramid, PyramidRegion region) {
  std::string text =
      fmt::format("{:>5} {:>8} {:>11} {:>9} {:>9} {:>9}\n", "level", "stride", "images", "blocks", "occupied", "MB");
  const nlohmann::json json = pyramidJson(pyramid, region);
  int l = 0;
  for (const auto& level : json["levels"]) {
    const std::string stride =
        level["is_mean"].get<bool>() ? "mean" : fmt::format("{:.0f}", level["stride_texels"].get<double>());
    text += fmt::format("{:>5} {:>8} {:>5} x {:<3} {:>9} {:>8.1f}% {:>9.2f}\n", l++, stride, level["columns"].get<int>(),
                        level["rows"].get<int>(), level["blocks"].get<std::size_t>(), 100 * level["occupied"].get<double>(),
                        1e-6 * level["size_bytes"].get<double>());
  }
  text += fmt::format("total {:.2f} MB\n", 1e-6 * json["size_bytes"].get<double>());
  if (pyramid.shape.resolution < bake::resolutionFor(pyramid.shape.sigma_r))
    text += fmt::format("sigma_r is {:.2g} pixels of an image; for small lights give --resolution auto\n",
                        json["sigma_r_pixels"].get<double>());
  return text;
}

void reportPyramid(Tool& tool, const bake::NdfPyramidData& pyramid, PyramidRegion region) {
  tool.setResult(pyramidJson(pyramid, region));
  tool.summary(pyramidText(pyramid, region));
}

}  // namespace glint::apps
