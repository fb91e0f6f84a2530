#pragma once

#include <algorithm>
#include <cstdint>

#include "glint/model/ndf_cp.h"
#include "glint/query/detail/compressed/cluster_arrays.h"
#include "glint/query/detail/compressed/column_layout.h"
#include "glint/query/detail/compressed/column_windows.h"
#include "glint/query/detail/compressed/prefix_axis.h"
#include "glint/query/detail/compressed/prefix_weights.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"

namespace glint {

/// Basis of a cluster of method tucker: column k is U_a(x) V_b(y), where core[k] = a + 16 b.
struct TuckerBasis : ClusterArrays {
  using Axis = PrefixAxis;
  static constexpr bool kIsQuickAlone = false;
  static constexpr bool kHasCore = true;

  /// Writes the projection at one pixel.
  GLINT_HOST_INLINE GLINT_HD void pixel(const ColumnLayout& layout, int x, int y, float* projection) const {
    float at_x[kBlockSize] = {}, at_y[kBlockSize];
    Axis(alongX(), rankX(), x).store(at_x);
    Axis(alongY(), rankY(), y).store(at_y);
    arrangePairs(layout, at_x, at_y, projection);
  }

  /// Writes the values of all columns at the pixels of a window.
  /// @param x, y  column and row of its first pixel, -2 to 15
  GLINT_HD void window(int x, int y, ColumnWindows& windows) const {
    const AxisWindow<kBlockSize> at_x(alongX(), rankX(), x), at_y(alongY(), rankY(), y);
    Float4 lanes[kBlockSize];
    for (int a = 0; a < rankX(); ++a) lanes[a] = at_x.lanes(a);
    const std::uint8_t* pairs = core();
    for (int k = 0; k < columns(); ++k)
      for (int row = 0; row < ColumnWindows::kRows; ++row)
        windows.setRow(k, row, lanes[pairs[k] % kBlockSize] * Float4::all(at_y.at[row][pairs[k] / kBlockSize]));
  }

  /// Writes the projection of a box: sums of columns over the part of the block.
  GLINT_DEVICE_CALL GLINT_HD void box(const ColumnLayout& layout, const BlockBox& b, float* projection) const {
    float in_x[kBlockSize] = {}, in_y[kBlockSize];
    sumAlongAxis(alongX(), rankX(), b.x0, b.x1, in_x);
    sumAlongAxis(alongY(), rankY(), b.y0, b.y1, in_y);
    arrangePairs(layout, in_x, in_y, projection);
  }

  /// Writes the coefficients of a slice as a matrix: the weight of U_a V_b at a + 16 b, 0 where no column has this pair. Rows
  /// are filled up to a multiple of four b.
  /// @param scaled   coefficients times scales, [columns]
  /// @param weights  [kBlockPixels]
  GLINT_HD void fillMatrix(const float* scaled, float* weights) const {
    std::fill(weights, weights + kBlockSize * ((rankY() + 3) & ~3), 0.0f);
    const std::uint8_t* pairs = core();
    for (int k = 0; k < columns(); ++k) weights[pairs[k]] += scaled[k];
  }

  /// Sum of each row of a slice, negative pixels included; O((16 + rank_x) rank_y).
  /// @param weights  matrix of fillMatrix
  /// @param weigh    WeighPrefixes, or a function with the same results
  template <class Weigh>
  GLINT_DEVICE_CALL GLINT_HD Float16 rowSums(const float* weights, Weigh weigh) const {
    float sums_of_x[kBlockSize] = {};
    for (int a = 0; a < rankX(); ++a) sums_of_x[a] = static_cast<float>(alongX()[(kBlockSize - 1) * rankX() + a]);
    float in_rows[kBlockSize];  // weights of the functions of y
    weighMatrixRows(weights, rankY(), sums_of_x, in_rows);
    return weigh(alongY(), rankY(), rankY(), in_rows, Stored()).differences();
  }

  /// Pixels of row y of a slice. Costs as much as rowSums.
  template <class Weigh>
  GLINT_DEVICE_CALL GLINT_HD Float16 rowPixels(const float* weights, int y, Weigh weigh) const {
    float at_y[kBlockSize], in_row[kBlockSize];  // in_row: weights of the functions of x
    Axis(alongY(), rankY(), y).store(at_y);
    weighMatrixColumns(weights, rankY(), at_y, in_row);
    return weigh(alongX(), rankX(), rankX(), in_row, Stored()).differences();
  }

  /// All pixels of a slice, [16][16]; O(16 rank_x (16 + rank_y)).
  template <class Weigh>
  GLINT_DEVICE_CALL GLINT_HD void block(const float* weights, float* pixels, Weigh /*weigh*/) const {
    float x_values[kBlockPixels], y_values[kBlockPixels], in_rows[kBlockPixels];
    valuesOfAxis(alongX(), rankX(), x_values);
    valuesOfAxis(alongY(), rankY(), y_values);
    for (int a = 0; a < rankX(); ++a) {
      for (int y = 0; y < kBlockSize; y += 4) {
        Float4 sum = Float4::zero();
        for (int b = 0; b < rankY(); ++b)
          sum = sum + Float4::all(weights[b * kBlockSize + a]) * Float4::load(y_values + b * kBlockSize + y);
        sum.store(in_rows + a * kBlockSize + y);
      }
    }
    combineRows(x_values, in_rows, rankX(), pixels);
  }

  GLINT_HD int rankX() const { return cluster.rank_x; }
  GLINT_HD int rankY() const { return cluster.rank_y; }
  GLINT_HD const std::int32_t* alongX() const { return basis(); }                         ///< prefix sums of U, [16][rankX()]
  GLINT_HD const std::int32_t* alongY() const { return basis() + kBlockSize * rankX(); }  ///< prefix sums of V, [16][rankY()]

 private:
  /// Products of pairs of functions, for ColumnLayout::arrange.
  struct Pairs {
    GLINT_HD float one(int k) const { return products[pairs[k]]; }
    GLINT_HD Float4 four(int k) const { return Float4::of(one(k), one(k + 1), one(k + 2), one(k + 3)); }
    const std::uint8_t* pairs;  ///< core of the cluster
    const float* products;      ///< of function a of x and function b of y, at a + 16 b
  };

  /// Writes a projection from values of the functions of each axis.
  /// @param x  [16], zeros from rankX() up to a multiple of four
  GLINT_HD void arrangePairs(const ColumnLayout& layout, const float* x, const float* y, float* projection) const {
    float products[kBlockPixels];  // products beyond the ranks are never read
    for (int b = 0; b < rankY(); ++b) {
      const Float4 all = Float4::all(y[b]);
      for (int a = 0; a < rankX(); a += 4) (all * Float4::load(x + a)).store(products + b * kBlockSize + a);
    }
    layout.arrange(scales(), Pairs{core(), products}, projection);
  }

  /// sums[b] = sum over a of matrix[a + 16 b] * weights[a], for b up to a multiple of four.
  static GLINT_HD void weighMatrixRows(const float* matrix, int rows, const float* weights, float* sums) {
    const Float16 w = Float16::load(weights);
    const auto row = [&](int b) {
      const Float16 r = Float16::load(matrix + b * kBlockSize);
      return (w.v[0] * r.v[0] + w.v[1] * r.v[1]) + (w.v[2] * r.v[2] + w.v[3] * r.v[3]);
    };
    for (int b = 0; b < rows; b += 4) sumsOf(row(b), row(b + 1), row(b + 2), row(b + 3)).store(sums + b);
  }

  /// sums[a] = sum over b of matrix[a + 16 b] * weights[b], for all 16 a.
  static GLINT_HD void weighMatrixColumns(const float* matrix, int rows, const float* weights, float* sums) {
    Float4 lanes[4] = {Float4::zero(), Float4::zero(), Float4::zero(), Float4::zero()};
    for (int b = 0; b < rows; ++b) {
      const Float4 w = Float4::all(weights[b]);
      for (int k = 0; k < 4; ++k) lanes[k] = lanes[k] + w * Float4::load(matrix + b * kBlockSize + 4 * k);
    }
    for (int k = 0; k < 4; ++k) lanes[k].store(sums + 4 * k);
  }
};

}  // namespace glint
