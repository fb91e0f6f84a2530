#pragma once

#include "glint/math/avx2.h"
#include "glint/query/detail/compressed/prefix_axis.h"
#include "glint/query/detail/compressed/prefix_weights.h"

#ifdef GLINT_AVX2

namespace glint {

/// Prefix sums with vectors of eight. Functions of the same name as in prefix_axis.h and prefix_weights.h return the same bits
/// and read no further.
struct Avx2Prefixes {
  /// Columns k to k + 7 at the pixel of an axis.
  GLINT_AVX2 static __m256 eight(const PrefixAxis& axis, int k) { return difference(axis.at + k, axis.before + k, axis.inner); }

  /// weighPrefixes as a function object. Not inlined: with a copy in each caller, a source takes twice as long to compile.
  struct Weigh {
    template <class T, class Load>
    [[gnu::noinline]] GLINT_AVX2 GLINT_FLATTEN Float16 operator()(const T* prefix, int stride, int columns,
                                                                  const float* weights, Load load) const {
      return weighPrefixes(prefix, stride, columns, weights, load, EightRows());
    }
  };

 private:
  /// Eight elements as floats: a[k] - b[k], rounded once, or a[k] where `mask` is 0 rather than -1 (Float4::difference).
  GLINT_AVX2 static __m256 difference(const std::int32_t* a, const std::int32_t* b, int mask) {
    return _mm256_cvtepi32_ps(_mm256_sub_epi32(integersOf(a), _mm256_and_si256(integersOf(b), _mm256_set1_epi32(mask))));
  }

  // Eight elements, read as the argument says.
  template <class T>
  GLINT_AVX2 static __m256 eight(Stored, const T* at) {
    return loadEight(at);
  }
  template <class T>
  GLINT_AVX2 static __m256 eight(LessAbove load, const T* at) {
    return difference(at, at - load.above, -1);
  }

  struct EightRows {
    template <class T, class Load>
    GLINT_AVX2 void operator()(const T* prefix, int stride, const ColumnWeights& columns, Load load, Float4* sums) const {
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
    template <class T, class Load>
    GLINT_AVX2 static void add(__m256 w, const T* at, int stride, Load load, __m256 (&rows)[8]) {
      for (int j = 0; j < 8; ++j) rows[j] = _mm256_add_ps(rows[j], _mm256_mul_ps(w, eight(load, at + j * stride)));
    }
    /// Lanes 0 to 3: low half plus high half of `a`. Lanes 4 to 7: low half plus high half of `b`.
    GLINT_AVX2 static __m256 halves(__m256 a, __m256 b) {
      return _mm256_add_ps(_mm256_permute2f128_ps(a, b, 0x20), _mm256_permute2f128_ps(a, b, 0x31));
    }
    /// sumsOf (float4.h) in lanes 0 to 3, and in lanes 4 to 7.
    GLINT_AVX2 static __m256 sumsOfEach(__m256 a, __m256 b, __m256 c, __m256 d) {
      const __m256 ab = _mm256_add_ps(_mm256_unpacklo_ps(a, b), _mm256_unpackhi_ps(a, b));
      const __m256 cd = _mm256_add_ps(_mm256_unpacklo_ps(c, d), _mm256_unpackhi_ps(c, d));
      return _mm256_add_ps(_mm256_shuffle_ps(ab, cd, 0x44), _mm256_shuffle_ps(ab, cd, 0xee));
    }
  };
};

}  // namespace glint

#endif
