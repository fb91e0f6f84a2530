#pragma once

#include <cstddef>
#include <functional>
#include <mutex>

namespace glint::bake {

/// A function that a builder calls from time to time: `done` of `total` units of work are finished. Calls come from any thread,
/// but never two at once, and `done` never decreases. May be empty.
using ProgressFn = std::function<void(std::size_t done, std::size_t total)>;

/// Counts units of work that threads finish, and reports each.
class ProgressCounter {
 public:
  /// @param report  must outlive the counter
  ProgressCounter(const ProgressFn& report, std::size_t total) : report_(report), total_(total) {}

  /// Adds units to the total, when there is more work than was known. Not while threads call advance().
  void grow(std::size_t units) { total_ += units; }

  /// Reports one more finished unit.
  void advance() {
    if (!report_) return;
    const std::lock_guard lock(mutex_);
    report_(++done_, total_);
  }

 private:
  const ProgressFn& report_;
  std::mutex mutex_;
  std::size_t done_ = 0;
  std::size_t total_;
};

}  // namespace glint::bake
