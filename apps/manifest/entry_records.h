#pragma once

#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <unordered_map>

#include "manifest/file_stamp.h"
#include "manifest/json_lines.h"
#include "manifest/manifest.h"

namespace glint::apps {

/// State of an entry by what its records and stamps say, without reading assets.
enum class EntryState : unsigned char {
  done,     ///< its files are those that were recorded
  changed,  ///< a file is there, but is not the recorded one
  missing,  ///< a file is missing, or was never recorded
};

/// What runs of a manifest have recorded: the log of its entries.
/// @note thread-safe
class EntryRecords {
 public:
  /// Reads the log of a manifest.
  /// @throws Error io
  explicit EntryRecords(const Manifest& manifest);

  /// Reads what other programs have added.
  /// @throws Error io
  void refresh();

  EntryState stateOf(const ManifestEntry& entry) const;
  /// Whether a file is one that was recorded, for an entry of any key.
  bool isRecorded(const std::string& file) const;
  /// The last line of an entry; nothing if it has none.
  std::optional<nlohmann::ordered_json> lastLine(const std::string& key) const;

  /// Adds a line, with the stamps of all files of the entry if it is done.
  /// @throws Error io
  void add(const ManifestEntry& entry, nlohmann::ordered_json line, bool done);

 private:
  struct Recorded {
    std::string key;
    FileStamp stamp;
  };

  void take(const nlohmann::ordered_json& line);

  const Manifest& manifest_;
  mutable std::mutex mutex_;
  JsonLines lines_;
  std::unordered_map<std::string, Recorded> files_;
  std::unordered_map<std::string, nlohmann::ordered_json> last_;  ///< by key
};

}  // namespace glint::apps
