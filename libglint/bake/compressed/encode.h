#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/bake/compressed/model.h"

namespace glint::bake {

/// What the decoded slice and its error are, in units of the peak of the cluster.
struct SliceError {
  float error = 0;     ///< sum of (slice - decoded)^2
  float cross = 0;     ///< sum of (slice - decoded) decoded
  float power = 0;     ///< sum of decoded^2
  float sum = 0;       ///< sum of decoded
  float positive = 0;  ///< sum of decoded where it is positive
};

/// A cluster as NdfCp stores it.
struct EncodedCluster {
  int columns = 0;
  int narrow_columns = 0;
  int rank_x = 0;  ///< tucker
  int rank_y = 0;
  std::vector<std::byte> basis;
  std::vector<std::byte> coefficients;  ///< rows of `kept`, without padding; spots: as in ndf_cp.h
  std::vector<float> scales;
  std::vector<std::uint8_t> core;
  std::vector<std::uint32_t> kept;  ///< slices that are stored, rising; the others decode to 0
  std::uint64_t spots = 0;
  std::vector<SliceError> slices;  ///< of all slices
};

/// Quantises a basis, solves the coefficients of every slice for the quantised basis by least squares, and quantises those.
/// @param unit      density of one stored unit (NdfPyramid::value_scale)
/// @param per_byte  columns: a slice that holds less energy (squared stored units) than this for each of its bytes is left
///                  out, unless it is a larger part of its image
EncodedCluster encodeCluster(const SliceIndex& index, std::size_t cluster, const ClusterStatistics& statistics,
                             const ClusterBasis& basis, CompressionMethod method, CoefficientType type, float unit,
                             double per_byte);

}  // namespace glint::bake
