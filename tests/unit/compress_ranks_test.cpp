#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <random>

#include "glint/bake/compressed/ranks.h"

namespace glint::bake::compress_ranks_test {
namespace {

/// Sums of some ten doubles.
constexpr double kRounding = 1e-12;
/// Shares of the budget that the search accepts as used up.
constexpr double kUsedUp = 0.985 * 0.985;

/// Clusters with few choices on convex hulls, so that every selection can be tried.
class Clusters {
 public:
  explicit Clusters(std::mt19937& random) {
    std::uniform_int_distribution<int> steps(0, 3), bytes(1, 40);
    std::uniform_real_distribution<double> unit(0, 1);
    for (int c = 0; c < 5; ++c) {
      std::vector<SizeChoice> choices(1);
      std::vector<std::pair<double, int>> gains;  // per byte, and bytes
      for (int k = steps(random); k > 0; --k) gains.emplace_back(unit(random), bytes(random));
      std::sort(gains.rbegin(), gains.rend());
      double error = unit(random) < 0.5 ? 0 : unit(random);  // some clusters can be stored without error
      for (const auto& [gain, size] : gains) error += gain * size;
      choices[0].error = error;
      for (const auto& [gain, size] : gains)
        choices.push_back(
            {false, 0, std::max(0.0, choices.back().error - gain * size), choices.back().bytes + static_cast<unsigned>(size)});
      clusters_.push_back(std::move(choices));
    }
  }

  std::vector<std::span<const SizeChoice>> spans() const { return {clusters_.begin(), clusters_.end()}; }

  std::uint64_t bytes(const std::vector<int>& selection) const {
    std::uint64_t sum = 0;
    for (std::size_t c = 0; c < clusters_.size(); ++c) sum += at(c, selection).bytes;
    return sum;
  }
  double error(const std::vector<int>& selection) const {
    double sum = 0;
    for (std::size_t c = 0; c < clusters_.size(); ++c) sum += at(c, selection).error;
    return sum;
  }
  std::vector<int> last() const {
    std::vector<int> selection;
    for (const auto& choices : clusters_) selection.push_back(static_cast<int>(choices.size()) - 1);
    return selection;
  }

  void forEachSelection(const std::function<void(const std::vector<int>&)>& visit) const {
    std::vector<int> selection(clusters_.size(), 0);
    const std::vector<int> most = last();
    for (;;) {
      visit(selection);
      std::size_t c = 0;
      while (c < selection.size() && selection[c] == most[c]) selection[c++] = 0;
      if (c == selection.size()) return;
      ++selection[c];
    }
  }

  /// The least squared error that a byte of the last steps removes.
  double leastGain(const std::vector<int>& selection) const {
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t c = 0; c < selection.size(); ++c) {
      if (selection[c] == 0) continue;
      const SizeChoice &last = at(c, selection), &before = clusters_[c][static_cast<std::size_t>(selection[c] - 1)];
      least = std::min(least, (before.error - last.error) / static_cast<double>(last.bytes - before.bytes));
    }
    return least;
  }

 private:
  const SizeChoice& at(std::size_t c, const std::vector<int>& selection) const {
    return clusters_[c][static_cast<std::size_t>(selection[c])];
  }
  std::vector<std::vector<SizeChoice>> clusters_;
};

TEST(RankAllocator, NoSelectionOfFewerBytesHasAsSmallAnError) {
  std::mt19937 random(1);
  int between = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const Clusters clusters(random);
    const RankAllocator allocator(clusters.spans());
    EXPECT_NEAR(allocator.largestError(), clusters.error(std::vector<int>(5, 0)), kRounding * allocator.largestError());
    EXPECT_NEAR(allocator.smallestError(), clusters.error(clusters.last()), kRounding * allocator.largestError());
    for (const double share : {0.01, 0.3, 0.6, 0.95, 2.0}) {
      const double bound = allocator.smallestError() + share * (allocator.largestError() - allocator.smallestError());
      const std::vector<int> chosen = allocator.allocate(bound);
      const double error = clusters.error(chosen), gain = clusters.leastGain(chosen);
      EXPECT_EQ(allocator.error(chosen), error);
      EXPECT_LE(error, bound * (1 + kRounding));
      std::uint64_t fewest = clusters.bytes(clusters.last());
      clusters.forEachSelection([&](const std::vector<int>& s) {
        if (clusters.error(s) <= error * (1 - kRounding)) {
          EXPECT_GE(clusters.bytes(s), clusters.bytes(chosen));
        }
        if (clusters.error(s) <= bound) fewest = std::min(fewest, clusters.bytes(s));
        if (clusters.bytes(chosen) == 0) return;
        // The least of error + gain * bytes: the price of a byte is that of the last one.
        EXPECT_GE(clusters.error(s) + gain * static_cast<double>(clusters.bytes(s)),
                  (error + gain * static_cast<double>(clusters.bytes(chosen))) * (1 - kRounding));
      });
      EXPECT_LT(clusters.bytes(chosen), fewest + 40);  // the longest step
      between += clusters.bytes(chosen) > 0 && chosen != clusters.last();
    }
  }
  EXPECT_GT(between, 100);
}

TEST(RankAllocator, KeepsTheBoundOfEveryCluster) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(0, 1);
  int bound_clusters = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const Clusters clusters(random);
    const auto spans = clusters.spans();
    std::vector<double> bounds;
    for (const auto& choices : spans) bounds.push_back(unit(random) * choices.front().error);
    const RankAllocator free(spans);
    RankAllocator bound(spans);
    bound.setBounds(bounds);
    for (const double share : {0.1, 0.5, 0.9, 2.0}) {
      const double target = share * free.largestError();
      const std::vector<int> chosen = bound.allocate(target), unbound = free.allocate(target);
      EXPECT_LE(clusters.error(chosen), std::max(target, bound.smallestError()) * (1 + kRounding));
      std::uint64_t fewest = clusters.bytes(clusters.last());
      for (std::size_t c = 0; c < spans.size(); ++c) {
        const auto at = static_cast<std::size_t>(chosen[c]);
        EXPECT_TRUE(spans[c][at].error <= bounds[c] || at + 1 == spans[c].size());
        bound_clusters += chosen[c] > unbound[c];
      }
      clusters.forEachSelection([&](const std::vector<int>& s) {
        bool holds = clusters.error(s) <= target;
        for (std::size_t c = 0; c < spans.size(); ++c) {
          const auto at = static_cast<std::size_t>(s[c]);
          holds = holds && (spans[c][at].error <= bounds[c] || at + 1 == spans[c].size());
        }
        if (holds) fewest = std::min(fewest, clusters.bytes(s));
      });
      EXPECT_LT(clusters.bytes(chosen), fewest + 40);  // the longest step
    }
    bound.setBounds({});
    EXPECT_EQ(bound.allocate(0.5 * free.largestError()), free.allocate(0.5 * free.largestError()));
  }
  EXPECT_GT(bound_clusters, 100);
}

TEST(RankAllocator, TakesEverythingWhereNothingIsEnough) {
  std::mt19937 random(2);
  const Clusters clusters(random);
  const RankAllocator allocator(clusters.spans());
  EXPECT_EQ(allocator.allocate(0.5 * allocator.smallestError() - 1), clusters.last());
  EXPECT_EQ(RankAllocator({}).allocate(0), std::vector<int>());
  EXPECT_EQ(RankAllocator({}).largestError(), 0);
}

/// What encoding makes of the error of a choice.
using Measure = std::function<double(double error)>;

/// Runs a search to its end. Returns how often it measured.
int run(ToleranceSearch& search, const Clusters& clusters, const Measure& measure) {
  int measured = 1;
  while (search.next(measure(clusters.error(search.selection())))) ++measured;
  EXPECT_FALSE(search.next(0));  // what is done stays so
  return measured;
}

/// The selections that an allocator can make, from few bytes to many.
std::vector<std::vector<int>> allocations(const RankAllocator& allocator, const Clusters& clusters) {
  std::vector<std::vector<int>> all = {std::vector<int>(5, 0)};
  while (all.back() != clusters.last()) {
    // Just below what it has: one more step.
    std::vector<int> next = allocator.allocate(allocator.error(all.back()) * (1 - 1e-9) - 1e-12);
    if (next == all.back()) break;
    all.push_back(std::move(next));
  }
  return all;
}

TEST(ToleranceSearch, FindsTheFewestBytesThatMeetTheBudget) {
  const Measure measures[] = {
      [](double e) { return e; },              // encoding changes nothing
      [](double e) { return 1.3 * e; },        // more by a share
      [](double e) { return 0.6 * e; },        // less
      [](double e) { return e + 2; },          // noise of rounding
      [](double e) { return 3 * e * e / 40; }  // not proportional at all
  };
  std::mt19937 random(3);
  int exact = 0, used_up = 0;
  for (int trial = 0; trial < 200; ++trial) {
    const Clusters clusters(random);
    const RankAllocator allocator(clusters.spans());
    const auto all = allocations(allocator, clusters);
    for (const Measure& measure : measures) {
      for (const double share : {0.05, 0.4, 0.8}) {
        const double budget = measure(allocator.smallestError()) +
                              share * (measure(allocator.largestError()) - measure(allocator.smallestError())) + 1e-6;
        ToleranceSearch search(clusters.spans(), budget);
        run(search, clusters, measure);
        const double reached = measure(clusters.error(search.selection()));
        ASSERT_LE(reached, budget);
        const auto best =
            std::find_if(all.begin(), all.end(), [&](const auto& s) { return measure(clusters.error(s)) <= budget; });
        ASSERT_NE(best, all.end());
        exact += search.selection() == *best;
        used_up += search.selection() != *best && reached >= kUsedUp * budget;
        EXPECT_TRUE(search.selection() == *best || reached >= kUsedUp * budget)
            << "trial " << trial << ": " << clusters.bytes(search.selection()) << " bytes, not " << clusters.bytes(*best);
      }
    }
  }
  EXPECT_GT(exact, 2000);
  EXPECT_GT(used_up, 0);
}

TEST(ToleranceSearch, TakesEverythingWhereTheBudgetCannotBeMet) {
  std::mt19937 random(4);
  for (int trial = 0; trial < 20; ++trial) {
    const Clusters clusters(random);
    ToleranceSearch search(clusters.spans(), 0.5);
    EXPECT_LE(run(search, clusters, [](double e) { return e + 1; }), 17);
    EXPECT_EQ(search.selection(), clusters.last());
  }
}

TEST(ToleranceSearch, TakesNothingWhereNothingIsNeeded) {
  std::mt19937 random(5);
  for (int trial = 0; trial < 20; ++trial) {
    const Clusters clusters(random);
    const double everything = clusters.error(std::vector<int>(5, 0));
    ToleranceSearch search(clusters.spans(), 2 * everything + 1);
    EXPECT_EQ(run(search, clusters, [](double e) { return e; }), 1);
    EXPECT_EQ(search.selection(), std::vector<int>(5, 0));
  }
}

TEST(ToleranceSearch, KeepsBoundsThatAreSetOnTheWay) {
  std::mt19937 random(5);
  int raised = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const Clusters clusters(random);
    const auto spans = clusters.spans();
    const double budget = 0.7 * RankAllocator(spans).largestError();
    ToleranceSearch search(spans, budget);
    const auto exact = [](double error) { return error; };
    run(search, clusters, exact);
    const std::vector<int> before = search.selection();
    std::vector<double> bounds;
    for (const auto& choices : spans) bounds.push_back(0.5 * choices.front().error);
    search.setBounds(bounds);
    run(search, clusters, exact);
    EXPECT_LE(clusters.error(search.selection()), std::max(budget, clusters.error(clusters.last())) * (1 + kRounding));
    for (std::size_t c = 0; c < spans.size(); ++c) {
      const auto at = static_cast<std::size_t>(search.selection()[c]);
      EXPECT_TRUE(spans[c][at].error <= bounds[c] || at + 1 == spans[c].size());
      raised += search.selection()[c] > before[c];
    }
  }
  EXPECT_GT(raised, 10);
}

TEST(ToleranceSearch, KeepsTheBudgetWhereMeasuresAreNotMonotonic) {
  // Scaling of images can make a choice of more bytes worse. The search may then miss the fewest bytes, but not the budget.
  std::mt19937 random(6);
  for (int trial = 0; trial < 200; ++trial) {
    const Clusters clusters(random);
    const double budget = 0.4 * clusters.error(std::vector<int>(5, 0)) + 0.1 * trial;
    const Measure measure = [&](double e) { return e * (1 + 0.5 * std::sin(7 * e + trial)); };
    ToleranceSearch search(clusters.spans(), budget);
    EXPECT_LE(run(search, clusters, measure), 17);
    const double reached = measure(clusters.error(search.selection()));
    if (measure(clusters.error(clusters.last())) <= budget) {
      EXPECT_LE(reached, budget) << trial;
    }
  }
}

}  // namespace
}  // namespace glint::bake::compress_ranks_test
