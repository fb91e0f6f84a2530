#pragma once

#include <cstdint>

#include "glint/math/device.h"
#include "glint/model/ndf_cp.h"
#include "glint/query/detail/compressed/cluster_arrays.h"
#include "glint/query/detail/compressed/column_layout.h"
#include "glint/query/detail/compressed/column_windows.h"
#include "glint/query/detail/compressed/prefix_axis.h"
#include "glint/query/detail/compressed/prefix_weights.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"

namespace glint {

/// Basis of a cluster of method cp: column k is X_k(x) Y_k(y) (Deng 2022, Eq. 5).
struct CpBasis : ClusterArrays {
  using Axis = PrefixAxis;
  /// Whether one pixel of one slice costs no more by itself than with a projection that other slices share.
  static constexpr bool kIsQuickAlone = true;
  /// Whether coefficients form a matrix.
  static constexpr bool kHasCore = false;

  /// Values of columns at one pixel, for ColumnLayout::arrange.
  struct Pixel {
    GLINT_HD float one(int k) const { return x.one(k) * y.one(k); }
    GLINT_HD Float4 four(int k) const { return x.four(k) * y.four(k); }
    Axis x, y;
  };
  GLINT_HD Pixel at(int x, int y) const { return {Axis(alongX(), columns(), x), Axis(alongY(), columns(), y)}; }

  /// Writes the projection at one pixel.
  GLINT_HOST_INLINE GLINT_HD void pixel(const ColumnLayout& layout, int x, int y, float* projection) const {
    layout.arrange(scales(), at(x, y), projection);
  }

  /// Writes the values of all columns at the pixels of a window.
  /// @param x, y  column and row of its first pixel, -2 to 15
  GLINT_HD void window(int x, int y, ColumnWindows& windows) const {
    const AxisWindow<kMaxColumns> at_x(alongX(), columns(), x), at_y(alongY(), columns(), y);
    for (int k = 0; k < columns(); ++k)
      for (int row = 0; row < ColumnWindows::kRows; ++row) windows.setRow(k, row, at_x.lanes(k) * Float4::all(at_y.at[row][k]));
  }

  /// Writes the projection of a box: sums of columns over the part of the block (Deng 2022, Eq. 6 and 7).
  GLINT_DEVICE_CALL GLINT_HD void box(const ColumnLayout& layout, const BlockBox& b, float* projection) const {
    float in_x[kMaxColumns], in_y[kMaxColumns];
    const int count = columns();
    sumAlongAxis(alongX(), count, b.x0, b.x1, in_x);
    sumAlongAxis(alongY(), count, b.y0, b.y1, in_y);
    for (int k = 0; k < count; ++k) in_x[k] *= in_y[k];
    layout.arrange(scales(), ColumnValues{in_x}, projection);
  }

  /// Asks the memory for the columns at one pixel.
  GLINT_HD void prefetchPixel(int x, int y) const {
    const auto count = static_cast<std::uint64_t>(columns());
    prefetch(basis() + static_cast<unsigned>(x) * count);
    prefetch(basis() + static_cast<unsigned>(kBlockSize + y) * count);
  }

  /// Sum of each row of a slice, negative pixels included; O(16 rank).
  /// @param weights  coefficients times scales, [columns]
  /// @param weigh    WeighPrefixes, or a function with the same results
  template <class Weigh>
  GLINT_DEVICE_CALL GLINT_HD Float16 rowSums(const float* weights, Weigh weigh) const {
    const int count = columns();
    const std::int32_t* sums_of_x = alongX() + (kBlockSize - 1) * count;
    float in_rows[kMaxColumns];  // weights of the functions of y
    for (int k = 0; k < count; ++k) in_rows[k] = weights[k] * static_cast<float>(sums_of_x[k]);
    return weigh(alongY(), count, count, in_rows, Stored()).differences();
  }

  /// Pixels of row y of a slice; O(16 rank).
  template <class Weigh>
  GLINT_DEVICE_CALL GLINT_HD Float16 rowPixels(const float* weights, int y, Weigh weigh) const {
    float in_row[kMaxColumns];  // weights of the functions of x
    const int count = columns();
    Axis(alongY(), count, y).store(in_row);
    for (int k = 0; k < count; ++k) in_row[k] *= weights[k];
    return weigh(alongX(), count, count, in_row, Stored()).differences();
  }

  /// All pixels of a slice, [16][16]; O(256 rank).
  template <class Weigh>
  GLINT_DEVICE_CALL GLINT_HD void block(const float* weights, float* pixels, Weigh /*weigh*/) const {
    float x_values[kMaxColumns * kBlockSize], y_values[kMaxColumns * kBlockSize];
    const int count = columns();
    valuesOfAxis(alongX(), count, x_values);
    valuesOfAxis(alongY(), count, y_values);
    float in_rows[kMaxColumns * kBlockSize];
    for (int k = 0; k < count; ++k) {
      const Float4 weight = Float4::all(weights[k]);
      for (int y = 0; y < kBlockSize; y += 4)
        (weight * Float4::load(y_values + k * kBlockSize + y)).store(in_rows + k * kBlockSize + y);
    }
    combineRows(x_values, in_rows, count, pixels);
  }

  GLINT_HD const std::int32_t* alongX() const { return basis(); }                           ///< prefix sums of X, [16][columns]
  GLINT_HD const std::int32_t* alongY() const { return basis() + kBlockSize * columns(); }  ///< prefix sums of Y, [16][columns]
};

}  // namespace glint
