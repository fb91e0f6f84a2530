#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "glint/math/float4.h"
#include "glint/math/half.h"
#include "glint/model/ndf_cp.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"

namespace glint {

/// Columns of the largest cluster: a block has no more pixels.
inline constexpr int kMaxColumns = kBlockPixels;

/// Where a projection holds the columns of a cluster, so that groups of four of them meet groups of four of a row: wide
/// columns, then the narrow ones of low and of high halves, each padded by zeros.
struct ColumnLayout {
  GLINT_HD explicit ColumnLayout(const NdfCluster& cluster)
      : columns(cluster.columns), wide(cluster.columns - cluster.narrow_columns), half((cluster.narrow_columns + 1) / 2) {}

  /// Floats of the largest projection.
  static constexpr int kMost = kMaxColumns + 16;

  /// Writes a projection: scales[k] * values.one(k) of every column k, four(k) of four at once; values.scaled(scales, k, to) of
  /// eight, if there is such a function.
  template <class Values>
  GLINT_HD void arrange(const float* scales, const Values& values, float* projection) const {
    const int ends[4] = {0, wide, wide + half, columns}, places[3] = {0, low(), high()};
    for (int part = 0; part < (half > 0 ? 3 : 1); ++part)
      arrangeRange(scales, values, ends[part], ends[part + 1], projection + places[part]);
  }

  // Where a projection has the first narrow column of each half.
  GLINT_HD int low() const { return (wide + 3) & ~3; }
  GLINT_HD int high() const { return low() + ((half + 3) & ~3); }

  int columns, wide, half;

 private:
  /// A range of columns, and zeros up to a whole group.
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
    // Always: the high halves may be one less than the low ones, and a group of these more.
    Float4::zero().store(to + count);
  }
};

/// Columns that are at hand, for ColumnLayout::arrange.
struct ColumnValues {
  const float* values;
  GLINT_HD float one(int k) const { return values[k]; }
  GLINT_HD Float4 four(int k) const { return Float4::load(values + k); }
};

template <class Basis, class Coefficient>
class Avx2Reader;

/// What reads the factors of clusters of columns: Basis is the stored type of prefix sums, Coefficient that of coefficients.
template <class Basis, class Coefficient>
class ClusterReader {
 public:
  GLINT_HD explicit ClusterReader(const NdfCp& ndf) : ndf_(ndf) {}

  using Row = const Coefficient*;
  using Avx2 = Avx2Reader<Basis, Coefficient>;  ///< the same with vectors of eight, where the processor has them

  /// Coefficients of a slice.
  GLINT_HD Row row(const NdfCluster& cluster, std::uint64_t slice) const {
    return static_cast<Row>(ndf_.coefficients) + cluster.first_coefficient +
           slice * static_cast<std::uint64_t>(rowElements(cluster));
  }

  /// The rows of a cluster, by slice.
  struct Rows {
    GLINT_HD Row operator()(std::uint64_t slice) const { return first + slice * elements; }
    Row first;
    std::uint64_t elements;
  };
  GLINT_HD Rows rows(const NdfCluster& cluster, const ColumnLayout& layout) const {
    return {static_cast<Row>(ndf_.coefficients) + cluster.first_coefficient,
            static_cast<std::uint64_t>(layout.wide + layout.half)};
  }

  /// projection = scaled columns at one pixel, as ColumnLayout says.
  /// @note inline: as a call it would have callers save all their vectors
  GLINT_HOST_INLINE GLINT_HD void pixel(const NdfCluster& cluster, const ColumnLayout& layout, int x, int y,
                                        float* projection) const {
    const Basis* basis = first(cluster);
    const float* scales = scalesOf(cluster);
    const int columns = cluster.columns;
    if (isOf(CompressionMethod::cp)) {
      const Axis along_x(basis, columns, x), along_y(basis + kBlockSize * columns, columns, y);
      layout.arrange(scales, Products{along_x, along_y}, projection);
    } else if (isOf(CompressionMethod::tucker)) {
      const int rx = cluster.rank_x, ry = cluster.rank_y;
      float along_x[kBlockSize] = {}, along_y[kBlockSize];
      Axis(basis, rx, x).store(along_x);
      Axis(basis + kBlockSize * rx, ry, y).store(along_y);
      arrangeCore(cluster, layout, along_x, along_y, projection);
    } else {
      layout.arrange(scales, Image(basis, columns, x, y), projection);
    }
  }

  /// Whether a slice is as quickly asked by itself as with a projection that others share. Then nothing branches on whether
  /// neighbours are of one cluster.
  GLINT_HD bool asksAlone(const NdfCluster& cluster) const {
    return isOf(CompressionMethod::cp) && cluster.narrow_columns == 0 && cluster.columns > 0;
  }

  /// Asks the memory for what valueAlone reads.
  GLINT_HD void prefetchAlone(const NdfCluster& cluster, std::uint64_t slice, int x, int y) const {
    const auto columns = static_cast<std::uint64_t>(cluster.columns);
    prefetch(first(cluster) + static_cast<unsigned>(x) * columns);
    prefetch(first(cluster) + static_cast<unsigned>(kBlockSize + y) * columns);
    prefetch(static_cast<Row>(ndf_.coefficients) + cluster.first_coefficient + slice * columns);
  }

  /// One pixel of a slice of such a cluster: `dot` with `pixel`, to the bit.
  GLINT_DEVICE_CALL GLINT_HD float valueAlone(const NdfCluster& cluster, Row c, int x, int y) const {
    const int columns = cluster.columns;
    const Axis along_x(first(cluster), columns, x), along_y(first(cluster) + kBlockSize * columns, columns, y);
    return addRest(cluster, c, Products{along_x, along_y}, 0, Float4::zero());
  }

  /// projection = sums of scaled columns over a part of the block, as ColumnLayout says.
  GLINT_DEVICE_CALL GLINT_HD void box(const NdfCluster& cluster, const ColumnLayout& layout, const BlockBox& b,
                                      float* projection) const {
    const Basis* basis = first(cluster);
    const int columns = cluster.columns;
    if (isOf(CompressionMethod::tucker)) {
      float along_x[kBlockSize] = {}, along_y[kBlockSize];
      sumAlongAxis(basis, cluster.rank_x, b.x0, b.x1, along_x);
      sumAlongAxis(basis + kBlockSize * cluster.rank_x, cluster.rank_y, b.y0, b.y1, along_y);
      return arrangeCore(cluster, layout, along_x, along_y, projection);
    }
    float along_x[kMaxColumns], along_y[kMaxColumns];
    if (isOf(CompressionMethod::pca)) {
      std::fill(along_x, along_x + columns, 0.0f);
      forEachPrefix(basis, columns, b, [&](const Basis* row, float weight) {
        for (int k = 0; k < columns; ++k) along_x[k] += weight * static_cast<float>(row[k]);
      });
    } else {
      sumAlongAxis(basis, columns, b.x0, b.x1, along_x);
      sumAlongAxis(basis + kBlockSize * columns, columns, b.y0, b.y1, along_y);
      for (int k = 0; k < columns; ++k) along_x[k] *= along_y[k];
    }
    layout.arrange(scalesOf(cluster), ColumnValues{along_x}, projection);
  }

  /// Dot product of a projection with the coefficients of a slice.
  /// @note reads up to three elements after the row, which meet zeros
  GLINT_DEVICE_CALL GLINT_HD float dot(const float* projection, const ColumnLayout& layout, Row c) const {
    Float4 sum[1] = {Float4::zero()};
    addProducts<1>(projection, layout, &c, sum);
    return sum[0].sum();
  }

  /// The same for four slices, to the bit.
  GLINT_DEVICE_CALL GLINT_HD Float4 dots(const float* projection, const ColumnLayout& layout, const Row (&rows)[4]) const {
    Float4 sums[4] = {Float4::zero(), Float4::zero(), Float4::zero(), Float4::zero()};
    addProducts<4>(projection, layout, rows, sums);
    return sumsOf(sums[0], sums[1], sums[2], sums[3]);
  }

  /// scaled = coefficients of a slice times the scales of their columns, in the order of columns.
  GLINT_DEVICE_CALL GLINT_HD void scaledCoefficients(const NdfCluster& cluster, Row c, float* scaled) const {
    const float* scales = scalesOf(cluster);
    const ColumnLayout layout(cluster);
    int k = 0;
    for (; k + 4 <= layout.wide; k += 4) (Float4::load(scales + k) * Float4::load(c + k)).store(scaled + k);
    for (; k < layout.wide; ++k) scaled[k] = scales[k] * value(c[k]);
    if constexpr (std::is_same_v<Coefficient, std::int8_t>) scaleNarrow(scales, layout, c + layout.wide, 0, scaled);
  }

  /// What rowSums, rowPixels and block ask of a slice. cp and pca: its scaledCoefficients. tucker: these as a matrix, that of
  /// function a of x and b of y at a + 16 b; 0 where there is no such column, up to a multiple of four b.
  /// @param weights  [kBlockPixels]
  GLINT_DEVICE_CALL GLINT_HD void sliceWeights(const NdfCluster& cluster, Row c, float* weights) const {
    sliceWeightsBy(*this, cluster, c, weights);
  }

  /// Sums of the rows of a slice, negative pixels included: O(16 rank) for cp, O((16 + rank_x) rank_y) for tucker, O(16
  /// columns) for pca.
  /// @param weights  its sliceWeights
  GLINT_HD Float16 rowSums(const NdfCluster& cluster, const float* weights) const {
    return rowSumsBy(cluster, weights, WeighPrefixes());
  }
  /// Row y of a slice, negative pixels taken as 0. The cost is that of rowSums.
  /// @param weights  its sliceWeights
  GLINT_HD Float16 rowPixels(const NdfCluster& cluster, const float* weights, int y) const {
    return rowPixelsBy(cluster, weights, y, WeighPrefixes());
  }

  /// All pixels of a slice, [16][16], negative ones taken as 0.
  /// @param weights  its sliceWeights
  GLINT_DEVICE_CALL GLINT_HD void block(const NdfCluster& cluster, const float* weights, float* pixels) const {
    if (isOf(CompressionMethod::pca)) return sumImages(cluster, weights, pixels);
    const bool cp = isOf(CompressionMethod::cp);
    const int rx = cp ? cluster.columns : cluster.rank_x, ry = cp ? rx : cluster.rank_y;
    float along_x[kMaxColumns * kBlockSize], along_y[kMaxColumns * kBlockSize];  // [rank][16]
    valuesOfAxis(first(cluster), rx, along_x);
    valuesOfAxis(first(cluster) + kBlockSize * rx, ry, along_y);
    float in_row[kMaxColumns * kBlockSize];  // [rank_x][16]: weights of the functions of x in each row
    for (int a = 0; a < rx; ++a) {
      for (int y = 0; y < kBlockSize; y += 4) {
        const auto function = [&](int b, float weight) {
          return Float4::all(weight) * Float4::load(along_y + b * kBlockSize + y);
        };
        Float4 sum = cp ? function(a, weights[a]) : Float4::zero();
        for (int b = 0; !cp && b < ry; ++b) sum = sum + function(b, weights[b * kBlockSize + a]);
        sum.store(in_row + a * kBlockSize + y);
      }
    }
    for (int y = 0; y < kBlockSize; ++y) {
      Float4 sums[4] = {Float4::zero(), Float4::zero(), Float4::zero(), Float4::zero()};
      for (int a = 0; a < rx; ++a) {
        const Float4 w = Float4::all(in_row[a * kBlockSize + y]);
        for (int x = 0; x < 4; ++x) sums[x] = sums[x] + w * Float4::load(along_x + a * kBlockSize + 4 * x);
      }
      for (int x = 0; x < 4; ++x) sums[x].positive().store(pixels + y * kBlockSize + 4 * x);
    }
  }

 protected:
  /// Whether clusters are of this method: integers of a basis say whether it is pca.
  GLINT_HD bool isOf(CompressionMethod method) const {
    if constexpr (std::is_same_v<Basis, std::int32_t>) return method == CompressionMethod::pca;
    if (std::is_same_v<Basis, std::int16_t> && method == CompressionMethod::pca) return false;
    return ndf_.method == method;
  }

  GLINT_HD const Basis* first(const NdfCluster& cluster) const {
    return static_cast<const Basis*>(ndf_.basis) + cluster.first_basis;
  }

  GLINT_HD const float* scalesOf(const NdfCluster& cluster) const { return ndf_.scales.data() + cluster.first_scale; }
  GLINT_HD const std::uint8_t* coreOf(const NdfCluster& cluster) const { return ndf_.core.data() + cluster.first_scale; }

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

  /// valueAlone from column k on. `sum` has the columns before.
  template <class Values>
  GLINT_HD float addRest(const NdfCluster& cluster, Row c, const Values& values, int k, Float4 sum) const {
    const float* scales = scalesOf(cluster);
    const int columns = cluster.columns;
    for (; k + 4 <= columns; k += 4) sum = sum + Float4::load(scales + k) * values.four(k) * Float4::load(c + k);
    float rest[4] = {};
    for (int j = 0; k < columns; ++k, ++j) rest[j] = scales[k] * values.one(k) * value(c[k]);
    return (columns % 4 == 0 ? sum : sum + Float4::load(rest)).sum();
  }

  /// scaledCoefficients of narrow columns from number j of each half on.
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

  /// Adds the products of a projection and rows of coefficients: lane k has those of columns 4 n + k.
  template <int kRows>
  static GLINT_HD void addProducts(const float* projection, const ColumnLayout& layout, const Row* rows, Float4* sums) {
    for (int k = 0; k < layout.wide; k += 4) {
      const Float4 p = Float4::load(projection + k);
      for (int r = 0; r < kRows; ++r) sums[r] = sums[r] + p * Float4::load(rows[r] + k);
    }
    if constexpr (std::is_same_v<Coefficient, std::int8_t>) {
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

  /// Functions of one axis at a pixel: differences of rows of prefix sums.
  struct Axis {
    GLINT_HD Axis(const Basis* prefix, int columns, int pixel)
        : inner(pixel > 0 ? -1 : 0), count(columns), at(prefix + pixel * columns), before(at - (columns & inner)) {}
    GLINT_HD float one(int k) const { return differenceOf(at[k], inner != 0 ? before[k] : Basis{0}); }
    GLINT_HD Float4 four(int k) const { return Float4::difference(at + k, before + k, inner); }
    GLINT_HD void store(float* values) const {
      if (count < 4) {
        for (int k = 0; k < count; ++k) values[k] = one(k);
        return;
      }
      int k = 0;
      for (; k + 4 <= count; k += 4) four(k).store(values + k);
      if (k < count) four(count - 4).store(values + count - 4);
    }
    int inner;  ///< all bits, or none where there is nothing before
    int count;
    const Basis *at, *before;
  };

  /// cp: products of functions of x and of y.
  struct Products {
    GLINT_HD float one(int k) const { return x.one(k) * y.one(k); }
    GLINT_HD Float4 four(int k) const { return x.four(k) * y.four(k); }
    const Axis &x, &y;
  };

  /// pca: a pixel of every basis image, from their prefix sums over both axes.
  struct Image {
    GLINT_HD Image(const Basis* prefix, int columns, int x, int y)
        : here(prefix + y * kBlockSize * columns, columns, x),
          below(prefix + (y > 0 ? y - 1 : 0) * kBlockSize * columns, columns, x),
          inner(y > 0) {}
    GLINT_HD float one(int k) const { return here.one(k) - (inner ? below.one(k) : 0.0f); }
    GLINT_HD Float4 four(int k) const { return inner ? here.four(k) - below.four(k) : here.four(k); }
    Axis here, below;
    bool inner;
  };

  /// tucker: products of the pairs of functions that the core names.
  struct CorePairs {
    GLINT_HD float one(int k) const { return products[core[k]]; }
    GLINT_HD Float4 four(int k) const { return Float4::of(one(k), one(k + 1), one(k + 2), one(k + 3)); }
    const std::uint8_t* core;
    const float* products;  ///< a + 16 b: of function a of x and function b of y
  };

  GLINT_HOST_INLINE GLINT_HD void arrangeCore(const NdfCluster& cluster, const ColumnLayout& layout, const float* along_x,
                                              const float* along_y, float* projection) const {
    float products[kBlockPixels];  // those beyond rank_x are of no meaning
    for (int b = 0; b < cluster.rank_y; ++b) {
      const Float4 y = Float4::all(along_y[b]);
      for (int a = 0; a < cluster.rank_x; a += 4) (y * Float4::load(along_x + a)).store(products + b * kBlockSize + a);
    }
    layout.arrange(scalesOf(cluster), CorePairs{coreOf(cluster), products}, projection);
  }

  static GLINT_HD float value(Coefficient c) {
    if constexpr (std::is_same_v<Coefficient, std::uint16_t>)
      return halfToFloat(c);
    else
      return static_cast<float>(c);
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

  /// Weights of columns in groups of eight.
  struct ColumnWeights {
    const float* weights;  ///< of `whole` columns
    int whole;
    // Of columns [last_at, last_at + 8), but for the first `counted`; nullptr: no more.
    const float* last;
    int last_at, counted;
  };

  /// Prefix sums as they are stored.
  struct Stored {
    GLINT_HD Float4 four(const Basis* at) const { return Float4::load(at); }
  };
  /// Prefix sums less those `above` elements before them.
  struct LessAbove {
    GLINT_HD Float4 four(const Basis* at) const { return Float4::difference(at, at - above, -1); }
    std::ptrdiff_t above;
  };

  /// Lane t: sum over k of weights[k] * prefix[t * stride + k].
  /// @param load        Stored or LessAbove
  /// @param eight_rows  EightRows, or what has the same results
  template <class Load, class Rows>
  static GLINT_HD Float16 weighPrefixes(const Basis* prefix, int stride, int columns, const float* weights, Load load,
                                        Rows eight_rows) {
    if (columns < 4) return weighFew(prefix, stride, columns, weights, load);
    Float16 sums;
    const Basis* last_rows = prefix + kBlockSize / 2 * stride;
    if (columns < 8) {  // reads what is around a row, but nothing around the block
      float first[8] = {}, last[8] = {};
      for (int k = 0; k < columns; ++k) first[k] = last[8 - columns + k] = weights[k];
      eight_rows(prefix, stride, ColumnWeights{weights, 0, first, 0, 0}, load, sums.v);
      eight_rows(last_rows, stride, ColumnWeights{weights, 0, last, columns - 8, 0}, load, sums.v + 2);
      return sums;
    }
    const int rest = columns % 8, last_at = columns - 8;
    const ColumnWeights all = {weights, columns - rest, rest > 0 ? weights + last_at : nullptr, last_at, 8 - rest};
    eight_rows(prefix, stride, all, load, sums.v);
    eight_rows(last_rows, stride, all, load, sums.v + 2);
    return sums;
  }

  /// The same for less than four columns.
  template <class Load>
  static GLINT_HD Float16 weighFew(const Basis* prefix, int stride, int columns, const float* weights, Load load) {
    float w[3] = {};
    for (int k = 0; k < columns; ++k) w[k] = weights[k];
    const Float4 head = Float4::of(w[0], w[1], w[2], 0);
    const Float4 tail = columns == 1   ? Float4::of(0, 0, 0, w[0])
                        : columns == 2 ? Float4::of(0, 0, w[0], w[1])
                                       : Float4::of(0, w[0], w[1], w[2]);
    const auto four = [&](const Basis* at, Float4 each) {
      return sumsOf(each * load.four(at), each * load.four(at + stride), each * load.four(at + 2 * stride),
                    each * load.four(at + 3 * stride));
    };
    // Reads what is around a row, but nothing around the block.
    return {{four(prefix, head), four(prefix + 4 * stride, head), four(prefix + 8 * stride, head),
             four(prefix + 12 * stride + columns - 4, tail)}};
  }

  /// Weighted sums of the columns of eight rows: each in eight lanes first, which two groups of four hold.
  struct EightRows {
    template <class Load>
    GLINT_HD void operator()(const Basis* prefix, int stride, const ColumnWeights& columns, Load load, Float4* sums) const {
      for (int k = 0; k < 2; ++k) sums[k] = four(prefix + 4 * k * stride, stride, columns, load);
    }

   private:
    template <class Load>
    static GLINT_HD Float4 four(const Basis* prefix, int stride, const ColumnWeights& columns, Load load) {
      Float4 low[4] = {Float4::zero(), Float4::zero(), Float4::zero(), Float4::zero()},
             high[4] = {low[0], low[0], low[0], low[0]};
      const auto add = [&](Float4 w0, Float4 w1, const Basis* at) {
        for (int j = 0; j < 4; ++j) {
          low[j] = low[j] + w0 * load.four(at + j * stride);
          high[j] = high[j] + w1 * load.four(at + j * stride + 4);
        }
      };
      if (columns.last != nullptr) {
        const Float4 counted = Float4::all(static_cast<float>(columns.counted) - 0.5f);
        add(whereLess(counted, Float4::of(0, 1, 2, 3), Float4::load(columns.last)),
            whereLess(counted, Float4::of(4, 5, 6, 7), Float4::load(columns.last + 4)), prefix + columns.last_at);
      }
      for (int k = 0; k < columns.whole; k += 8)
        add(Float4::load(columns.weights + k), Float4::load(columns.weights + k + 4), prefix + k);
      return sumsOf(low[0] + high[0], low[1] + high[1], low[2] + high[2], low[3] + high[3]);
    }
  };

  /// weighPrefixes by EightRows.
  struct WeighPrefixes {
    template <class Load>
    GLINT_DEVICE_CALL GLINT_HD Float16 operator()(const Basis* prefix, int stride, int columns, const float* weights,
                                                  Load load) const {
      return weighPrefixes(prefix, stride, columns, weights, load, EightRows());
    }
  };

  /// sliceWeights by the scaledCoefficients of a reader.
  template <class Reader>
  GLINT_HD void sliceWeightsBy(const Reader& reader, const NdfCluster& cluster, Row c, float* weights) const {
    if (!isOf(CompressionMethod::tucker)) return reader.scaledCoefficients(cluster, c, weights);
    float scaled[kMaxColumns];
    reader.scaledCoefficients(cluster, c, scaled);
    std::fill(weights, weights + kBlockSize * ((cluster.rank_y + 3) & ~3), 0.0f);
    const std::uint8_t* core = coreOf(cluster);
    for (int k = 0; k < cluster.columns; ++k) weights[core[k]] += scaled[k];
  }

  // rowSums and rowPixels by WeighPrefixes, or by what has the same results.
  template <class Weigh>
  GLINT_DEVICE_CALL GLINT_HD Float16 rowSumsBy(const NdfCluster& cluster, const float* weights, Weigh weigh) const {
    constexpr int kLast = kBlockSize - 1;
    const Basis* basis = first(cluster);
    const int columns = cluster.columns;
    if (isOf(CompressionMethod::pca))
      return weigh(basis + kLast * columns, kBlockSize * columns, columns, weights, Stored()).differences();
    float in_rows[kMaxColumns];  // weights of the functions of y
    if (isOf(CompressionMethod::cp)) {
      const Basis* along_x = basis + kLast * columns;
      for (int k = 0; k < columns; ++k) in_rows[k] = weights[k] * static_cast<float>(along_x[k]);
      return weigh(basis + kBlockSize * columns, columns, columns, in_rows, Stored()).differences();
    }
    const int rx = cluster.rank_x, ry = cluster.rank_y;
    float along_x[kBlockSize] = {};
    for (int a = 0; a < rx; ++a) along_x[a] = static_cast<float>(basis[kLast * rx + a]);
    weighCoreRows(weights, ry, along_x, in_rows);
    return weigh(basis + kBlockSize * rx, ry, ry, in_rows, Stored()).differences();
  }

  template <class Weigh>
  GLINT_DEVICE_CALL GLINT_HD Float16 rowPixelsBy(const NdfCluster& cluster, const float* weights, int y, Weigh weigh) const {
    const Basis* basis = first(cluster);
    const int columns = cluster.columns;
    if (isOf(CompressionMethod::pca)) {
      const int row_elements = kBlockSize * columns;
      const Basis* row = basis + y * row_elements;
      const Float16 sums = y > 0 ? weigh(row, columns, columns, weights, LessAbove{row_elements})
                                 : weigh(row, columns, columns, weights, Stored());
      return sums.differences().positive();
    }
    float along_y[kMaxColumns];
    if (isOf(CompressionMethod::cp)) {
      Axis(basis + kBlockSize * columns, columns, y).store(along_y);
      for (int k = 0; k < columns; ++k) along_y[k] *= weights[k];
      return weigh(basis, columns, columns, along_y, Stored()).differences().positive();
    }
    const int rx = cluster.rank_x, ry = cluster.rank_y;
    Axis(basis + kBlockSize * rx, ry, y).store(along_y);
    float in_row[kBlockSize];  // weights of the functions of x
    weighCoreColumns(weights, ry, along_y, in_row);
    return weigh(basis, rx, rx, in_row, Stored()).differences().positive();
  }

  /// sums[b] = sum over a of matrix[a + 16 b] * weights[a]; for whole groups of four b.
  static GLINT_HD void weighCoreRows(const float* matrix, int rows, const float* weights, float* sums) {
    const Float16 w = Float16::load(weights);
    const auto row = [&](int b) {
      const Float16 r = Float16::load(matrix + b * kBlockSize);
      return (w.v[0] * r.v[0] + w.v[1] * r.v[1]) + (w.v[2] * r.v[2] + w.v[3] * r.v[3]);
    };
    for (int b = 0; b < rows; b += 4) sumsOf(row(b), row(b + 1), row(b + 2), row(b + 3)).store(sums + b);
  }
  /// sums[a] = sum over b of matrix[a + 16 b] * weights[b], [16].
  static GLINT_HD void weighCoreColumns(const float* matrix, int rows, const float* weights, float* sums) {
    Float4 lanes[4] = {Float4::zero(), Float4::zero(), Float4::zero(), Float4::zero()};
    for (int b = 0; b < rows; ++b) {
      const Float4 w = Float4::all(weights[b]);
      for (int k = 0; k < 4; ++k) lanes[k] = lanes[k] + w * Float4::load(matrix + b * kBlockSize + 4 * k);
    }
    for (int k = 0; k < 4; ++k) lanes[k].store(sums + 4 * k);
  }

  /// pca: sums the prefix sums of all columns first, and takes differences once.
  GLINT_HD void sumImages(const NdfCluster& cluster, const float* scaled, float* pixels) const {
    const int columns = cluster.columns;
    const Basis* at = first(cluster);
    Float16 above = {{Float4::zero(), Float4::zero(), Float4::zero(), Float4::zero()}};
    for (int y = 0; y < kBlockSize; ++y, at += kBlockSize * columns) {
      const Float16 here = WeighPrefixes()(at, columns, columns, scaled, Stored()).differences();
      (here - above).positive().store(pixels + y * kBlockSize);
      above = here;
    }
  }

  const NdfCp& ndf_;
};

/// Calls visitor(ClusterReader) for the types that a compressed NDF stores.
template <class Visitor>
GLINT_HD auto withReader(const NdfCp& ndf, Visitor&& visitor) {
  const bool pca = ndf.method == CompressionMethod::pca;
  if (ndf.coefficient_type == CoefficientType::f32) return visitor(ClusterReader<float, float>(ndf));
  if (ndf.coefficient_type == CoefficientType::f16)
    return pca ? visitor(ClusterReader<std::int32_t, std::uint16_t>(ndf))
               : visitor(ClusterReader<std::int16_t, std::uint16_t>(ndf));
  return pca ? visitor(ClusterReader<std::int32_t, std::int8_t>(ndf)) : visitor(ClusterReader<std::int16_t, std::int8_t>(ndf));
}

}  // namespace glint
