#pragma once

#include <cstddef>
#include <vector>

#include "glint/bake/compress_model.h"

namespace glint::bake {

/// What the decoded slice and its error are, in units of the peak of the cluster.
struct SliceError {
  float error = 0;     ///< sum of (slice - decoded)^2
  float cross = 0;     ///< sum of (slice - decoded) decoded
  float power = 0;     ///< sum of decoded^2
  float sum = 0;       ///< sum of decoded
  float positive = 0;  ///< sum of decoded where it is positive
};

/// A cluster as CompressedNdf stores it.
struct EncodedCluster {
  int rank_x = 0;
  int rank_y = 0;
  std::vector<std::byte> basis;
  std::vector<std::byte> coefficients;
  std::vector<float> scales;
  std::vector<SliceError> slices;
};

/// Quantises a basis, solves the coefficients of every slice for the quantised basis by least squares, and quantises those.
/// @param unit  density of one stored unit (NdfPyramid::value_scale)
EncodedCluster encodeCluster(const SliceIndex& index, std::size_t cluster, const ClusterStatistics& statistics,
                             const ClusterBasis& basis, CompressionMethod method, CoefficientType type, float unit);

}  // namespace glint::bake
