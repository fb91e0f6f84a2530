#include "glint/formats/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <string>
#include <vector>

#include "glint/formats/descriptor.h"
#include "glint/formats/hash.h"
#include "glint/formats/system_error.h"
#include "glint/formats/temporary_registry.h"
#include "glint/model/error.h"

namespace glint::formats {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kWriteBytes = 8 << 20;  // of one write call
constexpr int kMostLinks = 40;                // as many as Linux follows
constexpr int kMostAttempts = 100;            // to find a name that nobody has
constexpr std::string_view kSuffix = ".tmp";
constexpr std::size_t kNumberBytes = 64;  // of process, counter, time and suffix in a temporary name

fs::path folderOf(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

/// Number of the descriptor that a path of /proc/self/fd names; -1 if it names none.
int ownDescriptor(const fs::path& path) {
  const std::string number = path.filename().string();
  if (number.empty() || number.size() > 9 || number.find_first_not_of("0123456789") != std::string::npos) return -1;
  std::error_code error;
  const fs::path folder = fs::canonical(folderOf(path), error);
  return !error && folder == "/proc/" + std::to_string(::getpid()) + "/fd" ? std::stoi(number) : -1;
}

[[noreturn]] void throwNoFile(const fs::path& name, const std::string& what, const std::string& remedy) {
  throw Error(ErrorCode::io, "output.regular", name.string(), {}, what, remedy);
}

/// Sorts what stands at the end of the links.
OutputTarget::Kind kindOf(const fs::path& name, mode_t mode) {
  if (S_ISREG(mode)) return OutputTarget::Kind::file;
  if (S_ISCHR(mode) || S_ISFIFO(mode)) return OutputTarget::Kind::stream;
  if (S_ISDIR(mode)) throwNoFile(name, "is a folder", "name a file in it");
  if (S_ISBLK(mode)) throwNoFile(name, "is a disk", "name a file");
  throwNoFile(name, "is a socket", "name a file, or a pipe");
}

void writeAll(int file, const std::byte* data, std::size_t size, const fs::path& name) {
  while (size > 0) {
    const ssize_t written = ::write(file, data, std::min(size, kWriteBytes));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) throwUnwritable(name, "cannot be written", written < 0 ? errno : EIO);
    data += written;
    size -= static_cast<std::size_t>(written);
  }
}

/// Opens a device or pipe without changing anything about it.
int openStream(const OutputTarget& target, const fs::path& name) {
  const int file = target.descriptor >= 0 ? ::fcntl(target.descriptor, F_DUPFD_CLOEXEC, 3)
                                          : ::open(target.path.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY);
  if (file < 0) throwUnwritable(name, "cannot be opened", errno);
  return file;
}

/// How the names of all temporary files of a target start: with its own name where there is room for it.
std::string prefixOf(const fs::path& target) {
  const std::string name = target.filename().string();
  const long most = ::pathconf(folderOf(target).c_str(), _PC_NAME_MAX);
  const std::size_t room = most > 0 ? static_cast<std::size_t>(most) : 255;
  if (name.size() + 2 + kNumberBytes <= room) return "." + name + ".";
  return "." + hashBytes(name.data(), name.size()) + ".";
}

bool isTemporary(const std::string& name, const std::string& prefix) {
  if (!name.starts_with(prefix) || !name.ends_with(kSuffix)) return false;
  return name.find_first_not_of("0123456789abcdef-", prefix.size()) == name.size() - kSuffix.size();
}

/// Locks the open file description, which no other lock of this process is part of.
/// @return whether nobody else has the file locked; false where there are no locks
bool lock(int file) {
  struct flock whole = {};
  whole.l_type = F_WRLCK;
  whole.l_whence = SEEK_SET;
  return ::fcntl(file, F_OFD_SETLK, &whole) == 0;
}

/// Removes the temporary files that killed writers of the same target have left.
void removeStale(const fs::path& folder, const std::string& prefix) {
  std::error_code error;
  for (fs::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error)) {
    if (!isTemporary(entry->path().filename().string(), prefix)) continue;
    const Descriptor file(::open(entry->path().c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
    // Who writes through HDF5 may hold a lock of the other kind only.
    if (file.id >= 0 && lock(file.id) && ::flock(file.id, LOCK_EX | LOCK_NB) == 0) ::unlink(entry->path().c_str());
  }
}

std::string uniqueNumber() {
  static std::atomic<unsigned> counter{0};
  const auto ticks = static_cast<unsigned long long>(std::chrono::steady_clock::now().time_since_epoch().count());
  char text[kNumberBytes];
  std::snprintf(text, sizeof text, "%d-%u-%llx%s", static_cast<int>(::getpid()), counter++, ticks, kSuffix.data());
  return text;
}

/// Makes a directory entry permanent. Some file systems cannot flush folders; the data is safe either way.
void syncFolder(const fs::path& folder) {
  const Descriptor directory(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.id >= 0) ::fsync(directory.id);
}

}  // namespace

OutputTarget findOutput(const fs::path& name) {
  if (!name.has_filename()) throwNoFile(name, "is a folder", "name a file in it");
  OutputTarget target;
  target.path = name;
  for (int links = 0; links <= kMostLinks; ++links) {
    target.descriptor = ownDescriptor(target.path);
    struct stat status {};
    const int failed = target.descriptor >= 0 ? ::stat(target.path.c_str(), &status) : ::lstat(target.path.c_str(), &status);
    if (failed != 0 && errno == ENOENT && target.descriptor < 0) return target;  // missing; so may be its folder
    if (failed != 0) throwUnwritable(name, "cannot be written", errno);
    if (!S_ISLNK(status.st_mode)) {
      target.kind = kindOf(name, status.st_mode);
      if (target.descriptor >= 0) target.kind = OutputTarget::Kind::stream;
      return target;
    }
    const fs::path next = folderOf(target.path) / fs::read_symlink(target.path);
    struct stat ignored {};
    // Descriptors of other processes are links whose texts are no paths: pipe:[4026].
    if (::stat(target.path.c_str(), &status) == 0 && ::lstat(next.c_str(), &ignored) != 0) {
      target.kind = OutputTarget::Kind::stream;
      return target;
    }
    target.path = next;
  }
  throwUnwritable(name, "cannot be written", ELOOP);
}

AtomicFile::AtomicFile(const fs::path& name) : name_(name), target_(findOutput(name)) {
  std::error_code none;
  const fs::path elsewhere = fs::temp_directory_path(none);
  create(target_.kind != OutputTarget::Kind::stream ? folderOf(target_.path) : none ? fs::path("/tmp") : elsewhere);
}

void AtomicFile::create(const fs::path& folder) {
  const std::string prefix = prefixOf(folder / target_.path.filename());
  removeStale(folder, prefix);
  // Nobody else may read meanwhile what will replace a file that nobody else may read.
  const mode_t mode = target_.kind == OutputTarget::Kind::missing ? 0666 : 0600;
  for (int attempt = 0;; ++attempt) {
    path_ = folder / (prefix + uniqueNumber());
    slot_ = registerTemporary(path_);
    file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    if (file_ < 0) {
      const int error = errno;
      forgetTemporary(slot_);
      if (error != EEXIST || attempt >= kMostAttempts) throwUnwritable(name_, "cannot be created", error);
      continue;
    }
    // Another writer may have removed the new file before it was locked. Where locks do not work, no writer removes any.
    struct stat status {};
    if (!lock(file_) || ::fstat(file_, &status) != 0 || status.st_nlink > 0) return;
    ::close(file_);
    forgetTemporary(slot_);
  }
}

AtomicFile::~AtomicFile() {
  if (!renamed_) ::unlink(path_.c_str());
  if (file_ >= 0) ::close(file_);
  forgetTemporary(slot_);
}

void AtomicFile::write(const void* data, std::uint64_t size_bytes, std::uint64_t offset) {
  const char* at = static_cast<const char*>(data);
  while (size_bytes > 0) {
    const ssize_t written = ::pwrite(file_, at, std::min<std::uint64_t>(size_bytes, kWriteBytes), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) throwUnwritable(name_, "cannot be written", written < 0 ? errno : EIO);
    at += written;
    size_bytes -= static_cast<std::uint64_t>(written);
    offset += static_cast<std::uint64_t>(written);
  }
}

void AtomicFile::reserve(std::uint64_t size_bytes) {
  const int error = ::posix_fallocate(file_, 0, static_cast<off_t>(size_bytes));
  if (error == EFBIG || error == ENOSPC || error == EDQUOT || error == EIO) throwUnwritable(name_, "cannot be written", error);
}

void AtomicFile::keepPermissions() {
  struct stat old {};
  if (::stat(target_.path.c_str(), &old) != 0) return;
  // Only root may give files away; a member of the group may keep the group.
  const bool same_owner = ::fchown(file_, old.st_uid, old.st_gid) == 0;
  const bool same_group = same_owner || ::fchown(file_, static_cast<uid_t>(-1), old.st_gid) == 0;
  mode_t mode = old.st_mode & 07777;
  if (!same_owner) mode &= 0777;                       // not to run as somebody else
  if (!same_group) mode &= ~(S_IRWXG & ~(mode << 3));  // another group gets no more than others do
  if (::fchmod(file_, mode) != 0) throwUnwritable(name_, "cannot be given the permissions of the old file", errno);
}

void AtomicFile::copyToStream() {
  const Descriptor stream(openStream(target_, name_));
  std::vector<std::byte> piece(kWriteBytes);
  for (off_t at = 0;;) {
    const ssize_t count = ::pread(file_, piece.data(), piece.size(), at);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) throwUnwritable(name_, "cannot be written", errno);
    if (count == 0) return;
    writeAll(stream.id, piece.data(), static_cast<std::size_t>(count), name_);
    at += count;
  }
}

void AtomicFile::publish(bool overwrite) {
  if (target_.kind == OutputTarget::Kind::stream) return copyToStream();
  keepPermissions();
  if (::fsync(file_) != 0) throwUnwritable(name_, "cannot be flushed to the disk", errno);
  if (overwrite) {
    if (::rename(path_.c_str(), target_.path.c_str()) != 0) throwUnwritable(name_, "cannot be replaced", errno);
  } else {
    // Unlike rename, link fails if another process has made the target meanwhile.
    if (::link(path_.c_str(), target_.path.c_str()) != 0) throwUnwritable(name_, "cannot be created", errno);
    ::unlink(path_.c_str());
  }
  renamed_ = true;
  syncFolder(folderOf(target_.path));
}

void writeFile(const fs::path& name, std::span<const std::byte> bytes) {
  const OutputTarget target = findOutput(name);
  if (target.kind == OutputTarget::Kind::stream) {
    const Descriptor stream(openStream(target, name));
    return writeAll(stream.id, bytes.data(), bytes.size(), name);
  }
  AtomicFile file(name);
  file.write(bytes.data(), bytes.size(), 0);
  file.publish(true);
}

}  // namespace glint::formats
