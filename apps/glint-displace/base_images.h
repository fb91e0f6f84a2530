#pragma once

#include <cstdint>
#include <string>

#include "common/tool.h"
#include "glint/bake/displace/base_texture.h"

namespace glint::apps {

/// Mix-in: images of how the base varies over the map (--base-color, --base-roughness, --color-space).
class BaseImages {
 public:
  explicit BaseImages(Tool& tool);

  bool colored() const { return !color_path_.empty(); }

  /// Reads the images; colours become linear, and one channel if they are all grey.
  /// @param width, height  of the heights
  /// @throws Error invalid_input if an image has another size, pixels missing or transparent, or values that are not finite or
  ///         outside 0..1
  bake::BaseTexture read(int width, int height) const;

 private:
  enum class ColorSpace : std::uint8_t { automatic, srgb, linear };

  Tool& tool_;
  std::string color_path_, roughness_path_;
  ColorSpace color_space_ = ColorSpace::automatic;
};

}  // namespace glint::apps
