#pragma once

#include <cstdint>
#include <vector>

#include "glint/bake/compressed/cp.h"
#include "glint/bake/compressed/slices.h"
#include "glint/bake/compressed/spots.h"

namespace glint::bake {

/// One size that a cluster can have, and what it costs.
struct SizeChoice {
  bool spots = false;       ///< of spots, not of columns
  int count = 0;            ///< steps of columns (cp: rank), or spots
  double error = 0;         ///< squared, stored units (cp: a bound of it)
  std::uint64_t bytes = 0;  ///< bases, coefficients, scales and block masses
};

/// A column of a cluster and the bits of its coefficients.
struct ClusterColumn {
  int index = 0;  ///< cp: of the factors; tucker: a + 16 b; pca: of the components
  int bits = 8;   ///< 4 or 8; the other coefficient types do not look at it
};

/// What a choice stands for: real-valued basis images, or spots.
struct ClusterBasis {
  std::vector<ClusterColumn> columns;  ///< wide ones first
  int rank_x = 0;                      ///< functions in x and y; pca: images in x
  int rank_y = 0;
  std::vector<float> x;           ///< cp: X[16][R]; tucker: U[16][rank_x]; pca: images [256][K]
  std::vector<float> y;           ///< cp: Y[16][R]; tucker: V[16][rank_y]; pca: empty
  std::vector<SliceSpots> spots;  ///< of each slice; empty for columns
};

/// Size and scale of a cluster.
struct ClusterStatistics {
  float peak = 0;     ///< largest magnitude, stored units
  double energy = 0;  ///< sum of squares, stored units
};

/// @throw Error invalid_input if a value is not finite
ClusterStatistics measureCluster(const SliceIndex& index, std::size_t cluster);

/// A decomposed cluster: the sizes worth choosing, and what each stands for.
class ClusterModel {
 public:
  /// @param index       must outlive the model
  /// @param options     a tolerance of 0 gives one choice, `options.rank`; else the choices on the lower convex hull of (bytes,
  ///                    error), starting with nothing at all
  /// @param negligible  squared error in stored units below which more columns are of no interest (for a tolerance)
  ClusterModel(const SliceIndex& index, std::size_t cluster, const ClusterStatistics& statistics,
               const CompressionOptions& options, double negligible);

  /// From few bytes to many; never empty.
  const std::vector<SizeChoice>& choices() const { return choices_; }

  /// cp: decomposes the cluster.
  /// @param choice  0..choices().size()-1
  ClusterBasis basis(int choice) const;

 private:
  /// A column, or more bits for its coefficients, in the order of gain per byte.
  struct Step {
    int column;
    int bits;
    double gain;
    double bytes;
  };

  void addColumnSteps(int column, const float* coefficients, double basis_bytes);
  void addStepChoices(double error);
  void addSpots(const SliceIndex& index, double negligible);
  void addSpotChoices(const SpotFinder& finder, std::vector<float> rests);
  std::vector<float> project(const SliceIndex& index, const std::vector<float>& images, int count) const;
  void keepHull();
  void decomposeTucker(const SliceIndex& index, const CompressionOptions& options, double negligible);
  void decomposePca(const SliceIndex& index, const CompressionOptions& options, double negligible);
  void boundCpRanks(const SliceIndex& index, const CompressionOptions& options, double negligible);
  CpFactors decompose(int rank) const;
  TuckerAxes analyseAxes(const SliceIndex& index) const;
  std::vector<ClusterColumn> columnsAfter(int steps) const;

  CompressionMethod method_;
  CoefficientType type_;
  std::size_t cluster_;
  int slice_count_;
  float peak_;
  double energy_;  // of the slices divided by peak_
  const SliceIndex* index_;
  double min_improvement_;
  int max_iterations_;
  std::vector<SizeChoice> choices_;
  std::vector<Step> steps_;        // tucker, pca
  std::vector<SliceSpots> spots_;  // of each slice, falling gains
  std::vector<float> spot_gains_;  // of all spots, falling
  TuckerAxes axes_;                // tucker, cp
  std::vector<float> components_;  // pca: [K][256], orthonormal
};

}  // namespace glint::bake
