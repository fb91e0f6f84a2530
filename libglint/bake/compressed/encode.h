#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "glint/bake/compressed/error_weights.h"
#include "glint/bake/compressed/floors.h"
#include "glint/bake/compressed/model.h"
#include "glint/bake/compressed/slice_errors.h"

namespace glint::bake {

/// A cluster, encoded as NdfCp stores it.
struct EncodedCluster {
  int columns = 0;
  int narrow_columns = 0;
  int rank_x = 0;  ///< tucker only, as rank_y
  int rank_y = 0;
  std::vector<std::int32_t> basis;
  std::vector<std::byte> coefficients;  ///< a row for each slice of `kept`, without padding; spots: as ndf_cp.h says
  std::vector<float> scales;
  std::vector<std::uint8_t> core;
  std::vector<std::uint32_t> kept;  ///< numbers of the slices that are stored, ascending; other slices decode to 0
  std::uint64_t spots = 0;
  ClusterFloors floors;  ///< none for clusters of spots
  ClusterErrors errors;
};

/// Quantises the basis of a cluster, solves the coefficients of every slice for the quantised basis by least squares, and
/// quantises the coefficients. Finds the floors of its decoded slices. A basis of spots is quantised spot by spot; all spots together
/// have the light of their slices, so that a direction is not too dark where many small spots were left out.
/// @param per_byte        weighted energy that a slice must hold for each byte of its coefficients to be stored. A slice with a
///                        large part of its image's mass is always stored. Not used for spots
/// @param density_scales  [images]: factors of the densities that errors are measured with (NdfCp::density_scales)
EncodedCluster encodeCluster(const SliceIndex& index, const ErrorWeights& weights, std::size_t cluster,
                             const ClusterStatistics& statistics, const ClusterBasis& basis, CompressionMethod method,
                             CoefficientType type, double per_byte, std::span<const float> density_scales);

}  // namespace glint::bake
