#include "manifest/entry_records.h"

#include <algorithm>

namespace glint::apps {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> filesOf(const ManifestEntry& entry) {
  std::vector<std::string> files = {entry.output};
  files.insert(files.end(), entry.links.begin(), entry.links.end());
  return files;
}

/// Throws a Json::exception unless the members of a line that others read have their types.
void requireForm(const Json& line) {
  (void)line.value("status", std::string());
  for (const char* number : {"wall_s", "cpu_s", "peak_bytes"}) (void)line.value(number, 0.0);
  const Json error = line.value("error", Json::object());
  for (const char* text : {"rule", "message"}) (void)error.value(text, std::string());
}

}  // namespace

EntryRecords::EntryRecords(const Manifest& manifest) : manifest_(manifest), lines_(manifest.logPath()) { refresh(); }

void EntryRecords::refresh() {
  const std::lock_guard lock(mutex_);
  for (const Json& line : lines_.readNew()) take(line);
}

void EntryRecords::take(const Json& line) {
  try {
    requireForm(line);
    const auto key = line.at("key").get<std::string>();
    std::vector<std::pair<std::string, FileStamp>> files;
    for (const Json& file : line.value("files", Json::array()))
      files.emplace_back(file.at("file").get<std::string>(), stampOf(file));
    for (const auto& [file, stamp] : files) files_[file] = {key, stamp};
    last_[key] = line;
  } catch (const Json::exception&) {
    // A line of another form says nothing: the tool looks at the asset.
  }
}

EntryState EntryRecords::stateOf(const ManifestEntry& entry) const {
  EntryState state = EntryState::done;
  const std::lock_guard lock(mutex_);
  for (const std::string& file : filesOf(entry)) {
    const auto stamp = stampOf(manifest_.at(file));
    const auto recorded = files_.find(file);
    const bool known = recorded != files_.end() && recorded->second.key == entry.key;
    if (!stamp || !known) return EntryState::missing;
    if (*stamp != recorded->second.stamp) state = EntryState::changed;
  }
  return state;
}

bool EntryRecords::isRecorded(const std::string& file) const {
  const std::lock_guard lock(mutex_);
  const auto recorded = files_.find(file);
  return recorded != files_.end() && stampOf(manifest_.at(file)) == recorded->second.stamp;
}

std::optional<Json> EntryRecords::lastLine(const std::string& key) const {
  const std::lock_guard lock(mutex_);
  const auto line = last_.find(key);
  if (line == last_.end()) return {};
  return line->second;
}

void EntryRecords::add(const ManifestEntry& entry, Json line, bool done) {
  if (done) {
    Json files = Json::array();
    for (const std::string& file : filesOf(entry)) {
      Json one = {{"file", file}};
      if (const auto stamp = stampOf(manifest_.at(file))) one.update(stampJson(*stamp)), files.push_back(std::move(one));
    }
    line["files"] = std::move(files);
  }
  const std::lock_guard lock(mutex_);
  lines_.append({line});
  take(line);
}

}  // namespace glint::apps
