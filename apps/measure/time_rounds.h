#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace glint::apps {

/// Time that this thread has had of a processor, seconds.
double threadSeconds();

/// Questions of which the clock would take a share, and so many between two looks at it.
inline constexpr double kQuickQuestion_s = 5e-6;
inline constexpr std::size_t kBetweenLooks = 64;

/// Asks ask(next), and the questions after it, in turn. The run ends when every question was asked and `shortest_s` have passed, or
/// after `longest_s`.
/// @param count  questions, which go round
/// @param next   the first question; becomes the one after the last
/// @param now    a clock, seconds
/// @return seconds of a question
template <class Ask>
double runOf(std::size_t count, std::size_t& next, double shortest_s, double longest_s, const Ask& ask, double (*now)()) {
  const double start = now();
  std::size_t asked = 0;
  double seconds = 0;
  do {
    const bool quick = asked > 0 && seconds < kQuickQuestion_s * static_cast<double>(asked);
    for (std::size_t k = 0; k < (quick ? kBetweenLooks : 1); ++k, ++asked) {
      ask(next);
      next = next + 1 < count ? next + 1 : 0;
    }
    seconds = now() - start;
  } while (seconds < longest_s && (asked < count || seconds < shortest_s));
  return seconds / static_cast<double>(asked);
}

/// A thing that is asked.
struct TimedQuestions {
  std::size_t count = 0;  ///< of different questions
  std::function<void(std::size_t)> ask;
};

/// How things are timed.
struct TimeRounds {
  int rounds = 9;
  double longest_s = 0.02;          ///< of one thing in a round
  double longest_warm_s = 0.1;      ///< of one thing before the first round
  double (*now)() = threadSeconds;  ///< a clock, seconds
};

/// Times things in turns: a round asks each of them for a while, so that a machine that is busy for some rounds is so for all things.
/// Before the first round each is asked all of its questions once, which is not timed.
/// @return seconds of a question of each thing in each round, [thing][round]
std::vector<std::vector<double>> timeInTurns(std::span<const TimedQuestions> things, const TimeRounds& how);

/// The lower quartile of some rounds: other programs take caches away and make questions slower, hardly ever quicker. So up to three
/// quarters of the rounds may be disturbed; the least would be that of one lucky round.
/// @param rounds  at least one
double calmTime(std::vector<double> rounds);

}  // namespace glint::apps
