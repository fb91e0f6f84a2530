#include "common/memory.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cmath>
#include <fstream>
#include <limits>
#include <string_view>

#include "common/numbers.h"

namespace glint::apps {
namespace {

constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();
constexpr double kKilo = 1024;
constexpr std::string_view kUnits = "KMGT";
std::atomic<std::uint64_t> most_bytes = 0;  // of limitMemory()
// Kept free for the system and for other programs: this share, and at least this much.
constexpr std::uint64_t kMarginShare = 20;
constexpr std::uint64_t kLeastMargin = std::uint64_t{64} << 20;

/// First number in a file; kUnlimited where there is no file, or where it says "max".
std::uint64_t numberIn(const std::string& path) {
  std::ifstream file(path);
  std::uint64_t number = 0;
  return file >> number ? number : kUnlimited;
}

/// Number of bytes behind a name in a file of lines "Name:   123 kB".
std::uint64_t namedBytes(const std::string& path, const std::string& name) {
  std::ifstream file(path);
  for (std::string word; file >> word;) {
    std::uint64_t kilobytes = 0;
    if (word == name && file >> kilobytes) return kilobytes << 10;
  }
  return kUnlimited;
}

std::uint64_t remaining(std::uint64_t limit, std::uint64_t used) {
  if (limit == kUnlimited || used == kUnlimited) return kUnlimited;
  return limit > used ? limit - used : 0;
}

/// Pages of files in a control group's use, which the kernel drops when memory is short.
std::uint64_t droppable(const std::string& folder, const std::string& name) {
  std::ifstream file(folder + "/memory.stat");
  for (std::string word; file >> word;) {
    std::uint64_t bytes = 0;
    if (word == name && file >> bytes) return bytes;
  }
  return 0;
}

/// What a control group leaves, of either version.
std::uint64_t remainingIn(const std::string& folder) {
  std::uint64_t used = numberIn(folder + "/memory.current"), limit = numberIn(folder + "/memory.max");
  std::uint64_t files = droppable(folder, "inactive_file");
  if (used == kUnlimited) {
    used = numberIn(folder + "/memory.usage_in_bytes"), limit = numberIn(folder + "/memory.limit_in_bytes");
    files = droppable(folder, "total_inactive_file");
  }
  return remaining(limit, used == kUnlimited ? used : used - std::min(used, files));
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
  return remaining(limit.rlim_cur, namedBytes("/proc/self/status", used_name));
}

}  // namespace

std::uint64_t availableMemory() {
  if (most_bytes > 0) return most_bytes;
  const std::uint64_t least = std::min({namedBytes("/proc/meminfo", "MemAvailable:"), remainingInGroups(),
                                        remainingOf(RLIMIT_AS, "VmSize:"), remainingOf(RLIMIT_DATA, "VmData:")});
  if (least == kUnlimited) return least;
  return least - std::min(least, std::max(least / kMarginShare, kLeastMargin));
}

void limitMemory(std::uint64_t bytes) { most_bytes = bytes; }

std::string memoryText(double bytes) {
  double value = bytes;
  std::string unit = "bytes";
  for (const char letter : kUnits) {
    if (value < kKilo) break;
    value /= kKilo;
    unit = fmt::format("{}B", letter);
  }
  const double step = value < 10 ? 0.01 : value < 100 ? 0.1 : 1;
  return fmt::format("{:.{}f} {}", std::ceil(value / step) * step, unit == "bytes" || step == 1 ? 0 : value < 10 ? 2 : 1, unit);
}

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
