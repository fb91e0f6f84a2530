#include "glint/bake/compressed/ranks.h"

#include <algorithm>
#include <cmath>

namespace glint::bake {
namespace {

// The search ends when the measured error lies between this part of the tolerance and all of it.
constexpr double kTightness = 0.985;
constexpr int kMostCorrections = 16;
// Corrections that follow the line between two trials; the others halve the interval.
constexpr int kLineCorrections = 8;

}  // namespace

RankAllocator::RankAllocator(std::vector<std::span<const SizeChoice>> clusters) : clusters_(std::move(clusters)) {
  for (std::size_t c = 0; c < clusters_.size(); ++c) {
    const auto& choices = clusters_[c];
    for (std::size_t i = 1; i < choices.size(); ++i) {
      const double gain = choices[i - 1].error - choices[i].error;
      const auto bytes = static_cast<double>(choices[i].bytes - choices[i - 1].bytes);
      steps_.push_back({gain / bytes, static_cast<std::uint32_t>(c), static_cast<std::uint32_t>(i), false});
    }
  }
  setBounds({});
}

void RankAllocator::setBounds(std::span<const double> bounds) {
  bound_steps_ = 0;
  for (Step& step : steps_) {
    step.bound = !bounds.empty() && clusters_[step.cluster][step.choice - 1].error > bounds[step.cluster];
    bound_steps_ += step.bound;
  }
  // Gains per byte and errors fall along a hull, so a stable sort keeps the steps of a cluster in order.
  std::stable_sort(steps_.begin(), steps_.end(), [](const Step& a, const Step& b) {
    return a.bound != b.bound ? a.bound : a.gain_per_byte > b.gain_per_byte;
  });
  double error = 0;
  for (const auto& choices : clusters_) error += choices[0].error;
  errors_ = {error};
  for (const Step& step : steps_) {
    const auto& choices = clusters_[step.cluster];
    error -= choices[step.choice - 1].error - choices[step.choice].error;
    errors_.push_back(error);
  }
}

std::vector<int> RankAllocator::allocate(double squared_error) const {
  std::vector<int> selection(clusters_.size(), 0);
  for (std::size_t i = 0; i < steps_.size() && (i < bound_steps_ || errors_[i] > squared_error); ++i)
    selection[steps_[i].cluster] = static_cast<int>(steps_[i].choice);
  return selection;
}

double RankAllocator::error(std::span<const int> selection) const {
  double sum = 0;
  for (std::size_t c = 0; c < clusters_.size(); ++c) sum += clusters_[c][static_cast<std::size_t>(selection[c])].error;
  return sum;
}

ToleranceSearch::ToleranceSearch(std::vector<std::span<const SizeChoice>> clusters, double budget)
    : allocator_(std::move(clusters)), budget_(budget), target_(budget), selection_(allocator_.allocate(budget)) {}

void ToleranceSearch::setBounds(std::span<const double> bounds) {
  allocator_.setBounds(bounds);
  met_ = failed_ = {};
  corrections_ = 0;
  done_ = false;
  selection_ = allocator_.allocate(target_);
}

bool ToleranceSearch::next(double measured) {
  if (done_) return false;
  // Note whether this target met the budget, and stop if it did so closely enough.
  const bool met = measured <= budget_;
  if (met) {
    if (target_ > met_.target) met_ = {target_, measured};
    if (measured >= kTightness * kTightness * budget_ || target_ >= allocator_.largestError()) return finish(target_);
  } else if (failed_.target == 0 || target_ < failed_.target) {
    failed_ = {target_, measured};
  }
  if (++corrections_ == kMostCorrections || (!met && target_ <= allocator_.smallestError())) return finish(met_.target);
  target_ = nextTarget(measured);
  selection_ = allocator_.allocate(target_);
  return true;
}

double ToleranceSearch::nextTarget(double measured) const {
  // Aim at the middle of the wanted interval.
  const double aim = budget_ * (1 + kTightness * kTightness) / 2;
  if (met_.target > 0 && failed_.target > 0) {
    constexpr double kNearestEnd = 0.1;
    double share = 0.5;
    if (corrections_ <= kLineCorrections && met_.measured > 0)
      share =
          std::clamp(std::log(aim / met_.measured) / std::log(failed_.measured / met_.measured), kNearestEnd, 1 - kNearestEnd);
    return met_.target * std::pow(failed_.target / met_.target, share);
  }
  // In proportion; beyond the end that is known.
  const double target = allocator_.error(selection_) * aim / measured;
  if (met_.target > 0 && target <= met_.target) return 2 * met_.target;
  if (failed_.target > 0 && target >= failed_.target) return failed_.target / 2;
  return target;
}

bool ToleranceSearch::finish(double target) {
  done_ = true;
  target_ = target;
  selection_ = allocator_.allocate(target);
  return false;
}

}  // namespace glint::bake
