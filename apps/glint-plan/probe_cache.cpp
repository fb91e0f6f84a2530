#include "glint-plan/probe_cache.h"

#include <filesystem>

#include "common/files.h"
#include "common/json_file.h"
#include "glint/model/error.h"

namespace glint::apps {

namespace fs = std::filesystem;

ProbeCache::ProbeCache(const std::string& folder, const std::string& map_hash) {
  if (folder.empty()) return;
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder, error))
    throw Error(ErrorCode::io, "output.folder", folder, "", "the folder for probes cannot be made",
                "name another one with --cache");
  file_ = (fs::path(folder) / (map_hash + ".probe.json")).string();
  if (!fs::exists(file_)) return;
  nlohmann::json read = readJsonOrNothing(file_);
  if (read.is_object()) values_ = std::move(read);
}

std::optional<double> ProbeCache::find(const std::string& key) const {
  const auto found = values_.find(key);
  if (found == values_.end() || !found->is_number()) return std::nullopt;
  return found->get<double>();
}

void ProbeCache::put(const std::string& key, double value) {
  values_[key] = value;
  changed_ = true;
}

void ProbeCache::save() {
  if (file_.empty() || !changed_) return;
  writeTextFile(file_, values_.dump(1) + "\n");
  changed_ = false;
}

}  // namespace glint::apps
