#include "common/image_input.h"

#include <fmt/format.h>

#include "common/image_formats.h"
#include "common/name_list.h"
#include "glint/model/texel_name.h"

namespace glint::apps {

void ImageOptions::declare(Tool& tool) {
  choice_.has_options = true;
  using Window = ImageChoice::Window;
  using Alpha = ImageChoice::Alpha;
  tool.option("--subimage", choice_.part, "number, from 0, or name of one of several images in the file (parts, pages)")
      .defaultText("0, with a warning that names the others");
  tool.option("--layer", choice_.layer,
              "channels whose names start with this and a point, or the image of this name, in the first image that has them")
      .defaultText("the layer of the first channel, with a warning that names the others");
  tool.option("--channels", choice_.channels,
              "what to read, in order: letters of r g b a (rg, ag, ...) or names with commas between them. Two channels of a "
              "normal map are x and y; channels that are named are taken at their word")
      .defaultText("all");
  tool.choice("--alpha", choice_.alpha, {{"auto", Alpha::automatic}, {"divide", Alpha::divide}, {"ignore", Alpha::ignore}},
              "colours that are multiplied by alpha are divided by it; auto: where the file says so");
  tool.choice("--window", choice_.window, {{"display", Window::display}, {"data", Window::data}},
              "display: the image as it is shown; data: the pixels that the file stores");
}

Image readInputImage(Tool& tool, const std::string& path, const ImageChoice& choice) {
  const char* remedy =
      choice.has_options ? "choose with --subimage or --layer" : "export the one that is meant to a file of its own";
  Image image = readImage(path, choice);
  for (const std::string& note : image.notes) tool.warn(path + ": " + note);
  // The first image of a PSD is all of its layers together, as it is shown.
  if (image.parts.size() > 1 && choice.part.empty() && choice.layer.empty() && image.format != "psd") {
    tool.warn(fmt::format("{}: holds {} images, of which the first was read: {}; {}", path, image.parts.size(),
                          partList(image.parts), remedy));
  }
  if (image.layers.size() > 1 && choice.layer.empty()) {
    const auto label = [](std::size_t, const std::string& name) { return name.empty() ? "the one without a name" : name; };
    tool.warn(fmt::format("{}: holds {} layers, of which the first was read: {}; {}", path, image.layers.size(),
                          nameList(image.layers, label), remedy));
  }
  return image;
}

void requireSize(const std::string& path, const Image& image, int width, int height) {
  if (image.width == width && image.height == height) return;
  throw Error(ErrorCode::invalid_input, "image.size", path, "",
              fmt::format("the image has {} x {} pixels, the map {} x {} texels", image.width, image.height, width, height),
              "resample it to the size of the map");
}

void requireUnitRange(const std::string& path, const std::vector<float>& values, int channels, int width, int height,
                      const std::string& reason) {
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (values[k] >= 0 && values[k] <= 1) continue;
    throw Error(ErrorCode::invalid_input, "image.range", path, texelName(width, height, k / static_cast<std::size_t>(channels)),
                fmt::format("the value {} is not in 0..1", values[k]), "scale the image to 0..1: " + reason);
  }
}

std::vector<float> readUnitChannel(Tool& tool, const std::string& path, int width, int height, const std::string& reason) {
  const Image image = readInputImage(tool, path);
  requireSize(path, image, width, height);
  std::vector<float> values = channelsOf(image, 1);
  requireUnitRange(path, values, 1, width, height, reason);
  return values;
}

}  // namespace glint::apps
