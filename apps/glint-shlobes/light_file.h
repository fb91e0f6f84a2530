#pragma once

#include <string>

#include "common/tool.h"
#include "glint/bake/sh/environment.h"

namespace glint::apps {

/// How area lights become an environment.
struct AreaLightOptions {
  int height = 256;  ///< pixels of the latitude-longitude image
  int samples = 4;   ///< rays of a pixel along each axis
};

/// The form of a file of area lights, for the help text.
inline constexpr const char* kAreaLightNotes =
    "Area lights (.json):\n"
    "  {\"lights\": [{\"type\": \"rectangle\", \"centre\": [0, 1, 3], \"axis_u\": [1, 0, 0], \"axis_v\": [0, -0.5, 0],\n"
    "               \"radiance\": [5, 5, 4], \"texture\": \"window.exr\"},\n"
    "              {\"type\": \"sphere\", \"centre\": [-2, 0, 2], \"radius\": 0.4, \"radiance\": [9, 9, 9]}]}\n"
    "  Centres and half axes are relative to the shading point, z out of the surface. A rectangle emits to one side, that of\n"
    "  axis_u x axis_v: negate one of them to turn it round. A sphere emits outwards. Textures are optional, scale the\n"
    "  radiance, and lie relative to the JSON; those of integers are taken as sRGB.";

/// Reads light: a latitude-longitude image of 2:1 (any floating-point format), or area lights from JSON (kAreaLightNotes). Adds
/// the textures to the tool's inputs. Warns of rectangles that face away, and where no light comes from above the surface.
/// @throws Error io; invalid_input if the light cannot be used: not 2:1, pixels that are negative or not finite, ...
bake::Environment readLight(Tool& tool, const std::string& path, const AreaLightOptions& options);

}  // namespace glint::apps
