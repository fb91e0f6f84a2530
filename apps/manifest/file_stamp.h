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

/// Stamp of a file that people write. The time of its last change of any kind shows that it was overwritten in place, whatever its other
/// time says. Assets have none: a further name of an asset changes it.
struct MapStamp {
  FileStamp file;
  std::int64_t ctime_ns = 0;
  friend bool operator==(const MapStamp&, const MapStamp&) = default;
};

/// Stamp of a regular file, behind links; nothing where there is none.
std::optional<MapStamp> mapStampOf(const std::string& path);

/// {"size_bytes", "mtime_ns", "inode"}.
nlohmann::ordered_json stampJson(const FileStamp& stamp);

/// @throws nlohmann::json::exception if a member is missing or no number
FileStamp stampOf(const nlohmann::ordered_json& json);

/// The same with "ctime_ns".
nlohmann::ordered_json stampJson(const MapStamp& stamp);
/// @throws nlohmann::json::exception if a member is missing or no number
MapStamp mapStampOf(const nlohmann::ordered_json& json);

}  // namespace glint::apps
