#pragma once

#include <string>

#include "common/tool.h"
#include "glint/bake/environment.h"

namespace glint::apps {

/// How area lights become an environment.
struct AreaLightOptions {
  int height = 256;  ///< pixels of the latitude-longitude image
  int samples = 4;   ///< rays of a pixel along each axis
};

/// Reads light: a latitude-longitude image of 2:1 (any floating-point format), or area lights from JSON:
///   {"lights": [{"type": "rectangle", "centre": [x, y, z], "axis_u": [..], "axis_v": [..], "radiance": [r, g, b],
///                "texture": "a.exr"},
///               {"type": "sphere", "centre": [..], "radius": r, "radiance": [..], "texture": "b.exr"}]}
/// Half axes and positions are relative to the shading point; textures are optional, and relative to the JSON's folder.
/// Textures of integers are taken as sRGB. Adds the textures to the tool's inputs.
/// @throws Error io; invalid_input if the light cannot be used: not 2:1, pixels that are negative or not finite, ...
bake::Environment readLight(Tool& tool, const std::string& path, const AreaLightOptions& options);

}  // namespace glint::apps
