#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "glint/math/float4.h"
#include "glint/math/half.h"
#include "glint/model/ndf_cp.h"
#include "glint/query/detail/pyramid/block_mass.h"

namespace glint {

/// What is taken off the pixels of a cluster's slices before negative pixels count as 0 (NdfCp::floors).
class PixelFloors {
 public:
  /// @param cluster  an element of ndf.clusters
  GLINT_HD PixelFloors(const NdfCp& ndf, const NdfCluster& cluster)
      : codes_(ndf.floors.data() + (&cluster - ndf.clusters.data()) * kFloorCells),
        unit_(positiveHalfToFloat(cluster.floor_unit)) {}

  /// Floor of a pixel of the block.
  GLINT_HD float at(int x, int y) const { return unit_ * blockMass(codes_[floorCell(x, y)]); }

  /// Floors of three neighbouring pixels of a row, in the first three lanes. Pixels outside the block have no density to lose.
  /// @param x, y  column and row of the first pixel, -2 to 15
  GLINT_HD Float4 three(int x, int y) const {
    const auto inside = [](int p) { return std::clamp(p, 0, kBlockSize - 1); };
    return Float4::of(at(inside(x), inside(y)), at(inside(x + 1), inside(y)), at(inside(x + 2), inside(y)), 0);
  }

  /// Floors of the pixels of a row.
  GLINT_HD Float16 row(int y) const {
    Float16 floors;
    for (int cell = 0; cell < 4; ++cell) floors.v[cell] = Float4::all(at(cell * kFloorPixels, y));
    return floors;
  }

  /// Sum of the floors of each row.
  GLINT_HD Float16 rowSums() const {
    Float16 sums;
    for (int cell = 0; cell < 4; ++cell) sums.v[cell] = Float4::all(row(cell * kFloorPixels).sum());
    return sums;
  }

 private:
  const std::uint8_t* codes_;  // [kFloorCells]
  float unit_;
};

}  // namespace glint
