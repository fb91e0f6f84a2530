#include "manifest/file_stamp.h"

#include <sys/stat.h>

#include <nlohmann/json.hpp>

namespace glint::apps {

std::optional<FileStamp> stampOf(const std::string& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0 || !S_ISREG(info.st_mode)) return {};
  constexpr std::int64_t kSecond_ns = 1'000'000'000;
  return FileStamp{static_cast<std::uint64_t>(info.st_size), info.st_mtim.tv_sec * kSecond_ns + info.st_mtim.tv_nsec,
                   static_cast<std::uint64_t>(info.st_ino)};
}

nlohmann::ordered_json stampJson(const FileStamp& stamp) {
  return {{"size_bytes", stamp.size_bytes}, {"mtime_ns", stamp.mtime_ns}, {"inode", stamp.inode}};
}

FileStamp stampOf(const nlohmann::ordered_json& json) {
  return {json.at("size_bytes").get<std::uint64_t>(), json.at("mtime_ns").get<std::int64_t>(),
          json.at("inode").get<std::uint64_t>()};
}

}  // namespace glint::apps
