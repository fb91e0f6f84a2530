#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "glint/math/device.h"
#include "glint/math/float4.h"
#include "glint/model/ndf_cp.h"
#include "glint/query/detail/compressed/column_layout.h"
#include "glint/query/detail/compressed/prefix_axis.h"
#include "glint/query/detail/pyramid/pixel_spline.h"

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
};

/// Values of columns at the pixels of a window: a Float4 for each of its rows, whose lanes are pixels. 0 at pixels outside the
/// block.
struct ColumnWindows {
  static constexpr int kRows = PixelWindow::kSize, kLanes = 4;

  GLINT_HD Float4 row(int column, int y) const { return Float4::load(values + (column * kRows + y) * kLanes); }
  GLINT_HD void setRow(int column, int y, Float4 pixels) { pixels.store(values + (column * kRows + y) * kLanes); }
  GLINT_HD void set(int column, int x, int y, float value) { values[(column * kRows + y) * kLanes + x] = value; }

  float values[kMaxColumns * kRows * kLanes];
};

/// Values of the functions of one axis of a block at three neighbouring pixels, 0 at pixels outside the block.
/// @tparam kMost  most functions
template <std::size_t kMost>
struct AxisWindow {
  static constexpr std::size_t kPixels = PixelWindow::kSize;

  /// @param prefix  inclusive prefix sums of the functions, [16][count]
  /// @param first   first pixel, -2 to 15
  GLINT_HD AxisWindow(const std::int32_t* prefix, int count, int first) {
    for (int t = 0; t < PixelWindow::kSize; ++t) {
      if (first + t >= 0 && first + t < kBlockSize)
        PrefixAxis(prefix, count, first + t).store(at[t]);
      else
        std::fill(at[t], at[t] + count, 0.0f);
    }
  }
  /// Function k at the pixels.
  GLINT_HD Float4 lanes(int k) const { return Float4::of(at[0][k], at[1][k], at[2][k], 0); }

  float at[kPixels][kMost];
};

}  // namespace glint
