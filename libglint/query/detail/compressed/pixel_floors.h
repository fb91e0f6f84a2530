#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "glint/math/float4.h"
#include "glint/math/half.h"
#include "glint/model/ndf_cp.h"
#include "glint/query/detail/pyramid/block_mass.h"
#include "glint/query/detail/pyramid/pixel_spline.h"

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

  /// Floors of the pixels of a window, a row in each element, in its first three lanes. Pixels outside the block have no density
  /// to lose, and get a floor of the nearest cell.
  /// @param x, y  column and row of the first pixel, -2 to 15
  GLINT_HD void window(int x, int y, Float4 (&rows)[PixelWindow::kSize]) const {
    const auto inside = [](int p) { return std::clamp(p, 0, kBlockSize - 1); };
    const int left = inside(x), right = inside(x + 2), low = inside(y), high = inside(y + 2);
    // The window meets one or two cells along each axis.
    const bool middle_is_right = inside(x + 1) / kFloorPixels != left / kFloorPixels;
    const auto row = [&](int at_y) {
      const float first = at(left, at_y), last = at(right, at_y);
      return Float4::of(first, middle_is_right ? last : first, last, 0);
    };
    rows[0] = row(low);
    rows[2] = low / kFloorPixels == high / kFloorPixels ? rows[0] : row(high);
    rows[1] = inside(y + 1) / kFloorPixels != low / kFloorPixels ? rows[2] : rows[0];
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
