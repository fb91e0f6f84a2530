#include "measure/time_rounds.h"

#include <algorithm>
#include <ctime>

namespace glint::apps {

double threadSeconds() {
  std::timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

std::vector<std::vector<double>> timeInTurns(std::span<const TimedQuestions> things, const TimeRounds& how) {
  const double shortest_s = how.longest_s / 4;
  std::vector<std::size_t> next(things.size(), 0);
  std::vector<std::vector<double>> times(things.size());
  for (std::size_t k = 0; k < things.size(); ++k)
    runOf(things[k].count, next[k], 0, how.longest_warm_s, things[k].ask, how.now);
  for (int round = 0; round < how.rounds; ++round) {
    for (std::size_t k = 0; k < things.size(); ++k)
      times[k].push_back(runOf(things[k].count, next[k], shortest_s, how.longest_s, things[k].ask, how.now));
  }
  return times;
}

double calmTime(std::vector<double> rounds) {
  const auto quartile = rounds.begin() + static_cast<std::ptrdiff_t>((rounds.size() - 1) / 4);
  std::nth_element(rounds.begin(), quartile, rounds.end());
  return *quartile;
}

}  // namespace glint::apps
