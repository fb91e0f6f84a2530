#include "manifest/manifest.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>

#include "common/files.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr const char* kForm = "glint-farm manifest 1";

[[noreturn]] void refuse(const std::string& path, const std::string& what) {
  throw Error(ErrorCode::invalid_input, "farm.manifest", path, "", what, "make it with glint-farm plan FOLDER -o FILE");
}

/// Programs of this package are named by letters behind glint-, so that a manifest starts nothing else.
bool isProgram(std::string_view name) {
  constexpr std::string_view kPrefix = "glint-";
  return name.starts_with(kPrefix) && name.size() > kPrefix.size() &&
         std::all_of(name.begin() + kPrefix.size(), name.end(), [](char c) { return c >= 'a' && c <= 'z'; });
}

ManifestEntry entryOf(const Json& json) {
  using Texts = std::vector<std::string>;
  return {json.at("key").get<std::string>(), json.at("output").get<std::string>(), json.at("links").get<Texts>(),
          json.at("twins").get<Texts>(),     json.at("command").get<Texts>(),      json.at("inputs").get<Texts>(),
          json.at("after").get<Texts>()};
}

Json entryJson(const ManifestEntry& entry) {
  return {{"key", entry.key},         {"output", entry.output}, {"links", entry.links}, {"twins", entry.twins},
          {"command", entry.command}, {"inputs", entry.inputs}, {"after", entry.after}};
}

Json parse(const std::string& path) {
  const std::vector<std::byte> bytes = readFile(path);
  const auto* text = reinterpret_cast<const char*>(bytes.data());
  return Json::parse(text, text + bytes.size(), nullptr, false);
}

/// Throws unless every entry comes after those that it needs, so that there are no circles.
void checkEntries(const Manifest& manifest) {
  for (std::size_t k = 0; k < manifest.entries.size(); ++k) {
    const ManifestEntry& entry = manifest.entries[k];
    if (entry.command.empty() || !isProgram(entry.command.front()))
      refuse(manifest.path, "entry " + entry.key + " runs no program of glint");
    if (manifest.entry_of_key.at(entry.key) != k) refuse(manifest.path, "two entries have the key " + entry.key);
    for (const std::string& key : entry.after) {
      const auto needed = manifest.entry_of_key.find(key);
      if (needed == manifest.entry_of_key.end() || needed->second >= k)
        refuse(manifest.path, "entry " + entry.key + " needs " + key + ", which does not come before it");
    }
  }
}

}  // namespace

std::string manifestFolder(const std::string& path) {
  const std::string folder = fs::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

std::string Manifest::at(const std::string& file) const {
  return folder == "." || fs::path(file).is_absolute() ? file : folder + "/" + file;
}

void Manifest::index() {
  for (std::size_t k = 0; k < entries.size(); ++k) entry_of_key.emplace(entries[k].key, k);
  for (const ManifestMap& map : maps) hash_of_map.emplace(map.file, map.hash);
}

Manifest readManifest(const std::string& path) {
  const Json json = parse(path);
  if (!json.is_object() || json.value("schema", Json()) != kForm) refuse(path, std::string("is no \"") + kForm + "\"");
  Manifest manifest;
  manifest.path = path;
  manifest.folder = manifestFolder(path);
  try {
    manifest.generator = json.at("generator").get<std::string>();
    for (const Json& map : json.at("maps"))
      manifest.maps.push_back({map.at("file").get<std::string>(), map.at("hash").get<std::string>()});
    for (const Json& entry : json.at("entries")) manifest.entries.push_back(entryOf(entry));
  } catch (const Json::exception&) {
    refuse(path, "lacks a part of a manifest");
  }
  manifest.index();
  checkEntries(manifest);
  return manifest;
}

std::string manifestText(const Manifest& manifest) {
  Json maps = Json::array(), entries = Json::array();
  for (const ManifestMap& map : manifest.maps) maps.push_back({{"file", map.file}, {"hash", map.hash}});
  for (const ManifestEntry& entry : manifest.entries) entries.push_back(entryJson(entry));
  const Json json = {
      {"schema", kForm}, {"generator", manifest.generator}, {"maps", std::move(maps)}, {"entries", std::move(entries)}};
  return json.dump(1) + "\n";
}

}  // namespace glint::apps
