#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace glint::apps {

enum class ProgressMode : std::uint8_t {
  automatic,  ///< a bar on stderr, when that is a terminal and the work takes more than a second
  none,
  json,  ///< one JSON object a line on stderr, at most ten a second, and one at the end
};

/// Shows how far one stage of the work is: fraction, rate and time left.
/// @note update() may come from any thread but not concurrently, as bake::ProgressFn promises
class ProgressReporter {
 public:
  ProgressReporter(ProgressMode mode, std::string tool, std::string stage);
  ~ProgressReporter();
  ProgressReporter(const ProgressReporter&) = delete;
  ProgressReporter& operator=(const ProgressReporter&) = delete;

  void update(std::size_t done, std::size_t total);

  /// Leaves the line of the bar to what is printed next. The next update draws the bar again.
  void clear();

 private:
  using Clock = std::chrono::steady_clock;

  void drawBar(std::size_t done, std::size_t total, double elapsed_s);
  void printJson(std::size_t done, std::size_t total, double elapsed_s);

  ProgressMode mode_;
  std::string tool_;
  std::string stage_;
  Clock::time_point start_;
  Clock::time_point last_;
  bool drawn_ = false;
};

}  // namespace glint::apps
