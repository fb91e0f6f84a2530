#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <new>
#include <vector>

#include "common/image_formats.h"
#include "common/name_list.h"
#include "glint/model/error.h"
#include "glint/model/shown_text.h"

namespace glint::apps {

void checkSystemReads(const std::string& path) {
  const auto fail = [&](int error) {
    throw Error(ErrorCode::io, "file.readable", path, "", std::string("cannot be read: ") + std::strerror(error),
                "check the file's permissions and disk, and the limits of the system");
  };
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), std::fclose);
  if (!file) fail(errno);
  std::vector<char> piece(1 << 20);
  while (std::fread(piece.data(), 1, piece.size(), file.get()) > 0) continue;
  if (std::ferror(file.get())) fail(errno);
}

void checkSystemReason(const std::string& path, int error) {
  if (error == ENOMEM) throw std::bad_alloc();
  if (error != EMFILE && error != ENFILE && error != EIO) return;
  throw Error(ErrorCode::io, "file.readable", path, "", std::string("cannot be read: ") + std::strerror(error),
              "check the file's permissions and disk, and the limits of the system");
}

void throwDamagedImage(const std::string& path, const std::string& reason) {
  constexpr std::size_t kMostReason = 200;  // bytes; decoders can complain about every row
  checkSystemReads(path);
  throw Error(ErrorCode::invalid_input, "image.complete", path, "",
              "the image is damaged or truncated" + (reason.empty() ? "" : " (" + shownText(reason, kMostReason) + ")"),
              "copy or export the file again");
}

void checkDeclaredSize(const std::string& path, const std::string& format, std::uint64_t pixel_bytes,
                       std::uint64_t most_bytes) {
  // Below a gigabyte any header of a compressed format is believed. Above, no map compresses so well: deflate ends at 1 : 1032.
  constexpr std::uint64_t kBelieved = std::uint64_t{1} << 30, kBestRatio = 2048;
  // Without compression: only pixels of one bit (PBM) take less in the file than in memory.
  constexpr std::uint64_t kBits = 8;
  const bool plain = format == "pnm" || format == "fits" || format == "cineon";
  const std::uint64_t ratio = plain ? kBits : kBestRatio;
  if ((plain || pixel_bytes > kBelieved) && pixel_bytes / ratio > std::filesystem::file_size(path))
    throwDamagedImage(path, "it declares more pixels than the file can hold");
  if (pixel_bytes > most_bytes)
    throw Error(ErrorCode::failed, "memory.limit", path, "",
                fmt::format("its pixels take {} MB of memory, and {} MB may be used", pixel_bytes >> 20, most_bytes >> 20),
                "scale the image down, or raise --max-memory where the machine has more");
}

std::string partList(const std::vector<std::string>& names) {
  return nameList(names, [](std::size_t k, const std::string& name) {
    return std::to_string(k) + (name.empty() ? "" : " (" + name + ")");
  });
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
