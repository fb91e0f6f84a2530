#include "glint/formats/mapped_files.h"

#include <sys/mman.h>

#include <map>
#include <mutex>

namespace glint::formats {
namespace {

struct MappedFiles {
  std::mutex mutex;
  std::map<const std::byte*, std::size_t> sizes;  // by address
};

/// Never destroyed: assets may outlive the objects of this file.
MappedFiles& mappedFiles() {
  static auto* const files = new MappedFiles;
  return *files;
}

}  // namespace

void giveBackMappedFiles() noexcept {
  MappedFiles& files = mappedFiles();
  const std::scoped_lock lock(files.mutex);
  // The maps are read-only and shared: the file has all that is in their pages.
  for (const auto& [address, size] : files.sizes) ::madvise(const_cast<std::byte*>(address), size, MADV_DONTNEED);
}

void rememberMappedFile(std::span<const std::byte> bytes) {
  MappedFiles& files = mappedFiles();
  const std::scoped_lock lock(files.mutex);
  files.sizes[bytes.data()] = bytes.size();
}

void forgetMappedFile(std::span<const std::byte> bytes) noexcept {
  MappedFiles& files = mappedFiles();
  const std::scoped_lock lock(files.mutex);
  files.sizes.erase(bytes.data());
}

}  // namespace glint::formats
