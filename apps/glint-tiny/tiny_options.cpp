#include "glint-tiny/tiny_options.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/files.h"
#include "common/numbers.h"
#include "glint-tiny/transforms_file.h"
#include "glint/query/detail/tiny/scattered_pieces.h"

namespace glint::apps {

TinyOptions::TinyOptions(Tool& tool) : tool_(tool) {
  const auto add = [&](Option& option) {
    options_.push_back(&option);
    return &option;
  };
  add(tool.choice(
      "--mode", values_.mode, {{"tiled", TinyMode::tiled}, {"scattered", TinyMode::scattered}},
      "how copies cover the plane: side by side (brushed metal, leather), or at random places (scratches, flakes)"));
  add(tool.option("--cut", cut_, "cut an example of N x N texels from the map").range(2, 256));
  at_option_ =
      add(tool.option("--at", at_, "texel of the map that is the lower left one of the example: column, row").count(2));
  add(tool.option("--transforms", transforms_path_, "JSON file with the transforms of examples, see below"));
  density_option_ = add(
      tool.option("--density", values_.density, "scattered: examples in a cell, the square of the example's size, on average"));
  overlap_option_ =
      add(tool.choice("--overlap", values_.overlap, {{"quarters", TinyOverlap::quarters}, {"nearest", TinyOverlap::nearest}},
                      "scattered: which of several examples is seen. quarters: the one nearest to the middle of a quarter of "
                      "their common box (Xing 2024); nearest: the one nearest to the point"));
  background_option_ = add(tool.option("--background-sigma-r", values_.background_sigma_r,
                                       "scattered: roughness of the surface between examples, disk units")
                               .range(1e-4, 0.25)
                               .defaultText("that of --sigma-r"));
  add(tool.option("--resolution", resolution_,
                  "pixels of an NDF image along each axis, a multiple of 16 from 32 to 1024; auto: so many that sigma_r is 1.5 "
                  "pixels"));
  add(tool.option("--sigma-r", values_.sigma_r, "intrinsic roughness: standard deviation of a facet's lobe, disk units"));
  add(tool.choice("--surface", values_.surface, {{"flat", Surface::flat}, {"smooth", Surface::smooth}},
                  "each texel is a facet (flat), or normals are interpolated between texels (smooth)"));
  add(tool.choice("--precision", values_.precision, {{"half", BlockPrecision::f16}, {"float", BlockPrecision::f32}},
                  "of stored pixels"));
  tool.usesSeed();
  tool.addCheck([this] { check(); });
}

void TinyOptions::check() const {
  if (!transforms_path_.empty()) {
    checkRegular(transforms_path_);
    tool_.addInput(transforms_path_);
  }
  const auto refuse = [](const char* name, const std::string& remedy) {
    throw Error(ErrorCode::usage, "option.mode", {}, name, "has no effect on tiled examples", remedy);
  };
  if (values_.mode != TinyMode::tiled) return;
  if (density_option_->given()) refuse("--density", "add --mode scattered");
  if (overlap_option_->given()) refuse("--overlap", "add --mode scattered");
  if (background_option_->given()) refuse("--background-sigma-r", "add --mode scattered");
}

bake::TinyOptions TinyOptions::values() {
  bake::TinyOptions options = values_;
  if (resolution_ == "auto") {
    if (options.sigma_r > 0) options.resolution = bake::resolutionFor(options.sigma_r);
  } else if (!parseNumber(resolution_, options.resolution).empty()) {
    throw Error(ErrorCode::usage, "option.range", {}, "--resolution", "'" + resolution_ + "' is not a number of pixels",
                "give auto, or a multiple of 16 from 32 to 1024");
  }
  options.seed = static_cast<int>(tool_.seed() & 0x7fffffff);
  if (!transforms_path_.empty()) readTransforms(transforms_path_, options);
  return options;
}

NormalMap TinyOptions::example(const NormalMap& map) {
  if (cut_ == 0) {
    if (at_option_->given())
      throw Error(ErrorCode::usage, "option.range", {}, "--at", "says where to cut, and not how much", "add --cut N");
    return map;
  }
  const int x = at_[0], y = at_[1];
  if (x < 0 || y < 0 || x > map.width - cut_ || y > map.height - cut_)
    throw Error(
        ErrorCode::usage, "option.range", {}, "--cut",
        fmt::format("{} x {} texels at {}, {} are not inside a map of {} x {}", cut_, cut_, x, y, map.width, map.height),
        "give a smaller --cut or another --at");
  normals_.clear();
  for (int j = 0; j < cut_; ++j)
    for (int i = 0; i < cut_; ++i) normals_.push_back(map.at(x + i, y + j));
  NormalMap example;
  example.width = example.height = cut_;
  example.texel_size_um = map.texel_size_um;
  example.normals = normals_;
  return example;
}

ExplicitOptions::ExplicitOptions(Tool& tool, const std::vector<const Option*>& others) {
  tool.section("A part of the plane as a map");
  Option& size = tool.option("--explicit", size_, "write W x H texels of the plane of an asset of kind tiny-example").count(2);
  option_ = &size;
  tool.option("--origin", origin_, "texel of the plane at the lower left corner: X Y").count(2).needs(size);
  tool.option("--per-texel", per_texel_, "texels of the map along a texel of the plane")
      .range(1, bake::PlaneWindow::kMostPerTexel)
      .needs(size);
  for (const Option* other : others) size.excludes(*other);
}

bake::PlaneWindow ExplicitOptions::window() const {
  constexpr int kMostSide = 1 << 16;
  constexpr double kMostTexels = 1 << 28, kFarthest = 0x1p50;
  const double width = size_[0], height = size_[1];
  if (!(width >= 1 && height >= 1 && width <= kMostSide && height <= kMostSide && width * height <= kMostTexels))
    throw Error(ErrorCode::usage, "option.range", {}, "--explicit",
                fmt::format("{:g} x {:g} texels are out of range", width, height),
                "give at most 65536 along each axis and 2^28 in all");
  double origin[2] = {};
  for (std::size_t k = 0; k < 2; ++k)
    if (!parseNumber(origin_[k], origin[k]).empty() || origin[k] != std::floor(origin[k]) || std::fabs(origin[k]) > kFarthest)
      throw Error(ErrorCode::usage, "option.range", {}, "--origin", "'" + origin_[k] + "' is no texel of the plane",
                  "give whole numbers up to 2^50");
  return {static_cast<std::int64_t>(origin[0]), static_cast<std::int64_t>(origin[1]), size_[0], size_[1], per_texel_};
}

nlohmann::json tinyJson(const bake::TinyExampleData& tiny) {
  nlohmann::json levels = nlohmann::json::array();
  const PyramidShape& shape = tiny.images.shape;
  const TinyExample view = tiny.view();
  std::size_t images = 0;
  for (int l = 0; l < shape.level_count; ++l) {
    const std::size_t blocks = tiny.images.levels[static_cast<std::size_t>(l)].block_means.size();
    const auto places = static_cast<double>(shape.levels[l].imageCount()) * shape.blocksPerImage();
    images += shape.levels[l].imageCount();
    levels.push_back({{"is_mean", l == view.exampleLevels()},
                      {"tile_texels", static_cast<int>(shape.levels[l].stride)},
                      {"images", shape.levels[l].imageCount()},
                      {"blocks", blocks},
                      {"occupied", static_cast<double>(blocks) / places}});
  }
  nlohmann::json json = {
      {"levels", std::move(levels)},
      {"images", images},
      {"size_bytes", tiny.sizeBytes()},
      {"full_bytes", images * static_cast<std::size_t>(shape.resolution) * static_cast<std::size_t>(shape.resolution) * 4},
      {"covered", tiny.covered},
      {"mean_from_sigma_texels", nullptr}};
  if (view.mode == TinyMode::scattered) json["mean_from_sigma_texels"] = ScatteredPieces(view).largestSigma();
  return json;
}

std::string tinyText(const bake::TinyExampleData& tiny) {
  const nlohmann::json json = tinyJson(tiny);
  std::string text = "level   tile   images   blocks   occupied\n";
  int l = 0;
  for (const nlohmann::json& level : json["levels"]) {
    const std::string tile = level["is_mean"].get<bool>() ? "mean" : std::to_string(level["tile_texels"].get<int>());
    text += fmt::format("{:>5} {:>6} {:>8} {:>8} {:>9.1f}%\n", l++, tile, level["images"].get<std::size_t>(),
                        level["blocks"].get<std::size_t>(), 100 * level["occupied"].get<double>());
  }
  text += fmt::format("{:.3f} MB; {:.3f} MB in full at 32 bits\n", 1e-6 * json["size_bytes"].get<double>(),
                      1e-6 * json["full_bytes"].get<double>());
  if (!json["mean_from_sigma_texels"].is_null())
    text += fmt::format("examples cover {:.1f} % of the plane; its mean answers from {:.3g} texels on\n",
                        100 * json["covered"].get<double>(), json["mean_from_sigma_texels"].get<double>());
  return text;
}

}  // namespace glint::apps
