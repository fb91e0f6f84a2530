#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <vector>

#include "glint/bake/displace/height_surface.h"
#include "glint/model/displacement.h"

namespace glint::bake {

/// How the reflectance of a displacement map varies: factors that multiply the base BRDF, for each texel, bottom row first.
struct BaseTexture {
  int channels = 1;              ///< channels of colours: 1, or 3 for linear red, green and blue
  std::vector<float> colors;     ///< [texels][channels], 0 to 1: factors of the reflectance; empty: all 1
  std::vector<float> roughness;  ///< [texels]: factors of the base's alpha (ggx only); empty: all 1
};

/// One number for each channel.
using Color = std::array<float, 3>;

/// The base BRDF of every facet. Colours and roughness are interpolated linearly between texels, as heights are, so a facet has
/// the mean of its corners.
class FacetBase {
 public:
  /// @param channels  of the base itself: 1, or 3 for a coloured table
  FacetBase(const HeightSurface& surface, const BaseBrdf& base, const BaseTexture& texture, int channels = 1)
      : surface_(surface), base_(base), texture_(texture), channels_(std::max(channels, texture.channels)) {}

  const BaseBrdf& base() const { return base_; }
  int channels() const { return channels_; }
  bool colored() const { return !texture_.colors.empty(); }
  bool rough() const { return !texture_.roughness.empty(); }

  /// Colour of a facet: the factor of the base's reflectance, 1 where there are no colours.
  Color color(std::size_t facet) const {
    Color color = {1, 1, 1};
    if (!colored()) return color;
    const auto corners = surface_.cornerTexels(facet);
    const auto count = static_cast<std::size_t>(texture_.channels);
    for (std::size_t c = 0; c < count; ++c) {
      const auto at = [&](std::size_t corner) { return texture_.colors[corners[corner] * count + c]; };
      color[c] = (at(0) + at(1) + at(2)) / 3;
    }
    if (count == 1) color[1] = color[2] = color[0];
    return color;
  }

  /// Alpha of the smoothest texel.
  float leastAlpha() const {
    return base_.alpha * (rough() ? *std::min_element(texture_.roughness.begin(), texture_.roughness.end()) : 1.0f);
  }

  /// The base with the roughness of a facet, without its colour.
  BaseBrdf of(std::size_t facet) const {
    BaseBrdf base = base_;
    if (!rough()) return base;
    float sum = 0;
    for (const std::size_t texel : surface_.cornerTexels(facet)) sum += texture_.roughness[texel];
    base.alpha *= sum / 3;
    return base;
  }

 private:
  HeightSurface surface_;
  const BaseBrdf& base_;
  const BaseTexture& texture_;
  int channels_;
};

}  // namespace glint::bake
