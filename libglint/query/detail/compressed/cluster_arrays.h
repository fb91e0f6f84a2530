#pragma once

#include <cstdint>

#include "glint/math/device.h"
#include "glint/model/ndf_cp.h"
#include "glint/query/detail/compressed/pixel_floors.h"

namespace glint {

/// Arrays of a compressed pyramid where they belong to one cluster of columns. Pointers are computed where they are used: kept
/// from the start, each would occupy a register in the loops before its use.
struct ClusterArrays {
  const NdfCp& ndf;
  const NdfCluster& cluster;

  GLINT_HD int columns() const { return cluster.columns; }
  /// First prefix sum.
  GLINT_HD const std::int32_t* basis() const { return ndf.basis.data() + cluster.first_basis; }
  /// First coefficient, stored as T.
  template <class T>
  GLINT_HD const T* coefficients() const {
    return static_cast<const T*>(ndf.coefficients) + cluster.first_coefficient;
  }
  GLINT_HD const float* scales() const { return ndf.scales.data() + cluster.first_scale; }     ///< [columns]
  GLINT_HD const std::uint8_t* core() const { return ndf.core.data() + cluster.first_scale; }  ///< [columns], tucker only
  GLINT_HD PixelFloors floors() const { return PixelFloors(ndf, cluster); }
};

}  // namespace glint
