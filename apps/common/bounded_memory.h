#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <map>
#include <memory_resource>
#include <mutex>
#include <string>
#include <thread>

#include "glint/formats/descriptor.h"

namespace glint::apps {

/// Memory of at most so many bytes: large arrays that do not fit any more are maps of temporary files.
///
/// The files have no name, so that nothing is left of them, whatever happens. The system writes their pages to the disk and
/// takes the memory back when it needs it. Pages also count as memory of this process (RSS) from their first use on; as soon as
/// the process has more than its share, a thread gives them up, and the next use takes them from the cache of files or from
/// the disk. Where no thread can be started, the pages stay until the system takes them.
///
/// Code that works on such arrays in the order of their elements runs at the speed of the disk or better.
class BoundedMemory : public std::pmr::memory_resource {
 public:
  /// @param most_bytes  of arrays in memory
  /// @param folder      for temporary files, on a disk with room for all arrays
  BoundedMemory(std::uint64_t most_bytes, std::string folder);
  BoundedMemory(const BoundedMemory&) = delete;
  BoundedMemory& operator=(const BoundedMemory&) = delete;
  ~BoundedMemory() override;

  /// Counts the maps of assets, too: gives up their pages as soon as the process has more than its share, as those of arrays.
  void watchMappedFiles();

  /// Bytes of arrays that are or were in files.
  std::uint64_t filedBytes() const { return filed_bytes_; }

 private:
  void* do_allocate(std::size_t bytes, std::size_t alignment) override;
  void do_deallocate(void* memory, std::size_t bytes, std::size_t alignment) override;
  bool do_is_equal(const std::pmr::memory_resource& other) const noexcept override { return this == &other; }

  /// @throws Error io  no temporary file, or no room on the disk
  void* mapFile(std::size_t bytes);
  void startWatcher();
  void giveUpPages() noexcept;
  void watch() noexcept;

  std::uint64_t most_bytes_;
  std::string folder_;
  formats::Descriptor statm_;  ///< /proc/self/statm
  std::uint64_t start_bytes_;  ///< memory of the process when this was made
  std::atomic<std::uint64_t> held_bytes_ = 0, filed_bytes_ = 0;
  std::mutex mutex_;
  std::map<void*, std::size_t> files_;
  bool stops_ = false, watches_mapped_files_ = false;
  std::condition_variable wakes_;
  std::thread watcher_;
};

/// Makes a BoundedMemory the default resource as long as it lives.
class DefaultMemory {
 public:
  explicit DefaultMemory(BoundedMemory& memory) : before_(std::pmr::set_default_resource(&memory)) {}
  DefaultMemory(const DefaultMemory&) = delete;
  DefaultMemory& operator=(const DefaultMemory&) = delete;
  ~DefaultMemory() { std::pmr::set_default_resource(before_); }

 private:
  std::pmr::memory_resource* before_;
};

}  // namespace glint::apps
