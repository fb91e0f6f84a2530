#pragma once

#include <cstdint>
#include <type_traits>

#include "glint/math/float4.h"
#include "glint/math/half.h"
#include "glint/query/detail/compressed/column_layout.h"

namespace glint {

/// Decodes rows of coefficients. A row has the coefficients of one slice: wide columns, then bytes of two narrow columns each.
/// @tparam Coefficient  stored type: std::int8_t, std::uint16_t (half precision) or float
template <class Coefficient>
struct CoefficientRows {
  using Row = const Coefficient*;
  /// Whether rows can have narrow columns.
  static constexpr bool kHasNarrow = std::is_same_v<Coefficient, std::int8_t>;

  static GLINT_HD float value(Coefficient c) {
    if constexpr (std::is_same_v<Coefficient, std::uint16_t>)
      return halfToFloat(c);
    else
      return static_cast<float>(c);
  }

  /// Dot product of a projection with the coefficients of a slice.
  /// @note reads up to three elements after the row; zeros of the projection cancel them
  GLINT_DEVICE_CALL static GLINT_HD float dot(const float* projection, const ColumnLayout& layout, Row row) {
    Float4 sum[1] = {Float4::zero()};
    addProducts<1>(projection, layout, &row, sum);
    return sum[0].sum();
  }

  /// Dot products with four slices: each has the same bits as `dot`.
  GLINT_DEVICE_CALL static GLINT_HD Float4 dots(const float* projection, const ColumnLayout& layout, const Row (&rows)[4]) {
    Float4 sums[4] = {Float4::zero(), Float4::zero(), Float4::zero(), Float4::zero()};
    addProducts<4>(projection, layout, rows, sums);
    return sumsOf(sums[0], sums[1], sums[2], sums[3]);
  }

  /// scaled[k] = scales[k] * coefficient of column k.
  GLINT_DEVICE_CALL static GLINT_HD void scale(const float* scales, const ColumnLayout& layout, Row row, float* scaled) {
    int k = 0;
    for (; k + 4 <= layout.wide; k += 4) (Float4::load(scales + k) * Float4::load(row + k)).store(scaled + k);
    for (; k < layout.wide; ++k) scaled[k] = scales[k] * value(row[k]);
    if constexpr (kHasNarrow) scaleNarrow(scales, layout, row + layout.wide, 0, scaled);
  }

  /// The part of `scale` for narrow columns, from byte j on.
  /// @param bytes  first byte of the row that holds narrow columns
  static GLINT_HD void scaleNarrow(const float* scales, const ColumnLayout& layout, const std::int8_t* bytes, int j,
                                   float* scaled) {
    const int low = layout.wide, high = layout.wide + layout.half, high_columns = layout.columns - high;
    for (; j + 4 <= high_columns; j += 4) {
      (Float4::load(scales + low + j) * Float4::loadLow(bytes + j)).store(scaled + low + j);
      (Float4::load(scales + high + j) * Float4::loadHigh(bytes + j)).store(scaled + high + j);
    }
    for (; j < layout.half; ++j) {
      scaled[low + j] = scales[low + j] * static_cast<float>(lowHalf(bytes[j]));
      if (j < high_columns) scaled[high + j] = scales[high + j] * static_cast<float>(highHalf(bytes[j]));
    }
  }

 private:
  /// Adds the products of a projection and rows of coefficients: lane k has the products of columns k, k + 4, k + 8, ...
  template <int kRows>
  static GLINT_HD void addProducts(const float* projection, const ColumnLayout& layout, const Row* rows, Float4* sums) {
    for (int k = 0; k < layout.wide; k += 4) {
      const Float4 p = Float4::load(projection + k);
      for (int r = 0; r < kRows; ++r) sums[r] = sums[r] + p * Float4::load(rows[r] + k);
    }
    if constexpr (kHasNarrow) {
      for (int j = 0; j < layout.half; j += 4) {
        const Float4 low = Float4::load(projection + layout.low() + j), high = Float4::load(projection + layout.high() + j);
        for (int r = 0; r < kRows; ++r) {
          const std::int8_t* narrow = rows[r] + layout.wide + j;
          sums[r] = sums[r] + low * Float4::loadLow(narrow);
          sums[r] = sums[r] + high * Float4::loadHigh(narrow);
        }
      }
    }
  }
};

}  // namespace glint
