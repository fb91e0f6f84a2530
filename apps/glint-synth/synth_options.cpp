#include "glint-synth/synth_options.h"

#include "common/numbers.h"

namespace glint::apps {
namespace {

using bake::SynthKind;

/// "N" or "NxM".
void parseSize(const std::string& text, int& width, int& height) {
  if (parseProduct(text, width, height)) return;
  if (!parseNumber(text, width).empty())
    throw Error(ErrorCode::usage, "cli.size", "", "--size", "'" + text + "' is not a size",
                "write N or NxM, for example 1024x512");
  height = width;
}

}  // namespace

SynthOptions::SynthOptions(Tool& tool) {
  bake::SynthOptions& p = values_;
  const std::string per_kind = "depends on KIND";
  tool.choice("KIND", p.kind,
              {{"isotropic", SynthKind::isotropic},
               {"brushed", SynthKind::brushed},
               {"flakes", SynthKind::flakes},
               {"scratches", SynthKind::scratches},
               {"leather", SynthKind::leather},
               {"weave", SynthKind::weave},
               {"twill", SynthKind::twill},
               {"silk", SynthKind::silk},
               {"bumps", SynthKind::bumps},
               {"scales", SynthKind::scales},
               {"structured", SynthKind::structured},
               {"relief", SynthKind::relief},
               {"wood", SynthKind::wood},
               {"anisotropic", SynthKind::anisotropic},
               {"sawtooth", SynthKind::sawtooth},
               {"flat", SynthKind::flat},
               {"grating", SynthKind::grating},
               {"flake2d", SynthKind::flake2d}},
              "the surface to make")
      .required();
  tool.option("--size", size_, "N or NxM texels");
  alpha_ = &tool.option("--alpha", p.alpha, "Beckmann roughness of the noise; GTR roughness of flakes").range(0, 2);
  gamma_ = &tool.option("--gamma", p.gamma, "exponent of the GTR distribution of flakes; 2: GGX").range(0.1, 20);
  correlation_ = &tool.option("--correlation", p.correlation_texels, "correlation length of the noise, texels").range(0, 65536);
  streak_ = &tool.option("--streak", p.streak_texels, "length of the streaks of brushed, anisotropic and wood, texels")
                 .range(0, 65536);
  feature_ = &tool.option("--flake-size,--feature-size", p.feature_texels,
                          "size of a flake, pebble, thread, tooth, bump, scale, pyramid, island or ring, period of a grating, "
                          "or width of a "
                          "scratch, texels")
                  .range(1, 65536);
  density_ = &tool.option("--density", p.density, "scratches in 64x64 texels").range(1e-3, 64);
  slope_ = &tool.option("--slope", p.slope, "steepest slope of a pattern; not of flakes and noise").range(0, 10);
  tool.choice("--profile", p.profile, {{"sine", bake::GratingProfile::sine}, {"blazed", bake::GratingProfile::blazed}},
              "shape of the grooves of a grating");
  flake_size_uv_ =
      &tool.option("--flake-size-uv", p.flake_size_uv,
                   "flake2d: the input `size` of MaterialX's node, in widths of the map; the map tiles where 1 / size is whole")
           .range(1e-5, 1);
  roughness_ = &tool.option("--roughness", p.roughness, "flake2d: the node's input; alpha is its square").range(0, 1);
  coverage_ = &tool.option("--coverage", p.coverage, "flake2d: the node's input, the share that flakes cover").range(0, 1);
  texel_size_ = &tool.option("--texel-size-um", texel_size_um_,
                             "size of a texel in micrometres: --height then writes micrometres instead of texels")
                     .range(1e-6, 1e9);
  depth_ =
      &tool.option("--depth-um", depth_um_, "from the lowest to the highest point, micrometres, instead of --slope and --alpha")
           .range(1e-6, 1e9)
           .needs(*texel_size_);
  for (Option* option : {alpha_, correlation_, streak_, feature_, slope_}) option->defaultText(per_kind);
  tool.usesSeed();
}

void SynthOptions::checkFlake2d() const {
  const auto refuse = [](const char* option, const char* problem, const char* hint) {
    throw Error(ErrorCode::usage, "cli.usage", "", option, problem, hint);
  };
  if (values_.kind == SynthKind::flake2d) {
    if (feature_->given())
      refuse("--flake-size", "flake2d takes sizes as its node has them", "give --flake-size-uv: texels / width");
    if (alpha_->given())
      refuse("--alpha", "flake2d takes roughness as its node has it", "give --roughness: the square root of alpha");
    return;
  }
  const char* hint = "take kind flake2d, or leave it out";
  if (flake_size_uv_->given()) refuse("--flake-size-uv", "only flake2d has this option", hint);
  if (roughness_->given()) refuse("--roughness", "only flake2d has this option", hint);
  if (coverage_->given()) refuse("--coverage", "only flake2d has this option", hint);
}

const bake::SynthOptions& SynthOptions::values(Tool& tool) {
  bake::SynthOptions& p = values_;
  checkFlake2d();
  const bake::SynthOptions defaults = bake::defaultSynthOptions(p.kind);
  if (!alpha_->given()) p.alpha = defaults.alpha;
  if (!gamma_->given()) p.gamma = defaults.gamma;
  if (!correlation_->given()) p.correlation_texels = defaults.correlation_texels;
  if (!streak_->given()) p.streak_texels = defaults.streak_texels;
  if (!feature_->given()) p.feature_texels = defaults.feature_texels;
  if (!density_->given()) p.density = defaults.density;
  if (!slope_->given()) p.slope = defaults.slope;
  parseSize(size_, p.width, p.height);
  p.seed = tool.seed();
  if (depth_->given()) {
    if (p.kind == SynthKind::flakes || p.kind == SynthKind::flake2d)
      throw Error(ErrorCode::usage, "cli.usage", "", "--depth-um", "flakes have no common height field", "take another kind");
    p.depth_texels = depth_um_ / texel_size_um_;
  }
  return p;
}

}  // namespace glint::apps
