#include "common/progress_reporter.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/standard_streams.h"

namespace glint::apps {
namespace {

constexpr double kQuietSeconds = 1.0;
constexpr double kSecondsBetweenUpdates = 0.1;
constexpr int kBarWidth = 30;

std::string duration(double seconds) {
  const auto whole = static_cast<long long>(seconds + 0.5);
  if (whole >= 3600) return fmt::format("{}:{:02}:{:02}", whole / 3600, whole / 60 % 60, whole % 60);
  return fmt::format("{}:{:02}", whole / 60, whole % 60);
}

double remainingSeconds(std::size_t done, std::size_t total, double elapsed_s) {
  return done == 0 ? 0 : elapsed_s * static_cast<double>(total - std::min(done, total)) / static_cast<double>(done);
}

}  // namespace

ProgressReporter::ProgressReporter(ProgressMode mode, std::string tool, std::string stage)
    : mode_(mode), tool_(std::move(tool)), stage_(std::move(stage)), start_(Clock::now()), last_(start_) {
  if (mode_ == ProgressMode::automatic && isatty(STDERR_FILENO) == 0) mode_ = ProgressMode::none;
}

ProgressReporter::~ProgressReporter() { clear(); }

void ProgressReporter::clear() {
  if (drawn_) writeStderr("\r\033[K");
  drawn_ = false;
}

void ProgressReporter::update(std::size_t done, std::size_t total) {
  if (mode_ == ProgressMode::none || total == 0) return;
  const auto now = Clock::now();
  const bool last = done >= total;
  if (!last && std::chrono::duration<double>(now - last_).count() < kSecondsBetweenUpdates) return;
  last_ = now;
  const double elapsed_s = std::chrono::duration<double>(now - start_).count();
  if (mode_ == ProgressMode::json) {
    printJson(done, total, elapsed_s);
  } else if (elapsed_s >= kQuietSeconds) {
    drawBar(done, total, elapsed_s);
  }
}

void ProgressReporter::drawBar(std::size_t done, std::size_t total, double elapsed_s) {
  const double fraction = std::min(1.0, static_cast<double>(done) / static_cast<double>(total));
  const int filled = static_cast<int>(fraction * kBarWidth);
  writeStderr(fmt::format("\r\033[K{}: {} [{:#<{}}{: <{}}] {:3.0f}% {:.3g}/s, {} left", tool_, stage_, "", filled, "",
                          kBarWidth - filled, fraction * 100, static_cast<double>(done) / elapsed_s,
                          duration(remainingSeconds(done, total, elapsed_s))));
  drawn_ = true;
}

void ProgressReporter::printJson(std::size_t done, std::size_t total, double elapsed_s) {
  const nlohmann::json line = {{"stage", stage_},
                               {"done", done},
                               {"total", total},
                               {"elapsed_s", elapsed_s},
                               {"rate_per_s", elapsed_s > 0 ? static_cast<double>(done) / elapsed_s : 0},
                               {"remaining_s", remainingSeconds(done, total, elapsed_s)}};
  writeStderr(nlohmann::json{{"progress", line}}.dump() + "\n");
}

}  // namespace glint::apps
