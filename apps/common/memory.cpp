#include "common/memory.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include "common/numbers.h"

namespace glint::apps {
namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();
constexpr double kKilo = 1024;
constexpr std::string_view kUnits = "KMGT";
std::atomic<std::uint64_t> most_bytes = 0;  // of limitMemory()
// Kept free for the system and for other programs: this share, and at least this much, but no more than half.
constexpr std::uint64_t kMarginShare = 20;
constexpr std::uint64_t kLeastMargin = std::uint64_t{64} << 20;

/// First number in a file; kUnlimited where there is no file, or where it says "max".
std::uint64_t numberIn(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t number = 0;
  return file >> number ? number : kUnlimited;
}

/// Number behind a name in a file of lines of a name and a number.
std::optional<std::uint64_t> numberAfter(const std::string& path, const std::string& name) {
  std::ifstream file(path);
  for (std::string word; file >> word;) {
    std::uint64_t number = 0;
    if (word == name && file >> number) return number;
  }
  return std::nullopt;
}

/// Bytes of a line "Name:   123 kB" of /proc; kUnlimited where there is none.
std::uint64_t procBytes(const std::string& path, const std::string& name) {
  const std::optional<std::uint64_t> kilobytes = numberAfter(path, name);
  return kilobytes ? *kilobytes << 10 : kUnlimited;
}

std::uint64_t remaining(std::uint64_t limit, std::uint64_t used) {
  if (limit == kUnlimited || used == kUnlimited) return kUnlimited;
  return limit > used ? limit - used : 0;
}

/// What a control group leaves, of either version. The kernel drops pages of files and caches of names when memory is short.
std::uint64_t remainingIn(const std::string& folder) {
  std::uint64_t used = numberIn(folder + "/memory.current"), limit = numberIn(folder + "/memory.max");
  std::vector<const char*> droppable = {"inactive_file", "active_file", "slab_reclaimable"};
  if (used == kUnlimited) {
    used = numberIn(folder + "/memory.usage_in_bytes"), limit = numberIn(folder + "/memory.limit_in_bytes");
    droppable = {"total_inactive_file", "total_active_file"};
  }
  if (used == kUnlimited) return kUnlimited;
  for (const char* name : droppable) used -= std::min(used, numberAfter(folder + "/memory.stat", name).value_or(0));
  return remaining(limit, used);
}

/// What all control groups of this process leave: its own, and those that hold it.
std::uint64_t remainingInGroups() {
  std::uint64_t least = kUnlimited;
  std::ifstream groups("/proc/self/cgroup");
  for (std::string line; std::getline(groups, line);) {
    const std::size_t first = line.find(':'), second = line.find(':', first + 1);
    if (first == std::string::npos || second == std::string::npos) continue;
    const std::string controllers = line.substr(first + 1, second - first - 1);
    if (!controllers.empty() && ("," + controllers + ",").find(",memory,") == std::string::npos) continue;
    const std::string root = controllers.empty() ? "/sys/fs/cgroup" : "/sys/fs/cgroup/memory";
    for (std::string path = line.substr(second + 1);; path.erase(path.rfind('/'))) {
      least = std::min(least, remainingIn(root + path));
      if (path.find('/') == std::string::npos) break;
    }
  }
  return least;
}

std::uint64_t remainingOf(decltype(RLIMIT_AS) resource, const std::string& used_name) {
  rlimit limit = {};
  if (::getrlimit(resource, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return kUnlimited;
  return remaining(limit.rlim_cur, procBytes("/proc/self/status", used_name));
}

}  // namespace

std::uint64_t availableMemory() {
  if (most_bytes > 0) return most_bytes;
  const std::uint64_t least = std::min({procBytes("/proc/meminfo", "MemAvailable:"), remainingInGroups(),
                                        remainingOf(RLIMIT_AS, "VmSize:"), remainingOf(RLIMIT_DATA, "VmData:")});
  if (least == kUnlimited) return least;
  return least - std::min(least / 2, std::max(least / kMarginShare, kLeastMargin));
}

void limitMemory(std::uint64_t bytes) { most_bytes = bytes; }

std::uint64_t memoryLimit() { return most_bytes; }

CLI::Validator memorySize() {
  return {[](std::string& text) {
            std::string number = text;
            const auto last = [&] {
              return number.empty() ? '\0' : static_cast<char>(std::toupper(static_cast<unsigned char>(number.back())));
            };
            if (last() == 'B') number.pop_back();
            if (last() == 'I') number.pop_back();
            double factor = 1;
            if (const std::size_t unit = kUnits.find(last()); unit != std::string_view::npos && last() != '\0') {
              factor = std::pow(kKilo, static_cast<double>(unit + 1));
              number.pop_back();
            }
            double value = 0;
            if (!parseNumber(number, value).empty() || !(value * factor >= 1) || !(value * factor < 0x1p63))
              return "'" + text + "' is no size of memory: write bytes, or a number with K, M, G or T, such as 8G";
            text = fmt::format("{:.0f}", std::floor(value * factor));
            return std::string();
          },
          "", "size"};
}

}  // namespace glint::apps
