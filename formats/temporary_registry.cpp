#include "glint/formats/temporary_registry.h"

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstring>

#include "glint/formats/atomic_file.h"

namespace glint::formats {
namespace {

enum SlotState : int { kFree, kBeingSet, kSet };

/// A path at a fixed place, where a signal handler finds it without a lock.
struct Slot {
  std::atomic<int> state = kFree;
  pid_t process = 0;  ///< a child after fork() must not remove the files of its parent
  char path[PATH_MAX] = {};
};
static_assert(std::atomic<int>::is_always_lock_free);

Slot slots[16];  // a program writes one or two files at a time

}  // namespace

int registerTemporary(const std::filesystem::path& path) {
  std::error_code unknown;
  const std::string absolute = std::filesystem::absolute(path, unknown).string();
  if (unknown || absolute.size() >= PATH_MAX) return -1;
  for (int k = 0; k < static_cast<int>(std::size(slots)); ++k) {
    int expected = kFree;
    if (!slots[k].state.compare_exchange_strong(expected, kBeingSet)) continue;
    std::memcpy(slots[k].path, absolute.c_str(), absolute.size() + 1);
    slots[k].process = ::getpid();
    slots[k].state.store(kSet);
    return k;
  }
  return -1;
}

void forgetTemporary(int slot) {
  if (slot >= 0) slots[slot].state.store(kFree);
}

void removeTemporaryFiles() noexcept {
  const int error = errno;
  for (const Slot& slot : slots) {
    if (slot.state.load() == kSet && slot.process == ::getpid()) ::unlink(slot.path);
  }
  errno = error;
}

}  // namespace glint::formats
