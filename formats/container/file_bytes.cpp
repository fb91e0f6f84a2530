#include "glint/formats/container/file_bytes.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <new>
#include <utility>

#include "glint/formats/descriptor.h"
#include "glint/formats/findings.h"
#include "glint/formats/mapped_files.h"
#include "glint/formats/system_error.h"

namespace glint::formats {
namespace {

constexpr std::align_val_t kAlignment{64};
constexpr std::uint64_t kPartBytes = std::uint64_t{1} << 24;  // bytes that are read at a time

/// Reads all of `to` from an offset of a file.
void readAll(int file, std::uint64_t offset, std::span<std::byte> to) {
  while (!to.empty()) {
    const ssize_t count = ::pread(file, to.data(), to.size(), static_cast<off_t>(offset));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throwUnreadable({}, "cannot be read", errno);
    if (count == 0) throwBroken("file.readable", {}, "became shorter while it was being read");
    offset += static_cast<std::uint64_t>(count);
    to = to.subspan(static_cast<std::size_t>(count));
  }
}

}  // namespace

void FileBytes::Release::operator()(std::byte* bytes) const { ::operator delete(bytes, kAlignment); }

FileBytes::~FileBytes() {
  if (!mapped_) return;
  forgetMappedFile(bytes_);
  ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

void FileBytes::swap(FileBytes& other) noexcept {
  std::swap(bytes_, other.bytes_);
  std::swap(mapped_, other.mapped_);
  std::swap(owned_, other.owned_);
}

std::span<std::byte> FileBytes::allocate(std::size_t size) {
  owned_.reset(static_cast<std::byte*>(::operator new(std::max<std::size_t>(size, 1), kAlignment)));
  bytes_ = {owned_.get(), size};
  return {owned_.get(), size};
}

FileBytes FileBytes::ofFile(const std::filesystem::path& path, bool copy) {
  // Non-blocking: opening a pipe or device must not hang; only regular files pass the next check.
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (file.id < 0) throwUnreadable({}, "cannot be opened", errno);
  struct stat status = {};
  if (::fstat(file.id, &status) != 0) throwUnreadable({}, "cannot be opened", errno);
  if (!S_ISREG(status.st_mode)) throwBroken("file.readable", {}, "is not a regular file");
  if (status.st_size == 0) throwBroken("file.signature", {}, "is empty");
  const auto size = static_cast<std::size_t>(status.st_size);
  FileBytes bytes;
  if (copy) {
    readAll(file.id, 0, bytes.allocate(size));
    return bytes;
  }
  void* address = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, file.id, 0);
  if (address == MAP_FAILED) throwUnreadable({}, "cannot be mapped", errno);
  bytes.bytes_ = {static_cast<const std::byte*>(address), size};
  bytes.mapped_ = true;
  rememberMappedFile(bytes.bytes_);
  return bytes;
}

FileBytes FileBytes::ofMemory(std::span<const std::byte> memory, bool copy) {
  FileBytes bytes;
  const auto start = reinterpret_cast<std::uintptr_t>(memory.data());
  if (!copy && start % static_cast<std::size_t>(kAlignment) == 0) {
    bytes.bytes_ = memory;
    return bytes;
  }
  const std::span<std::byte> own = bytes.allocate(memory.size());
  if (!memory.empty()) std::memcpy(own.data(), memory.data(), memory.size());
  return bytes;
}

FileBytes FileBytes::ofSource(std::uint64_t size, const std::function<bool(std::uint64_t, std::span<std::byte>)>& read) {
  FileBytes bytes;
  const std::span<std::byte> own = bytes.allocate(static_cast<std::size_t>(size));
  for (std::uint64_t offset = 0; offset < size; offset += kPartBytes) {
    const auto part =
        own.subspan(static_cast<std::size_t>(offset), static_cast<std::size_t>(std::min(kPartBytes, size - offset)));
    if (!read(offset, part)) throwBroken("file.readable", {}, "cannot be read at offset " + std::to_string(offset));
  }
  return bytes;
}

}  // namespace glint::formats
