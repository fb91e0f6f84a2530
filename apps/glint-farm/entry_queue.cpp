#include "glint-farm/entry_queue.h"

namespace glint::apps {
namespace {
// Signals and other farms wake nobody here.
constexpr auto kBetweenLooks = std::chrono::milliseconds(50);
constexpr auto kBusyFor = std::chrono::milliseconds(200);
}  // namespace

EntryQueue::EntryQueue(const Manifest& manifest, const std::vector<std::size_t>& wanted)
    : waits_for_(manifest.entries.size()), users_(manifest.entries.size()), lost_(manifest.entries.size()) {
  std::vector<bool> is_wanted(manifest.entries.size());
  for (const std::size_t k : wanted) is_wanted[k] = true;
  for (const std::size_t k : wanted) {
    for (const std::string& key : manifest.entries[k].after) {
      const std::size_t needed = manifest.entry_of_key.at(key);
      if (is_wanted[needed]) users_[needed].push_back(k), ++waits_for_[k];
    }
    if (waits_for_[k] == 0) ready_.push_back(k);
  }
}

std::optional<std::size_t> EntryQueue::take() {
  if (!ready_.empty()) {
    const std::size_t entry = ready_.front();
    ready_.pop_front();
    return entry;
  }
  if (!later_.empty() && later_.front().when <= Clock::now()) {
    const std::size_t entry = later_.front().entry;
    later_.pop_front();
    return entry;
  }
  return {};
}

std::optional<std::size_t> EntryQueue::next(const std::function<bool()>& stopped) {
  std::unique_lock lock(mutex_);
  while (!stopped()) {
    if (const auto entry = take()) {
      ++running_;
      return entry;
    }
    if (running_ == 0 && later_.empty()) return {};
    changed_.wait_for(lock, kBetweenLooks);
  }
  return {};
}

void EntryQueue::done(std::size_t entry) {
  const std::lock_guard lock(mutex_);
  --running_;
  // What is made of it comes next, while its file is still in memory.
  for (const std::size_t user : users_[entry])
    if (--waits_for_[user] == 0 && !lost_[user]) ready_.push_front(user);
  changed_.notify_all();
}

std::vector<std::size_t> EntryQueue::failed(std::size_t entry) {
  const std::lock_guard lock(mutex_);
  --running_;
  std::vector<std::size_t> lost, from = {entry};
  while (!from.empty()) {
    const std::size_t one = from.back();
    from.pop_back();
    for (const std::size_t user : users_[one]) {
      if (lost_[user]) continue;
      lost_[user] = true;
      lost.push_back(user), from.push_back(user);
    }
  }
  changed_.notify_all();
  return lost;
}

void EntryQueue::again(std::size_t entry) {
  const std::lock_guard lock(mutex_);
  --running_;
  ready_.push_back(entry);
  changed_.notify_all();
}

void EntryQueue::busy(std::size_t entry) {
  const std::lock_guard lock(mutex_);
  --running_;
  later_.push_back({entry, Clock::now() + kBusyFor});
}

}  // namespace glint::apps
