#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__CUDACC__) && !defined(__CUDA__)

#include <immintrin.h>

#include <cstdint>

#include "glint/math/float4.h"

/// Marks functions that use AVX2 and F16C. Callers check hasAvx2() first. Only marked functions may take or return vectors of
/// eight: functions that are compiled for other processors pass such vectors in another way.
#define GLINT_AVX2 [[gnu::target("avx2,f16c")]]

namespace glint {

/// Whether this processor runs functions marked GLINT_AVX2. Does not ask for F16C, which clang before version 18 cannot: every
/// processor with AVX2 has it. Asks at run time, whatever processor a source is compiled for: the linker keeps one copy of an
/// inline function for the whole program, and that copy may come from any source.
inline bool hasAvx2() { return __builtin_cpu_supports("avx2") != 0; }

/// p[0] to p[7] as floats.
GLINT_AVX2 inline __m256 loadEight(const float* p) { return _mm256_loadu_ps(p); }
/// halfToFloat of eight numbers.
GLINT_AVX2 inline __m256 floatsOf(__m128i halves) {
  const __m128i largest = _mm_or_si128(_mm_and_si128(halves, _mm_set1_epi16(-0x8000)), _mm_set1_epi16(kLargestHalf));
  return _mm256_cvtph_ps(_mm_min_epi16(halves, largest));
}
/// positiveHalfToFloat of eight numbers.
GLINT_AVX2 inline __m256 positiveFloatsOf(__m128i halves) {
  return _mm256_cvtph_ps(_mm_min_epi16(_mm_max_epi16(halves, _mm_setzero_si128()), _mm_set1_epi16(kLargestHalf)));
}
/// p[0] to p[7], half-precision numbers, as floats.
GLINT_AVX2 inline __m256 loadEight(const std::uint16_t* p) {
  return floatsOf(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
}
/// p[0] to p[7] as integers of 32 bits.
GLINT_AVX2 inline __m256i integersOf(const std::int8_t* p) {
  return _mm256_cvtepi8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)));
}
GLINT_AVX2 inline __m256i integersOf(const std::int32_t* p) { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)); }
/// p[0] to p[7], integers, as floats.
template <class Integer>
GLINT_AVX2 inline __m256 loadEight(const Integer* p) {
  return _mm256_cvtepi32_ps(integersOf(p));
}

// Lanes 0 to 3, and lanes 4 to 7.
GLINT_AVX2 inline Float4 lowFour(__m256 v) { return {_mm256_castps256_ps128(v)}; }
GLINT_AVX2 inline Float4 highFour(__m256 v) { return {_mm256_extractf128_ps(v, 1)}; }

}  // namespace glint

#endif
