#include "glint-shlobes/light_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/image_input.h"
#include "common/json_file.h"

namespace glint::apps {
namespace {

using nlohmann::json;

/// Radiance that is multiplied by alpha is what arrives.
const ImageChoice kRadiance = {.alpha = ImageChoice::Alpha::ignore};

/// Linear RGB of an image. Integers are taken as sRGB. Grey images have the same value in red, green and blue.
std::vector<float> linearRgb(const Image& image, const std::string& path) {
  if (image.channels == 2)
    throw Error(ErrorCode::invalid_input, "light.channels", path, "", "has 2 channels",
                "give an image of 1, 3 or more channels");
  const bool grey = image.channels == 1;
  std::vector<float> values = channelsOf(image, grey ? 1 : 3);
  if (!image.floating)
    for (float& value : values) value = linearFromSrgb(value);
  if (!grey) return values;
  std::vector<float> rgb;
  for (const float value : values) rgb.insert(rgb.end(), 3, value);
  return rgb;
}

/// One light of the JSON. Members are taken out one after the other; members that are left in the end are unknown.
class LightReader {
 public:
  LightReader(const json& light, std::size_t index, const std::string& path, Tool& tool)
      : light_(light), place_("light " + std::to_string(index)), path_(path), tool_(tool) {
    if (!light_.is_object()) fail("is no object");
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorCode::invalid_input, "light.json", path_, place_, what,
                "see glint-shlobes --help for the members of a light");
  }

  std::string text(const char* name) const {
    if (!light_.contains(name) || !light_[name].is_string()) fail(std::string("needs a text \"") + name + "\"");
    return light_[name].get<std::string>();
  }
  float number(const char* name) const {
    if (!light_.contains(name) || !light_[name].is_number()) fail(std::string("needs a number \"") + name + "\"");
    return floatOf(light_[name], name);
  }
  Vec3 vector(const char* name) const {
    if (!light_.contains(name) || !light_[name].is_array() || light_[name].size() != 3)
      fail(std::string("needs three numbers \"") + name + "\"");
    for (const json& v : light_[name])
      if (!v.is_number()) fail(std::string("needs three numbers \"") + name + "\"");
    return {floatOf(light_[name][0], name), floatOf(light_[name][1], name), floatOf(light_[name][2], name)};
  }
  void allowOnly(std::initializer_list<const char*> names) const {
    for (const auto& [key, value] : light_.items())
      if (std::find(names.begin(), names.end(), key) == names.end()) fail("has an unknown member \"" + key + "\"");
  }
  template <class Light>
  void readSurface(Light& light) const {
    const Vec3 radiance = vector("radiance");
    light.radiance[0] = radiance.x, light.radiance[1] = radiance.y, light.radiance[2] = radiance.z;
    if (!light_.contains("texture")) return;
    const std::string texture = (std::filesystem::path(path_).parent_path() / text("texture")).string();
    const Image image = readInputImage(tool_, texture, kRadiance);
    tool_.addInput(texture);
    light.texture_width = image.width;
    light.texture_height = image.height;
    light.texture = linearRgb(image, texture);
  }

 private:
  float floatOf(const json& value, const char* name) const {
    const auto number = value.get<double>();
    if (!(std::fabs(number) <= std::numeric_limits<float>::max()))
      fail(std::string("has a number too large in \"") + name + "\"");
    return static_cast<float>(number);
  }

  const json& light_;
  std::string place_;
  const std::string& path_;
  Tool& tool_;
};

bake::Environment readAreaLights(Tool& tool, const std::string& path, const AreaLightOptions& options) {
  const json document = readJsonFile(path, "light.json");
  if (!document.is_object() || !document.contains("lights") || !document["lights"].is_array() || document.size() != 1)
    throw Error(ErrorCode::invalid_input, "light.json", path, "", "is no JSON object with a list \"lights\" alone",
                "write {\"lights\": [...]}");
  std::vector<bake::RectangleLight> rectangles;
  std::vector<bake::SphereLight> spheres;
  for (std::size_t k = 0; k < document["lights"].size(); ++k) {
    const LightReader reader(document["lights"][k], k, path, tool);
    const std::string type = reader.text("type");
    if (type == "rectangle") {
      reader.allowOnly({"type", "centre", "axis_u", "axis_v", "radiance", "texture"});
      bake::RectangleLight& light = rectangles.emplace_back();
      light.centre = reader.vector("centre");
      light.axis_u = reader.vector("axis_u");
      light.axis_v = reader.vector("axis_v");
      reader.readSurface(light);
      if (!bake::facesOrigin(light))
        tool.warn(path + ": light " + std::to_string(k) +
                  " faces away from the shading point, which sees nothing of it: a rectangle emits to the side of axis_u x "
                  "axis_v; negate one of them");
    } else if (type == "sphere") {
      reader.allowOnly({"type", "centre", "radius", "radiance", "texture"});
      bake::SphereLight& light = spheres.emplace_back();
      light.centre = reader.vector("centre");
      light.radius = reader.number("radius");
      reader.readSurface(light);
    } else {
      reader.fail("is of type \"" + type + "\", which is not rectangle or sphere");
    }
  }
  return bake::renderAreaLights(rectangles, spheres, options.height, options.samples);
}

bake::Environment readEnvironment(Tool& tool, const std::string& path) {
  const Image image = readInputImage(tool, path, kRadiance);
  if (!image.floating)
    throw Error(ErrorCode::invalid_input, "light.range", path, "", "holds integers, which cut off bright light",
                "give an image of floating-point radiance, such as .exr or .hdr");
  bake::Environment environment{image.width, image.height, linearRgb(image, path)};
  bake::requireUsable(environment, path);
  return environment;
}

}  // namespace

bake::Environment readLight(Tool& tool, const std::string& path, const AreaLightOptions& options) {
  const bool of_areas = std::filesystem::path(path).extension() == ".json";
  bake::Environment environment = of_areas ? readAreaLights(tool, path, options) : readEnvironment(tool, path);
  if (!bake::hasLightAbove(environment))
    tool.warn(path + ": no light comes from above the surface (z > 0), so that the table is black");
  return environment;
}

}  // namespace glint::apps
