#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

namespace glint::apps {

/// A file of JSON objects, a line each, which grows: several programs, on several machines, may add to it at once.
class JsonLines {
 public:
  explicit JsonLines(std::string path) : path_(std::move(path)) {}

  /// Adds lines, all or none. A lock of the file keeps those of other programs apart; the system gives it back when a program is
  /// killed. A part of a line that a killed program has left stays a line of its own.
  /// @throws Error io
  void append(const std::vector<nlohmann::ordered_json>& lines) const;

  /// The lines that were added since the last call. Lines that are no JSON object, or are nested
  /// deeper than kMostJsonDepth, are left out. No file: no lines.
  /// @throws Error io
  std::vector<nlohmann::ordered_json> readNew();

  const std::string& path() const { return path_; }

 private:
  std::string path_;
  std::uint64_t read_bytes_ = 0;
};

}  // namespace glint::apps
