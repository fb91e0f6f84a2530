#include <algorithm>
#include <charconv>
#include <filesystem>

#include "common/image_formats.h"
#include "glint/model/error.h"

namespace glint::apps {

void throwDamagedImage(const std::string& path, const std::string& reason) {
  throw Error(ErrorCode::invalid_input, "image.complete", path, "",
              "the image is damaged or truncated" + (reason.empty() ? "" : " (" + reason + ")"),
              "copy or export the file again");
}

void checkDeclaredSize(const std::string& path, std::uint64_t pixel_bytes) {
  // Below a gigabyte any header is believed. Above, no map compresses so well: deflate ends at 1 : 1032.
  constexpr std::uint64_t kBelieved = std::uint64_t{1} << 30, kBestRatio = 2048;
  if (pixel_bytes > kBelieved && pixel_bytes / kBestRatio > std::filesystem::file_size(path))
    throwDamagedImage(path, "it declares more pixels than the file can hold");
}

std::string partList(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 8;
  std::string list;
  for (std::size_t k = 0; k < std::min(names.size(), kMost); ++k) {
    list += (k > 0 ? ", " : "") + std::to_string(k);
    if (!names[k].empty()) list += " (" + names[k] + ")";
  }
  return list + (names.size() > kMost ? ", ..." : "");
}

int findPart(const std::string& path, const std::string& part, const std::vector<std::string>& names) {
  if (part.empty()) return 0;
  const auto named = std::find(names.begin(), names.end(), part);
  if (named != names.end()) return static_cast<int>(named - names.begin());
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), number);
  if (error == std::errc() && end == part.data() + part.size() && number < names.size()) return static_cast<int>(number);
  throw Error(ErrorCode::invalid_input, "image.part", path, "", "has no image \"" + part + "\"",
              "it has " + partList(names) + "; choose one with --subimage");
}

}  // namespace glint::apps
