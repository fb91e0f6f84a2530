#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__CUDACC__) && !defined(__CUDA__)

#include <immintrin.h>

#include <cstdint>

#include "glint/query/float4.h"

/// Marks functions for AVX2 and F16C, to be called only where hasWideVectors(). Only such functions may hand vectors of eight
/// to one another: compiled for other processors these are passed in other ways.
#define GLINT_WIDE [[gnu::target("avx2,f16c")]]

namespace glint {

/// Whether this processor has what functions that are marked GLINT_WIDE need.
inline bool hasWideVectors() {
#if defined(__AVX2__) && defined(__F16C__)
  return true;
#else
  return __builtin_cpu_supports("avx2") != 0 && __builtin_cpu_supports("f16c") != 0;
#endif
}

/// Eight numbers as floats.
GLINT_WIDE inline __m256 loadEight(const float* p) { return _mm256_loadu_ps(p); }
/// Half-precision numbers.
GLINT_WIDE inline __m256 loadEight(const std::uint16_t* p) {
  return _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
}
GLINT_WIDE inline __m256i integersOf(const std::int8_t* p) {
  return _mm256_cvtepi8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)));
}
GLINT_WIDE inline __m256i integersOf(const std::int16_t* p) {
  return _mm256_cvtepi16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
}
GLINT_WIDE inline __m256i integersOf(const std::int32_t* p) { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)); }
template <class Integer>
GLINT_WIDE inline __m256 loadEight(const Integer* p) {
  return _mm256_cvtepi32_ps(integersOf(p));
}

GLINT_WIDE inline Float4 fourOf(__m128 v) {
#ifdef __SSE4_1__
  return {v};
#else
  float lanes[4];
  _mm_storeu_ps(lanes, v);
  return Float4::load(lanes);
#endif
}
GLINT_WIDE inline Float4 lowFour(__m256 v) { return fourOf(_mm256_castps256_ps128(v)); }
GLINT_WIDE inline Float4 highFour(__m256 v) { return fourOf(_mm256_extractf128_ps(v, 1)); }

}  // namespace glint

#endif
