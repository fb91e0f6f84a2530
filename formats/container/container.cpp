#include "glint/formats/container/container.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <set>

#include "glint/formats/container/cursor.h"

namespace glint::formats {
namespace {

static_assert(std::endian::native == std::endian::little, "assets are used in place: little-endian");

using Bytes = std::span<const std::byte>;

constexpr unsigned char kSignature[8] = {0x89, 'H', 'D', 'F', '\r', '\n', 0x1a, '\n'};
constexpr std::size_t kSuperblockBytes = 48;  // of versions 2 and 3 with 8-byte offsets

void checkLength(Bytes file, std::uint64_t end) {
  if (end > file.size()) {
    throwBroken(
        "file.truncated", {},
        "has " + std::to_string(file.size()) + " bytes of the " + std::to_string(end) + " that its superblock declares");
  }
  if (end < file.size()) {
    throwBroken("file.trailing", {},
                "has " + std::to_string(file.size() - end) + " bytes after the end that its superblock declares");
  }
}

/// @return address of the root's object header
std::uint64_t readSuperblock(Bytes file) {
  if (file.size() < sizeof(kSignature) || std::memcmp(file.data(), kSignature, sizeof(kSignature)) != 0)
    throwBroken("file.signature", {}, "is not an HDF5 file");
  if (file.size() < kSuperblockBytes) throwBroken("file.truncated", {}, "ends inside its superblock");
  const std::string nowhere;
  Cursor cursor(file.first(kSuperblockBytes).subspan(sizeof(kSignature)), nowhere, "superblock");
  const std::uint64_t version = cursor.number(1);
  if (version != 2 && version != 3)
    throwBroken("file.superblock", {}, "has superblock version " + std::to_string(version) + ", not 2 or 3");
  if (cursor.number(1) != 8 || cursor.number(1) != 8)
    throwBroken("file.superblock", {}, "has offsets or lengths that are not of 8 bytes");
  cursor.take(1);  // flags of files that are open for writing
  if (cursor.number(8) != 0) throwBroken("file.superblock", {}, "has a base address that is not 0");
  if (cursor.number(8) != kNowhere) throwBroken("file.superblock", {}, "has a superblock extension");
  checkLength(file, cursor.number(8));
  requireChecksum(file.first(kSuperblockBytes), "/", "superblock");
  return cursor.number(8);
}

/// Walks a file from its root.
class Walk {
 public:
  explicit Walk(Bytes file) : file_(file) {}

  Container walk() {
    const std::uint64_t root = readSuperblock(file_);
    container_.extents.push_back({0, kSuperblockBytes});
    readObject(root, "/", 1);
    addDatasets();
    return std::move(container_);
  }

 private:
  void readObject(std::uint64_t address, const std::string& path, int depth) {
    if (container_.objects.size() == kMaxObjects) throwBroken("file.objects", path, "is one object too many");
    if (!seen_.insert(address).second) throwBroken("link.single", path, "has several links");
    ObjectHeader header = readObjectHeader(file_, address, path, container_.extents);
    const std::vector<RawLink> links = header.links;
    if (header.is_group && depth > kMaxDepth) throwBroken("group.depth", path, "is nested too deep");
    container_.objects.push_back({path, std::move(header)});
    std::set<std::string_view> names;
    for (const RawLink& link : links) {
      const std::string child = (path == "/" ? path : path + "/") + std::string(link.name);
      if (!names.insert(link.name).second) throwBroken("file.hdf5", child, "has a name that another object has");
      readObject(link.address, child, depth + 1);
    }
  }

  /// Notes the bytes of datasets, and makes sure that nothing lies over each other.
  void addDatasets() {
    for (const ContainerObject& object : container_.objects) {
      const ObjectHeader& header = object.header;
      if (header.is_group || header.size_bytes == 0 || header.place == kNowhere) continue;
      container_.extents.push_back({header.place, header.place + header.size_bytes});
    }
    std::sort(container_.extents.begin(), container_.extents.end(), [](Extent a, Extent b) { return a.begin < b.begin; });
    for (std::size_t k = 1; k < container_.extents.size(); ++k) {
      if (container_.extents[k].begin < container_.extents[k - 1].end)
        throwBroken("file.hdf5", {}, "has objects that lie over each other");
    }
  }

  Bytes file_;
  Container container_;
  std::set<std::uint64_t> seen_;  // addresses of object headers
};

}  // namespace

Container readContainer(Bytes file) { return Walk(file).walk(); }

}  // namespace glint::formats
