#include "glint-bench/result_checks.h"

#include <fmt/format.h>

#include <initializer_list>
#include <map>
#include <utility>
#include <vector>

#include "common/base64.h"

namespace glint::apps {
namespace {

using Json = nlohmann::ordered_json;

/// A part that is there and cannot be right.
struct Fault {
  std::string text;
};

/// The scene and the size of a picture; the scene is empty for NDF images.
using Subject = std::pair<std::string, double>;

/// What measurements are compared with.
struct MapParts {
  std::vector<Subject> images, pictures;
  std::map<Subject, int> pixels;  ///< of pictures
};

/// A member that is a list.
const Json::array_t& listOf(const Json& part, const char* name) { return part.at(name).get_ref<const Json::array_t&>(); }

/// A size of footprints.
double sizeOf(const Json& part) {
  const double size = part.at("sigma_texels").get<double>();
  if (!(size > 0)) throw Fault{fmt::format("has a size of {} texels", size)};
  return size;
}

void readStrings(const Json& part, std::initializer_list<const char*> names) {
  for (const char* name : names) part.at(name).get<std::string>();
}

void readNumbers(const Json& part, std::initializer_list<const char*> names) {
  for (const char* name : names) part.at(name).get<double>();
}

/// NDF images of a map or a measurement.
std::vector<Subject> readImages(const Json::array_t& list) {
  constexpr std::size_t kPixels = 64 * 64;
  std::vector<Subject> subjects;
  for (const Json& image : list) {
    subjects.emplace_back("", sizeOf(image));
    if (image.at("image").get<std::vector<double>>().size() != kPixels)
      throw Fault{fmt::format("has an NDF image that has not {} pixels", kPixels)};
  }
  return subjects;
}

Subject subjectOf(const Json& picture) {
  Subject subject = {picture.at("scene").get<std::string>(), sizeOf(picture)};
  if (subject.first != "plane" && subject.first != "sphere") throw Fault{"has a picture of an unknown scene"};
  return subject;
}

/// The pixels of a square picture, in half precision.
void checkPicture(const Json& picture, int pixels) {
  const std::size_t bytes = std::size_t{2} * static_cast<std::size_t>(pixels) * static_cast<std::size_t>(pixels);
  if (!isBase64(picture.at("picture").get_ref<const std::string&>(), bytes))
    throw Fault{fmt::format("has a picture that is not base64 of {} x {} pixels", pixels, pixels)};
}

MapParts readMap(const Json& map) {
  constexpr int kMostPixels = 1 << 12;
  readStrings(map, {"name", "hash"});
  for (const char* name : {"width", "height"}) map.at(name).get<int>();
  MapParts parts;
  parts.images = readImages(listOf(map, "truth"));
  for (const Json& picture : listOf(map, "pictures")) {
    const Subject subject = subjectOf(picture);
    const int pixels = picture.at("pixels").get<int>();
    if (pixels < 1 || pixels > kMostPixels) throw Fault{fmt::format("has a picture of {0} x {0} pixels", pixels)};
    if (!(picture.at("white").get<double>() > 0)) throw Fault{"has a picture whose white is black"};
    readNumbers(picture, {"black_flip"});
    checkPicture(picture, pixels);
    parts.pictures.push_back(subject);
    parts.pixels[subject] = pixels;
  }
  return parts;
}

void checkSame(const std::vector<Subject>& mine, const std::vector<Subject>& right, const char* what) {
  if (!mine.empty() && mine != right) throw Fault{fmt::format("has {} of other sizes than its map", what)};
}

void readTimes(const Json& times) {
  const Json& density = times.at("density");
  for (const char* name : {"cold", "warm", "batch"}) readNumbers(density.at(name), {"ns"});
  for (const Json& time : listOf(density, "sizes")) {
    sizeOf(time);
    readNumbers(time, {"ns"});
  }
  for (const char* name : {"mean", "sample"}) readNumbers(times.at(name).at("cold"), {"ns"});
}

void readErrors(const Json::array_t& errors, const MapParts& map) {
  std::vector<Subject> round;
  for (const Json& set : errors) {
    readNumbers(set, {"places", "seen", "seen_worst", "bias", "rel_l2", "tv", "energy"});
    (void)set.at("as_asked").get<bool>();
    const double size = sizeOf(set);
    if (set.at("shape").get<std::string>() == "round") round.emplace_back("", size);
  }
  if (!errors.empty() && round != map.images) throw Fault{"has errors of other sizes than its map"};
}

void readPictures(const Json::array_t& pictures, const MapParts& map) {
  std::vector<Subject> subjects;
  for (const Json& picture : pictures) subjects.push_back(subjectOf(picture));
  checkSame(subjects, map.pictures, "pictures");
  for (std::size_t k = 0; k < subjects.size(); ++k) {
    const Json& picture = pictures[k];
    (void)picture.at("as_asked").get<bool>();
    if (picture.contains("given_up_s") && !picture.contains("flip") && !picture.contains("picture")) continue;
    readNumbers(picture, {"rmse", "flip"});
    checkPicture(picture, map.pixels.at(subjects[k]));
  }
}

void readMeasurement(const Json& m, const std::map<std::string, MapParts>& maps) {
  readStrings(m, {"map", "name", "method", "setting", "command", "status"});
  const auto map = maps.find(m.at("map").get<std::string>());
  if (map == maps.end()) throw Fault{"is of a map that is not there"};
  if (m.at("status") != "ok") {
    if (m.contains("message")) readStrings(m, {"message"});
    return;
  }
  readNumbers(m.at("prepare"), {"total_s", "peak_bytes"});
  readNumbers(m, {"file_bytes"});
  readTimes(m.at("times"));
  readErrors(listOf(m, "errors"), map->second);
  checkSame(readImages(listOf(m, "images")), map->second.images, "NDF images");
  readPictures(listOf(m, "pictures"), map->second);
}

}  // namespace

std::string faultOf(const Json& document) {
  std::string part;  // that is read
  try {
    for (const char* name : {"generator", "machine", "seed", "places", "quick"}) (void)document.at(name);
    readStrings(document.at("machine"), {"processor", "system"});
    std::map<std::string, MapParts> maps;
    for (const Json& map : listOf(document, "maps")) {
      part = fmt::format("map {} ", maps.size() + 1);
      if (!maps.emplace(map.at("hash").get<std::string>(), readMap(map)).second) throw Fault{"is there twice"};
    }
    std::size_t count = 0;
    for (const Json& measurement : listOf(document, "measurements")) {
      part = fmt::format("measurement {} ", ++count);
      readMeasurement(measurement, maps);
    }
    return {};
  } catch (const Fault& fault) {
    return part + fault.text;
  } catch (const Json::exception&) {
    return part + "lacks a part of a bench's results";
  }
}

}  // namespace glint::apps
