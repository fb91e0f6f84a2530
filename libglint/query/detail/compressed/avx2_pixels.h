#pragma once

#include "glint/math/avx2.h"
#include "glint/query/detail/compressed/avx2_coefficients.h"
#include "glint/query/detail/compressed/avx2_prefixes.h"
#include "glint/query/detail/compressed/cp_basis.h"
#include "glint/query/detail/compressed/pca_basis.h"
#include "glint/query/detail/compressed/tucker_basis.h"

#ifdef GLINT_AVX2

namespace glint {

// Values of columns at one pixel with vectors of eight: avx2Pixel(basis, ...) for the basis of each method, and the function
// `scaled` that ColumnLayout::arrange then uses. Results are those of basis.pixel to the bit.

struct Avx2CpPixel : CpBasis::Pixel {
  GLINT_AVX2 __m256 eight(int k) const {
    return _mm256_mul_ps(Avx2Prefixes::eight(this->x, k), Avx2Prefixes::eight(this->y, k));
  }
  GLINT_AVX2 void scaled(const float* scales, int k, float* to) const {
    storeEight(to, _mm256_mul_ps(loadEight(scales + k), eight(k)));
  }
};
GLINT_AVX2 inline void avx2Pixel(const CpBasis& basis, const ColumnLayout& layout, int x, int y, float* projection) {
  layout.arrange(basis.scales(), Avx2CpPixel{basis.at(x, y)}, projection);
}

struct Avx2PcaPixel : PcaBasis::Pixel {
  GLINT_AVX2 void scaled(const float* scales, int k, float* to) const {
    const __m256 at = Avx2Prefixes::eight(this->here, k);
    const __m256 value = this->inner ? _mm256_sub_ps(at, Avx2Prefixes::eight(this->below, k)) : at;
    storeEight(to, _mm256_mul_ps(loadEight(scales + k), value));
  }
};
GLINT_AVX2 inline void avx2Pixel(const PcaBasis& basis, const ColumnLayout& layout, int x, int y, float* projection) {
  layout.arrange(basis.scales(), Avx2PcaPixel{basis.at(x, y)}, projection);
}

/// Products of pairs of functions. The values of the 16 functions of each axis stay in two vectors, where the core picks them.
struct Avx2TuckerPixel {
  GLINT_AVX2 Avx2TuckerPixel(const std::uint8_t* c, const float* along_x, const float* along_y)
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
    storeEight(to, _mm256_mul_ps(loadEight(scales + k), products));
  }
  /// In each lane: element number index % 16 of the 16 elements in `low` and `high`.
  GLINT_AVX2 static __m256 choose(__m256 low, __m256 high, __m256i index) {
    const __m256 upper = _mm256_castsi256_ps(_mm256_slli_epi32(index, 28));  // bit 3 of the index becomes the sign bit
    return _mm256_blendv_ps(_mm256_permutevar8x32_ps(low, index), _mm256_permutevar8x32_ps(high, index), upper);
  }
  const std::uint8_t* core;
  const float *x, *y;
  __m256 low_x, high_x, low_y, high_y;
};
GLINT_AVX2 inline void avx2Pixel(const TuckerBasis& basis, const ColumnLayout& layout, int x, int y, float* projection) {
  float at_x[kBlockSize] = {}, at_y[kBlockSize] = {};
  PrefixAxis(basis.alongX(), basis.rankX(), x).store(at_x);
  PrefixAxis(basis.alongY(), basis.rankY(), y).store(at_y);
  layout.arrange(basis.scales(), Avx2TuckerPixel{basis.core(), at_x, at_y}, projection);
}

}  // namespace glint

#endif
