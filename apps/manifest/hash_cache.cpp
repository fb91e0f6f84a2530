#include "manifest/hash_cache.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "glint/formats/hash.h"

namespace glint::apps {

using Json = nlohmann::ordered_json;

HashCache::HashCache(const std::string& path) : lines_(path) {
  for (const Json& line : lines_.readNew()) {
    try {
      known_[line.at("file").get<std::string>()] = {mapStampOf(line), line.at("hash").get<std::string>()};
    } catch (const Json::exception&) {
      // A line of another form: the file is read again.
    }
  }
}

std::string HashCache::hash(const std::string& name, const std::string& file) {
  // The stamp comes first: a file that changes while it is read is read again next time.
  const std::optional<MapStamp> stamp = mapStampOf(file);
  {
    const std::lock_guard lock(mutex_);
    const auto known = known_.find(name);
    if (stamp && known != known_.end() && known->second.stamp == *stamp) return known->second.hash;
  }
  std::string hash = formats::hashFile(file);
  const std::lock_guard lock(mutex_);
  ++read_files_;
  if (stamp) known_[name] = {*stamp, hash}, unsaved_.push_back(name);
  return hash;
}

void HashCache::save() {
  const std::lock_guard lock(mutex_);
  std::vector<Json> lines;
  for (const std::string& name : unsaved_) {
    Json line = {{"file", name}, {"hash", known_.at(name).hash}};
    line.update(stampJson(known_.at(name).stamp));
    lines.push_back(std::move(line));
  }
  lines_.append(lines);
  unsaved_.clear();
}

std::optional<std::string> changedMap(const Manifest& manifest, const ManifestEntry& entry, HashCache& hashes) {
  const auto has_changed = [&](const std::string& input) {
    const auto map = manifest.hash_of_map.find(input);
    if (map == manifest.hash_of_map.end()) return false;
    const std::string file = manifest.at(input);
    return stampOf(file) && hashes.hash(input, file) != map->second;
  };
  for (const std::vector<std::string>* files : {&entry.inputs, &entry.twins}) {
    const auto changed = std::find_if(files->begin(), files->end(), has_changed);
    if (changed != files->end()) return *changed;
  }
  return {};
}

}  // namespace glint::apps
