#pragma once

#include <vector>

#include "glint/bake/compress_model.h"

namespace glint::bake {

/// Chooses a rank for every cluster: the fewest bytes for a squared error summed over all clusters.
///
/// The choices of a cluster lie on a convex hull, so steps along it bring less and less error per byte. Taking the steps of all
/// clusters in the order of their gain per byte is the minimum of bytes + lambda error for every lambda.
class RankAllocator {
 public:
  /// @param models  must outlive the allocator
  explicit RankAllocator(const std::vector<ClusterModel>& models);

  /// Fewest bytes for at most this error.
  /// @return choice of each cluster; the last of each if even that has a larger error
  std::vector<int> allocate(double squared_error) const;

  /// Squared error that the last byte of allocate(squared_error) takes off.
  double gainPerByte(double squared_error) const;

  /// Sum of the errors of a selection, before quantisation.
  double error(const std::vector<int>& selection) const;

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

  const std::vector<ClusterModel>& models_;
  std::vector<Step> steps_;
  std::vector<double> errors_;  // [steps + 1]: after so many steps
};

}  // namespace glint::bake
