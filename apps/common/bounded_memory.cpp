#include "common/bounded_memory.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <utility>

#include "glint/formats/descriptor.h"
#include "glint/formats/system_error.h"

namespace glint::apps {
namespace {

constexpr std::size_t kLargeBytes = 1 << 20;  // smaller arrays are always in memory
constexpr std::chrono::milliseconds kWatchInterval{1};

/// Memory of the process, mapped files included.
std::uint64_t residentBytes() {
  std::ifstream file("/proc/self/statm");
  std::uint64_t total = 0, resident = 0;
  file >> total >> resident;
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
    : most_bytes_(most_bytes), folder_(std::move(folder)), start_bytes_(residentBytes()) {}

BoundedMemory::~BoundedMemory() {
  if (!watcher_.joinable()) return;
  {
    const std::scoped_lock lock(mutex_);
    stops_ = true;
  }
  wakes_.notify_all();
  watcher_.join();
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
  // With its room taken now, a full disk is an error here and not a signal later.
  if (const int error = ::posix_fallocate(file.id, 0, static_cast<off_t>(bytes)); error != 0)
    formats::throwUnwritable(folder_, "has no room for arrays that do not fit into memory", error);
  void* memory = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file.id, 0);
  if (memory == MAP_FAILED) formats::throwUnwritable(folder_, "cannot be mapped", errno);
  const std::scoped_lock lock(mutex_);
  files_[memory] = bytes;
  filed_bytes_ += bytes;
  if (!watcher_.joinable()) watcher_ = std::thread([this] { watch(); });
  return memory;
}

void BoundedMemory::giveUpPages() {
  // Of a shared map of a file this loses nothing: pages that were written stay in the cache of files.
  for (const auto& [memory, bytes] : files_) ::madvise(memory, bytes, MADV_DONTNEED);
}

void BoundedMemory::watch() {
  std::unique_lock lock(mutex_);
  while (!wakes_.wait_for(lock, kWatchInterval, [this] { return stops_; }))
    if (residentBytes() > start_bytes_ + most_bytes_) giveUpPages();
}

}  // namespace glint::apps
