#pragma once

#include <cstdint>

#include "glint/math/float4.h"
#include "glint/model/ndf_cp.h"
#include "glint/query/detail/compressed/coefficient_rows.h"
#include "glint/query/detail/compressed/column_layout.h"
#include "glint/query/detail/compressed/cp_basis.h"
#include "glint/query/detail/compressed/pca_basis.h"
#include "glint/query/detail/compressed/tucker_basis.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"

namespace glint {

template <class Basis, class Coefficient>
class Avx2Reader;

/// Reads the slices of clusters of columns.
///
/// Where a block is asked for one pixel or one box, the values of all columns there are computed first: the projection. A slice
/// of the cluster then costs one dot product with its row of coefficients. Where many pixels of one slice are asked, `weights`
/// of its columns are computed first (sliceWeights).
/// @tparam Basis        CpBasis, TuckerBasis or PcaBasis
/// @tparam Coefficient  stored type of coefficients
template <class Basis, class Coefficient>
class ClusterReader {
 public:
  using Rows = CoefficientRows<Coefficient>;
  using Row = typename Rows::Row;
  using Avx2 = Avx2Reader<Basis, Coefficient>;  ///< the same answers with vectors of eight, for processors that have AVX2

  GLINT_HD explicit ClusterReader(const NdfCp& ndf) : ndf_(ndf) {}

  /// Coefficients of a slice.
  GLINT_HD Row row(const NdfCluster& cluster, std::uint64_t slice) const {
    return firstRow(cluster) + slice * static_cast<std::uint64_t>(rowElements(cluster));
  }

  /// Rows of a cluster, by slice.
  struct RowsOfCluster {
    GLINT_HD Row operator()(std::uint64_t slice) const { return first + slice * elements; }
    Row first;
    std::uint64_t elements;
  };
  GLINT_HD RowsOfCluster rows(const NdfCluster& cluster, const ColumnLayout& layout) const {
    return {firstRow(cluster), static_cast<std::uint64_t>(layout.wide + layout.half)};
  }

  /// Writes the projection at one pixel: scaled values of columns, arranged by ColumnLayout.
  /// @note always inlined on hosts: around a call, callers would have to save all their vectors
  GLINT_HOST_INLINE GLINT_HD void pixel(const NdfCluster& cluster, const ColumnLayout& layout, int x, int y,
                                        float* projection) const {
    basisOf(cluster).pixel(layout, x, y, projection);
  }

  /// Writes the values of columns, without scales, at the pixels of a window.
  /// @param x, y  column and row of its first pixel in the block, -2 to 15
  GLINT_HD void window(const NdfCluster& cluster, int x, int y, ColumnWindows& windows) const {
    basisOf(cluster).window(x, y, windows);
  }

  /// Writes the projection of a box: sums of scaled columns over the part of the block.
  GLINT_HD void box(const NdfCluster& cluster, const ColumnLayout& layout, const BlockBox& b, float* projection) const {
    basisOf(cluster).box(layout, b, projection);
  }

  /// Dot product of a projection with the coefficients of a slice.
  /// @note reads up to three elements after the row; zeros of the projection cancel them
  GLINT_HD float dot(const float* projection, const ColumnLayout& layout, Row c) const {
    return Rows::dot(projection, layout, c);
  }
  /// Dot products with four slices: each has the same bits as `dot`.
  GLINT_HD Float4 dots(const float* projection, const ColumnLayout& layout, const Row (&rows)[4]) const {
    return Rows::dots(projection, layout, rows);
  }

  /// Whether a pixel is best asked of each slice by itself (valueAlone), without a projection. Then no branch depends on
  /// whether neighbouring slices are of the same cluster.
  GLINT_HD bool asksAlone(const NdfCluster& cluster) const {
    return Basis::kIsQuickAlone && cluster.narrow_columns == 0 && cluster.columns > 0;
  }

  /// Asks the memory for what valueAlone reads.
  GLINT_HD void prefetchAlone(const NdfCluster& cluster, std::uint64_t slice, int x, int y) const {
    if constexpr (Basis::kIsQuickAlone) {
      basisOf(cluster).prefetchPixel(x, y);
      prefetch(firstRow(cluster) + slice * static_cast<std::uint64_t>(cluster.columns));
    }
  }

  /// One pixel of a slice: the same bits as `dot` with `pixel`.
  /// @pre asksAlone(cluster); otherwise the answer is 0
  GLINT_DEVICE_CALL GLINT_HD float valueAlone(const NdfCluster& cluster, Row c, int x, int y) const {
    if constexpr (Basis::kIsQuickAlone)
      return addRest(cluster, c, basisOf(cluster).at(x, y), 0, Float4::zero());
    else
      return 0;
  }

  /// scaled[k] = coefficient of column k times its scale.
  GLINT_HD void scaledCoefficients(const NdfCluster& cluster, Row c, float* scaled) const {
    Rows::scale(scalesOf(cluster), ColumnLayout(cluster), c, scaled);
  }

  /// Writes the weights that leastSums, rowPixels and block ask for: scaledCoefficients, or the matrix of TuckerBasis.
  /// @param weights  [kBlockPixels]
  GLINT_DEVICE_CALL GLINT_HD void sliceWeights(const NdfCluster& cluster, Row c, float* weights) const {
    sliceWeightsBy(*this, cluster, c, weights);
  }

  /// A lower bound of the sum of rowPixels, for each row: the sum of its pixels, less their floors.
  /// @param weights  from sliceWeights
  GLINT_HD Float16 leastSums(const NdfCluster& cluster, const float* weights) const {
    return leastSumsBy(WeighPrefixes(), cluster, weights);
  }
  /// Pixels of row y of a slice, less their floors, negative pixels taken as 0. Costs as much as leastSums.
  GLINT_HD Float16 rowPixels(const NdfCluster& cluster, const float* weights, int y) const {
    return rowPixelsBy(WeighPrefixes(), cluster, weights, y);
  }
  /// All pixels of a slice, [16][16], less their floors, negative pixels taken as 0.
  GLINT_HD void block(const NdfCluster& cluster, const float* weights, float* pixels) const {
    blockBy(WeighPrefixes(), cluster, weights, pixels);
  }

 protected:
  GLINT_HD Basis basisOf(const NdfCluster& cluster) const { return {{ndf_, cluster}}; }
  GLINT_HD Row firstRow(const NdfCluster& cluster) const { return basisOf(cluster).template coefficients<Coefficient>(); }
  GLINT_HD const float* scalesOf(const NdfCluster& cluster) const { return basisOf(cluster).scales(); }

  /// valueAlone from column k on.
  /// @param sum  of the products of columns before k
  template <class Values>
  GLINT_HD float addRest(const NdfCluster& cluster, Row c, const Values& values, int k, Float4 sum) const {
    const float* scales = scalesOf(cluster);
    const int columns = cluster.columns;
    for (; k + 4 <= columns; k += 4) sum = sum + Float4::load(scales + k) * values.four(k) * Float4::load(c + k);
    float rest[4] = {};
    for (int j = 0; k < columns; ++k, ++j) rest[j] = scales[k] * values.one(k) * Rows::value(c[k]);
    return (columns % 4 == 0 ? sum : sum + Float4::load(rest)).sum();
  }

  /// sliceWeights by the scaledCoefficients of a reader.
  template <class Reader>
  GLINT_HD void sliceWeightsBy(const Reader& reader, const NdfCluster& cluster, Row c, float* weights) const {
    if constexpr (Basis::kHasCore) {
      float scaled[kMaxColumns];
      reader.scaledCoefficients(cluster, c, scaled);
      basisOf(cluster).fillMatrix(scaled, weights);
    } else {
      reader.scaledCoefficients(cluster, c, weights);
    }
  }

  template <class Weigh>
  GLINT_HD Float16 leastSumsBy(Weigh weigh, const NdfCluster& cluster, const float* weights) const {
    const Basis basis = basisOf(cluster);
    return (basis.rowSums(weights, weigh) - basis.floors().rowSums()).positive();
  }
  template <class Weigh>
  GLINT_HD Float16 rowPixelsBy(Weigh weigh, const NdfCluster& cluster, const float* weights, int y) const {
    const Basis basis = basisOf(cluster);
    return (basis.rowPixels(weights, y, weigh) - basis.floors().row(y)).positive();
  }
  template <class Weigh>
  GLINT_HD void blockBy(Weigh weigh, const NdfCluster& cluster, const float* weights, float* pixels) const {
    const Basis basis = basisOf(cluster);
    basis.block(weights, pixels, weigh);
    for (int y = 0; y < kBlockSize; ++y)
      (Float16::load(pixels + y * kBlockSize) - basis.floors().row(y)).positive().store(pixels + y * kBlockSize);
  }

 private:
  const NdfCp& ndf_;
};

/// Calls visitor(ClusterReader) for a method and a type of coefficients.
template <class Coefficient, class Visitor>
GLINT_HD auto withReaderOf(const NdfCp& ndf, Visitor& visitor) {
  if (ndf.method == CompressionMethod::cp) return visitor(ClusterReader<CpBasis, Coefficient>(ndf));
  if (ndf.method == CompressionMethod::tucker) return visitor(ClusterReader<TuckerBasis, Coefficient>(ndf));
  return visitor(ClusterReader<PcaBasis, Coefficient>(ndf));
}

/// Calls visitor(ClusterReader) for the method and the types of a compressed pyramid.
template <class Visitor>
GLINT_HD auto withReader(const NdfCp& ndf, Visitor&& visitor) {
  if (ndf.coefficient_type == CoefficientType::f32) return withReaderOf<float>(ndf, visitor);
  if (ndf.coefficient_type == CoefficientType::f16) return withReaderOf<std::uint16_t>(ndf, visitor);
  return withReaderOf<std::int8_t>(ndf, visitor);
}

}  // namespace glint
