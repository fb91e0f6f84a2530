#include "common/image_input.h"

#include <fmt/format.h>

#include "common/image_formats.h"
#include "common/name_list.h"

namespace glint::apps {

void ImageOptions::declare(Tool& tool) {
  choice_.has_options = true;
  using Window = ImageChoice::Window;
  using Alpha = ImageChoice::Alpha;
  tool.option("--subimage", choice_.part, "number, from 0, or name of one of several images in the file (parts, pages)")
      .defaultText("0, with a warning that names the others");
  tool.option("--layer", choice_.layer, "channels whose names start with this and a point")
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
  if (image.parts.size() > 1 && choice.part.empty() && image.format != "psd") {
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

}  // namespace glint::apps
