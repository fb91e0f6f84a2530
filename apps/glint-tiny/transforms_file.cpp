#include "glint-tiny/transforms_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "common/json_file.h"
#include "glint/math/gaussian.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

using nlohmann::json;

constexpr const char* kForm = "see glint-tiny --help for the members of the file";

class TransformsReader {
 public:
  explicit TransformsReader(const std::string& path) : path_(path) {
    document_ = readJsonFile(path, "tiny.transforms_file");
    if (!document_.is_object()) fail("", "is no JSON object");
  }

  [[noreturn]] void fail(const std::string& member, const std::string& what, const std::string& remedy = kForm) const {
    throw Error(ErrorCode::invalid_input, "tiny.transforms_file", path_, member, what, remedy);
  }

  bool has(const char* name) const { return document_.contains(name); }
  void allowOnly(std::initializer_list<const char*> names) const {
    for (const auto& [key, value] : document_.items()) {
      const bool known = std::find(names.begin(), names.end(), key) != names.end();
      if (!known) fail(key, "is no member of the transforms of this mode");
    }
  }

  /// Numbers of a list of so many.
  std::vector<float> list(const json& value, const std::string& name, std::size_t count) const {
    if (!value.is_array() || value.size() != count) fail(name, fmt::format("is no list of {} numbers", count));
    std::vector<float> numbers;
    for (const json& number : value) numbers.push_back(numberOf(number, name));
    return numbers;
  }
  std::vector<float> list(const char* name, std::size_t count) const { return list(document_[name], name, count); }
  const json& at(const char* name) const { return document_[name]; }

  /// Reads a number or a range, where the file has it.
  /// @param low, high  that numbers may have
  void range(const char* name, float low, float high, TinyRange& range) const {
    if (!has(name)) return;
    if (document_[name].is_array()) {
      const std::vector<float> ends = list(name, 2);
      range = {ends[0], ends[1]};
      if (!(range.low <= range.high)) fail(name, "is a range whose first number is the larger one", "write [low, high]");
    } else {
      range.low = range.high = numberOf(document_[name], name);
    }
    if (range.low >= low && range.high <= high) return;
    fail(name, "is out of range", fmt::format("give numbers from {:g} to {:g}", low, high));
  }
  /// Reads a number, where the file has it.
  void number(const char* name, float low, float high, float& value) const {
    TinyRange both = {value, value};
    range(name, low, high, both);
    if (both.low != both.high) fail(name, "is a range, and tiled examples have one transform", "give one number");
    value = both.low;
  }

 private:
  float numberOf(const json& value, const std::string& name) const {
    if (!value.is_number()) fail(name, "holds something that is no number");
    const double number = value.get<double>();
    constexpr double kMost = 1e6;
    if (!(std::fabs(number) <= kMost)) fail(name, "holds a number beyond 1e6");
    return static_cast<float>(number);
  }

  std::string path_;
  json document_;
};

constexpr float kMostFactor = 64, kMostDegrees = 36000;
constexpr float kDegree = kPi / 180;

/// What both modes have.
void readShapes(const TransformsReader& reader, TinyTransforms& t) {
  reader.range("scale", 1 / kMostFactor, kMostFactor, t.scale);
  reader.range("stretch", 1 / kMostFactor, kMostFactor, t.stretch);
  reader.range("shear", -kMostFactor, kMostFactor, t.shear);
  TinyRange degrees = {t.rotation_rad.low / kDegree, t.rotation_rad.high / kDegree};
  reader.range("rotation_deg", -kMostDegrees, kMostDegrees, degrees);
  t.rotation_rad = {degrees.low * kDegree, degrees.high * kDegree};
  reader.range("heights", 1 / kMostFactor, kMostFactor, t.heights);
}

void readTiled(const TransformsReader& reader, bake::TinyOptions& options) {
  reader.allowOnly({"matrix", "scale", "stretch", "shear", "rotation_deg", "mirror", "heights", "offset"});
  reader.number("heights", 1 / kMostFactor, kMostFactor, options.heights);
  if (reader.has("offset")) {
    const std::vector<float> offset = reader.list("offset", 2);
    options.offset = {offset[0], offset[1]};
  }
  if (reader.has("matrix")) {
    for (const char* name : {"scale", "stretch", "shear", "rotation_deg", "mirror"})
      if (reader.has(name)) reader.fail(name, "comes beside a matrix, which is the whole transform", "leave one of them out");
    const json& rows = reader.at("matrix");
    if (!rows.is_array() || rows.size() != 2) reader.fail("matrix", "is no list of two rows");
    const std::vector<float> x = reader.list(rows[0], "matrix", 2), y = reader.list(rows[1], "matrix", 2);
    options.matrix = {x[0], x[1], y[0], y[1]};
    return;
  }
  float scale = 1, stretch = 1, shear = 0, degrees = 0, mirror = 0;
  reader.number("scale", 1 / kMostFactor, kMostFactor, scale);
  reader.number("stretch", 1 / kMostFactor, kMostFactor, stretch);
  reader.number("shear", -kMostFactor, kMostFactor, shear);
  reader.number("rotation_deg", -kMostDegrees, kMostDegrees, degrees);
  reader.number("mirror", 0, 1, mirror);
  if (mirror != 0 && mirror != 1) reader.fail("mirror", "is a share, and tiled examples have one transform", "give 0 or 1");
  options.matrix = transformMatrix({scale, stretch, shear, degrees * kDegree, mirror == 1});
}

}  // namespace

void readTransforms(const std::string& path, bake::TinyOptions& options) {
  const TransformsReader reader(path);
  if (options.mode == TinyMode::tiled) return readTiled(reader, options);
  reader.allowOnly({"scale", "stretch", "shear", "rotation_deg", "mirror", "heights"});
  readShapes(reader, options.transforms);
  TinyRange mirror = {options.transforms.mirror, options.transforms.mirror};
  reader.range("mirror", 0, 1, mirror);
  if (mirror.low != mirror.high) reader.fail("mirror", "is a range, not a share of the examples", "give one number, 0 to 1");
  options.transforms.mirror = mirror.low;
}

}  // namespace glint::apps
