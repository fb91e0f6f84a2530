#include "manifest/manifest.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string_view>
#include <unordered_set>

#include "common/json_file.h"
#include "glint/formats/hash.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using Read = nlohmann::json;

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

ManifestEntry entryOf(const Read& json) {
  using Texts = std::vector<std::string>;
  return {json.at("key").get<std::string>(), json.at("output").get<std::string>(), json.at("links").get<Texts>(),
          json.at("twins").get<Texts>(),     json.at("command").get<Texts>(),      json.at("inputs").get<Texts>(),
          json.at("after").get<Texts>()};
}

Json entryJson(const ManifestEntry& entry) {
  return {{"key", entry.key},         {"output", entry.output}, {"links", entry.links}, {"twins", entry.twins},
          {"command", entry.command}, {"inputs", entry.inputs}, {"after", entry.after}};
}

/// Ending of a file's name, in small letters: some readers of images go by it.
std::string endingOf(const std::string& file) {
  std::string ending = fs::path(file).extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

/// Throws if two entries would make one file.
void checkOutputs(const Manifest& manifest) {
  std::unordered_set<std::string> names;
  const auto claim = [&](const std::string& name) {
    if (!names.insert(name).second) refuse(manifest.path, "two entries make " + name);
  };
  for (const ManifestEntry& entry : manifest.entries) {
    claim(entry.output);
    for (const std::string& link : entry.links) claim(link);
  }
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
  const Read json = readJsonOrNothing(path);
  if (!json.is_object() || json.value("schema", Read()) != kForm) refuse(path, std::string("is no \"") + kForm + "\"");
  Manifest manifest;
  manifest.path = path;
  manifest.folder = manifestFolder(path);
  try {
    manifest.generator = json.at("generator").get<std::string>();
    for (const Read& map : json.at("maps"))
      manifest.maps.push_back({map.at("file").get<std::string>(), map.at("hash").get<std::string>()});
    for (const Read& entry : json.at("entries")) manifest.entries.push_back(entryOf(entry));
  } catch (const Read::exception&) {
    refuse(path, "lacks a part of a manifest");
  }
  manifest.index();
  checkEntries(manifest);
  checkOutputs(manifest);
  return manifest;
}

std::string keyOf(const std::string& generator, const ManifestEntry& entry,
                  const std::function<std::string(const std::string&)>& source_of) {
  // Files stand in the key as what they hold, not as how they are named.
  Json words = Json::array({generator});
  for (const std::string& word : entry.command) {
    if (word == entry.output)
      words.push_back({{"output", true}});
    else if (std::find(entry.inputs.begin(), entry.inputs.end(), word) != entry.inputs.end())
      words.push_back({{"input", source_of(word)}});
    else
      words.push_back(word);
  }
  const std::string text = words.dump(-1, ' ', false, Json::error_handler_t::replace);
  return formats::hashBytes(text.data(), text.size());
}

std::string sourceOfMap(const std::string& file, const std::string& hash) { return hash + endingOf(file); }

void requireKeys(const Manifest& manifest) {
  std::unordered_map<std::string, std::string> maker_of;  // output -> key
  const auto source_of = [&](const std::string& file) {
    if (const auto maker = maker_of.find(file); maker != maker_of.end()) return maker->second;
    const auto map = manifest.hash_of_map.find(file);
    return map == manifest.hash_of_map.end() ? std::string() : sourceOfMap(file, map->second);
  };
  for (const ManifestEntry& entry : manifest.entries) {
    std::vector<std::string> after;
    for (const std::string& input : entry.inputs)
      if (const auto maker = maker_of.find(input); maker != maker_of.end()) after.push_back(maker->second);
    const bool names_output = std::find(entry.command.begin(), entry.command.end(), entry.output) != entry.command.end();
    if (!names_output || after != entry.after || keyOf(manifest.generator, entry, source_of) != entry.key)
      refuse(manifest.path, "entry " + entry.key + " (" + entry.output + ") was changed by hand; plan again");
    maker_of.emplace(entry.output, entry.key);
  }
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
