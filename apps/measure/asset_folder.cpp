#include "measure/asset_folder.h"

#include <dirent.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <climits>
#include <cstring>
#include <filesystem>
#include <string_view>

#include "glint/formats/descriptor.h"
#include "glint/model/error.h"

namespace glint::apps {
namespace {

namespace fs = std::filesystem;

constexpr const char* kLockName = ".glint.lock";
constexpr int kFolder = O_RDONLY | O_DIRECTORY | O_CLOEXEC;

/// The beginning of the names of a map's assets.
std::string prefixOf(const std::string& map_hash) { return map_hash.substr(0, 8) + "-"; }

/// Whether a file has a name that a bench gives, or one under which a program that was stopped was writing it.
bool isOurs(std::string_view name) {
  if (name.starts_with('.') && name.ends_with(".tmp")) name.remove_prefix(1);
  constexpr std::string_view kDigits = "0123456789abcdef";
  return name.find_first_not_of(kDigits) == 8 && name[8] == '-' && name.find(".glint") != std::string_view::npos;
}

/// Calls visit(entry) for the entries of an open folder, until one returns false. A handler of signals may call it: it takes no
/// memory.
template <class Visit>
void forEachEntry(int folder, const Visit& visit) noexcept {
  alignas(dirent64) std::array<char, 4096> entries;
  ::lseek(folder, 0, SEEK_SET);
  for (ssize_t bytes = 0; (bytes = ::getdents64(folder, entries.data(), entries.size())) > 0;) {
    for (ssize_t at = 0; at < bytes;) {
      const auto* entry = reinterpret_cast<const dirent64*>(entries.data() + at);
      at += entry->d_reclen;
      if (!visit(*entry)) return;
    }
  }
}

/// Removes assets of an open folder. A handler of signals may call it.
void removeOurs(int folder, std::string_view part_of_name) noexcept {
  bool removed = true;
  while (removed) {  // some file systems leave out entries while others are removed
    removed = false;
    forEachEntry(folder, [&](const dirent64& entry) {
      const std::string_view name = entry.d_name;
      const bool is_file = entry.d_type == DT_REG || entry.d_type == DT_UNKNOWN;
      if (is_file && isOurs(name) && name.find(part_of_name) != std::string_view::npos)
        removed |= ::unlinkat(folder, entry.d_name, 0) == 0;
      return true;
    });
  }
}

/// Unlinks the lock of a folder that holds nothing else. A file of a program that has not ended keeps the lock, by which a later
/// process knows whose folder it is.
void removeLock(int folder) noexcept {
  bool alone = true;
  forEachEntry(folder, [&](const dirent64& entry) {
    const std::string_view name = entry.d_name;
    return alone = name == "." || name == ".." || name == kLockName;
  });
  if (alone) ::unlinkat(folder, kLockName, 0);
}

/// Removes a folder of assets, as removeOurs. Files of others keep it.
/// @return whether it is gone
bool removeFolder(const char* path) noexcept {
  {
    const formats::Descriptor folder(::open(path, kFolder));
    if (folder.id >= 0) removeOurs(folder.id, ""), removeLock(folder.id);
  }
  return ::rmdir(path) == 0 || errno == ENOENT;
}

/// The folder that a signal removes.
struct AtSignals {
  pid_t process = 0;  ///< a child after fork() must not remove the folder of its parent
  std::array<char, PATH_MAX> path{};
} at_signals;

void removeAtSignal() noexcept {
  // Programs that got the signal, too, remove their files in the folder, and other threads may finish one.
  constexpr int kMostWait_ms = 1000, kStep_ms = 5;
  const int error = errno;
  if (at_signals.process == ::getpid())
    for (int k = 0; k < kMostWait_ms / kStep_ms && !removeFolder(at_signals.path.data()); ++k) ::poll(nullptr, 0, kStep_ms);
  errno = error;
}

/// Locks the open file description, which programs that get the file share.
/// @param command  F_OFD_SETLK or F_OFD_SETLKW
bool lockFile(int file, int command) {
  struct flock whole = {};
  whole.l_type = F_WRLCK;
  whole.l_whence = SEEK_SET;
  int result = 0;
  while ((result = ::fcntl(file, command, &whole)) != 0 && errno == EINTR) {
  }
  return result == 0;
}

/// The beginning of the paths of a base's folders.
std::string beginningOf(const std::string& base) { return base + ".assets-"; }

/// Removes the folders of a base whose processes are gone.
void removeStale(const std::string& base) {
  const fs::path beginning(beginningOf(base));
  const std::string prefix = beginning.filename().string();
  std::error_code error;
  const fs::path parent = beginning.has_parent_path() ? beginning.parent_path() : fs::path(".");
  for (fs::directory_iterator entry(parent, error), end; !error && entry != end; entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(prefix) || name.find_first_not_of("0123456789-", prefix.size()) != std::string::npos) continue;
    const formats::Descriptor folder(::open(entry->path().c_str(), kFolder | O_NOFOLLOW));
    if (folder.id < 0) continue;
    const formats::Descriptor lock(::openat(folder.id, kLockName, O_RDWR | O_CLOEXEC | O_NOFOLLOW));
    if (lock.id >= 0) {
      if (!lockFile(lock.id, F_OFD_SETLK)) continue;
      removeOurs(folder.id, "");
      removeLock(folder.id);
    }
    ::rmdir(entry->path().c_str());  // fails if anything is in it: without a lock it is nobody's that we know
  }
}

[[noreturn]] void throwNoFolder(const std::string& path, const std::string& why) {
  throw Error(ErrorCode::io, "output.folder", path, "", "the folder for the assets cannot be made: " + why,
              "name another one with --assets");
}

}  // namespace

/// A new folder, and its locked file.
struct AssetFolder::Locked {
  explicit Locked(const std::string& base) {
    constexpr int kMostAttempts = 100;
    for (int attempt = 0; attempt < kMostAttempts; ++attempt) {
      // Processes of several containers may have the same number.
      path = beginningOf(base) + std::to_string(::getpid()) + (attempt > 0 ? "-" + std::to_string(attempt) : "");
      if (::mkdir(path.c_str(), 0777) != 0) {
        if (errno == EEXIST) continue;
        throwNoFolder(path, std::strerror(errno));
      }
      file = ::open((path + "/" + kLockName).c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
      if (file < 0 && errno != ENOENT) throwNoFolder(path, std::strerror(errno));
      if (file < 0) continue;
      // Another process may have taken the new folder for an old one before its file was locked.
      struct stat status {};
      if (!lockFile(file, F_OFD_SETLKW) || ::fstat(file, &status) != 0 || status.st_nlink > 0) return;
      ::close(file);
    }
    throwNoFolder(path, "all names are taken");
  }
  std::string path;
  int file = -1;
};

AssetFolder::AssetFolder(const Locked& made) : path_(made.path), remove_(true), lock_(made.file) { removeAtSignals(); }

AssetFolder AssetFolder::temporary(const std::string& base) {
  removeStale(base);
  return AssetFolder(Locked(base));
}

AssetFolder::AssetFolder(const std::string& path, bool remove) : path_(path), remove_(remove) {
  std::error_code error;
  fs::create_directories(path, error);
  if (error || !fs::is_directory(path, error)) throwNoFolder(path, error.message());
  if (!remove) {
    holdLock();
    return;
  }
  for (const fs::directory_entry& entry : fs::directory_iterator(path)) {
    if (isOurs(entry.path().filename().string()) && entry.is_regular_file()) continue;
    throw Error(ErrorCode::usage, "output.ours", path, "",
                "exists and would be removed, but holds " + entry.path().filename().string() + ", which is not of a bench",
                "name a folder with --assets");
  }
  removeAtSignals();
}

/// Keeps the folder of a killed process, which is used again, from those that remove such folders.
void AssetFolder::holdLock() {
  lock_ = ::open((path_ + "/" + kLockName).c_str(), O_RDWR | O_CLOEXEC | O_NOFOLLOW);
  if (lock_ < 0 || lockFile(lock_, F_OFD_SETLK) || (errno != EAGAIN && errno != EACCES)) return;
  throw Error(ErrorCode::usage, "output.ours", path_, "", "is the temporary folder of a program that runs",
              "name another folder with --assets");
}

void AssetFolder::removeAtSignals() {
  std::error_code unknown;
  const std::string absolute = fs::absolute(path_, unknown).string();
  if (unknown || absolute.size() >= at_signals.path.size()) return;  // left to the next process
  std::memcpy(at_signals.path.data(), absolute.c_str(), absolute.size() + 1);
  at_signals.process = ::getpid();
  end_.emplace(removeAtSignal);
}

AssetFolder::~AssetFolder() {
  if (remove_) removeFolder(path_.c_str());
  // A folder that stays is no longer one that the next process removes.
  if (!remove_ && lock_ >= 0) ::unlink((path_ + "/" + kLockName).c_str());
  end_.reset();
  if (lock_ >= 0) ::close(lock_);
}

std::string AssetFolder::fileOf(const std::string& map_hash, const std::string& candidate) const {
  std::string name = prefixOf(map_hash) + candidate + ".glint";
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c == ' ' || c == ',' || c == '/'; }, '_');
  return (fs::path(path_) / name).string();
}

void AssetFolder::finish(const std::string& map_hash) const {
  if (!remove_) return;
  const formats::Descriptor folder(::open(path_.c_str(), kFolder));
  if (folder.id >= 0) removeOurs(folder.id, prefixOf(map_hash));
}

}  // namespace glint::apps
