#pragma once

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__CUDACC__) && !defined(__CUDA__)

#include <immintrin.h>

#include <cstdint>

#include "glint/query/float4.h"

/// Marks functions for AVX2 and F16C, to be called only where hasWideVectors(). Only such functions may hand vectors of eight
/// to one another: compiled for other processors these are passed in other ways.
#define GLINT_WIDE [[gnu::target("avx2,f16c")]]

namespace glint {

/// Whether this processor has what functions that are marked GLINT_WIDE need: all that have AVX2 have F16C, which clang cannot
/// be asked for before version 18. Never decided by how a source is compiled: the linker keeps one copy for all of a program.
inline bool hasWideVectors() { return __builtin_cpu_supports("avx2") != 0; }

/// p[0] to p[7] as floats.
GLINT_WIDE inline __m256 loadEight(const float* p) { return _mm256_loadu_ps(p); }
/// Eight half-precision numbers, from the bits of a file, which may be anything: like halfToFloat, makes finite numbers of what
/// is none.
/// @param least  what is lower becomes this
GLINT_WIDE inline __m256 floatsOf(__m128i halves, float least = -65536) {
  const __m256 known = _mm256_max_ps(_mm256_cvtph_ps(halves), _mm256_set1_ps(least));  // no number: the second one
  return _mm256_min_ps(known, _mm256_set1_ps(65536));
}
/// Half-precision numbers.
GLINT_WIDE inline __m256 loadEight(const std::uint16_t* p) {
  return floatsOf(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
}
/// p[0] to p[7] as integers of 32 bits.
GLINT_WIDE inline __m256i integersOf(const std::int8_t* p) {
  return _mm256_cvtepi8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)));
}
GLINT_WIDE inline __m256i integersOf(const std::int16_t* p) {
  return _mm256_cvtepi16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)));
}
GLINT_WIDE inline __m256i integersOf(const std::int32_t* p) { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)); }
/// Integers.
template <class Integer>
GLINT_WIDE inline __m256 loadEight(const Integer* p) {
  return _mm256_cvtepi32_ps(integersOf(p));
}

/// Vectors of four as what the rest of the library takes.
GLINT_WIDE inline Float4 fourOf(__m128 v) {
#ifdef __SSE4_1__
  return {v};
#else
  float lanes[4];
  _mm_storeu_ps(lanes, v);
  return Float4::load(lanes);
#endif
}
// Lanes 0 to 3, and 4 to 7.
GLINT_WIDE inline Float4 lowFour(__m256 v) { return fourOf(_mm256_castps256_ps128(v)); }
GLINT_WIDE inline Float4 highFour(__m256 v) { return fourOf(_mm256_extractf128_ps(v, 1)); }

}  // namespace glint

#endif
