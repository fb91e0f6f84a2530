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

}  // namespace glint::apps
