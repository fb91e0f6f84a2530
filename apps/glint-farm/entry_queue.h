#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "manifest/manifest.h"

namespace glint::apps {

/// Entries of a manifest in an order in which each comes after those that it needs.
/// @note thread-safe
class EntryQueue {
 public:
  /// @param wanted  entries to hand out; entries that these need are wanted, too, or done
  EntryQueue(const Manifest& manifest, const std::vector<std::size_t>& wanted);

  /// Waits for the next entry. Nothing: all have ended, or `stopped` says so.
  std::optional<std::size_t> next(const std::function<bool()>& stopped);

  // Each entry that next() gave ends in one of these.

  void done(std::size_t entry);
  /// @return entries that need it and are now never handed out
  std::vector<std::size_t> failed(std::size_t entry);
  /// Hands it out again, after the others.
  void again(std::size_t entry);
  /// Hands it out again in a while: another program makes it.
  void busy(std::size_t entry);

 private:
  using Clock = std::chrono::steady_clock;
  struct Later {
    std::size_t entry;
    Clock::time_point when;
  };
  std::optional<std::size_t> take();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::size_t> ready_;
  std::deque<Later> later_;
  std::size_t running_ = 0;
  std::vector<std::size_t> waits_for_;           ///< by entry: how many that it needs have not ended
  std::vector<std::vector<std::size_t>> users_;  ///< by entry: those that need it
  std::vector<bool> lost_;                       ///< by entry: one that it needs has failed
};

}  // namespace glint::apps
