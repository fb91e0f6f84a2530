#include "common/bounded_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "glint/formats/mapped_files.h"
#include "glint/formats/system_error.h"

namespace glint::apps {
namespace {

constexpr std::size_t kLargeBytes = 1 << 20;  // smaller arrays are always in memory
constexpr std::chrono::milliseconds kWatchInterval{1};
constexpr std::chrono::milliseconds kLongestInterval{64};  // between two times that giving up pages freed little
constexpr std::uint64_t kMuchFreed = 4 << 20;

/// Memory of the process, mapped files included; 0 where /proc does not say. Allocates nothing.
std::uint64_t residentBytes(int statm) noexcept {
  std::array<char, 128> text{};
  const ssize_t size = ::pread(statm, text.data(), text.size(), 0);
  if (size <= 0) return 0;
  const char* end = text.data() + size;
  std::uint64_t total = 0, resident = 0;
  const char* gap = std::from_chars(text.data(), end, total).ptr;
  if (gap == end || std::from_chars(gap + 1, end, resident).ec != std::errc{}) return 0;
  return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

/// A temporary file without a name.
int openNameless(const std::string& folder) {
  const int file = ::open(folder.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (file >= 0 || (errno != EOPNOTSUPP && errno != EISDIR && errno != ENOENT)) return file;
  std::string name = folder + "/.glint-XXXXXX";
  const int named = ::mkostemp(name.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(name.c_str());
  return named;
}

}  // namespace

BoundedMemory::BoundedMemory(std::uint64_t most_bytes, std::string folder)
    : most_bytes_(most_bytes),
      folder_(std::move(folder)),
      statm_(::open("/proc/self/statm", O_RDONLY | O_CLOEXEC)),
      start_bytes_(residentBytes(statm_.id)) {}

BoundedMemory::~BoundedMemory() {
  if (watcher_.joinable()) {
    {
      const std::scoped_lock lock(mutex_);
      stops_ = true;
    }
    wakes_.notify_all();
    watcher_.join();
  }
  for (const auto& [memory, bytes] : files_) ::munmap(memory, bytes);
}

void* BoundedMemory::do_allocate(std::size_t bytes, std::size_t alignment) {
  if (bytes >= kLargeBytes && held_bytes_ + bytes > most_bytes_) return mapFile(bytes);
  void* memory = std::pmr::new_delete_resource()->allocate(bytes, alignment);
  held_bytes_ += bytes;
  return memory;
}

void BoundedMemory::do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) {
  {
    const std::scoped_lock lock(mutex_);
    if (files_.erase(memory) > 0) {
      ::munmap(memory, bytes);
      return;
    }
  }
  std::pmr::new_delete_resource()->deallocate(memory, bytes, alignment);
  held_bytes_ -= bytes;
}

void* BoundedMemory::mapFile(std::size_t bytes) {
  const formats::Descriptor file(openNameless(folder_));
  if (file.id < 0)
    formats::throwUnwritable(folder_, "cannot hold a temporary file for arrays that do not fit into memory", errno);
  // With its room taken now, a full disk is an error here and not a signal later. Disks that copy on write, and those of a
  // network, may still run full later: then the process ends with SIGBUS.
  int error = EINTR;
  while (error == EINTR) error = ::posix_fallocate(file.id, 0, static_cast<off_t>(bytes));
  if (error != 0) formats::throwUnwritable(folder_, "has no room for arrays that do not fit into memory", error);
  const std::scoped_lock lock(mutex_);
  startWatcher();
  void* memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file.id, 0);
  if (memory == MAP_FAILED) formats::throwUnwritable(folder_, "cannot be mapped", errno);
  try {
    files_[memory] = bytes;
  } catch (...) {
    ::munmap(memory, bytes);
    throw;
  }
  filed_bytes_ += bytes;
  return memory;
}

void BoundedMemory::watchMappedFiles() {
  const std::scoped_lock lock(mutex_);
  watches_mapped_files_ = true;
  startWatcher();
}

void BoundedMemory::startWatcher() {
  if (watcher_.joinable()) return;
  try {
    watcher_ = std::thread([this] { watch(); });
  } catch (const std::system_error&) {
    // No thread is left. The pages then stay until the system needs them.
  }
}

void BoundedMemory::giveUpPages() noexcept {
  // Of a shared map of a file this loses nothing: pages that were written stay in the cache of files.
  for (const auto& [memory, bytes] : files_) ::madvise(memory, bytes, MADV_DONTNEED);
  if (watches_mapped_files_) formats::giveBackMappedFiles();
}

void BoundedMemory::watch() noexcept {
  std::unique_lock lock(mutex_);
  std::chrono::milliseconds interval = kWatchInterval;
  while (!wakes_.wait_for(lock, interval, [this] { return stops_; })) {
    const std::uint64_t before = residentBytes(statm_.id);
    if (before <= start_bytes_ + most_bytes_) {
      interval = kWatchInterval;
      continue;
    }
    giveUpPages();
    // Where arrays in memory alone are too many, pages are not the cause: giving them up again at once only costs time.
    const bool freed_much = residentBytes(statm_.id) + kMuchFreed <= before;
    interval = freed_much ? kWatchInterval : std::min(2 * interval, kLongestInterval);
  }
}

}  // namespace glint::apps
