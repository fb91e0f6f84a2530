#pragma once

#include <algorithm>

#include "glint/model/ndf_cp.h"
#include "glint/query/detail/compressed/cluster_arrays.h"
#include "glint/query/detail/compressed/column_layout.h"
#include "glint/query/detail/compressed/column_windows.h"
#include "glint/query/detail/compressed/prefix_axis.h"
#include "glint/query/detail/compressed/prefix_weights.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"

namespace glint {

/// Basis of a cluster of method pca: each column is an image of 16x16 pixels, stored as prefix sums over both axes.
struct PcaBasis : ClusterArrays {
  using Axis = PrefixAxis;
  static constexpr bool kIsQuickAlone = false;
  static constexpr bool kHasCore = false;

  /// Values of columns at one pixel, for ColumnLayout::arrange.
  struct Pixel {
    GLINT_HD float one(int k) const { return here.one(k) - (inner ? below.one(k) : 0.0f); }
    GLINT_HD Float4 four(int k) const { return inner ? here.four(k) - below.four(k) : here.four(k); }
    Axis here, below;  ///< prefix sums of rows y and y - 1
    bool inner;        ///< whether y > 0
  };
  GLINT_HD Pixel at(int x, int y) const {
    const int count = columns();
    return {Axis(prefix() + y * kBlockSize * count, count, x),
            Axis(prefix() + (y > 0 ? y - 1 : 0) * kBlockSize * count, count, x), y > 0};
  }

  /// Writes the projection at one pixel.
  GLINT_HOST_INLINE GLINT_HD void pixel(const ColumnLayout& layout, int x, int y, float* projection) const {
    layout.arrange(scales(), at(x, y), projection);
  }

  /// Writes the values of all columns at the pixels of a window.
  /// @param x, y  column and row of its first pixel, -2 to 15
  GLINT_HD void window(int x, int y, ColumnWindows& windows) const {
    const int count = columns();
    const auto sumsOfRow = [&](int row) { return AxisWindow<kMaxColumns>(prefix() + row * kBlockSize * count, count, x); };
    for (int row = 0; row < ColumnWindows::kRows; ++row) {
      const int at = y + row;
      if (at < 0 || at >= kBlockSize) {
        for (int k = 0; k < count; ++k) windows.setRow(k, row, Float4::zero());
        continue;
      }
      const AxisWindow<kMaxColumns> here = sumsOfRow(at), below = sumsOfRow(std::max(at - 1, 0));
      for (int k = 0; k < count; ++k) windows.setRow(k, row, at > 0 ? here.lanes(k) - below.lanes(k) : here.lanes(k));
    }
  }

  /// Writes the projection of a box: sums of columns over the part of the block.
  GLINT_DEVICE_CALL GLINT_HD void box(const ColumnLayout& layout, const BlockBox& b, float* projection) const {
    const int count = columns();
    float sums[kMaxColumns];
    std::fill(sums, sums + count, 0.0f);
    forEachPrefix(b, [&](const std::int32_t* sums_before, float weight) {
      for (int k = 0; k < count; ++k) sums[k] += weight * static_cast<float>(sums_before[k]);
    });
    layout.arrange(scales(), ColumnValues{sums}, projection);
  }

  /// Sum of each row of a slice, negative pixels included; O(16 columns).
  /// @param weights  coefficients times scales, [columns]
  /// @param weigh    WeighPrefixes, or a function with the same results
  template <class Weigh>
  GLINT_DEVICE_CALL GLINT_HD Float16 rowSums(const float* weights, Weigh weigh) const {
    const int count = columns();
    return weigh(prefix() + (kBlockSize - 1) * count, kBlockSize * count, count, weights, Stored()).differences();
  }

  /// Pixels of row y of a slice; O(16 columns).
  template <class Weigh>
  GLINT_DEVICE_CALL GLINT_HD Float16 rowPixels(const float* weights, int y, Weigh weigh) const {
    const int count = columns(), row_elements = kBlockSize * count;
    const std::int32_t* row = prefix() + y * row_elements;
    const Float16 sums =
        y > 0 ? weigh(row, count, count, weights, LessAbove{row_elements}) : weigh(row, count, count, weights, Stored());
    return sums.differences();
  }

  /// All pixels of a slice, [16][16]; O(256 columns). Weighs the prefix sums of all columns first,
  /// and takes differences once.
  template <class Weigh>
  GLINT_DEVICE_CALL GLINT_HD void block(const float* weights, float* pixels, Weigh weigh) const {
    const int count = columns();
    const std::int32_t* row = prefix();
    Float16 above = {{Float4::zero(), Float4::zero(), Float4::zero(), Float4::zero()}};
    for (int y = 0; y < kBlockSize; ++y, row += kBlockSize * count) {
      const Float16 here = weigh(row, count, count, weights, Stored()).differences();
      (here - above).store(pixels + y * kBlockSize);
      above = here;
    }
  }

  GLINT_HD const std::int32_t* prefix() const { return basis(); }  ///< prefix sums over x and y, [16][16][columns]

 private:
  /// Calls visitor(prefix sums [columns], weight) for the prefix sums that add up to the sum over a box.
  template <class Visitor>
  GLINT_HD void forEachPrefix(const BlockBox& box, Visitor&& visitor) const {
    const WeightedPrefixes across(box.x0, box.x1), up(box.y0, box.y1);
    for (int j = 0; j < up.count; ++j)
      for (int i = 0; i < across.count; ++i)
        visitor(prefix() + (up.pixels[j] * kBlockSize + across.pixels[i]) * columns(), up.parts[j] * across.parts[i]);
  }
};

}  // namespace glint
