#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "glint/bake/compressed/model.h"

namespace glint::bake {

/// Chooses a rank for every cluster: the fewest bytes for a squared error summed over all clusters.
///
/// The choices of a cluster lie on a convex hull, so steps along it bring less and less error per byte. Taking the steps of all
/// clusters in the order of their gain per byte is the minimum of bytes + lambda error for every lambda.
class RankAllocator {
 public:
  /// @param clusters  choices of each, on a convex hull from few bytes to many; must outlive the allocator
  explicit RankAllocator(std::vector<std::span<const SizeChoice>> clusters);

  /// Fewest bytes for at most this error.
  /// @return choice of each cluster; the last of each if even that has a larger error
  std::vector<int> allocate(double squared_error) const;

  /// Squared error that the last byte of allocate(squared_error) takes off.
  double gainPerByte(double squared_error) const;

  /// Sum of the errors of a selection, before quantisation.
  double error(std::span<const int> selection) const;

  /// Error without any step.
  double largestError() const { return errors_.front(); }

  /// Error with all steps taken.
  double smallestError() const { return errors_.back(); }

 private:
  struct Step {
    double gain_per_byte;
    std::uint32_t cluster;
    std::uint32_t choice;
  };

  std::vector<std::span<const SizeChoice>> clusters_;
  std::vector<Step> steps_;
  std::vector<double> errors_;  // [steps + 1]: after so many steps
};

/// Searches the error that an allocator has to aim at so that the measured one, after quantisation, meets a budget.
///
/// The two are nearly proportional, so a few corrections suffice; where they are not, the search halves the interval.
class ToleranceSearch {
 public:
  /// @param budget  squared error that must not be exceeded, and is used up as far as single steps allow
  ToleranceSearch(std::vector<std::span<const SizeChoice>> clusters, double budget);

  /// Choices to encode and measure next; those to keep once the search is done.
  const std::vector<int>& selection() const { return selection_; }

  /// Squared error that a byte has to take off to be worth it beside those of selection(); 0 when every byte is.
  double gainPerByte() const { return target_ > 0 ? allocator_.gainPerByte(target_) : 0; }

  /// @param measured  squared error of selection()
  /// @return false when the search is done
  bool next(double measured);

 private:
  bool finish(double target);

  RankAllocator allocator_;
  double budget_, target_;
  double met_ = 0, failed_ = 0;  // targets; 0: none yet
  int corrections_ = 0;
  bool done_ = false;
  std::vector<int> selection_;
};

}  // namespace glint::bake
