#include "common/tiff_tags.h"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <string_view>
#include <vector>

#include "common/files.h"

namespace glint::apps {
namespace {

constexpr std::uint64_t kImageWidth = 256, kBitsPerSample = 258, kOrientation = 274, kGdalNoData = 42113;
constexpr std::uint64_t kShort = 3;
/// Numbers in text are shorter than this.
constexpr std::uint64_t kLongestText = 256;
/// A chain of more directories than this is damaged or a loop.
constexpr int kMostDirectories = 4096;

/// Reads bytes at an offset; false if the file ends before.
using ReadBytes = std::function<bool(std::uint64_t offset, std::span<std::byte> bytes)>;

/// One tag of a directory.
struct Tag {
  std::uint64_t type = 0;
  std::uint64_t count = 0;
  std::uint64_t value_at = 0;  ///< where its value is, or the offset of its value
};

/// Finds tags in files of classic TIFF and of BigTIFF. Offsets of BigTIFF have 8 bytes.
class TiffReader {
 public:
  explicit TiffReader(ReadBytes read) : read_(std::move(read)) {}

  std::optional<Tag> find(int directory, std::uint64_t tag) {
    std::byte mark[2];
    if (!read_(0, mark)) return {};
    little_ = mark[0] == std::byte{'I'};
    if (mark[0] != mark[1] || (!little_ && mark[0] != std::byte{'M'})) return {};
    const std::uint64_t version = number(2, 2);
    big_ = version == 43;
    if (!big_ && version != 42) return {};
    std::uint64_t at = big_ ? number(8, 8) : number(4, 4);
    for (int k = 0; k < std::min(directory, kMostDirectories) && at != 0; ++k)
      at = number(entryAt(at, entries(at)), offsetSize());
    for (std::uint64_t k = 0; at != 0 && k < entries(at); ++k) {
      const std::uint64_t entry = entryAt(at, k);
      if (number(entry, 2) == tag) return Tag{number(entry + 2, 2), number(entry + 4, offsetSize()), entry + 4 + offsetSize()};
    }
    return {};
  }

  std::string text(const Tag& tag) {
    std::string text(std::min(tag.count, kLongestText), '\0');
    const std::uint64_t at = tag.count <= offsetSize() ? tag.value_at : number(tag.value_at, offsetSize());
    if (!read_(at, std::as_writable_bytes(std::span(text)))) text.clear();
    return text.c_str();  // ends at the first NUL
  }
  std::uint64_t shortNumber(const Tag& tag) { return tag.type == kShort ? number(tag.value_at, 2) : 0; }

 private:
  std::uint64_t offsetSize() const { return big_ ? 8 : 4; }
  std::uint64_t countSize() const { return big_ ? 8 : 2; }
  std::uint64_t entries(std::uint64_t at) { return std::min<std::uint64_t>(number(at, countSize()), 0xffff); }
  std::uint64_t entryAt(std::uint64_t at, std::uint64_t k) const { return at + countSize() + k * (4 + 2 * offsetSize()); }

  /// An unsigned number of so many bytes; 0 beyond the end.
  std::uint64_t number(std::uint64_t at, std::size_t size) {
    std::byte bytes[8] = {};
    if (!read_(at, std::span(bytes).first(size))) return 0;
    if (!little_) std::reverse(bytes, bytes + size);
    std::uint64_t value = 0;
    for (std::size_t k = size; k-- > 0;) value = value << 8 | std::to_integer<std::uint64_t>(bytes[k]);
    return value;
  }

  ReadBytes read_;
  bool little_ = true;
  bool big_ = false;
};

/// Reads the bytes of a file. It must outlive what is returned.
ReadBytes bytesOf(std::ifstream& file) {
  return [&file](std::uint64_t offset, std::span<std::byte> bytes) {
    file.clear();
    file.seekg(static_cast<std::streamoff>(offset & INT64_MAX));
    file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    return file.good();
  };
}

/// Whether a directory of a TIFF is there, and has no such tag.
bool lacks(const std::string& path, int directory, std::uint64_t tag) {
  std::ifstream file(path, std::ios::binary);
  TiffReader reader(bytesOf(file));
  return reader.find(directory, kImageWidth) && !reader.find(directory, tag);
}

}  // namespace

bool lacksBitsPerSample(const std::string& path, int directory) { return lacks(path, directory, kBitsPerSample); }

std::optional<double> geoTiffNoData(const std::string& path, int directory) {
  std::ifstream file(path, std::ios::binary);
  TiffReader reader(bytesOf(file));
  const std::optional<Tag> tag = reader.find(directory, kGdalNoData);
  if (!tag) return {};
  const std::string text = reader.text(*tag);
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end == text.c_str()) return {};
  return value;
}

int webpOrientation(const std::string& path) {
  // A file is "RIFF", its size, "WEBP", and chunks: a name, a size (both of four bytes), and as many bytes, padded to an even number.
  const std::vector<std::byte> file = readFile(path);
  const auto name = [&](std::size_t at) { return std::string_view(reinterpret_cast<const char*>(file.data()) + at, 4); };
  constexpr std::size_t kHeader = 8, kFirst = 12;
  constexpr std::string_view kPrefix("Exif\0\0", 6);  // some writers put it before the TIFF
  if (file.size() < kFirst || name(0) != "RIFF" || name(kHeader) != "WEBP") return 1;
  for (std::size_t at = kFirst; at + kHeader <= file.size();) {
    std::uint64_t size = 0;
    for (std::size_t k = 4; k-- > 0;) size = size << 8 | std::to_integer<std::uint64_t>(file[at + 4 + k]);
    const std::span chunk = std::span(file).subspan(at + kHeader);
    if (size > chunk.size()) return 1;
    if (name(at) == "EXIF") {
      const std::string_view text(reinterpret_cast<const char*>(chunk.data()), size);
      const std::size_t skipped = text.starts_with(kPrefix) ? kPrefix.size() : 0;
      return exifOrientation(chunk.first(size).subspan(skipped));
    }
    at += kHeader + size + size % 2;
  }
  return 1;
}

int exifOrientation(std::span<const std::byte> exif) {
  TiffReader reader([&](std::uint64_t offset, std::span<std::byte> bytes) {
    if (offset > exif.size() || bytes.size() > exif.size() - offset) return false;
    std::copy_n(exif.begin() + static_cast<std::ptrdiff_t>(offset), bytes.size(), bytes.begin());
    return true;
  });
  const std::optional<Tag> tag = reader.find(0, kOrientation);
  const std::uint64_t value = tag ? reader.shortNumber(*tag) : 1;
  return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
}

}  // namespace glint::apps
