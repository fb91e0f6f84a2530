#include "glint/bake/compressed/ranks.h"

#include <algorithm>
#include <cmath>

namespace glint::bake {
namespace {

// The search ends when the measured error lies between this part of the tolerance and all of it.
constexpr double kTightness = 0.985;
constexpr int kMostCorrections = 16;

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

double RankAllocator::gainPerByte(double squared_error) const {
  double gain = bound_steps_ > 0 && bound_steps_ < steps_.size() ? steps_[bound_steps_].gain_per_byte : 0;
  for (std::size_t i = bound_steps_; i < steps_.size() && errors_[i] > squared_error; ++i) gain = steps_[i].gain_per_byte;
  return gain;
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
  met_ = failed_ = 0;
  corrections_ = 0;
  done_ = false;
  selection_ = allocator_.allocate(target_);
}

bool ToleranceSearch::next(double measured) {
  if (done_) return false;
  // Note whether this target met the budget, and stop if it did so closely enough.
  const bool met = measured <= budget_;
  if (met) {
    met_ = std::max(met_, target_);
    if (measured >= kTightness * kTightness * budget_ || met_ >= allocator_.largestError()) return finish(target_);
  } else {
    failed_ = failed_ > 0 ? std::min(failed_, target_) : target_;
  }
  if (++corrections_ == kMostCorrections || (!met && target_ <= allocator_.smallestError())) return finish(met_);
  // Aim in proportion, at the middle of the wanted interval; inside the known interval, or beyond its open end.
  target_ = allocator_.error(selection_) * budget_ * (1 + kTightness * kTightness) / (2 * measured);
  const bool outside = (met_ > 0 && target_ <= met_) || (failed_ > 0 && target_ >= failed_);
  if (outside && met_ > 0 && failed_ > 0)
    target_ = std::sqrt(met_ * failed_);
  else if (outside)
    target_ = met_ > 0 ? 2 * met_ : failed_ / 2;
  selection_ = allocator_.allocate(target_);
  return true;
}

bool ToleranceSearch::finish(double target) {
  done_ = true;
  target_ = target;
  selection_ = allocator_.allocate(target);
  return false;
}

}  // namespace glint::bake
