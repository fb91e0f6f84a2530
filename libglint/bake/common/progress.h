#pragma once

#include <cstddef>
#include <functional>
#include <mutex>

namespace glint::bake {

/// Called now and then while a builder works: `done` of `total` units, from any thread but never concurrently, `done` never
/// decreasing. An empty function is fine.
using ProgressFn = std::function<void(std::size_t done, std::size_t total)>;

/// Counts units of work as threads finish them, and reports one at a time.
class ProgressCounter {
 public:
  /// @param report  must outlive the counter
  ProgressCounter(const ProgressFn& report, std::size_t total) : report_(report), total_(total) {}

  /// More work than was known at first. Not while threads count.
  void grow(std::size_t units) { total_ += units; }

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
