// Compiled for AVX2 and F16C as a whole. Nothing but intrinsics may be included: an inline function of another header would be
// compiled for AVX2 too, and the linker might give that copy to those who run on older processors.
#include "glint/api/batch_columns.h"

#if defined(GLINT_WIDE_KERNELS)

#include <immintrin.h>

namespace glint::api {
namespace {

constexpr int kWidth = 8;
constexpr int kBlockSide = 16;

inline __m256 load(const float* at) { return _mm256_loadu_ps(at); }
inline __m256 load(const std::int8_t* at) {
  return _mm256_cvtepi32_ps(_mm256_cvtepi8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(at))));
}
inline __m256 load(const std::uint16_t* halves) {
  return _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(halves)));
}

/// Differences of neighbouring prefix sums: values at a pixel. `before` is null at pixel 0.
inline __m256 difference(const std::int16_t* after, const std::int16_t* before) {
  const __m256i high = _mm256_cvtepi16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(after)));
  if (before == nullptr) return _mm256_cvtepi32_ps(high);
  const __m256i low = _mm256_cvtepi16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(before)));
  return _mm256_cvtepi32_ps(_mm256_sub_epi32(high, low));
}
inline __m256 difference(const float* after, const float* before) {
  return before == nullptr ? load(after) : _mm256_sub_ps(load(after), load(before));
}

template <class T>
inline void project(const T* basis, int columns, int x, int y, const float* scales, float* projection) {
  const T* x1 = basis + x * columns;
  const T* y1 = basis + (kBlockSide + y) * columns;
  const T* x0 = x > 0 ? x1 - columns : nullptr;
  const T* y0 = y > 0 ? y1 - columns : nullptr;
  int k = 0;
  for (; k + kWidth <= columns; k += kWidth) {
    const __m256 along_x = difference(x1 + k, x0 != nullptr ? x0 + k : nullptr);
    const __m256 along_y = difference(y1 + k, y0 != nullptr ? y0 + k : nullptr);
    _mm256_storeu_ps(projection + k, _mm256_mul_ps(_mm256_mul_ps(along_x, along_y), load(scales + k)));
  }
  for (; k < columns; ++k) {
    const auto along_x = static_cast<float>(x0 != nullptr ? x1[k] - x0[k] : x1[k]);
    const auto along_y = static_cast<float>(y0 != nullptr ? y1[k] - y0[k] : y1[k]);
    projection[k] = along_x * along_y * scales[k];
  }
  for (; k % 4 != 0; ++k) projection[k] = 0;
}

inline __m128 loadFour(const float* at) { return _mm_loadu_ps(at); }
inline __m128 loadFour(const std::int8_t* at) { return _mm_cvtepi32_ps(_mm_cvtepi8_epi32(_mm_loadu_si32(at))); }
inline __m128 loadFour(const std::uint16_t* halves) {
  return _mm_cvtph_ps(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(halves)));
}

template <class T>
inline float dot(const float* projection, const T* row, int columns) {
  __m128 sum = _mm_setzero_ps();
  int k = 0;
  for (; k + kWidth <= columns; k += kWidth) {
    const __m256 products = _mm256_mul_ps(load(projection + k), load(row + k));
    sum = _mm_add_ps(_mm_add_ps(sum, _mm256_castps256_ps128(products)), _mm256_extractf128_ps(products, 1));
  }
  if (k < columns) sum = _mm_add_ps(sum, _mm_mul_ps(_mm_loadu_ps(projection + k), loadFour(row + k)));
  const __m128 pairs = _mm_add_ps(sum, _mm_movehl_ps(sum, sum));  // (0 + 2), (1 + 3)
  return _mm_cvtss_f32(_mm_add_ss(pairs, _mm_shuffle_ps(pairs, pairs, 1)));
}

}  // namespace

void projectColumns(const std::int16_t* basis, int columns, int x, int y, const float* scales, float* projection) {
  project(basis, columns, x, y, scales, projection);
}
void projectColumns(const float* basis, int columns, int x, int y, const float* scales, float* projection) {
  project(basis, columns, x, y, scales, projection);
}

float dotColumns(const float* projection, const std::int8_t* row, int columns) { return dot(projection, row, columns); }
float dotColumns(const float* projection, const std::uint16_t* row, int columns) { return dot(projection, row, columns); }
float dotColumns(const float* projection, const float* row, int columns) { return dot(projection, row, columns); }

}  // namespace glint::api

#endif
