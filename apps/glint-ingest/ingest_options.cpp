#include "glint-ingest/ingest_options.h"

#include <fmt/format.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "common/numbers.h"
#include "common/udim_loop.h"
#include "glint/model/counted.h"

namespace glint::apps {
namespace {

/// Mean tilts beyond this are warned of: the map may be in object space or in another encoding.
constexpr double kSuspiciousMeanTilt = 0.5;
/// Central differences across one texel say little about a surface this steep.
constexpr float kSuspiciousSteepness_deg = 85;

/// Steps between opposite borders this many times as rough as the roughest place inside tell of heights that do not tile.
constexpr float kSuspiciousSeam = 1.5f;

/// "auto" and "none", or a number, which may be nan.
std::optional<double> parseNoData(const std::string& text) {
  if (text == "auto" || text == "none") return {};
  if (trimBlanks(text) == "nan") return std::numeric_limits<double>::quiet_NaN();
  double value = 0;
  if (parseNumber(text, value).empty()) return value;
  throw Error(ErrorCode::usage, "cli.usage", "", "--nodata", "\"" + text + "\" is not auto, none or a number",
              "give the number that the file has where it has no data, such as -9999");
}

const char* channelsName(bake::NormalChannels channels) {
  switch (channels) {
    case bake::NormalChannels::rgb:
      return "rgb";
    case bake::NormalChannels::rg:
      return "rg";
    case bake::NormalChannels::ag:
      return "ag";
  }
  return "rgb";
}

const char* encodingName(bake::Encoding encoding) { return encoding == bake::Encoding::snorm ? "snorm" : "unorm"; }

}  // namespace

IngestOptions::IngestOptions(Tool& tool) {
  using bake::Convention;
  using bake::Dequantize;
  using bake::Encoding;
  bake::IngestOptions& p = values_;
  tool.choice("--kind", kind_, {{"normal", Kind::normal}, {"height", Kind::height}}, "what the image holds");
  tool.choice("--to", to_, {{"normals", To::normals}, {"heights", To::heights}},
              "what to write; normals of heights are central differences");
  tool.choice("--convention", p.convention, {{"opengl", Convention::opengl}, {"directx", Convention::directx}},
              "opengl: green is up; directx: green is down");
  tool.choice("--encoding", p.encoding, {{"auto", Encoding::automatic}, {"unorm", Encoding::unorm}, {"snorm", Encoding::snorm}},
              "unorm: 0..1 means -1..1 (zero is 127.5 of 255); snorm: -1..1 as they are (zero is code 128)");
  Option& scale =
      tool.option("--height-scale", p.height_scale, "height, in texels, of a value of 1 (of integers: of the largest code)")
          .range(-1e6, 1e6);
  Option& texel_size =
      tool.option("--texel-size-um", texel_size_um_, "size of a texel in micrometres; 0: unknown").range(0, 1e9);
  height_scale_um_option_ = &tool.option("--height-scale-um", height_scale_um_, "--height-scale in micrometres instead")
                                 .range(-1e9, 1e9)
                                 .excludes(scale)
                                 .needs(texel_size);
  boundary_option_ =
      &tool.choice("--boundary", p.boundary, {{"wrap", Boundary::wrap}, {"clamp", Boundary::clamp}},
                   "normals of heights at the border. wrap: the map tiles; clamp: it ends there, differences are one-sided");
  image_.declare(tool);
  tool.option("--nodata", no_data_,
              "number that pixels without data hold: they are filled by their neighbours. auto: the one of a GeoTIFF's tag; "
              "heights that seem to hold another are refused; none: every number is a height");
  tool.flag("--fix-invalid", p.fix_invalid,
            "replace texels that are not finite, transparent or point below the surface by the mean of their neighbours "
            "(one in 1000 may point below without this)");
  tool.flag("--allow-constant", p.allow_constant, "accept a map that has the same value everywhere");
  tool.choice("--dequantize", p.dequantize,
              {{"auto", Dequantize::automatic}, {"none", Dequantize::none}, {"tpdf", Dequantize::tpdf}},
              "tpdf: triangular noise of +-1 code hides the steps of integers; auto: for 8 bits only, also where they were "
              "scaled to 16 bits or floating point");
  tool.usesSeed();
  tool.addCheck([this] {
    parseNoData(no_data_);
    if (kind_ == Kind::normal && to_ == To::heights) {
      throw Error(ErrorCode::usage, "cli.usage", "", "--to", "heights cannot be made from normals",
                  "add --kind height or use --to normals");
    }
    if (height_scale_um_option_->given() && texel_size_um_ <= 0) {
      throw Error(ErrorCode::usage, "cli.usage", "", "--height-scale-um", "needs the size of a texel", "give --texel-size-um");
    }
  });
}

bake::IngestOptions IngestOptions::values(Tool& tool, const std::string& name, const Image& image) const {
  bake::IngestOptions p = values_;
  p.name = name;
  p.seed = tool.seed();
  p.trust_channels = !image_.choice().channels.empty();
  p.no_data = no_data_ == "auto" ? image.no_data : parseNoData(no_data_);
  p.refuse_sentinels = no_data_ != "none";
  if (height_scale_um_option_->given()) p.height_scale = height_scale_um_ / texel_size_um_;
  return p;
}

bake::IngestOptions IngestOptions::tileValues(Tool& tool, const std::string& name, const Image& image) const {
  bake::IngestOptions p = values(tool, name, image);
  requireClamp(*boundary_option_, p.boundary);
  p.boundary = Boundary::clamp;
  return p;
}

Image IngestOptions::read(Tool& tool, const std::string& path, bool of_any_size) const {
  ImageChoice choice = image_.choice();
  choice.transparent_holes = values_.fix_invalid;
  choice.of_any_size = of_any_size;
  return readInputImage(tool, path, choice);
}

bake::PixelArray pixelArray(const Image& image) {
  bake::PixelArray array{image.width, image.height, image.channels, {}, image.code_scale};
  array.inverted = image.inverted;
  array.grey_alpha = image.channels == 2 && image.alpha >= 0;
  // Integers with a sign are read as floats, and so are integers that were divided by alpha.
  const bool floats = std::holds_alternative<PixelVector<float>>(image.pixels);
  if (floats && !image.floating) array.step = static_cast<float>(1 / image.code_scale);
  std::visit([&](const auto& pixels) { array.pixels = std::span(pixels); }, image.pixels);
  return array;
}

nlohmann::json reportJson(const bake::IngestReport& r) {
  const Covariance& slopes = r.slopes.covariance;
  return {{"encoding", encodingName(r.encoding)},
          {"channels", channelsName(r.channels)},
          {"coarse_codes", r.coarse_codes},
          {"dequantized", r.dequantized},
          {"texels", r.texels},
          {"non_finite", r.non_finite},
          {"downward", r.downward},
          {"clipped", r.clipped},
          {"non_unit", r.non_unit},
          {"median_length_error", r.median_length_error},
          {"no_data", r.no_data},
          {"repaired", r.repaired},
          {"cliffs", r.cliffs},
          {"seam_roughness", {r.seam.x, r.seam.y}},
          {"mean_normal", {r.mean_normal.x, r.mean_normal.y}},
          {"mean_tilt_deg", r.mean_tilt_deg},
          {"steepest_tilt_deg", r.steepest_tilt_deg},
          {"slope_covariance", {{"xx", slopes.xx}, {"xy", slopes.xy}, {"yy", slopes.yy}}}};
}

std::string reportText(const std::string& name, const Image& image, const bake::IngestReport& r) {
  const Covariance& slopes = r.slopes.covariance;
  return fmt::format(
      "{}: {} x {}, {} channels of {} bits ({}), {}{}\n"
      "  mean normal ({:.5f}, {:.5f}), mean tilt {:.3f} degrees, steepest {:.3f}\n"
      "  slope covariance xx {:.6g} xy {:.6g} yy {:.6g}\n"
      "  {} not finite, {} downward, {} clipped, {} not of unit length, {} repaired\n",
      name, image.width, image.height, image.channels, image.bits, image.format, encodingName(r.encoding),
      r.dequantized ? ", dequantized" : "", r.mean_normal.x, r.mean_normal.y, r.mean_tilt_deg, r.steepest_tilt_deg, slopes.xx,
      slopes.xy, slopes.yy, r.non_finite, r.downward, r.clipped, r.non_unit, r.repaired);
}

namespace {

/// Heights that do not tile have a cliff where they wrap.
template <class Warn>
void warnOfSeam(const Warn& warn, Boundary boundary, Vec2 seam) {
  if (boundary == Boundary::clamp) return;
  const auto say = [&](float roughness, const char* borders) {
    if (roughness <= kSuspiciousSeam) return;
    warn(
        fmt::format("heights do not meet at the {} borders: the step there is {:.1f} times that of the roughest place inside; "
                    "if the map does not tile, use --boundary clamp here and in the tools that ask for it",
                    borders, roughness));
  };
  say(seam.x, "left and right");
  say(seam.y, "upper and lower");
}

}  // namespace

void IngestOptions::warnAbout(Tool& tool, const std::string& name, const std::optional<double>& no_data, Boundary boundary,
                              const bake::IngestReport& r) const {
  const auto warn = [&](const std::string& text) { tool.warn(name + ": " + text); };
  const auto replaced = [&](std::size_t count, const Subject& subject, const std::string& what) {
    if (count > 0) warn(counted(count, subject) + " " + what + ": replaced by the mean of the neighbours");
  };
  if (r.no_data > 0) replaced(r.no_data, {"texel holds", "texels hold"}, fmt::format("no data ({})", *no_data));
  if (const auto given = parseNoData(no_data_); given && r.no_data == 0)
    warn(fmt::format("no texel holds {}, the number of --nodata", *given));
  replaced(r.downward, {"texel points", "texels point"}, fmt::format("below the surface, of {}", r.texels));
  replaced(r.non_finite, {"texel is", "texels are"}, "not finite");
  if (r.clipped > 0) warn(counted(r.clipped, {"texel was", "texels were"}) + " on the rim of the disk: moved just inside it");
  if (r.cliffs > 0) {
    warn(counted(r.cliffs, {"texel is", "texels are"}) +
         " at cliffs steeper than 89.9 degrees: normals are moved there; check --height-scale and --nodata");
  }
  if (r.channels == bake::NormalChannels::ag)
    warn("red is constant: x was read from alpha, y from green, and z follows from them");
  if (r.positive_blue)
    warn("blue holds z from 0 to 1 rather than from -1 to 1: z was taken from red and green, as with --channels rg");
  else if (r.blue_ignored)
    warn("blue is constant and contradicts red and green: z was taken from them, as with --channels rg");
  if (r.non_unit > 0) {
    warn(counted(r.non_unit, {"vector was", "vectors were"}) +
         fmt::format(" not of unit length, of {} (half of all are off by more than {:.3f}): normalised", r.texels,
                     r.median_length_error));
  }
  warnOfSeam(warn, boundary, r.seam);
  if (std::max(std::abs(r.mean_normal.x), std::abs(r.mean_normal.y)) > kSuspiciousMeanTilt) {
    tool.warn(fmt::format("{}: the mean normal ({:.2f}, {:.2f}) is far from up; is this a tangent-space map?", name,
                          r.mean_normal.x, r.mean_normal.y));
  }
  if (r.steepest_tilt_deg > kSuspiciousSteepness_deg && r.clipped + r.cliffs == 0) {
    tool.warn(fmt::format("{}: the steepest normal leans {:.1f} degrees; check --height-scale or --encoding", name,
                          r.steepest_tilt_deg));
  }
}

}  // namespace glint::apps
