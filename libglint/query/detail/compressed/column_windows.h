#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "glint/math/float4.h"
#include "glint/query/detail/compressed/column_layout.h"
#include "glint/query/detail/compressed/prefix_axis.h"
#include "glint/query/detail/pyramid/pixel_spline.h"

// Columns of a cluster at a pixel and its eight neighbours.

namespace glint {

/// Values of columns at the pixels of a window: a Float4 for each of its rows, whose lanes are pixels. 0 at pixels outside the
/// block.
struct ColumnWindows {
  static constexpr int kRows = PixelWindow::kSize, kLanes = 4;

  GLINT_HD Float4 row(int column, int y) const { return Float4::load(values + (column * kRows + y) * kLanes); }
  GLINT_HD void setRow(int column, int y, Float4 pixels) { pixels.store(values + (column * kRows + y) * kLanes); }

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
