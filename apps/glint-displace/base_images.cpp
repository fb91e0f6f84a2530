#include "glint-displace/base_images.h"

#include "common/files.h"
#include "common/image_input.h"

namespace glint::apps {
namespace {

constexpr const char* kNoGain = "a surface cannot gain light";

}  // namespace

BaseImages::BaseImages(Tool& tool) : tool_(tool) {
  const Option& color =
      tool.option("--base-color", color_path_,
                  "image of the map's size whose colours multiply the base's reflectance; grey or RGB; colours "
                  "that are multiplied by alpha are divided by it. The albedo of a diffuse base is then 1 unless --base says "
                  "it");
  tool.option(
      "--base-roughness", roughness_path_,
      "image of the map's size whose first channel, linear, multiplies the base's ALPHA: with ggx:1 it is the roughness");
  tool.choice("--color-space", color_space_,
              {{"auto", ColorSpace::automatic}, {"srgb", ColorSpace::srgb}, {"linear", ColorSpace::linear}},
              "how --base-color is coded; auto: linear in floating-point files, else sRGB")
      .needs(color);
  tool.addCheck([this, &tool] {
    for (const std::string& path : {color_path_, roughness_path_}) {
      if (path.empty()) continue;
      checkRegular(path);
      tool.addInput(path);
    }
  });
}

bake::BaseTexture BaseImages::read(int width, int height) const {
  bake::BaseTexture texture;
  if (!roughness_path_.empty()) texture.roughness = readUnitChannel(tool_, roughness_path_, width, height, kNoGain);
  if (color_path_.empty()) return texture;
  const Image image = readInputImage(tool_, color_path_);
  requireSize(color_path_, image, width, height);
  texture.channels = image.channels >= 3 ? 3 : 1;
  texture.colors = channelsOf(image, texture.channels);
  requireUnitRange(color_path_, texture.colors, texture.channels, width, height, kNoGain);
  if (color_space_ == ColorSpace::srgb || (color_space_ == ColorSpace::automatic && !image.floating))
    for (float& value : texture.colors) value = linearFromSrgb(value);
  bool grey = true;
  for (std::size_t k = 0; grey && texture.channels == 3 && k < texture.colors.size(); k += 3)
    grey = texture.colors[k] == texture.colors[k + 1] && texture.colors[k] == texture.colors[k + 2];
  if (!grey || texture.channels == 1) return texture;
  for (std::size_t k = 0; 3 * k < texture.colors.size(); ++k) texture.colors[k] = texture.colors[3 * k];
  texture.colors.resize(texture.colors.size() / 3);
  texture.channels = 1;
  return texture;
}

}  // namespace glint::apps
