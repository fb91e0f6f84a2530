#include "manifest/file_stamp.h"

#include <sys/stat.h>

#include <nlohmann/json.hpp>

namespace glint::apps {
namespace {

std::int64_t nanoseconds(const struct timespec& time) {
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  return time.tv_sec * kSecond_ns + time.tv_nsec;
}

}  // namespace

std::optional<MapStamp> mapStampOf(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode)) return {};
  return MapStamp{
      {static_cast<std::uint64_t>(info.st_size), nanoseconds(info.st_mtim), static_cast<std::uint64_t>(info.st_ino)},
      nanoseconds(info.st_ctim)};
}

std::optional<FileStamp> stampOf(const std::string& path) {
  const std::optional<MapStamp> stamp = mapStampOf(path);
  if (!stamp) return {};
  return stamp->file;
}

nlohmann::ordered_json stampJson(const FileStamp& stamp) {
  return {{"size_bytes", stamp.size_bytes}, {"mtime_ns", stamp.mtime_ns}, {"inode", stamp.inode}};
}

FileStamp stampOf(const nlohmann::ordered_json& json) {
  return {json.at("size_bytes").get<std::uint64_t>(), json.at("mtime_ns").get<std::int64_t>(),
          json.at("inode").get<std::uint64_t>()};
}

nlohmann::ordered_json stampJson(const MapStamp& stamp) {
  nlohmann::ordered_json json = stampJson(stamp.file);
  json["ctime_ns"] = stamp.ctime_ns;
  return json;
}

MapStamp mapStampOf(const nlohmann::ordered_json& json) { return {stampOf(json), json.at("ctime_ns").get<std::int64_t>()}; }

}  // namespace glint::apps
