#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/bake/compressed/model.h"

namespace glint::bake {

/// Sums over the pixels of a slice and of its decoded form, in units of the peak of the cluster. From these follows the error
/// under any scale of the image.
struct SliceError {
  float error = 0;     ///< sum of (slice - decoded)^2
  float cross = 0;     ///< sum of (slice - decoded) decoded
  float power = 0;     ///< sum of decoded^2
  float sum = 0;       ///< sum of decoded
  float positive = 0;  ///< sum of decoded where it is positive
};

/// A cluster, encoded as NdfCp stores it.
struct EncodedCluster {
  int columns = 0;
  int narrow_columns = 0;
  int rank_x = 0;  ///< tucker only, as rank_y
  int rank_y = 0;
  std::vector<std::byte> basis;
  std::vector<std::byte> coefficients;  ///< a row for each slice of `kept`, without padding; spots: as ndf_cp.h says
  std::vector<float> scales;
  std::vector<std::uint8_t> core;
  std::vector<std::uint32_t> kept;  ///< numbers of the slices that are stored, ascending; other slices decode to 0
  std::uint64_t spots = 0;
  std::vector<SliceError> slices;  ///< of all slices
};

/// Quantises the basis of a cluster, solves the coefficients of every slice for the quantised basis by least squares, and
/// quantises the coefficients. A basis of spots is quantised spot by spot.
/// @param unit      density of one stored unit (NdfPyramid::value_scale)
/// @param per_byte  energy (squared stored units) that a slice must hold for each byte of its coefficients to be stored. A
///                  slice with a large part of its image's mass is always stored. Not used for spots
EncodedCluster encodeCluster(const SliceIndex& index, std::size_t cluster, const ClusterStatistics& statistics,
                             const ClusterBasis& basis, CompressionMethod method, CoefficientType type, float unit,
                             double per_byte);

}  // namespace glint::bake
