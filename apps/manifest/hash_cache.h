#pragma once

#include <mutex>
#include <optional>
#include <string>
#include <unordered_map>
#include <vector>

#include "manifest/file_stamp.h"
#include "manifest/json_lines.h"
#include "manifest/manifest.h"

namespace glint::apps {

/// Hashes of files, kept in a file by name and stamp, so that files that stay are read once.
class HashCache {
 public:
  /// Reads the cache at a path, which need not exist.
  /// @throws Error io
  explicit HashCache(const std::string& path);

  /// Hash of a file. Reads the file unless its stamp is known.
  /// @param name  of the file in the cache
  /// @throws Error io
  /// @note thread-safe
  std::string hash(const std::string& name, const std::string& file);

  /// Adds the hashes that are new to the file.
  /// @throws Error io
  void save();

  /// Files that were read.
  std::size_t readFiles() const { return read_files_; }

 private:
  struct Known {
    MapStamp stamp;
    std::string hash;
  };

  JsonLines lines_;
  std::mutex mutex_;
  std::unordered_map<std::string, Known> known_;
  std::vector<std::string> unsaved_;
  std::size_t read_files_ = 0;
};

/// The first of the maps that an entry reads, and of their twins, whose bytes are not those that were planned. Maps that are missing do not
/// count.
/// @throws Error io
std::optional<std::string> changedMap(const Manifest& manifest, const ManifestEntry& entry, HashCache& hashes);

}  // namespace glint::apps
