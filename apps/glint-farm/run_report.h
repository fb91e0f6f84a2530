#pragma once

#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/tool.h"
#include "glint-farm/entry_maker.h"
#include "manifest/json_lines.h"

namespace glint::apps {

/// Writes what happens to entries: their records, the log, warnings, and the sums at the end.
/// @note thread-safe
class RunReport {
 public:
  /// @param log      file for a line of every entry; empty: none
  /// @param entries  of this run
  RunReport(Tool& tool, EntryRecords& records, const std::string& log, std::size_t entries);

  /// An entry that was there.
  void known(const ManifestEntry& entry);
  void made(const ManifestEntry& entry, const EntryTry& last, int tries);
  void failed(const ManifestEntry& entry, const EntryTry& last, int tries);
  /// An entry that needs one that failed.
  void notMade(const ManifestEntry& entry, const ManifestEntry& needed);

  bool hasFailures() const { return !failures_.empty(); }
  nlohmann::json json() const;
  std::string text() const;

 private:
  void add(const ManifestEntry& entry, const char* status, nlohmann::ordered_json line, bool recorded, bool done);

  Tool& tool_;
  EntryRecords& records_;
  std::optional<JsonLines> log_;
  std::size_t entries_, ended_ = 0;
  bake::ProgressFn progress_;
  std::mutex mutex_;
  std::map<std::string, std::size_t> counts_;  ///< by status
  nlohmann::json failures_ = nlohmann::json::array();
  double program_s_ = 0, cpu_s_ = 0;
  std::int64_t peak_bytes_ = 0;
};

}  // namespace glint::apps
