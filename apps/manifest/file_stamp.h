#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

namespace glint::apps {

/// What shows, without reading a file, that it is the file that it was. Stamps are only compared: whether one is older than another
/// never counts, so that a clock may jump. A copy of a file has another stamp.
struct FileStamp {
  std::uint64_t size_bytes = 0;
  std::int64_t mtime_ns = 0;
  std::uint64_t inode = 0;
  friend bool operator==(const FileStamp&, const FileStamp&) = default;
};

/// Stamp of a regular file, behind links; nothing where there is none.
std::optional<FileStamp> stampOf(const std::string& path);

/// {"size_bytes", "mtime_ns", "inode"}.
nlohmann::ordered_json stampJson(const FileStamp& stamp);

/// @throws nlohmann::json::exception if a member is missing or no number
FileStamp stampOf(const nlohmann::ordered_json& json);

}  // namespace glint::apps
