#pragma once

#include <cstdint>
#include <vector>

#include "glint/bake/compress_cp.h"
#include "glint/bake/compress_slices.h"

namespace glint::bake {

/// One rank that a cluster can have, and what it costs.
struct RankChoice {
  int rank_x = 0;  ///< as in NdfCluster
  int rank_y = 0;
  double error = 0;         ///< squared, before quantisation, stored units
  std::uint64_t bytes = 0;  ///< bases, coefficients and scales
};

/// Real-valued basis of a cluster.
struct ClusterBasis {
  int rank_x = 0;
  int rank_y = 0;
  std::vector<float> x;  ///< cp: X[16][R]; tucker: U[16][rx]; pca: images [256][K]
  std::vector<float> y;  ///< cp: Y[16][R]; tucker: V[16][ry]; pca: empty
};

/// Size and scale of a cluster.
struct ClusterStatistics {
  float peak = 0;     ///< largest magnitude, stored units
  double energy = 0;  ///< sum of squares, stored units
};

/// @throw Error invalid_input if a value is not finite
ClusterStatistics measureCluster(const SliceIndex& index, std::size_t cluster);

/// A decomposed cluster: the ranks worth choosing, and the basis of each.
class ClusterModel {
 public:
  /// @param options     a tolerance of 0 gives one choice, `options.rank`; else the choices on the lower convex hull of (bytes,
  /// error),
  ///                    starting with no column at all
  /// @param negligible  squared error in stored units below which more columns are of no interest (for a tolerance)
  ClusterModel(const SliceIndex& index, std::size_t cluster, const ClusterStatistics& statistics,
               const CompressionOptions& options, double negligible);

  /// From few bytes to many; never empty.
  const std::vector<RankChoice>& choices() const { return choices_; }

  /// @param choice  0..choices().size()-1
  ClusterBasis basis(int choice) const;

 private:
  void addChoice(int rank_x, int rank_y, double error);
  void keepHull();
  void decomposeTucker(const SliceIndex& index, const CompressionOptions& options);
  void decomposePca(const SliceIndex& index, const CompressionOptions& options, double negligible);
  void decomposeCpRanks(const SliceIndex& index, const CompressionOptions& options, double negligible);
  TuckerAxes analyseAxes(const SliceIndex& index) const;

  CompressionMethod method_;
  CoefficientType type_;
  std::size_t cluster_;
  int slice_count_;
  float peak_;
  double energy_;  // of the slices divided by peak_
  std::vector<RankChoice> choices_;
  TuckerAxes axes_;                 // tucker
  std::vector<float> components_;   // pca: [K][256], orthonormal
  std::vector<CpFactors> factors_;  // cp: one for each rank tried
};

}  // namespace glint::bake
