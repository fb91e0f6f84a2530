#include "glint-ingest/ingest_options.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace glint::apps {
namespace {

/// Mean tilts beyond this are warned of: the map may be in object space or in another encoding.
constexpr double kSuspiciousMeanTilt = 0.5;
/// Central differences across one texel say little about a surface this steep.
constexpr float kSuspiciousSteepness_deg = 85;

const char* encodingName(bake::Encoding encoding) { return encoding == bake::Encoding::snorm ? "snorm" : "unorm"; }

}  // namespace

IngestOptions::IngestOptions(Tool& tool) {
  using bake::Convention;
  using bake::Dequantize;
  using bake::Encoding;
  bake::IngestParameters& p = parameters_;
  tool.choice("--kind", kind_, {{"normal", Kind::normal}, {"height", Kind::height}}, "what the image holds");
  tool.choice("--to", to_, {{"normals", To::normals}, {"heights", To::heights}},
              "what to write; normals of heights are central differences, wrapped");
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
  tool.flag("--fix-invalid", p.fix_invalid, "replace unusable texels by the mean of their neighbours");
  tool.flag("--allow-constant", p.allow_constant, "accept a map that has the same value everywhere");
  tool.choice("--dequantize", p.dequantize,
              {{"auto", Dequantize::automatic}, {"none", Dequantize::none}, {"tpdf", Dequantize::tpdf}},
              "tpdf: triangular noise of +-1 code hides the steps of integers; auto: for 8 bits only");
  tool.addCheck([this] {
    if (kind_ == Kind::normal && to_ == To::heights) {
      throw Error(ErrorCode::usage, "cli.usage", "", "--to", "heights cannot be made from normals",
                  "add --kind height or use --to normals");
    }
    if (height_scale_um_option_->given() && texel_size_um_ <= 0) {
      throw Error(ErrorCode::usage, "cli.usage", "", "--height-scale-um", "needs the size of a texel", "give --texel-size-um");
    }
  });
}

bake::IngestParameters IngestOptions::parameters(Tool& tool, const std::string& name) const {
  bake::IngestParameters p = parameters_;
  p.name = name;
  p.seed = tool.seed();
  if (height_scale_um_option_->given()) p.height_scale = height_scale_um_ / texel_size_um_;
  return p;
}

bake::PixelArray pixelArray(const Image& image) {
  bake::PixelArray array{image.width, image.height, image.channels, {}};
  std::visit([&](const auto& pixels) { array.pixels = std::span(pixels); }, image.pixels);
  return array;
}

nlohmann::json reportJson(const bake::IngestReport& r) {
  const Covariance& slopes = r.slopes.covariance;
  return {{"encoding", encodingName(r.encoding)},
          {"dequantized", r.dequantized},
          {"texels", r.texels},
          {"non_finite", r.non_finite},
          {"downward", r.downward},
          {"clipped", r.clipped},
          {"non_unit", r.non_unit},
          {"repaired", r.repaired},
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

void warnAbout(Tool& tool, const std::string& name, const bake::IngestReport& r) {
  if (r.repaired > 0)
    tool.warn(fmt::format("{}: {} unusable texels were replaced by their neighbours' mean", name, r.repaired));
  if (r.clipped > 0) tool.warn(fmt::format("{}: {} texels on the rim of the disk were moved just inside it", name, r.clipped));
  if (r.non_unit > 0) {
    tool.warn(fmt::format("{}: {} of {} vectors were not of unit length and were normalised", name, r.non_unit, r.texels));
  }
  if (std::max(std::abs(r.mean_normal.x), std::abs(r.mean_normal.y)) > kSuspiciousMeanTilt) {
    tool.warn(fmt::format("{}: the mean normal ({:.2f}, {:.2f}) is far from up; is this a tangent-space map?", name,
                          r.mean_normal.x, r.mean_normal.y));
  }
  if (r.steepest_tilt_deg > kSuspiciousSteepness_deg && r.clipped == 0) {
    tool.warn(fmt::format("{}: the steepest normal leans {:.1f} degrees; check --height-scale or --encoding", name,
                          r.steepest_tilt_deg));
  }
}

}  // namespace glint::apps
