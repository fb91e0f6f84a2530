#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "glint/bake/displace/base_texture.h"
#include "glint/bake/displace/height_surface.h"
#include "glint/bake/synth/synth.h"

namespace glint::test {

/// A height map and the surface over it.
struct OwnedSurface {
  int width;
  int height;
  std::vector<float> heights;
  bake::HeightSurface surface() const { return {width, height, heights}; }
};

inline OwnedSurface synthSurface(bake::SynthKind kind, int width, int height, float scale = 1) {
  bake::SynthOptions p = bake::defaultSynthOptions(kind);
  p.width = width, p.height = height;
  if (kind == bake::SynthKind::isotropic) p.alpha = 0.5f;
  if (kind == bake::SynthKind::scratches) p.density = 4;
  if (kind == bake::SynthKind::weave) p.feature_texels = 16, p.slope = 1.5f;
  OwnedSurface out{width, height, bake::synthHeights(p)};
  for (float& h : out.heights) h *= scale;
  return out;
}

/// Grooves along y with walls of this slope, `half_width` cells from ridge to valley.
inline OwnedSurface grooves(int width, int height, int half_width, float slope) {
  OwnedSurface out{width, height, std::vector<float>(static_cast<std::size_t>(width) * height)};
  for (std::size_t k = 0; k < out.heights.size(); ++k) {
    const int phase = static_cast<int>(k) % width % (2 * half_width);
    out.heights[k] = slope * static_cast<float>(std::min(phase, 2 * half_width - phase));
  }
  return out;
}

/// Red where the surface faces +x, blue where it faces -x, with a little of the other colours: Wu 2019, Fig. 14.
inline bake::BaseTexture twoColors(const OwnedSurface& map) {
  bake::BaseTexture texture{3, {}, {}};
  const auto surface = map.surface();
  for (int j = 0; j < map.height; ++j) {
    for (int i = 0; i < map.width; ++i) {
      const bool right = surface.at(surface.nextColumn(i), j) < surface.at(i, j);
      for (const float c : {right ? 0.9f : 0.1f, 0.3f, right ? 0.2f : 0.8f}) texture.colors.push_back(c);
    }
  }
  return texture;
}

}  // namespace glint::test
