#include "measure/time_rounds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

namespace glint::apps::time_rounds_test {
namespace {

/// The clock of these tests: questions move it on.
double clock_s = 0;
double readClock() { return clock_s; }

TimeRounds howOf(int rounds, double longest_s, double longest_warm_s = 1) {
  return {.rounds = rounds, .longest_s = longest_s, .longest_warm_s = longest_warm_s, .now = readClock};
}

/// Nanoseconds of a density in each round, recorded beside twelve other programs on two cores: of the ring's pyramid of docs/PLANS.md
/// (307 MB), of the pyramid of a probe of it (20 MB), and of 16 copies of this one.
const std::vector<double> kWhole = {2033, 2066, 2003, 2045, 2024, 2012, 2032, 2027, 1962};
const std::vector<double> kProbe = {604, 617, 630, 594, 597, 609, 617, 606, 590};
const std::vector<double> kCopies = {1919, 1874, 1815, 1911, 1845, 1865, 1892, 1767, 1836};

TEST(CalmTime, OfCopiesIsThatOfAWholeMapAndOfOneProbeIsNot) {
  constexpr double kSame = 1.15;
  EXPECT_LE(calmTime(kWhole), kSame * calmTime(kCopies));
  EXPECT_LE(calmTime(kCopies), kSame * calmTime(kWhole));
  EXPECT_GT(calmTime(kWhole), 3 * calmTime(kProbe));
}

TEST(CalmTime, IsThatOfUndisturbedRounds) {
  constexpr double kSame = 1.05;
  std::vector<double> rounds = kWhole;
  for (std::size_t k = 0; k < rounds.size(); ++k)
    if (k % 3 != 1) rounds[k] *= 1.5 + 0.25 * static_cast<double>(k);  // six of nine
  EXPECT_LE(calmTime(rounds), kSame * calmTime(kWhole));
  EXPECT_GE(calmTime(rounds), calmTime(kWhole) / kSame);
}

TEST(CalmTime, IsNotThatOfOneLuckyRound) {
  EXPECT_EQ(calmTime({1, 5, 5, 5, 5, 5, 5, 5, 5}), 5);
  EXPECT_EQ(calmTime({3}), 3);
}

TEST(TimeInTurns, AMachineThatIsBusyForHalfOfTheTimeChangesNoOrder) {
  // Four of the nine rounds take three times as long.
  constexpr double kQuick_s = 1e-5, kSlow_s = 1.2e-5;
  clock_s = 0;
  const auto takes = [](double seconds) { return [=](std::size_t) { clock_s += seconds * (clock_s < 0.03 ? 3 : 1); }; };
  const std::vector<TimedQuestions> things = {{100, takes(kQuick_s)}, {100, takes(kSlow_s)}};
  const auto times = timeInTurns(things, howOf(9, 0.005));
  EXPECT_GT(*std::max_element(times[0].begin(), times[0].end()), 2.5 * kQuick_s) << "the disturbance is among the rounds";
  EXPECT_NEAR(calmTime(times[0]), kQuick_s, 1e-9);
  EXPECT_NEAR(calmTime(times[1]), kSlow_s, 1e-9);
}

TEST(TimeInTurns, ThingsTakeTurnsAndTheFirstQuestionsAreNotTimed) {
  clock_s = 0;
  std::string order;
  std::vector<std::size_t> asked;
  const auto first = [&](std::size_t k) {
    if (order.empty() || order.back() != 'a') order += 'a';
    // The first time round takes as long as reading a file does.
    clock_s += asked.size() < 10 ? 1e-3 : 1e-5;
    asked.push_back(k);
  };
  const auto second = [&](std::size_t) {
    if (order.back() != 'b') order += 'b';
    clock_s += 1e-5;
  };
  const auto times = timeInTurns(std::vector<TimedQuestions>{{10, first}, {10, second}}, howOf(3, 1e-4));
  EXPECT_EQ(order, "abababab");
  for (const double seconds : times[0]) EXPECT_NEAR(seconds, 1e-5, 1e-9);
  for (std::size_t k = 0; k < asked.size(); ++k) ASSERT_EQ(asked[k], k % 10) << "each round goes on where the last one ended";
}

TEST(TimeInTurns, SlowQuestionsEndATurn) {
  clock_s = 0;
  int count = 0;
  const auto slow = [&](std::size_t) { ++count, clock_s += 0.01; };
  const auto times = timeInTurns(std::vector<TimedQuestions>{{4096, slow}}, howOf(9, 0.006, 0.02));
  EXPECT_EQ(count, 2 + 9) << "of the warm time two, of each round one";
  EXPECT_NEAR(times[0].front(), 0.01, 1e-9);
}

}  // namespace
}  // namespace glint::apps::time_rounds_test
