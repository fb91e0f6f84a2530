#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "glint/query/cluster_basis.h"
#include "glint/query/float4.h"

namespace glint {

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

/// What reads the factors of clusters: Basis is the stored type of prefix sums, Coefficient that of coefficients. Every function
/// reads only elements of its cluster.
template <class Basis, class Coefficient>
class ClusterReader {
 public:
  GLINT_HD explicit ClusterReader(const CompressedNdf& ndf) : ndf_(ndf) {}

  using Row = const Coefficient*;

  /// Coefficients of a slice.
  GLINT_HD Row row(const NdfCluster& cluster, std::uint64_t slice, int columns) const {
    return static_cast<Row>(ndf_.coefficients) + cluster.first_coefficient + slice * static_cast<std::uint64_t>(columns);
  }

  /// projection[k] = scaled column k at one pixel.
  GLINT_HD void pixel(const NdfCluster& cluster, int x, int y, float* projection) const {
    const Basis* basis = first(cluster);
    const float* scales = ndf_.scales.data() + cluster.first_scale;
    const int rx = cluster.rank_x, ry = cluster.rank_y;
    if (ndf_.method == CompressionMethod::cp) {
      const Basis *at_x = basis + x * rx, *at_y = basis + (kBlockSize + y) * rx;
      forEachColumn(
          rx,
          [&](int k) {
            (Float4::load(scales + k) * axis4(at_x + k, rx, x > 0) * axis4(at_y + k, rx, y > 0)).store(projection + k);
          },
          [&](int k) { projection[k] = scales[k] * axis(at_x + k, rx, x > 0) * axis(at_y + k, rx, y > 0); });
    } else if (ndf_.method == CompressionMethod::tucker) {
      const Basis *at_x = basis + x * rx, *at_y = basis + kBlockSize * rx + y * ry;
      for (int a = 0; a < rx; ++a) {
        const float value = axis(at_x + a, rx, x > 0);
        float* row = projection + a * ry;
        const float* row_scales = scales + a * ry;
        forEachColumn(
            ry, [&](int b) { (Float4::load(row_scales + b) * Float4::all(value) * axis4(at_y + b, ry, y > 0)).store(row + b); },
            [&](int b) { row[b] = row_scales[b] * value * axis(at_y + b, ry, y > 0); });
      }
    } else {
      const Basis* at = basis + (y * kBlockSize + x) * rx;
      forEachColumn(
          rx, [&](int k) { (Float4::load(scales + k) * image4(at + k, rx, x > 0, y > 0)).store(projection + k); },
          [&](int k) { projection[k] = scales[k] * image(at + k, rx, x > 0, y > 0); });
    }
  }

  /// The last group of four of a projection, without what whole groups before it hold.
  GLINT_HD Float4 lastColumns(const float* projection, int columns) const {
    if (columns < 4 || columns % 4 == 0) return Float4::zero();
    float last[4];
    for (int k = 0; k < 4; ++k) last[k] = k < 4 - columns % 4 ? 0.0f : projection[columns - 4 + k];
    return Float4::load(last);
  }

  /// Dot product of a projection with the coefficients of a slice.
  /// @param last  lastColumns(projection, columns)
  GLINT_HD float dot(const float* projection, Float4 last, Row c, int columns) const {
    if (columns < 4) {
      float sum = 0;
      for (int k = 0; k < columns; ++k) sum += projection[k] * value(c[k]);
      return sum;
    }
    Float4 sum = last * Float4::load(c + (columns - 4));
    for (int k = 0; k + 4 <= columns; k += 4) sum = sum + Float4::load(projection + k) * Float4::load(c + k);
    return sum.sum();
  }

  /// All pixels of a slice, [16][16], negative ones taken as 0.
  GLINT_HD void block(const NdfCluster& cluster, Row c, int columns, float* pixels) const {
    const float* scales = ndf_.scales.data() + cluster.first_scale;
    float scaled[kMaxColumns];
    for (int k = 0; k < columns; ++k) scaled[k] = scales[k] * value(c[k]);
    if (ndf_.method == CompressionMethod::pca) return sumImages(cluster, scaled, pixels);
    const bool cp = ndf_.method == CompressionMethod::cp;
    const int rx = cluster.rank_x, ry = cp ? rx : cluster.rank_y;
    float along_x[kMaxColumns * kBlockSize], along_y[kMaxColumns * kBlockSize];  // [rank][16]
    valuesOfAxis(first(cluster), rx, along_x);
    valuesOfAxis(first(cluster) + kBlockSize * rx, ry, along_y);
    float weights[kMaxColumns * kBlockSize];  // [rank_x][16]: of the functions of x in each row
    for (int a = 0; a < rx; ++a) {
      for (int y = 0; y < kBlockSize; y += 4) {
        Float4 sum = Float4::zero();
        if (cp) {
          sum = Float4::all(scaled[a]) * Float4::load(along_y + a * kBlockSize + y);
        } else {
          for (int b = 0; b < ry; ++b) sum = sum + Float4::all(scaled[a * ry + b]) * Float4::load(along_y + b * kBlockSize + y);
        }
        sum.store(weights + a * kBlockSize + y);
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

  /// The same for prefix sums over both axes of a block.
  static GLINT_HD float image(const Basis* at, int rank, bool inner_x, bool inner_y) {
    const float here = axis(at, rank, inner_x);
    return inner_y ? here - axis(at - kBlockSize * rank, rank, inner_x) : here;
  }
  static GLINT_HD Float4 image4(const Basis* at, int rank, bool inner_x, bool inner_y) {
    const Float4 here = axis4(at, rank, inner_x);
    return inner_y ? here - axis4(at - kBlockSize * rank, rank, inner_x) : here;
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

  /// pca: sums the prefix sums of all columns first, and takes differences once.
  GLINT_HD void sumImages(const NdfCluster& cluster, const float* scaled, float* pixels) const {
    const int columns = cluster.rank_x;
    const Basis* at = first(cluster);
    const Float4 last = lastColumns(scaled, columns);
    float above[kBlockSize + 1] = {}, here[kBlockSize + 1] = {};
    for (int y = 0; y < kBlockSize; ++y) {
      for (int x = 0; x < kBlockSize; x += 4, at += 4 * columns) {
        if (columns < 4) {
          for (int j = 0; j < 4; ++j) {
            here[1 + x + j] = 0;
            for (int k = 0; k < columns; ++k) here[1 + x + j] += scaled[k] * static_cast<float>(at[j * columns + k]);
          }
          continue;
        }
        Float4 sums[4];
        for (int j = 0; j < 4; ++j) sums[j] = last * Float4::load(at + j * columns + columns - 4);
        for (int k = 0; k + 4 <= columns; k += 4) {
          const Float4 w = Float4::load(scaled + k);
          for (int j = 0; j < 4; ++j) sums[j] = sums[j] + w * Float4::load(at + j * columns + k);
        }
        sumsOf(sums[0], sums[1], sums[2], sums[3]).store(here + 1 + x);
      }
      for (int x = 0; x < kBlockSize; x += 4) {
        const Float4 outer = Float4::load(here + x + 1) - Float4::load(here + x);
        const Float4 inner = Float4::load(above + x + 1) - Float4::load(above + x);
        (outer - inner).positive().store(pixels + y * kBlockSize + x);
      }
      for (int x = 1; x <= kBlockSize; ++x) above[x] = here[x];
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
