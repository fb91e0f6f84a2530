#include "measure/asset_folder.h"

#include <algorithm>
#include <filesystem>
#include <string_view>

#include "glint/model/error.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;

/// The beginning of the names of a map's assets.
std::string prefixOf(const std::string& map_hash) { return map_hash.substr(0, 8) + "-"; }

/// Whether a file has a name that a bench gives, or one under which a program that was stopped was writing it.
bool isOurs(const fs::directory_entry& entry) {
  std::string name = entry.path().filename().string();
  if (name.starts_with('.') && name.ends_with(".tmp")) name.erase(0, 1);
  constexpr std::string_view kDigits = "0123456789abcdef";
  const bool named = name.find_first_not_of(kDigits) == 8 && name[8] == '-' && name.find(".glint") != std::string::npos;
  return named && entry.is_regular_file();
}

void removeOurs(const std::string& folder, const std::string& part_of_name) {
  std::error_code ignored;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, ignored))
    if (isOurs(entry) && entry.path().filename().string().find(part_of_name) != std::string::npos)
      fs::remove(entry.path(), ignored);
}

}  // namespace

AssetFolder::AssetFolder(const std::string& path, bool remove) : path_(path), remove_(remove) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error || !fs::is_directory(path, error)) {
    throw Error(ErrorCode::io, "output.folder", path, "", "the folder for the assets cannot be made: " + error.message(),
                "name another one with --assets");
  }
  if (!remove) return;
  for (const fs::directory_entry& entry : fs::directory_iterator(path)) {
    if (isOurs(entry)) continue;
    throw Error(ErrorCode::usage, "output.ours", path, "",
                "exists and would be removed, but holds " + entry.path().filename().string() + ", which is not of a bench",
                "name a folder with --assets");
  }
}

AssetFolder::~AssetFolder() {
  if (!remove_) return;
  removeOurs(path_, "");
  std::error_code ignored;
  fs::remove(path_, ignored);
}

std::string AssetFolder::fileOf(const std::string& map_hash, const std::string& candidate) const {
  std::string name = prefixOf(map_hash) + candidate + ".glint";
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == ' ' || c == ',' || c == '/'; }, '_');
  return (fs::path(path_) / name).string();
}

void AssetFolder::finish(const std::string& map_hash) const {
  if (remove_) removeOurs(path_, prefixOf(map_hash));
}

}  // namespace glint::apps
