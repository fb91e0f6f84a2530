#include "glint-farm/entry_lock.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>

#include "glint/formats/descriptor.h"
#include "glint/formats/hash.h"
#include "glint/formats/system_error.h"

namespace glint::apps {
namespace {

std::string lockFileOf(const std::string& asset) {
  return (std::filesystem::path(asset).parent_path() / ".glint-farm.lock").string();
}

/// The lock of an asset's byte. The byte need not exist.
struct flock byteOf(const std::string& asset) {
  constexpr std::size_t kDigits = 15;  // hexadecimal: 60 bits, so that two names hardly ever share a byte
  const std::string name = std::filesystem::path(asset).filename().string();
  struct flock byte = {};
  byte.l_type = F_WRLCK;
  byte.l_whence = SEEK_SET;
  byte.l_start = static_cast<off_t>(std::stoull(formats::hashBytes(name.data(), name.size()).substr(0, kDigits), nullptr, 16));
  byte.l_len = 1;
  return byte;
}

}  // namespace

std::optional<EntryLock> EntryLock::take(const std::string& asset) {
  const std::string path = lockFileOf(asset);
  EntryLock lock(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
  if (lock.file_ < 0) formats::throwUnwritable(path, "cannot be opened", errno);
  struct flock byte = byteOf(asset);
  if (::fcntl(lock.file_, F_OFD_SETLK, &byte) != 0 && (errno == EAGAIN || errno == EACCES)) return {};
  return lock;
}

bool EntryLock::isTaken(const std::string& asset) {
  const formats::Descriptor file(::open(lockFileOf(asset).c_str(), O_RDWR | O_CLOEXEC));
  struct flock byte = byteOf(asset);
  return file.id >= 0 && ::fcntl(file.id, F_OFD_GETLK, &byte) == 0 && byte.l_type != F_UNLCK;
}

EntryLock::~EntryLock() {
  if (file_ >= 0) ::close(file_);
}

}  // namespace glint::apps
