#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "glint/model/map_slopes.h"

namespace glint::bake {

/// How textures name the two roughnesses of an anisotropic GGX lobe. Roughness is perceptual: the square root of alpha.
enum class LobeConvention : std::uint8_t {
  isotropic,  ///< `roughness` alone: one lobe of the same mean variance, for engines without anisotropy
  /// glTF 2.0 with KHR_materials_anisotropy. `roughness`: of the smaller alpha b. `anisotropy`, three channels: direction of the
  /// larger alpha as 0.5 + 0.5 (cos, sin), and strength s with larger alpha = b + (1 - b) s^2.
  gltf,
  /// MaterialX (roughness_anisotropy, standard surface). `roughness`: of the geometric mean of both alphas. `anisotropy`: 1 - smaller
  /// / larger alpha, of which renderers take at most 0.98. `rotation`: angle of the larger alpha in turns, [0, 0.5).
  materialx,
};

/// The lobe that stands for the slopes of a texel: alpha^2 is twice the variance of slopes, as for Beckmann lobes.
struct GgxLobe {
  float alpha_along = 0;   ///< the larger alpha, at most 1
  float alpha_across = 0;  ///< the smaller alpha
  Vec2 along;              ///< unit vector of the larger alpha; x >= 0
};
GgxLobe ggxLobe(const Covariance& slopes);
/// Whether an alpha that the textures of a convention hold is above 1, so that they hold 1.
bool isLimited(const Covariance& slopes, LobeConvention convention);

/// Pixels of one texture of one level, bottom row first, each in [0, 1].
struct LobeTexture {
  std::string_view name;  ///< "normal", "roughness", ...
  int channels = 0;
  std::vector<float> pixels;  ///< [rows][columns][channels]
};

/// The textures of a level: `normal`, the mean normal, and those of the convention.
/// @param texels  of the level; their covariances include the roughness of the material
std::vector<LobeTexture> lobeTextures(std::span<const MapSlopes> texels, LobeConvention convention);

/// Moments as LEAN mapping filters them, six channels as `maketx --bumpslopes` has them, for a map whose rows are counted downwards:
/// height, dh/ds, dh/dt, (dh/ds)^2, (dh/dt)^2, dh/ds dh/dt, in units of texels.
/// @param heights  of the texels; empty: the map has none, and heights are 0
/// @return [rows][columns][6], bottom row first
std::vector<float> leanChannels(std::span<const MapSlopes> texels, std::span<const float> heights);

}  // namespace glint::bake
