#pragma once

#include "glint/math/avx2.h"
#include "glint/query/detail/compressed/cluster_slices.h"

#ifdef GLINT_AVX2

namespace glint {

/// ClusterReader eight columns at a time, with the same results to the bit where no product and sum are fused. What it has of
/// its own does what is named alike there, and reads no further.
template <class Basis, class Coefficient>
class Avx2Reader : public ClusterReader<Basis, Coefficient> {
  using Base = ClusterReader<Basis, Coefficient>;

 public:
  using typename Base::Row;
  GLINT_AVX2 explicit Avx2Reader(const Base& reader) : Base(reader) {}

  GLINT_AVX2 void pixel(const NdfCluster& cluster, const ColumnLayout& layout, int x, int y, float* projection) const {
    const Basis* basis = this->first(cluster);
    const float* scales = this->scalesOf(cluster);
    const int columns = cluster.columns;
    if (this->isOf(CompressionMethod::cp)) {
      const Axis along_x(basis, columns, x), along_y(basis + kBlockSize * columns, columns, y);
      layout.arrange(scales, Products{{along_x, along_y}}, projection);
    } else if (this->isOf(CompressionMethod::tucker)) {
      const int rx = cluster.rank_x, ry = cluster.rank_y;
      float along_x[kBlockSize] = {}, along_y[kBlockSize] = {};
      Axis(basis, rx, x).store(along_x);
      Axis(basis + kBlockSize * rx, ry, y).store(along_y);
      layout.arrange(scales, CorePairs{this->coreOf(cluster), along_x, along_y}, projection);
    } else {
      layout.arrange(scales, Image{{basis, columns, x, y}}, projection);
    }
  }

  GLINT_AVX2 float valueAlone(const NdfCluster& cluster, Row c, int x, int y) const {
    const Basis* basis = this->first(cluster);
    const float* scales = this->scalesOf(cluster);
    const int columns = cluster.columns;
    const Axis along_x(basis, columns, x), along_y(basis + kBlockSize * columns, columns, y);
    const Products products{{along_x, along_y}};
    Float4 sum = Float4::zero();
    int k = 0;
    for (; k + 8 <= columns; k += 8) {
      const __m256 eight = _mm256_mul_ps(_mm256_mul_ps(loadEight(scales + k), products.eight(k)), loadEight(c + k));
      sum = sum + lowFour(eight) + highFour(eight);
    }
    return Base::addRest(cluster, c, products, k, sum);
  }

  GLINT_AVX2 Float4 dots(const float* projection, const ColumnLayout& layout, const Row (&rows)[4]) const {
    __m256 first = _mm256_setzero_ps(), second = first;
    for (int k = 0; k < layout.wide; k += 4) {
      const __m256 p = twice(projection + k);
      first = _mm256_add_ps(first, _mm256_mul_ps(p, loadTwo(rows[0] + k, rows[1] + k)));
      second = _mm256_add_ps(second, _mm256_mul_ps(p, loadTwo(rows[2] + k, rows[3] + k)));
    }
    if constexpr (std::is_same_v<Coefficient, std::int8_t>) {
      for (int j = 0; j < layout.half; j += 4) {
        const int k = layout.wide + j;
        const __m256i a = bytesOf(rows[0] + k, rows[1] + k), b = bytesOf(rows[2] + k, rows[3] + k);
        const __m256 low = twice(projection + layout.low() + j), high = twice(projection + layout.high() + j);
        first = _mm256_add_ps(_mm256_add_ps(first, _mm256_mul_ps(low, lowHalves(a))), _mm256_mul_ps(high, highHalves(a)));
        second = _mm256_add_ps(_mm256_add_ps(second, _mm256_mul_ps(low, lowHalves(b))), _mm256_mul_ps(high, highHalves(b)));
      }
    }
    return sumsOf(lowFour(first), highFour(first), lowFour(second), highFour(second));
  }

  GLINT_AVX2 void scaledCoefficients(const NdfCluster& cluster, Row c, float* scaled) const {
    const float* scales = this->scalesOf(cluster);
    const ColumnLayout layout(cluster);
    int k = 0;
    for (; k + 8 <= layout.wide; k += 8) store(scaled + k, _mm256_mul_ps(loadEight(scales + k), loadEight(c + k)));
    for (; k < layout.wide; ++k) scaled[k] = scales[k] * Base::value(c[k]);
    if constexpr (std::is_same_v<Coefficient, std::int8_t>) {
      const Row bytes = c + layout.wide;
      const int low = layout.wide, high = layout.wide + layout.half, high_columns = layout.columns - high;
      int j = 0;
      for (; j + 8 <= high_columns; j += 8) {
        const __m256i eight = integersOf(bytes + j);
        store(scaled + low + j, _mm256_mul_ps(loadEight(scales + low + j), lowHalves(eight)));
        store(scaled + high + j, _mm256_mul_ps(loadEight(scales + high + j), highHalves(eight)));
      }
      Base::scaleNarrow(scales, layout, bytes, j, scaled);
    }
  }
  GLINT_AVX2 void sliceWeights(const NdfCluster& cluster, Row c, float* weights) const {
    Base::sliceWeightsBy(*this, cluster, c, weights);
  }
  GLINT_AVX2 Float16 rowSums(const NdfCluster& cluster, const float* weights) const {
    return Base::rowSumsBy(cluster, weights, WeighPrefixes());
  }
  GLINT_AVX2 Float16 rowPixels(const NdfCluster& cluster, const float* weights, int y) const {
    return Base::rowPixelsBy(cluster, weights, y, WeighPrefixes());
  }

 private:
  // Base::Stored and Base::LessAbove.
  GLINT_AVX2 static __m256 eight(typename Base::Stored, const Basis* at) { return loadEight(at); }
  GLINT_AVX2 static __m256 eight(typename Base::LessAbove load, const Basis* at) { return difference(at, at - load.above, -1); }

  /// Base::EightRows.
  struct EightRows {
    template <class Load>
    GLINT_AVX2 void operator()(const Basis* prefix, int stride, const typename Base::ColumnWeights& columns, Load load,
                               Float4* sums) const {
      const __m256 zero = _mm256_setzero_ps();
      __m256 rows[8] = {zero, zero, zero, zero, zero, zero, zero, zero};
      if (columns.last != nullptr) {
        const __m256 counted = _mm256_set1_ps(static_cast<float>(columns.counted) - 0.5f);
        const __m256 left = _mm256_cmp_ps(counted, _mm256_setr_ps(0, 1, 2, 3, 4, 5, 6, 7), _CMP_LT_OQ);
        add(_mm256_and_ps(left, loadEight(columns.last)), prefix + columns.last_at, stride, load, rows);
      }
      for (int k = 0; k < columns.whole; k += 8) add(loadEight(columns.weights + k), prefix + k, stride, load, rows);
      const __m256 all =
          sumsOfEach(halves(rows[0], rows[4]), halves(rows[1], rows[5]), halves(rows[2], rows[6]), halves(rows[3], rows[7]));
      sums[0] = lowFour(all);
      sums[1] = highFour(all);
    }
    template <class Load>
    GLINT_AVX2 static void add(__m256 w, const Basis* at, int stride, Load load, __m256 (&rows)[8]) {
      for (int j = 0; j < 8; ++j) rows[j] = _mm256_add_ps(rows[j], _mm256_mul_ps(w, eight(load, at + j * stride)));
    }
    /// Both halves of a added up, and both of b.
    GLINT_AVX2 static __m256 halves(__m256 a, __m256 b) {
      return _mm256_add_ps(_mm256_permute2f128_ps(a, b, 0x20), _mm256_permute2f128_ps(a, b, 0x31));
    }
    /// sumsOf in either half.
    GLINT_AVX2 static __m256 sumsOfEach(__m256 a, __m256 b, __m256 c, __m256 d) {
      const __m256 ab = _mm256_add_ps(_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
      const __m256 cd = _mm256_add_ps(_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
      return _mm256_add_ps(_mm256_shuffle_ps(ab, cd, 0x44), _mm256_shuffle_ps(ab, cd, 0xee));
    }
  };

  /// Base::WeighPrefixes. Once for all callers: with copies in each of them a source takes twice as long to compile.
  struct WeighPrefixes {
    template <class Load>
    [[gnu::noinline]] GLINT_AVX2 GLINT_FLATTEN Float16 operator()(const Basis* prefix, int stride, int columns,
                                                                  const float* weights, Load load) const {
      return Base::weighPrefixes(prefix, stride, columns, weights, load, EightRows());
    }
  };

  using Axis = typename Base::Axis;
  /// Columns k to k + 7 at the pixel.
  GLINT_AVX2 static __m256 eight(const Axis& axis, int k) { return difference(axis.at + k, axis.before + k, axis.inner); }

  // Values of columns for ColumnLayout::arrange, `scaled` eight at once.

  struct Products : Base::Products {
    GLINT_AVX2 __m256 eight(int k) const { return _mm256_mul_ps(Avx2Reader::eight(this->x, k), Avx2Reader::eight(this->y, k)); }
    GLINT_AVX2 void scaled(const float* scales, int k, float* to) const {
      store(to, _mm256_mul_ps(loadEight(scales + k), eight(k)));
    }
  };

  struct Image : Base::Image {
    GLINT_AVX2 void scaled(const float* scales, int k, float* to) const {
      const __m256 at = eight(this->here, k);
      store(to, _mm256_mul_ps(loadEight(scales + k), this->inner ? _mm256_sub_ps(at, eight(this->below, k)) : at));
    }
  };

  struct CorePairs {
    GLINT_AVX2 CorePairs(const std::uint8_t* c, const float* along_x, const float* along_y)
        : core(c),
          x(along_x),
          y(along_y),
          low_x(loadEight(x)),
          high_x(loadEight(x + 8)),
          low_y(loadEight(y)),
          high_y(loadEight(y + 8)) {}
    GLINT_AVX2 float one(int k) const { return x[core[k] % kBlockSize] * y[core[k] / kBlockSize]; }
    GLINT_AVX2 Float4 four(int k) const { return Float4::of(one(k), one(k + 1), one(k + 2), one(k + 3)); }
    GLINT_AVX2 void scaled(const float* scales, int k, float* to) const {
      const __m256i pairs = _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(core + k)));
      const __m256 products = _mm256_mul_ps(choose(low_x, high_x, pairs), choose(low_y, high_y, _mm256_srli_epi32(pairs, 4)));
      store(to, _mm256_mul_ps(loadEight(scales + k), products));
    }
    /// In lanes: number index % 16 of 16.
    GLINT_AVX2 static __m256 choose(__m256 low, __m256 high, __m256i index) {
      const __m256 upper = _mm256_castsi256_ps(_mm256_slli_epi32(index, 28));  // bit 3 to the sign
      return _mm256_blendv_ps(_mm256_permutevar8x32_ps(low, index), _mm256_permutevar8x32_ps(high, index), upper);
    }
    const std::uint8_t* core;
    const float *x, *y;
    __m256 low_x, high_x, low_y, high_y;
  };

  GLINT_AVX2 static void store(float* to, __m256 v) { _mm256_storeu_ps(to, v); }

  /// Float4::difference.
  GLINT_AVX2 static __m256 difference(const float* a, const float* b, int mask) {
    return _mm256_sub_ps(loadEight(a), _mm256_and_ps(loadEight(b), _mm256_castsi256_ps(_mm256_set1_epi32(mask))));
  }
  template <class T>
  GLINT_AVX2 static __m256 difference(const T* a, const T* b, int mask) {
    return _mm256_cvtepi32_ps(_mm256_sub_epi32(integersOf(a), _mm256_and_si256(integersOf(b), _mm256_set1_epi32(mask))));
  }

  /// Four floats in both halves.
  GLINT_AVX2 static __m256 twice(const float* p) { return _mm256_broadcast_ps(reinterpret_cast<const __m128*>(p)); }

  // Four columns of two rows in the halves.
  GLINT_AVX2 static __m256i bytesOf(const std::int8_t* a, const std::int8_t* b) {
    return _mm256_cvtepi8_epi32(_mm_unpacklo_epi32(_mm_loadu_si32(a), _mm_loadu_si32(b)));
  }
  GLINT_AVX2 static __m256 loadTwo(const std::int8_t* a, const std::int8_t* b) { return _mm256_cvtepi32_ps(bytesOf(a, b)); }
  GLINT_AVX2 static __m256 loadTwo(const std::uint16_t* a, const std::uint16_t* b) {
    return floatsOf(_mm_unpacklo_epi64(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(a)),
                                       _mm_loadl_epi64(reinterpret_cast<const __m128i*>(b))));
  }
  GLINT_AVX2 static __m256 loadTwo(const float* a, const float* b) {
    return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(a)), _mm_loadu_ps(b), 1);
  }
  GLINT_AVX2 static __m256 lowHalves(__m256i bytes) {
    return _mm256_cvtepi32_ps(_mm256_srai_epi32(_mm256_slli_epi32(bytes, 28), 28));
  }
  GLINT_AVX2 static __m256 highHalves(__m256i bytes) { return _mm256_cvtepi32_ps(_mm256_srai_epi32(bytes, 4)); }
};

}  // namespace glint

#endif
