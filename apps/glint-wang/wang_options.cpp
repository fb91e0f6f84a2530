#include "glint-wang/wang_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/numbers.h"

namespace glint::apps {

WangOptions::WangOptions(Tool& tool) {
  std::vector<const Option*> of_tiles;
  const auto forTiles = [&](Option& option) -> Option& {
    of_tiles.push_back(&option);
    return option;
  };
  forTiles(tool.choice("--scheme", values_.scheme, {{"corner", WangScheme::corner}, {"edge", WangScheme::edge}},
                       "what has colours: corners of tiles, so that tiles across a corner agree as well, or edges"));
  forTiles(tool.option("--size", values_.size, "width and height of a tile, texels"))
      .range(WangTiles::kLeastSize, WangTiles::kMostSize);
  colors_option_ = &forTiles(
      tool.option("--colors", colors_, "number of colours, 2 to 8; scheme edge: also H,V, of horizontal and vertical edges"));
  tiles_option_ =
      &forTiles(tool.option("--tiles", tiles_,
                            "number of tiles: one for each combination of colours (C^4; scheme edge: H^2 V^2), or a "
                            "multiple, so that tiles of the same colours differ")
                    .range(1, WangTiles::kMostTiles)
                    .defaultText("one for each combination: 16 of 2 colours"));
  forTiles(tool.option("--overlap", values_.overlap, "texels from the border of a tile within which seams run")
               .range(2, WangTiles::kMostSize / 4)
               .defaultText("a 16th of --size, at least 4"));
  forTiles(tool.choice("--boundary", values_.boundary, {{"clamp", Boundary::clamp}, {"wrap", Boundary::wrap}},
                       "clamp: patches lie inside the map; wrap: the map repeats, and patches may cross its border"));
  Option& part = tool.option("--explicit", explicit_, "write W x H texels of the plane of an asset of kind wang-tiles as a map")
                     .count(2)
                     .range(1, 1 << 20);
  explicit_option_ = &part;
  tool.option("--origin", origin_, "with --explicit: texel X Y of the plane that the map begins with; whole numbers")
      .count(2)
      .range(-0x1p52, 0x1p52)
      .needs(part)
      .defaultText("0 0");
  for (const Option* option : of_tiles) part.excludes(*option);
  tool.usesSeed();
  tool.addCheck([this] { check(); });
}

void WangOptions::check() {
  readColors();
  const int combinations = values_.colors_h * values_.colors_h * values_.colors_v * values_.colors_v;
  values_.tile_count = tiles_option_->given() ? tiles_ : combinations;
  for (const double texel : origin_)
    if (texel != std::floor(texel))
      throw Error(ErrorCode::usage, "option.range", {}, "--origin", fmt::format("{} is no whole number", texel),
                  "give the number of a texel");
  constexpr std::int64_t kMostTexels = std::int64_t{1} << 30;
  if (wantsMap() && std::int64_t{explicit_[0]} * explicit_[1] > kMostTexels)
    throw Error(ErrorCode::usage, "option.range", {}, "--explicit",
                fmt::format("{} x {} texels are more than 2^30", explicit_[0], explicit_[1]),
                "write several parts, each with its --origin");
}

/// "C" or "H,V".
void WangOptions::readColors() {
  const std::size_t comma = colors_.find(',');
  const std::string first = colors_.substr(0, comma), second = comma == std::string::npos ? first : colors_.substr(comma + 1);
  const auto valid = [](int colors) { return colors >= WangTiles::kLeastColors && colors <= WangTiles::kMostColors; };
  const bool numbers = parseNumber(first, values_.colors_h).empty() && parseNumber(second, values_.colors_v).empty();
  if (!numbers || !valid(values_.colors_h) || !valid(values_.colors_v))
    throw Error(ErrorCode::usage, "option.range", {}, "--colors", fmt::format("'{}' is no number of colours", colors_),
                "give 2 to 8, or two such numbers as H,V; of one colour there is only one tile, and the plane repeats");
}

bake::WangOptions WangOptions::values(const Tool& tool, const std::string& path) const {
  bake::WangOptions options = values_;
  options.name = path;
  options.seed = tool.seed();
  return options;
}

nlohmann::json wangJson(const bake::WangTilesData& tiles) {
  const WangTiles& shape = tiles.shape;
  const bake::WangReport& report = tiles.report;
  return {{"tiles", shape.tile_count},
          {"tile_size", shape.size},
          {"size_bytes", tiles.normals.size() * sizeof(Vec2)},
          {"seam_cost", report.seam_cost},
          {"ndf_tv", report.ndf_tv},
          {"repetition", report.repetition},
          {"input_repetition", report.input_repetition},
          {"enlarged", report.enlarged}};
}

std::string wangText(const bake::WangTilesData& tiles) {
  const WangTiles& shape = tiles.shape;
  const bake::WangReport& report = tiles.report;
  return fmt::format(
             "{} tiles of {} x {} texels, {:.2f} MB\n"
             "seams      {:.2f} times the difference of neighbouring texels\n"
             "normals    {:.4f} total variation from the map\n"
             "repetition {:.3f} autocorrelation at whole tiles; of the map {:.3f}\n",
             shape.tile_count, shape.size, shape.size, 1e-6 * static_cast<double>(tiles.normals.size() * sizeof(Vec2)),
             report.seam_cost, report.ndf_tv, report.repetition, report.input_repetition) +
         (report.enlarged ? "patches did not fit into the map, so blocks of it were joined to a larger one first\n" : "");
}

void refuseTiles(const formats::Asset& asset, const std::string& path) {
  if (asset.kind() == formats::kKindName<WangTiles>)
    throw Error(ErrorCode::unsupported, "format.kind", path, "", "is of kind wang-tiles already, not normals",
                "give the map that it was made from, or add --explicit W H to write a part of its plane as a map");
}

void warnOfLargeTiles(Tool& tool, const std::string& path, const NormalMap& map, const bake::WangTilesData& tiles) {
  const int smaller = std::min(map.width, map.height);
  if (2 * tiles.shape.size <= smaller) return;
  tool.warn(fmt::format(
      "{}: tiles of {} texels are larger than half the map of {} x {}, so that several show the same texels; give a larger "
      "map, "
      "or --size {} or less",
      path, tiles.shape.size, map.width, map.height, std::max(static_cast<int>(WangTiles::kLeastSize), smaller / 2)));
}

}  // namespace glint::apps
