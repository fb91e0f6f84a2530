#pragma once

#include "glint/math/float4.h"
#include "glint/model/ndf_cp.h"

namespace glint {

/// Columns of the largest cluster: a block has no more pixels.
inline constexpr int kMaxColumns = kBlockPixels;

/// Places of the columns of a cluster in a projection (one float for each column, to be multiplied with the coefficients of a
/// slice).
///
/// A row of coefficients is read four bytes at a time, and a byte of narrow columns holds two columns in its halves. So a
/// projection is in three parts: wide columns, narrow columns of the low halves, narrow columns of the high halves. Zeros pad
/// each part to a multiple of four floats.
struct ColumnLayout {
  GLINT_HD explicit ColumnLayout(const NdfCluster& cluster)
      : columns(cluster.columns), wide(cluster.columns - cluster.narrow_columns), half((cluster.narrow_columns + 1) / 2) {}

  /// Floats of the largest projection.
  static constexpr int kMost = kMaxColumns + 16;

  /// Writes a projection: scales[k] * values.one(k) for every column k.
  /// @param values  has one(k), and four(k) for columns k to k + 3; may have scaled(scales, k, to), which writes the eight
  ///                products of columns k to k + 7
  template <class Values>
  GLINT_HD void arrange(const float* scales, const Values& values, float* projection) const {
    const int ends[4] = {0, wide, wide + half, columns}, places[3] = {0, low(), high()};
    for (int part = 0; part < (half > 0 ? 3 : 1); ++part)
      arrangeRange(scales, values, ends[part], ends[part + 1], projection + places[part]);
  }

  /// First float of the narrow columns in low halves.
  GLINT_HD int low() const { return (wide + 3) & ~3; }
  /// First float of the narrow columns in high halves.
  GLINT_HD int high() const { return low() + ((half + 3) & ~3); }

  int columns;  ///< of the cluster
  int wide;     ///< columns with a coefficient of their own in a row
  int half;     ///< bytes of a row that hold narrow columns

 private:
  /// Writes the columns from `begin` to `end`, and zeros up to a whole group of four.
  template <class Values>
  GLINT_DEVICE_CALL static GLINT_HD void arrangeRange(const float* scales, const Values& values, int begin, int end,
                                                      float* to) {
    const int count = end - begin;
    if constexpr (requires { values.scaled(scales, begin, to); }) {
      if (count >= 8) {
        for (int k = 0; k + 8 <= count; k += 8) values.scaled(scales, begin + k, to + k);
        if (count % 8 != 0) values.scaled(scales, end - 8, to + count - 8);
        Float4::zero().store(to + count);
        return;
      }
    }
    if (count < 4) {
      Float4::zero().store(to);
      for (int k = 0; k < count; ++k) to[k] = scales[begin + k] * values.one(begin + k);
      return;
    }
    const auto group = [&](int k) { (Float4::load(scales + begin + k) * values.four(begin + k)).store(to + k); };
    for (int k = 0; k + 4 <= count; k += 4) group(k);
    if (count % 4 != 0) group(count - 4);
    // Also after whole groups: the high halves can have one column less than the low halves, and so one group less.
    Float4::zero().store(to + count);
  }
};

/// Values of columns that an array holds, for ColumnLayout::arrange.
struct ColumnValues {
  const float* values;
  GLINT_HD float one(int k) const { return values[k]; }
  GLINT_HD Float4 four(int k) const { return Float4::load(values + k); }
};

}  // namespace glint
