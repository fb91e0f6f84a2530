#include "glint/bake/synth/synth.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "glint/bake/common/slopes.h"
#include "glint/bake/synth/kinds.h"
#include "glint/model/error.h"

namespace glint::bake {
namespace {

constexpr int kMaxSize = 65536;

void require(bool holds, const char* parameter, const char* range) {
  if (!holds) throw Error(ErrorCode::usage, "synth.range", "", parameter, std::string("is not ") + range, "see the help text");
}

/// Refuses scratches that take long and do not show: wider than the map, so that they wrap around it many times, or so many and
/// so wide that a great number lie on each texel.
void checkScratches(const SynthOptions& p) {
  constexpr int kSureWidth = 64;        // width, in texels, that is allowed on any map
  constexpr float kMeanLength = 128;    // about the mean length of a scratch, in texels
  constexpr double kMostLayers = 1024;  // largest mean number of scratches on a texel
  const int widest = std::max(kSureWidth, std::min(p.width, p.height));
  if (p.feature_texels > static_cast<float>(widest))
    throw Error(ErrorCode::usage, "synth.range", "", "feature size",
                fmt::format("scratches of {:g} texels are wider than the map", p.feature_texels),
                fmt::format("give --flake-size of at most {}", widest));
  const double layers = double{p.density} * p.feature_texels * (p.feature_texels + kMeanLength) / (64 * 64);
  if (layers > kMostLayers)
    throw Error(ErrorCode::usage, "synth.range", "", "density", fmt::format("{:.0f} scratches would lie on each texel", layers),
                fmt::format("give --density of at most {:g}, or a smaller --flake-size",
                            std::floor(1e3 * p.density * kMostLayers / layers) / 1e3));
}

void check(const SynthOptions& p) {
  require(p.width >= 1 && p.width <= kMaxSize && p.height >= 1 && p.height <= kMaxSize, "size", "1 to 65536 texels");
  require(p.alpha >= 0 && p.alpha <= 2, "alpha", "0 to 2");
  require(p.kind != SynthKind::flakes || (p.alpha >= 1e-4f && p.alpha <= 0.999f), "alpha", "0.0001 to 0.999 for flakes");
  require(p.gamma >= 0.1f && p.gamma <= 20, "gamma", "0.1 to 20");
  require(p.correlation_texels >= 0 && p.correlation_texels <= kMaxSize, "correlation", "0 to 65536 texels");
  require(p.streak_texels >= 0 && p.streak_texels <= kMaxSize, "streak", "0 to 65536 texels");
  require(p.feature_texels >= 1 && p.feature_texels <= kMaxSize, "feature size", "1 to 65536 texels");
  require(p.density > 0 && p.density <= 64, "density", "more than 0, at most 64");
  require(p.slope >= 0 && p.slope <= 10, "slope", "0 to 10");
  require(p.depth_texels >= 0 && p.depth_texels <= kMaxSize, "depth", "0 to 65536 texels");
  require(p.flake_size_uv >= 1e-5f && p.flake_size_uv <= 1, "flake size", "1e-05 to 1 widths of the map");
  require(p.roughness >= 0 && p.roughness <= 1, "roughness", "0 to 1");
  require(p.coverage >= 0 && p.coverage <= 1, "coverage", "0 to 1");
  if (p.kind == SynthKind::scratches) checkScratches(p);
}

void scale(std::vector<float>& heights, double factor) {
  for (float& h : heights) h = static_cast<float>(h * factor);
}

/// Whether the noise of a kind is stretched along u.
bool hasStreaks(SynthKind kind) {
  return kind == SynthKind::brushed || kind == SynthKind::anisotropic || kind == SynthKind::wood;
}

/// Makes noise whose slopes have the variance of the options. A map too small to have slopes (1 or 2 texels) is flat.
std::vector<float> scaledNoise(const SynthOptions& p) {
  const bool streaks = hasStreaks(p.kind);
  std::vector<float> heights = noiseHeights(p, streaks ? p.streak_texels : p.correlation_texels, p.correlation_texels);
  const SlopeVariances moments = slopeVariances(p.width, p.height, heights);
  const double variance = streaks ? moments.variance_y : 0.5 * (moments.variance_x + moments.variance_y);
  scale(heights, variance > 0 ? p.alpha / std::sqrt(2 * variance) : 0);
  return heights;
}

/// Scales heights to a distance from the lowest to the highest; 0 leaves them as they are. A flat map stays flat.
void scaleToDepth(std::vector<float>& heights, float depth_texels) {
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  const double depth = double{*high} - *low;
  if (depth_texels > 0 && depth > 0) scale(heights, depth_texels / depth);
}

std::vector<float> pattern(const SynthOptions& p) {
  switch (p.kind) {
    case SynthKind::scratches:
      return scratchHeights(p);
    case SynthKind::leather:
      return leatherHeights(p);
    case SynthKind::weave:
      return weaveHeights(p);
    case SynthKind::twill:
      return twillHeights(p);
    case SynthKind::silk:
      return silkHeights(p);
    case SynthKind::bumps:
      return bumpHeights(p);
    case SynthKind::scales:
      return scaleHeights(p);
    case SynthKind::structured:
      return structuredHeights(p);
    case SynthKind::relief:
      return reliefHeights(p);
    case SynthKind::wood:
      return woodHeights(p);
    case SynthKind::sawtooth:
      return sawtoothHeights(p);
    case SynthKind::grating:
      return gratingHeights(p);
    default:
      return std::vector<float>(static_cast<std::size_t>(p.width) * p.height, 0.0f);
  }
}

/// The pattern, and noise on it.
std::vector<float> patternHeights(const SynthOptions& p) {
  std::vector<float> heights = pattern(p);
  const float steepest = slopeVariances(p.width, p.height, heights).steepest;
  // A pattern that is finer than texels is the same at all of them, but for rounding.
  constexpr float kRounding = 1e-5f;
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  const bool flat = steepest <= kRounding * std::max(std::abs(*low), std::abs(*high));
  scale(heights, flat ? 0 : p.slope / steepest);
  if (p.alpha > 0 && p.kind != SynthKind::flat) {
    const std::vector<float> noise = scaledNoise(p);
    for (std::size_t i = 0; i < heights.size(); ++i) heights[i] += noise[i];
  }
  return heights;
}

}  // namespace

SynthOptions defaultSynthOptions(SynthKind kind) {
  SynthOptions p;
  p.kind = kind;
  switch (kind) {
    case SynthKind::isotropic:
      break;
    case SynthKind::brushed:
      p.alpha = 0.15f, p.correlation_texels = 2;
      break;
    case SynthKind::flakes:
      p.alpha = 0.15f;
      break;
    case SynthKind::scratches:
      p.alpha = 0.01f, p.feature_texels = 4;
      break;
    case SynthKind::leather:
      p.alpha = 0.05f, p.feature_texels = 32;
      break;
    case SynthKind::weave:
      p.alpha = 0.03f, p.feature_texels = 32, p.slope = 2;
      break;
    case SynthKind::twill:
      p.alpha = 0.03f, p.feature_texels = 16, p.slope = 2;
      break;
    case SynthKind::silk:
      p.alpha = 0.02f, p.feature_texels = 8, p.slope = 1;
      break;
    case SynthKind::bumps:
      p.alpha = 0.02f, p.feature_texels = 32, p.slope = 1;
      break;
    case SynthKind::scales:
      p.alpha = 0.02f, p.feature_texels = 48, p.slope = 2;
      break;
    case SynthKind::structured:
      p.alpha = 0.02f, p.feature_texels = 32, p.slope = 0.6f;
      break;
    case SynthKind::relief:
      p.alpha = 0.03f, p.feature_texels = 64, p.slope = 1;
      break;
    case SynthKind::wood:
      p.alpha = 0.08f, p.correlation_texels = 2, p.feature_texels = 32, p.slope = 0.4f;
      break;
    case SynthKind::anisotropic:
      p.alpha = 0.15f, p.streak_texels = 16;
      break;
    case SynthKind::sawtooth:
      p.alpha = 0, p.feature_texels = 16;
      break;
    case SynthKind::grating:
      p.alpha = 0, p.feature_texels = 16, p.slope = 0.1f;
      break;
    case SynthKind::flat:
    case SynthKind::flake2d:
      p.alpha = 0;
      break;
  }
  return p;
}

std::vector<float> synthHeights(const SynthOptions& p) {
  check(p);
  if (p.kind == SynthKind::flakes || p.kind == SynthKind::flake2d) {
    throw Error(ErrorCode::unsupported, "synth.flakes_height", "", "",
                "flakes are separate facets without a common height field", "make their normals instead, or another kind");
  }
  const bool noise_alone = p.kind == SynthKind::isotropic || p.kind == SynthKind::anisotropic || p.kind == SynthKind::brushed;
  std::vector<float> heights = noise_alone ? scaledNoise(p) : patternHeights(p);
  scaleToDepth(heights, p.depth_texels);
  return heights;
}

std::vector<Vec2> synthNormals(const SynthOptions& p) {
  check(p);
  if (p.kind == SynthKind::flakes) return flakeNormals(p);
  if (p.kind == SynthKind::flake2d) return flake2dNormals(p);
  return normalsFromHeights(p.width, p.height, synthHeights(p));
}

std::vector<float> synthPresence(const SynthOptions& p) {
  check(p);
  if (p.kind != SynthKind::flake2d)
    throw Error(ErrorCode::usage, "synth.presence", "", "presence", "only flake2d says which texels have a flake",
                "make a map of flake2d");
  return flake2dPresence(p);
}

}  // namespace glint::bake
