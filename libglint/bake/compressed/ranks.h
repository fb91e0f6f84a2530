#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "glint/bake/compressed/model.h"

namespace glint::bake {

/// Chooses a size for every cluster: the fewest bytes with which the squared error of all clusters together meets a bound.
///
/// The choices of a cluster lie on a convex hull, so each step along it removes less error per byte than the step before.
/// Taking the steps of all clusters in the order of error removed per byte minimises bytes + lambda error, for every lambda.
class RankAllocator {
 public:
  /// @param clusters  choices of each cluster, on a convex hull from few bytes to many; must outlive the allocator
  explicit RankAllocator(std::vector<std::span<const SizeChoice>> clusters);

  /// Bounds the errors of clusters. A cluster that cannot meet its bound takes its last choice.
  /// @param bounds  [clusters]: largest squared error of each cluster; empty: no bounds
  void setBounds(std::span<const double> bounds);

  /// Selects the fewest bytes with at most this error, and within the bounds.
  /// @return choice of each cluster; the last choice of every cluster if even these have a larger error
  std::vector<int> allocate(double squared_error) const;

  /// Sum of the errors of a selection, before quantisation.
  double error(std::span<const int> selection) const;

  /// Error with the steps that the bounds ask for, and no other.
  double largestError() const { return errors_[bound_steps_]; }

  /// Error with all steps taken.
  double smallestError() const { return errors_.back(); }

 private:
  struct Step {
    double gain_per_byte;
    std::uint32_t cluster;
    std::uint32_t choice;
    bool bound;  // whether a bound asks for it
  };

  std::vector<std::span<const SizeChoice>> clusters_;
  std::vector<Step> steps_;  // those that bounds ask for come first
  std::size_t bound_steps_ = 0;
  std::vector<double> errors_;  // [steps + 1]: squared error after so many steps
};

/// Searches the error for an allocator to aim at so that the error measured after quantisation meets a budget.
///
/// The two errors are nearly proportional, so a few corrections of the target suffice. Between a target that met the budget and a
/// target that failed, the search follows the line through both, in logarithms. Where that does not end, it halves the interval.
class ToleranceSearch {
 public:
  /// @param budget  largest squared error that is allowed; the search uses it up as far as single steps and bounds allow
  ToleranceSearch(std::vector<std::span<const SizeChoice>> clusters, double budget);

  /// Bounds the errors of clusters, as RankAllocator does, and searches anew from where the search is.
  void setBounds(std::span<const double> bounds);

  /// Choices to encode and measure next; once the search is done, the choices to keep.
  const std::vector<int>& selection() const { return selection_; }

  /// @param measured  squared error of selection()
  /// @return false when the search is done
  bool next(double measured);

 private:
  /// A target, and what was measured of its selection; 0: none yet.
  struct Trial {
    double target = 0, measured = 0;
  };

  bool finish(double target);
  double nextTarget(double measured) const;

  RankAllocator allocator_;
  double budget_, target_;
  Trial met_, failed_;  // of the largest target that met the budget, and the smallest that failed
  int corrections_ = 0;
  bool done_ = false;
  std::vector<int> selection_;
};

}  // namespace glint::bake
