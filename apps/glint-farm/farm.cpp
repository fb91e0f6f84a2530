#include "glint-farm/farm.h"

#include <atomic>
#include <exception>
#include <mutex>
#include <thread>

#include "glint-farm/entry_queue.h"

namespace glint::apps {
namespace {

using Outcome = EntryTry::Outcome;

/// What the threads of a farm share.
class Farm {
 public:
  Farm(const Manifest& manifest, const std::vector<std::size_t>& wanted, EntryMaker& maker, RunReport& report,
       const FarmOptions& options)
      : manifest_(manifest),
        maker_(maker),
        report_(report),
        options_(options),
        queue_(manifest, wanted),
        tries_(manifest.entries.size()) {}

  /// Works until nothing is left. Runs in several threads.
  void work() noexcept {
    try {
      while (const auto entry = queue_.next([this] { return error_seen_ || options_.stopped(); }))
        finish(*entry, maker_.make(manifest_.entries[*entry]));
    } catch (...) {
      const std::lock_guard lock(mutex_);
      if (!error_) error_ = std::current_exception();
      error_seen_ = true;
    }
  }

  void rethrow() const {
    if (error_) std::rethrow_exception(error_);
  }

 private:
  void finish(std::size_t k, const EntryTry& last) {
    const ManifestEntry& entry = manifest_.entries[k];
    if (last.outcome == Outcome::busy) return queue_.busy(k);
    if (last.outcome == Outcome::stopped && options_.stopped()) return;
    const int tries = ++tries_[k];
    if (last.outcome == Outcome::known) {
      report_.known(entry);
      return queue_.done(k);
    }
    if (last.outcome == Outcome::made || last.outcome == Outcome::unchanged) {
      report_.made(entry, last, tries);
      return queue_.done(k);
    }
    if (last.may_help_again && tries <= options_.retries) return queue_.again(k);
    report_.failed(entry, last, tries);
    for (const std::size_t user : queue_.failed(k)) report_.notMade(manifest_.entries[user], entry);
  }

  const Manifest& manifest_;
  EntryMaker& maker_;
  RunReport& report_;
  const FarmOptions& options_;
  EntryQueue queue_;
  std::vector<int> tries_;  ///< by entry; an entry is with one thread at a time
  std::mutex mutex_;
  std::exception_ptr error_;
  std::atomic<bool> error_seen_ = false;
};

}  // namespace

void runFarm(const Manifest& manifest, const std::vector<std::size_t>& entries, EntryMaker& maker, RunReport& report,
             const FarmOptions& options) {
  std::vector<std::size_t> wanted;
  for (const std::size_t k : entries) {
    if (options.stopped()) return;
    if (maker.isKnown(manifest.entries[k]))
      report.known(manifest.entries[k]);
    else
      wanted.push_back(k);
  }
  Farm farm(manifest, wanted, maker, report, options);
  std::vector<std::jthread> threads;
  for (int t = 1; t < options.jobs && static_cast<std::size_t>(t) < wanted.size(); ++t)
    threads.emplace_back([&] { farm.work(); });
  farm.work();
  threads.clear();  // joins
  farm.rethrow();
}

}  // namespace glint::apps
