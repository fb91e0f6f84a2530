#pragma once

#include <cstdint>
#include <vector>

#include "glint/bake/compressed/cp.h"
#include "glint/bake/compressed/error_weights.h"
#include "glint/bake/compressed/slices.h"
#include "glint/bake/compressed/spots.h"

namespace glint::bake {

/// One size that a cluster can have, with its error and its bytes.
struct SizeChoice {
  bool spots = false;       ///< whether the cluster has spots instead of columns
  int count = 0;            ///< number of spots, or of steps of columns (cp: rank)
  double error = 0;         ///< weighted squared error (ErrorWeights; cp: an upper bound)
  std::uint64_t bytes = 0;  ///< bytes of bases, coefficients, scales and block masses
};

/// A column of a cluster and the bits of its coefficients.
struct ClusterColumn {
  int index = 0;  ///< cp: column of the factors; tucker: axes a + 16 b; pca: number of the component
  int bits = 8;   ///< 4 or 8, for coefficients of type i8
};

/// The content of a choice before quantisation: basis images, or spots.
struct ClusterBasis {
  std::vector<ClusterColumn> columns;  ///< wide columns first
  int rank_x = 0;                      ///< number of functions of x; pca: of images
  int rank_y = 0;                      ///< number of functions of y
  std::vector<float> x;                ///< cp: X[16][R]; tucker: U[16][rank_x]; pca: images [256][K]
  std::vector<float> y;                ///< cp: Y[16][R]; tucker: V[16][rank_y]; pca: empty
  std::vector<SliceSpots> spots;       ///< [slices]; empty where the cluster has columns
};

/// Size of the slices of a cluster, in the domain that its BlockScale scales.
struct ClusterStatistics {
  float peak = 0;              ///< largest magnitude of a scaled pixel, stored units
  double energy = 0;           ///< weighted sum of the squares of scaled pixels, stored units
  std::vector<float> factors;  ///< [256]: what SliceIndex::load() multiplies by: the scale, over the peak
};

/// Measures a cluster.
/// @throw Error invalid_input if a value is not finite
ClusterStatistics measureCluster(const SliceIndex& index, const ErrorWeights& weights, std::size_t cluster);

/// A decomposed cluster: the sizes that are worth choosing, and the basis of each.
class ClusterModel {
 public:
  /// @param index       must outlive the model, as `weights` and `statistics`
  /// @param options     a tolerance of 0 gives one choice, `options.rank`. Any other tolerance gives the choices on the lower
  ///                    convex hull of (bytes, error), the first of which stores nothing
  /// @param type        of the coefficients
  /// @param negligible  with a tolerance: weighted squared error below which no more columns are looked for
  ClusterModel(const SliceIndex& index, const ErrorWeights& weights, std::size_t cluster, const ClusterStatistics& statistics,
               const CompressionOptions& options, CoefficientType type, double negligible);

  /// Whether another error of columns can be given with correctColumns().
  bool hasColumns() const;

  /// Basis of the columns whose error is nearest to the given one.
  /// @param predicted  set to their error as choices() tell it
  /// @pre hasColumns()
  ClusterBasis columnsNear(double error, double& predicted) const;

  /// Multiplies the errors of all choices of columns, where a measurement shows that a reader's answers have another error than
  /// sums of columns: readers take floors off, and have no negative pixels. Choices are chosen anew.
  void correctColumns(double factor);

  /// Choices from few bytes to many; at least one.
  const std::vector<SizeChoice>& choices() const { return choices_; }

  /// Basis of a choice. With cp, decomposes the cluster for it.
  /// @param choice  0..choices().size()-1
  ClusterBasis basis(int choice) const;

 private:
  /// What spots leave of a slice: its dot product with an even density of 1, and the sum of its squares.
  struct SliceRest {
    float match, energy;
  };

  /// One step of a growing cluster: a new column, or more bits for the coefficients of a column.
  struct Step {
    int column;
    int bits;
    double gain;
    double bytes;
  };

  void addColumnSteps(int column, const float* coefficients, double basis_bytes);
  void addStepChoices(double error);
  void addSpots(double negligible);
  void addSpotChoices(const SpotFinder& finder, std::vector<SliceRest> rests);
  std::vector<float> project(const std::vector<float>& images, int count) const;
  void keepHull();
  const SizeChoice* nearestColumns(double error) const;
  void decomposeTucker(const CompressionOptions& options, double negligible);
  void decomposePca(const CompressionOptions& options, double negligible);
  void boundCpRanks(const CompressionOptions& options, double negligible);
  CpFactors decompose(int rank) const;
  ClusterBasis basisOf(const SizeChoice& choice) const;
  ClusterBasis scaledBasis(const SizeChoice& choice) const;
  TuckerAxes analyseAxes() const;
  std::vector<float> gramMatrix() const;
  template <class Visit>
  void forEachPanel(bool weighted, Visit visit) const;
  std::vector<ClusterColumn> columnsAfter(int steps) const;

  CompressionMethod method_;
  CoefficientType type_;
  std::size_t cluster_;
  int slice_count_;
  float peak_;
  double energy_;  // energy of the slices, in units of peak_^2
  const SliceIndex* index_;
  const ClusterStatistics* statistics_;
  BlockScale scale_;
  std::vector<float> slice_weights_;  // [slices]: weights of their squared errors
  double min_improvement_;
  int max_iterations_;
  std::vector<SizeChoice> all_choices_;  // with a tolerance: by bytes
  std::vector<SizeChoice> choices_;      // those on the hull
  std::vector<Step> steps_;              // tucker, pca
  std::vector<SliceSpots> spots_;        // [slices], the spots of a slice in the order of falling gains
  std::vector<float> spot_gains_;        // gains of all spots, falling
  TuckerAxes axes_;                      // tucker, cp
  std::vector<float> components_;        // pca: [K][256], orthonormal
};

}  // namespace glint::bake
