#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "glint/model/compressed_ndf.h"
#include "glint/query/float4.h"
#include "glint/query/half.h"
#include "glint/query/pyramid_slices.h"

namespace glint {

/// Columns of the largest cluster: a block has no more pixels.
inline constexpr int kMaxColumns = kBlockPixels;

/// Where a projection holds the columns of a cluster, so that groups of four of them meet groups of four of a row: wide
/// columns, then the narrow ones of low and of high halves, each padded by zeros.
struct ColumnLayout {
  GLINT_HD explicit ColumnLayout(const NdfCluster& cluster)
      : columns(cluster.columns),
        wide(cluster.columns - cluster.narrow_columns),
        half((cluster.narrow_columns + 1) / 2),
        low((wide + 3) & ~3),
        high(low + ((half + 3) & ~3)) {}

  /// Floats of the largest projection.
  static constexpr int kMost = kMaxColumns + 16;

  /// Where column k is.
  GLINT_HD int at(int k) const { return k < wide ? k : k - wide < half ? low + (k - wide) : high + (k - wide - half); }

  int columns, wide, half;
  int low, high;  ///< first narrow column of each half
};

/// Calls four(k) for whole groups of four columns, so that every column below `columns` is in one; the last group may overlap the
/// one before. Fewer than four columns are visited by one(k).
template <class Four, class One>
GLINT_HD void forEachColumn(int columns, Four&& four, One&& one) {
  if (columns < 4) {
    for (int k = 0; k < columns; ++k) one(k);
    return;
  }
  int k = 0;
  for (; k + 4 <= columns; k += 4) four(k);
  if (k < columns) four(columns - 4);
}

/// What reads the factors of clusters of columns: Basis is the stored type of prefix sums, Coefficient that of coefficients.
template <class Basis, class Coefficient>
class ClusterReader {
 public:
  GLINT_HD explicit ClusterReader(const CompressedNdf& ndf) : ndf_(ndf) {}

  using Row = const Coefficient*;

  /// Coefficients of a slice.
  GLINT_HD Row row(const NdfCluster& cluster, std::uint64_t slice) const {
    return static_cast<Row>(ndf_.coefficients) + cluster.first_coefficient +
           slice * static_cast<std::uint64_t>(rowElements(cluster));
  }

  /// projection = scaled columns at one pixel, as ColumnLayout says.
  GLINT_HD void pixel(const NdfCluster& cluster, int x, int y, float* projection) const {
    const Basis* basis = first(cluster);
    const int columns = cluster.columns;
    if (ndf_.method == CompressionMethod::cp) {
      const Basis *at_x = basis + x * columns, *at_y = basis + (kBlockSize + y) * columns;
      forEachColumn(
          columns, [&](int k) { (axis4(at_x + k, columns, x > 0) * axis4(at_y + k, columns, y > 0)).store(projection + k); },
          [&](int k) { projection[k] = axis(at_x + k, columns, x > 0) * axis(at_y + k, columns, y > 0); });
    } else if (ndf_.method == CompressionMethod::tucker) {
      float along_x[kBlockSize], along_y[kBlockSize];
      alongAxes(cluster, x, y, along_x, along_y);
      combineCore(cluster, along_x, along_y, projection);
    } else {
      const Basis* at = basis + (y * kBlockSize + x) * columns;
      forEachColumn(
          columns, [&](int k) { image4(at + k, columns, x > 0, y > 0).store(projection + k); },
          [&](int k) { projection[k] = image(at + k, columns, x > 0, y > 0); });
    }
    scaleAndArrange(cluster, projection);
  }

  /// tucker: values of the functions along each axis at one pixel.
  GLINT_HD void alongAxes(const NdfCluster& cluster, int x, int y, float* along_x, float* along_y) const {
    const int rx = cluster.rank_x, ry = cluster.rank_y;
    axisColumns(first(cluster) + x * rx, rx, x > 0, along_x);
    axisColumns(first(cluster) + kBlockSize * rx + y * ry, ry, y > 0, along_y);
  }

  /// projection = sums of scaled columns over a part of the block, as ColumnLayout says.
  GLINT_HD void box(const NdfCluster& cluster, const BlockBox& b, float* projection) const {
    const Basis* basis = first(cluster);
    const int columns = cluster.columns;
    if (ndf_.method == CompressionMethod::pca) {
      std::fill(projection, projection + columns, 0.0f);
      forEachPrefix(basis, columns, b, [&](const Basis* row, float weight) {
        for (int k = 0; k < columns; ++k) projection[k] += weight * static_cast<float>(row[k]);
      });
    } else if (ndf_.method == CompressionMethod::cp) {
      float along_y[kMaxColumns];
      sumAlongAxis(basis, columns, b.x0, b.x1, projection);
      sumAlongAxis(basis + kBlockSize * columns, columns, b.y0, b.y1, along_y);
      for (int k = 0; k < columns; ++k) projection[k] *= along_y[k];
    } else {
      float along_x[kBlockSize], along_y[kBlockSize];
      sumAlongAxis(basis, cluster.rank_x, b.x0, b.x1, along_x);
      sumAlongAxis(basis + kBlockSize * cluster.rank_x, cluster.rank_y, b.y0, b.y1, along_y);
      combineCore(cluster, along_x, along_y, projection);
    }
    scaleAndArrange(cluster, projection);
  }

  /// pca: calls visitor(row, weight) for the rows of 2D prefix sums [16][16][columns] that make up the sums over a box:
  /// bilinear between the nearest at each corner.
  template <class Visitor>
  static GLINT_HD void forEachPrefix(const Basis* prefix, int columns, const BlockBox& box, Visitor&& visitor) {
    for (int end = 0; end < 4; ++end) {
      const float x = end & 1 ? box.x0 : box.x1, y = end & 2 ? box.y0 : box.y1, sign = end == 0 || end == 3 ? 1.0f : -1.0f;
      const int px = std::min(static_cast<int>(x), kBlockSize - 1), py = std::min(static_cast<int>(y), kBlockSize - 1);
      const float fx = x - static_cast<float>(px), fy = y - static_cast<float>(py);
      for (int corner = 0; corner < 4; ++corner) {
        const int cx = px - 1 + (corner & 1), cy = py - 1 + (corner >> 1);
        const float weight = sign * (corner & 1 ? fx : 1 - fx) * (corner & 2 ? fy : 1 - fy);
        if (weight != 0 && cx >= 0 && cy >= 0) visitor(prefix + (cy * kBlockSize + cx) * columns, weight);
      }
    }
  }

  /// Dot product of a projection with the coefficients of a slice.
  /// @note reads up to three elements after the row, which meet zeros
  GLINT_HD float dot(const float* projection, const ColumnLayout& layout, Row c) const {
    Float4 sum = Float4::zero();
    for (int k = 0; k < layout.wide; k += 4) sum = sum + Float4::load(projection + k) * Float4::load(c + k);
    if constexpr (std::is_same_v<Coefficient, std::int8_t>) {
      const std::int8_t* narrow = c + layout.wide;
      for (int j = 0; j < layout.half; j += 4) {
        sum = sum + Float4::load(projection + layout.low + j) * Float4::loadLow(narrow + j);
        sum = sum + Float4::load(projection + layout.high + j) * Float4::loadHigh(narrow + j);
      }
    }
    return sum.sum();
  }

  /// scaled = coefficients of a slice times the scales of their columns, in the order of columns.
  GLINT_HD void scaledCoefficients(const NdfCluster& cluster, Row c, float* scaled) const {
    const float* scales = ndf_.scales.data() + cluster.first_scale;
    const ColumnLayout layout(cluster);
    int k = 0;
    for (; k + 4 <= layout.wide; k += 4) (Float4::load(scales + k) * Float4::load(c + k)).store(scaled + k);
    for (; k < layout.wide; ++k) scaled[k] = scales[k] * value(c[k]);
    if constexpr (std::is_same_v<Coefficient, std::int8_t>) {
      const Row bytes = c + layout.wide;
      const int high = layout.wide + layout.half, high_columns = layout.columns - high;
      int j = 0;
      for (; j + 4 <= high_columns; j += 4) {
        (Float4::load(scales + layout.wide + j) * Float4::loadLow(bytes + j)).store(scaled + layout.wide + j);
        (Float4::load(scales + high + j) * Float4::loadHigh(bytes + j)).store(scaled + high + j);
      }
      for (; j < layout.half; ++j) {
        scaled[layout.wide + j] = scales[layout.wide + j] * static_cast<float>(lowHalf(bytes[j]));
        if (j < high_columns) scaled[high + j] = scales[high + j] * static_cast<float>(highHalf(bytes[j]));
      }
    }
  }

  /// Sums of the rows of a slice, negative pixels included: O(16 rank) for cp and tucker, O(16 columns) for pca.
  /// @param scaled  its scaledCoefficients
  GLINT_HD Float16 rowSums(const NdfCluster& cluster, const float* scaled) const {
    constexpr int kLast = kBlockSize - 1;
    const Basis* basis = first(cluster);
    const int columns = cluster.columns;
    if (ndf_.method == CompressionMethod::pca)
      return weighPrefixes(basis + kLast * columns, kBlockSize * columns, columns, scaled).differences();
    float weights[kMaxColumns];
    if (ndf_.method == CompressionMethod::cp) {
      const Basis* along_x = basis + kLast * columns;
      for (int k = 0; k < columns; ++k) weights[k] = scaled[k] * static_cast<float>(along_x[k]);
      return weighPrefixes(basis + kBlockSize * columns, columns, columns, weights).differences();
    }
    const int rx = cluster.rank_x, ry = cluster.rank_y;
    const std::uint8_t* core = ndf_.core.data() + cluster.first_scale;
    float along_x[kBlockSize];
    axisColumns(basis + kLast * rx, rx, false, along_x);
    std::fill(weights, weights + kBlockSize, 0.0f);
    for (int k = 0; k < columns; ++k) weights[core[k] / kBlockSize] += scaled[k] * along_x[core[k] % kBlockSize];
    return weighPrefixes(basis + kBlockSize * rx, ry, ry, weights).differences();
  }

  /// Row y of a slice, negative pixels taken as 0. The cost is that of rowSums.
  /// @param scaled  its scaledCoefficients
  GLINT_HD Float16 rowPixels(const NdfCluster& cluster, const float* scaled, int y) const {
    const Basis* basis = first(cluster);
    const int columns = cluster.columns;
    if (ndf_.method == CompressionMethod::pca) {
      const Basis* row = basis + y * kBlockSize * columns;
      Float16 sums = weighPrefixes(row, columns, columns, scaled);
      if (y > 0) sums = sums - weighPrefixes(row - kBlockSize * columns, columns, columns, scaled);
      return sums.differences().positive();
    }
    float weights[kMaxColumns];
    if (ndf_.method == CompressionMethod::cp) {
      axisColumns(basis + (kBlockSize + y) * columns, columns, y > 0, weights);
      for (int k = 0; k < columns; ++k) weights[k] *= scaled[k];
      return weighPrefixes(basis, columns, columns, weights).differences().positive();
    }
    const int rx = cluster.rank_x, ry = cluster.rank_y;
    const std::uint8_t* core = ndf_.core.data() + cluster.first_scale;
    float along_y[kBlockSize];
    axisColumns(basis + kBlockSize * rx + y * ry, ry, y > 0, along_y);
    std::fill(weights, weights + kBlockSize, 0.0f);
    for (int k = 0; k < columns; ++k) weights[core[k] % kBlockSize] += scaled[k] * along_y[core[k] / kBlockSize];
    return weighPrefixes(basis, rx, rx, weights).differences().positive();
  }

  /// All pixels of a slice, [16][16], negative ones taken as 0.
  GLINT_HD void block(const NdfCluster& cluster, const float* scaled, float* pixels) const {
    if (ndf_.method == CompressionMethod::pca) return sumImages(cluster, scaled, pixels);
    const bool cp = ndf_.method == CompressionMethod::cp;
    const int rx = cp ? cluster.columns : cluster.rank_x, ry = cp ? rx : cluster.rank_y;
    float along_x[kMaxColumns * kBlockSize], along_y[kMaxColumns * kBlockSize];  // [rank][16]
    valuesOfAxis(first(cluster), rx, along_x);
    valuesOfAxis(first(cluster) + kBlockSize * rx, ry, along_y);
    float weights[kMaxColumns * kBlockSize];  // [rank_x][16]: of the functions of x in each row
    if (!cp) std::fill(weights, weights + rx * kBlockSize, 0.0f);
    const std::uint8_t* core = ndf_.core.data() + cluster.first_scale;
    for (int k = 0; k < cluster.columns; ++k) {
      const int a = cp ? k : core[k] % kBlockSize, b = cp ? k : core[k] / kBlockSize;
      for (int y = 0; y < kBlockSize; y += 4) {
        const Float4 product = Float4::all(scaled[k]) * Float4::load(along_y + b * kBlockSize + y);
        float* weight = weights + a * kBlockSize + y;
        (cp ? product : Float4::load(weight) + product).store(weight);
      }
    }
    for (int y = 0; y < kBlockSize; ++y) {
      Float4 sums[4] = {Float4::zero(), Float4::zero(), Float4::zero(), Float4::zero()};
      for (int a = 0; a < rx; ++a) {
        const Float4 w = Float4::all(weights[a * kBlockSize + y]);
        for (int x = 0; x < 4; ++x) sums[x] = sums[x] + w * Float4::load(along_x + a * kBlockSize + 4 * x);
      }
      for (int x = 0; x < 4; ++x) sums[x].positive().store(pixels + y * kBlockSize + 4 * x);
    }
  }

 private:
  GLINT_HD const Basis* first(const NdfCluster& cluster) const {
    return static_cast<const Basis*>(ndf_.basis) + cluster.first_basis;
  }

  /// tucker: the column of each pair of functions.
  GLINT_HD void combineCore(const NdfCluster& cluster, const float* along_x, const float* along_y, float* projection) const {
    const std::uint8_t* core = ndf_.core.data() + cluster.first_scale;
    for (int k = 0; k < cluster.columns; ++k) projection[k] = along_x[core[k] % kBlockSize] * along_y[core[k] / kBlockSize];
  }

  /// Multiplies columns by their scales, and moves them to where ColumnLayout wants them.
  GLINT_HD void scaleAndArrange(const NdfCluster& cluster, float* projection) const {
    const float* scales = ndf_.scales.data() + cluster.first_scale;
    const ColumnLayout layout(cluster);
    int k4 = 0;
    for (; k4 + 4 <= layout.columns; k4 += 4)
      (Float4::load(scales + k4) * Float4::load(projection + k4)).store(projection + k4);
    for (; k4 < layout.columns; ++k4) projection[k4] *= scales[k4];
    // From the end: no column is moved down.
    for (int k = layout.columns - 1; k >= layout.wide; --k) projection[layout.at(k)] = projection[k];
    const int low_end = layout.low + layout.half, high_end = layout.high + layout.columns - layout.wide - layout.half;
    for (int k = layout.wide; k < layout.low; ++k) projection[k] = 0;
    for (int k = low_end; k < layout.high; ++k) projection[k] = 0;
    for (int k = high_end; k < layout.high + ((layout.half + 3) & ~3); ++k) projection[k] = 0;
  }

  static GLINT_HD float value(Coefficient c) {
    if constexpr (std::is_same_v<Coefficient, std::uint16_t>)
      return halfToFloat(c);
    else
      return static_cast<float>(c);
  }

  /// A prefix sum without the one before it along an axis.
  static GLINT_HD float axis(const Basis* at, int rank, bool inner) {
    return static_cast<float>(*at) - (inner ? static_cast<float>(at[-rank]) : 0.0f);
  }
  static GLINT_HD Float4 axis4(const Basis* at, int rank, bool inner) {
    return inner ? Float4::load(at) - Float4::load(at - rank) : Float4::load(at);
  }
  static GLINT_HD void axisColumns(const Basis* at, int rank, bool inner, float* values) {
    forEachColumn(
        rank, [&](int k) { axis4(at + k, rank, inner).store(values + k); },
        [&](int k) { values[k] = axis(at + k, rank, inner); });
  }

  /// The same for prefix sums over both axes of a block.
  static GLINT_HD float image(const Basis* at, int rank, bool inner_x, bool inner_y) {
    const float here = axis(at, rank, inner_x);
    return inner_y ? here - axis(at - kBlockSize * rank, rank, inner_x) : here;
  }
  static GLINT_HD Float4 image4(const Basis* at, int rank, bool inner_x, bool inner_y) {
    const Float4 here = axis4(at, rank, inner_x);
    return inner_y ? here - axis4(at - kBlockSize * rank, rank, inner_x) : here;
  }

  /// sums[k] = sum of column k over [low, high] of one block axis, from its inclusive prefix sums [16][columns]. Pixels at the
  /// ends count by their covered part.
  static GLINT_HD void sumAlongAxis(const Basis* prefix, int columns, float low, float high, float* sums) {
    const int l = std::min(static_cast<int>(low), kBlockSize - 1), h = std::min(static_cast<int>(high), kBlockSize - 1);
    const float fl = low - static_cast<float>(l), fh = high - static_cast<float>(h);
    // Sum up to x = (1 - f) * prefix before its pixel + f * prefix after it.
    const Basis* l0 = l > 0 ? prefix + (l - 1) * columns : nullptr;
    const Basis* h0 = h > 0 ? prefix + (h - 1) * columns : nullptr;
    const Basis* l1 = prefix + l * columns;
    const Basis* h1 = prefix + h * columns;
    for (int k = 0; k < columns; ++k) {
      const float before =
          (l0 ? (1 - fl) * static_cast<float>(l0[k]) : 0.0f) + (fl > 0 ? fl * static_cast<float>(l1[k]) : 0.0f);
      const float after = (h0 ? (1 - fh) * static_cast<float>(h0[k]) : 0.0f) + fh * static_cast<float>(h1[k]);
      sums[k] = after - before;
    }
  }

  /// values[k][t] = column k at pixel t of an axis.
  static GLINT_HD void valuesOfAxis(const Basis* prefix, int rank, float* values) {
    for (int k = 0; k < rank; ++k) {
      float before = 0;
      for (int t = 0; t < kBlockSize; ++t) {
        const auto sum = static_cast<float>(prefix[t * rank + k]);
        values[k * kBlockSize + t] = sum - before;
        before = sum;
      }
    }
  }

  /// The last group of four, without what whole groups before it hold.
  static GLINT_HD Float4 lastColumns(const float* values, int columns) {
    if (columns < 4 || columns % 4 == 0) return Float4::zero();
    float last[4];
    for (int k = 0; k < 4; ++k) last[k] = k < 4 - columns % 4 ? 0.0f : values[columns - 4 + k];
    return Float4::load(last);
  }

  /// Lane t: sum over k of weights[k] * prefix[t * stride + k].
  static GLINT_HD Float16 weighPrefixes(const Basis* prefix, int stride, int columns, const float* weights) {
    Float16 sums;
    if (columns < 4) {  // reads what is around a row, but nothing around the block
      float w[3] = {};
      for (int k = 0; k < columns; ++k) w[k] = weights[k];
      const Float4 head = Float4::of(w[0], w[1], w[2], 0);
      const Float4 tail = columns == 1   ? Float4::of(0, 0, 0, w[0])
                          : columns == 2 ? Float4::of(0, 0, w[0], w[1])
                                         : Float4::of(0, w[0], w[1], w[2]);
      for (int k = 0; k < 3; ++k) sums.v[k] = fourRows(prefix + 4 * k * stride, stride, head);
      sums.v[3] = fourRows(prefix + 12 * stride + columns - 4, stride, tail);
      return sums;
    }
    const Float4 last = lastColumns(weights, columns);
    for (int k = 0; k < 4; ++k) sums.v[k] = fourRows(prefix + 4 * k * stride, stride, columns, weights, last);
    return sums;
  }
  static GLINT_HD Float4 fourRows(const Basis* prefix, int stride, Float4 w) {
    return sumsOf(w * Float4::load(prefix), w * Float4::load(prefix + stride), w * Float4::load(prefix + 2 * stride),
                  w * Float4::load(prefix + 3 * stride));
  }
  static GLINT_HD Float4 fourRows(const Basis* prefix, int stride, int columns, const float* weights, Float4 last) {
    Float4 sums[4];
    for (int j = 0; j < 4; ++j) sums[j] = last * Float4::load(prefix + j * stride + columns - 4);
    for (int k = 0; k + 4 <= columns; k += 4) {
      const Float4 w = Float4::load(weights + k);
      for (int j = 0; j < 4; ++j) sums[j] = sums[j] + w * Float4::load(prefix + j * stride + k);
    }
    return sumsOf(sums[0], sums[1], sums[2], sums[3]);
  }

  /// pca: sums the prefix sums of all columns first, and takes differences once.
  GLINT_HD void sumImages(const NdfCluster& cluster, const float* scaled, float* pixels) const {
    const int columns = cluster.columns;
    const Basis* at = first(cluster);
    Float16 above = {{Float4::zero(), Float4::zero(), Float4::zero(), Float4::zero()}};
    for (int y = 0; y < kBlockSize; ++y, at += kBlockSize * columns) {
      const Float16 here = weighPrefixes(at, columns, columns, scaled).differences();
      (here - above).positive().store(pixels + y * kBlockSize);
      above = here;
    }
  }

  const CompressedNdf& ndf_;
};

/// Calls visitor(ClusterReader) for the types that a compressed NDF stores.
template <class Visitor>
GLINT_HD auto withReader(const CompressedNdf& ndf, Visitor&& visitor) {
  const bool pca = ndf.method == CompressionMethod::pca;
  if (ndf.coefficient_type == CoefficientType::f32) return visitor(ClusterReader<float, float>(ndf));
  if (ndf.coefficient_type == CoefficientType::f16)
    return pca ? visitor(ClusterReader<std::int32_t, std::uint16_t>(ndf))
               : visitor(ClusterReader<std::int16_t, std::uint16_t>(ndf));
  return pca ? visitor(ClusterReader<std::int32_t, std::int8_t>(ndf)) : visitor(ClusterReader<std::int16_t, std::int8_t>(ndf));
}

}  // namespace glint
