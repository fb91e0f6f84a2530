#pragma once

#include <optional>
#include <string>

namespace glint::apps {

/// The right to make one asset, among all farms on all machines that see its folder.
///
/// It is a lock of one byte of the file .glint-farm.lock in the asset's folder; the asset's name says which byte. The system gives it
/// back when a program ends, however it ends, so that nothing has to be cleaned up after kill -9, and no clock is asked whether a
/// lock is old. It belongs to the open file: a child that gets the file keeps the lock as long as it works, even without its farm.
/// File systems of networks pass such locks on (NFS 4). Where there are no locks, every lock is given: two farms may then do the same
/// work, and the assets stay whole, because tools put them in place in one step.
class EntryLock {
 public:
  /// @return nothing if another program makes the asset now
  /// @throws Error io if the file of the locks cannot be opened
  static std::optional<EntryLock> take(const std::string& asset);

  /// Whether another program holds the lock of an asset.
  static bool isTaken(const std::string& asset);

  EntryLock(EntryLock&& other) noexcept : file_(other.file_) { other.file_ = -1; }
  EntryLock& operator=(EntryLock&&) = delete;
  ~EntryLock();

  /// The open file, for the child.
  int file() const { return file_; }

 private:
  explicit EntryLock(int file) : file_(file) {}
  int file_;
};

}  // namespace glint::apps
