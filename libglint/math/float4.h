#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "glint/math/device.h"
#include "glint/math/half.h"

#if defined(__SSE2__) && !defined(__CUDACC__) && !defined(__CUDA__)
#define GLINT_SSE
#ifdef __SSE4_1__
#include <smmintrin.h>
#else
#include <emmintrin.h>
#endif
#endif

namespace glint {

/// The two numbers of four bits with sign that a byte holds.
inline GLINT_HD std::int8_t lowHalf(std::int8_t byte) { return static_cast<std::int8_t>(((byte & 15) ^ 8) - 8); }
inline GLINT_HD std::int8_t highHalf(std::int8_t byte) { return static_cast<std::int8_t>(byte >> 4); }

/// a - b, rounded once. Wraps where the difference does not fit 32 bits, as only a broken file has it.
inline GLINT_HD float differenceOf(std::int32_t a, std::int32_t b) {
  return static_cast<float>(static_cast<std::int32_t>(static_cast<std::uint32_t>(a) - static_cast<std::uint32_t>(b)));
}

#ifdef GLINT_SSE
/// Operations that SSE4.1 has and SSE2 lacks. Both versions return the same bits and pass arguments in the same registers. So
/// sources that are compiled for different processors can call one another.
namespace sse {
#ifdef __SSE4_1__
inline __m128i integersOf8(__m128i bytes) { return _mm_cvtepi8_epi32(bytes); }
inline __m128i productOf(__m128i a, __m128i b) { return _mm_mullo_epi32(a, b); }
inline __m128 where(__m128 mask, __m128 yes, __m128 no) { return _mm_blendv_ps(no, yes, mask); }
inline __m128 floorOf(__m128 v) { return _mm_floor_ps(v); }
#else
inline __m128i integersOf8(__m128i bytes) {
  const __m128i pairs = _mm_unpacklo_epi8(bytes, bytes);
  return _mm_srai_epi32(_mm_unpacklo_epi16(pairs, pairs), 24);
}
inline __m128i productOf(__m128i a, __m128i b) {
  const __m128i even = _mm_mul_epu32(a, b), odd = _mm_mul_epu32(_mm_srli_epi64(a, 32), _mm_srli_epi64(b, 32));
  return _mm_unpacklo_epi32(_mm_shuffle_epi32(even, 0x08), _mm_shuffle_epi32(odd, 0x08));
}
inline __m128 where(__m128 mask, __m128 yes, __m128 no) { return _mm_or_ps(_mm_and_ps(mask, yes), _mm_andnot_ps(mask, no)); }
inline __m128 floorOf(__m128 v) {
  const __m128 sign = _mm_set1_ps(-0.0f), whole = _mm_cvtepi32_ps(_mm_cvttps_epi32(v));
  const __m128 below = _mm_sub_ps(whole, _mm_and_ps(_mm_cmplt_ps(v, whole), _mm_set1_ps(1)));
  // Numbers from 2^23 on are whole already. They, infinities and NaN are returned unchanged.
  const __m128 has_fraction = _mm_cmplt_ps(_mm_andnot_ps(sign, v), _mm_set1_ps(0x1p23f));
  return where(has_fraction, _mm_or_ps(below, _mm_and_ps(v, sign)), v);
}
#endif
/// Four numbers of 16 bits, in the lower 64 bits.
inline __m128i loadFour(const void* p) { return _mm_loadl_epi64(static_cast<const __m128i*>(p)); }
}  // namespace sse
#endif

/// Four floats side by side: lanes 0 to 3. Each operation returns the same bits on every processor. A sum of products does so
/// only with -ffp-contract=off: otherwise the compiler may fuse a product and a sum into one operation that rounds once.
struct Float4 {
#ifdef GLINT_SSE
  __m128 v;

  static Float4 zero() { return {_mm_setzero_ps()}; }
  static Float4 all(float x) { return {_mm_set1_ps(x)}; }
  static Float4 of(float a, float b, float c, float d) { return {_mm_setr_ps(a, b, c, d)}; }
  /// a[0], a[1], b[0], b[1].
  static Float4 ofPairs(const float* a, const float* b) {
    const auto pair = [](const float* p) { return _mm_loadl_epi64(reinterpret_cast<const __m128i*>(p)); };
    return {_mm_castsi128_ps(_mm_unpacklo_epi64(pair(a), pair(b)))};
  }
  static Float4 load(const float* p) { return {_mm_loadu_ps(p)}; }
  static __m128i bytes(const std::int8_t* p) {
    std::int32_t four;
    std::memcpy(&four, p, sizeof four);
    return sse::integersOf8(_mm_cvtsi32_si128(four));
  }
  static Float4 load(const std::int8_t* p) { return {_mm_cvtepi32_ps(bytes(p))}; }
  static Float4 load(const std::int32_t* p) { return {_mm_cvtepi32_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(p)))}; }
  /// Loads half-precision numbers; infinities and NaN as in halfToFloat.
  static Float4 load(const std::uint16_t* p) {
    const __m128i halves = sse::loadFour(p), signs = _mm_and_si128(halves, _mm_set1_epi16(-0x8000));
    const __m128i finite = _mm_min_epi16(_mm_andnot_si128(signs, halves), _mm_set1_epi16(kLargestHalf));
    const __m128i magnitude = _mm_unpacklo_epi16(finite, _mm_setzero_si128());
    const __m128i sign = _mm_unpacklo_epi16(_mm_setzero_si128(), signs);
    const __m128i normal = _mm_add_epi32(_mm_slli_epi32(magnitude, 13), _mm_set1_epi32(112 << 23));
    // Subnormal numbers are converted as integers: arithmetic on subnormal floats takes a hundred cycles.
    const __m128 subnormal = _mm_mul_ps(_mm_cvtepi32_ps(magnitude), _mm_set1_ps(0x1p-24f));
    const __m128 is_subnormal = _mm_castsi128_ps(_mm_cmplt_epi32(magnitude, _mm_set1_epi32(0x400)));
    return {_mm_or_ps(sse::where(is_subnormal, subnormal, _mm_castsi128_ps(normal)), _mm_castsi128_ps(sign))};
  }
  /// differenceOf(a[k], b[k]), or a[k] where `mask` is 0 rather than -1.
  static Float4 difference(const std::int32_t* a, const std::int32_t* b, int mask) {
    const auto four = [](const std::int32_t* p) { return _mm_loadu_si128(reinterpret_cast<const __m128i*>(p)); };
    return {_mm_cvtepi32_ps(_mm_sub_epi32(four(a), _mm_and_si128(four(b), _mm_set1_epi32(mask))))};
  }
  /// Loads half-precision numbers as positiveHalfToFloat does. Takes fewer steps than `load`, which keeps signs.
  static Float4 loadPositive(const std::uint16_t* p) {
    return positiveHalves(_mm_unpacklo_epi16(sse::loadFour(p), _mm_setzero_si128()));
  }
  static Float4 ofPositive(std::uint16_t a, std::uint16_t b, std::uint16_t c, std::uint16_t d) {
    return positiveHalves(_mm_setr_epi32(a, b, c, d));
  }
  /// Masses of four blocks. `codes` holds one code (query/detail/pyramid/block_mass.h) per byte, lowest byte first.
  static Float4 ofMassCodes(std::uint32_t codes) {
    const __m128i zero = _mm_setzero_si128();
    const __m128i pairs = _mm_unpacklo_epi8(_mm_cvtsi32_si128(static_cast<int>(codes)), zero);
    return positiveHalves(_mm_slli_epi32(_mm_unpacklo_epi16(pairs, zero), 6));
  }
  /// @param halves  half-precision numbers in the low 16 bits of each lane
  static Float4 positiveHalves(__m128i halves) {
    const __m128i bits = _mm_min_epi16(_mm_max_epi16(halves, _mm_setzero_si128()), _mm_set1_epi32(kLargestHalf));
    // `normal` is right for normal numbers n, and 2 n - 2^-14 is at least n for them. A subnormal number f 2^-14 comes out as
    // n = 2^-15 (1 + f), for which 2 n - 2^-14 is the right value and less than n.
    const __m128 normal = _mm_castsi128_ps(_mm_add_epi32(_mm_slli_epi32(bits, 13), _mm_set1_epi32(112 << 23)));
    return {_mm_min_ps(normal, _mm_sub_ps(_mm_add_ps(normal, normal), _mm_set1_ps(0x1p-14f)))};
  }
  /// lowHalf and highHalf of four bytes.
  static Float4 loadLow(const std::int8_t* p) { return {_mm_cvtepi32_ps(_mm_srai_epi32(_mm_slli_epi32(bytes(p), 28), 28))}; }
  static Float4 loadHigh(const std::int8_t* p) { return {_mm_cvtepi32_ps(_mm_srai_epi32(bytes(p), 4))}; }
  void store(float* p) const { _mm_storeu_ps(p, v); }

  friend Float4 operator+(Float4 a, Float4 b) { return {_mm_add_ps(a.v, b.v)}; }
  friend Float4 operator-(Float4 a, Float4 b) { return {_mm_sub_ps(a.v, b.v)}; }
  friend Float4 operator*(Float4 a, Float4 b) { return {_mm_mul_ps(a.v, b.v)}; }
  friend Float4 operator/(Float4 a, Float4 b) { return {_mm_div_ps(a.v, b.v)}; }
  friend Float4 floorOf(Float4 a) { return {sse::floorOf(a.v)}; }
  friend Float4 minOf(Float4 a, Float4 b) { return {_mm_min_ps(a.v, b.v)}; }
  /// In lanes: numbers[k] == number ? yes : 0.
  friend Float4 whereEqual(const std::uint32_t* numbers, std::uint32_t number, Float4 yes) {
    const __m128i equal = _mm_cmpeq_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(numbers)),
                                          _mm_set1_epi32(static_cast<std::int32_t>(number)));
    return {_mm_and_ps(_mm_castsi128_ps(equal), yes.v)};
  }
  /// Lanes of `a` and `b` in turn: a0 b0 a1 b1 (low), a2 b2 a3 b3 (high).
  friend Float4 interleaveLow(Float4 a, Float4 b) { return {_mm_unpacklo_ps(a.v, b.v)}; }
  friend Float4 interleaveHigh(Float4 a, Float4 b) { return {_mm_unpackhi_ps(a.v, b.v)}; }
  Float4 lanes0101() const { return {_mm_movelh_ps(v, v)}; }
  Float4 lanes2233() const { return {_mm_unpackhi_ps(v, v)}; }
  /// out[k] = row[k] * columns + column[k]. Lanes hold whole numbers >= 0.
  friend void storeIndices(Float4 row, std::int32_t columns, Float4 column, std::uint32_t* out) {
    const __m128i before = sse::productOf(_mm_cvttps_epi32(row.v), _mm_set1_epi32(columns));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(out), _mm_add_epi32(before, _mm_cvttps_epi32(column.v)));
  }
  /// In lanes: a < b ? yes : no.
  friend Float4 whereLess(Float4 a, Float4 b, Float4 yes, Float4 no) {
    return {sse::where(_mm_cmplt_ps(a.v, b.v), yes.v, no.v)};
  }
  /// In lanes: a < b ? yes : 0.
  friend Float4 whereLess(Float4 a, Float4 b, Float4 yes) { return {_mm_and_ps(yes.v, _mm_cmplt_ps(a.v, b.v))}; }
  /// Negative numbers and NaN become 0.
  Float4 positive() const { return {_mm_max_ps(v, _mm_setzero_ps())}; }
  /// Bit k: lane k is at most `bound`.
  unsigned notAbove(float bound) const { return static_cast<unsigned>(_mm_movemask_ps(_mm_cmple_ps(v, _mm_set1_ps(bound)))); }
  /// Lane k: sum of lanes 0 to k, added in the order v0, v1 + v0, (v2 + v1) + v0, (v3 + v2) + (v1 + v0).
  Float4 runningSums() const {
    const __m128 pairs = _mm_add_ps(v, _mm_castsi128_ps(_mm_slli_si128(_mm_castps_si128(v), 4)));
    return {_mm_add_ps(pairs, _mm_castsi128_ps(_mm_slli_si128(_mm_castps_si128(pairs), 8)))};
  }
  /// Lane 3 in all lanes.
  Float4 last() const { return {_mm_shuffle_ps(v, v, 0xff)}; }
  float lastLane() const { return _mm_cvtss_f32(last().v); }
  /// Lane 3 of `before`, then lanes 0 to 2 of this.
  Float4 shiftedBehind(Float4 before) const { return {_mm_shuffle_ps(_mm_shuffle_ps(before.v, v, 0x0f), v, 0x98)}; }
  /// Sum of the lanes, added in the order (v0 + v2) + (v1 + v3).
  float sum() const {
    const __m128 pairs = _mm_add_ps(v, _mm_movehl_ps(v, v));
    return _mm_cvtss_f32(_mm_add_ss(pairs, _mm_shuffle_ps(pairs, pairs, 1)));
  }
#else
  float v[4];

  static GLINT_HD Float4 zero() { return {{0, 0, 0, 0}}; }
  static GLINT_HD Float4 all(float x) { return {{x, x, x, x}}; }
  static GLINT_HD Float4 of(float a, float b, float c, float d) { return {{a, b, c, d}}; }
  /// a[0], a[1], b[0], b[1].
  static GLINT_HD Float4 ofPairs(const float* a, const float* b) { return {{a[0], a[1], b[0], b[1]}}; }
  template <class T>
  static GLINT_HD Float4 load(const T* p) {
    return {{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]), static_cast<float>(p[3])}};
  }
  /// Loads half-precision numbers; infinities and NaN as in halfToFloat.
  static GLINT_HD Float4 load(const std::uint16_t* p) {
    return {{halfToFloat(p[0]), halfToFloat(p[1]), halfToFloat(p[2]), halfToFloat(p[3])}};
  }
  /// differenceOf(a[k], b[k]), or a[k] where `mask` is 0 rather than -1.
  static GLINT_HD Float4 difference(const std::int32_t* a, const std::int32_t* b, int mask) {
    Float4 out;
    for (int k = 0; k < 4; ++k) out.v[k] = differenceOf(a[k], mask != 0 ? b[k] : 0);
    return out;
  }
  static GLINT_HD Float4 loadPositive(const std::uint16_t* p) { return ofPositive(p[0], p[1], p[2], p[3]); }
  static GLINT_HD Float4 ofPositive(std::uint16_t a, std::uint16_t b, std::uint16_t c, std::uint16_t d) {
    return {{positiveHalfToFloat(a), positiveHalfToFloat(b), positiveHalfToFloat(c), positiveHalfToFloat(d)}};
  }
  /// Masses of four blocks. `codes` holds one code (query/detail/pyramid/block_mass.h) per byte, lowest byte first.
  static GLINT_HD Float4 ofMassCodes(std::uint32_t codes) {
    const auto half = [&](int k) { return static_cast<std::uint16_t>((codes >> (8 * k) & 255u) << 6); };
    return ofPositive(half(0), half(1), half(2), half(3));
  }
  /// lowHalf and highHalf of four bytes.
  static GLINT_HD Float4 loadLow(const std::int8_t* p) {
    const std::int8_t low[4] = {lowHalf(p[0]), lowHalf(p[1]), lowHalf(p[2]), lowHalf(p[3])};
    return load(low);
  }
  static GLINT_HD Float4 loadHigh(const std::int8_t* p) {
    const std::int8_t high[4] = {highHalf(p[0]), highHalf(p[1]), highHalf(p[2]), highHalf(p[3])};
    return load(high);
  }
  GLINT_HD void store(float* p) const {
    for (int k = 0; k < 4; ++k) p[k] = v[k];
  }

  friend GLINT_HD Float4 operator+(Float4 a, Float4 b) {
    return {{a.v[0] + b.v[0], a.v[1] + b.v[1], a.v[2] + b.v[2], a.v[3] + b.v[3]}};
  }
  friend GLINT_HD Float4 operator-(Float4 a, Float4 b) {
    return {{a.v[0] - b.v[0], a.v[1] - b.v[1], a.v[2] - b.v[2], a.v[3] - b.v[3]}};
  }
  friend GLINT_HD Float4 operator*(Float4 a, Float4 b) {
    return {{a.v[0] * b.v[0], a.v[1] * b.v[1], a.v[2] * b.v[2], a.v[3] * b.v[3]}};
  }
  friend GLINT_HD Float4 operator/(Float4 a, Float4 b) {
    return {{a.v[0] / b.v[0], a.v[1] / b.v[1], a.v[2] / b.v[2], a.v[3] / b.v[3]}};
  }
  friend GLINT_HD Float4 floorOf(Float4 a) {
    return {{std::floor(a.v[0]), std::floor(a.v[1]), std::floor(a.v[2]), std::floor(a.v[3])}};
  }
  /// In lanes: numbers[k] == number ? yes : 0.
  friend GLINT_HD Float4 whereEqual(const std::uint32_t* numbers, std::uint32_t number, Float4 yes) {
    for (int k = 0; k < 4; ++k) yes.v[k] = numbers[k] == number ? yes.v[k] : 0.0f;
    return yes;
  }
  friend GLINT_HD Float4 minOf(Float4 a, Float4 b) {
    for (int k = 0; k < 4; ++k) a.v[k] = a.v[k] < b.v[k] ? a.v[k] : b.v[k];
    return a;
  }
  /// Lanes of `a` and `b` in turn: a0 b0 a1 b1 (low), a2 b2 a3 b3 (high).
  friend GLINT_HD Float4 interleaveLow(Float4 a, Float4 b) { return {{a.v[0], b.v[0], a.v[1], b.v[1]}}; }
  friend GLINT_HD Float4 interleaveHigh(Float4 a, Float4 b) { return {{a.v[2], b.v[2], a.v[3], b.v[3]}}; }
  GLINT_HD Float4 lanes0101() const { return {{v[0], v[1], v[0], v[1]}}; }
  GLINT_HD Float4 lanes2233() const { return {{v[2], v[2], v[3], v[3]}}; }
  /// out[k] = row[k] * columns + column[k]. Lanes hold whole numbers >= 0.
  friend GLINT_HD void storeIndices(Float4 row, std::int32_t columns, Float4 column, std::uint32_t* out) {
    for (int k = 0; k < 4; ++k)
      out[k] =
          static_cast<std::uint32_t>(static_cast<std::int32_t>(row.v[k]) * columns + static_cast<std::int32_t>(column.v[k]));
  }
  /// In lanes: a < b ? yes : no.
  friend GLINT_HD Float4 whereLess(Float4 a, Float4 b, Float4 yes, Float4 no) {
    for (int k = 0; k < 4; ++k) no.v[k] = a.v[k] < b.v[k] ? yes.v[k] : no.v[k];
    return no;
  }
  /// In lanes: a < b ? yes : 0.
  friend GLINT_HD Float4 whereLess(Float4 a, Float4 b, Float4 yes) { return whereLess(a, b, yes, zero()); }
  /// Negative numbers and NaN become 0.
  GLINT_HD Float4 positive() const {
    return {{v[0] > 0 ? v[0] : 0, v[1] > 0 ? v[1] : 0, v[2] > 0 ? v[2] : 0, v[3] > 0 ? v[3] : 0}};
  }
  /// Bit k: lane k is at most `bound`.
  GLINT_HD unsigned notAbove(float bound) const {
    unsigned bits = 0;
    for (int k = 0; k < 4; ++k) bits |= (v[k] <= bound ? 1u : 0u) << k;
    return bits;
  }
  /// Lane k: sum of lanes 0 to k, added in the order v0, v1 + v0, (v2 + v1) + v0, (v3 + v2) + (v1 + v0).
  GLINT_HD Float4 runningSums() const {
    const float pair = v[1] + v[0];
    return {{v[0], pair, (v[2] + v[1]) + v[0], (v[3] + v[2]) + pair}};
  }
  /// Lane 3 in all lanes.
  GLINT_HD Float4 last() const { return {{v[3], v[3], v[3], v[3]}}; }
  GLINT_HD float lastLane() const { return v[3]; }
  /// Lane 3 of `before`, then lanes 0 to 2 of this.
  GLINT_HD Float4 shiftedBehind(Float4 before) const { return {{before.v[3], v[0], v[1], v[2]}}; }
  /// Sum of the lanes, added in the order (v0 + v2) + (v1 + v3).
  GLINT_HD float sum() const { return (v[0] + v[2]) + (v[1] + v[3]); }
#endif
};

/// The sums of the lanes of `a`, `b`, `c` and `d`: same bits as sum() of each.
inline GLINT_HD Float4 sumsOf(Float4 a, Float4 b, Float4 c, Float4 d) {
#ifdef GLINT_SSE
  const Float4 ab = {_mm_add_ps(_mm_unpacklo_ps(a.v, b.v), _mm_unpackhi_ps(a.v, b.v))};
  const Float4 cd = {_mm_add_ps(_mm_unpacklo_ps(c.v, d.v), _mm_unpackhi_ps(c.v, d.v))};
  return {_mm_add_ps(_mm_movelh_ps(ab.v, cd.v), _mm_movehl_ps(cd.v, ab.v))};
#else
  return {{a.sum(), b.sum(), c.sum(), d.sum()}};
#endif
}

/// Sixteen floats, one for each pixel of a row or a column of a block.
struct Float16 {
  Float4 v[4];

  static GLINT_HD Float16 load(const float* p) {
    return {{Float4::load(p), Float4::load(p + 4), Float4::load(p + 8), Float4::load(p + 12)}};
  }
  GLINT_HD void store(float* p) const {
    for (int k = 0; k < 4; ++k) v[k].store(p + 4 * k);
  }
  friend GLINT_HD Float16 operator-(const Float16& a, const Float16& b) {
    return {{a.v[0] - b.v[0], a.v[1] - b.v[1], a.v[2] - b.v[2], a.v[3] - b.v[3]}};
  }
  GLINT_HD Float16 positive() const { return {{v[0].positive(), v[1].positive(), v[2].positive(), v[3].positive()}}; }
  /// Lane k: sum of lanes 0 to k. Adds in an order that does not depend on the processor.
  GLINT_HD Float16 runningSums() const {
    Float16 sums;
    Float4 before = Float4::zero();
    for (int k = 0; k < 4; ++k) before = (sums.v[k] = before + v[k].runningSums()).last();
    return sums;
  }
  /// Lane k minus lane k - 1; lane 0 stays.
  GLINT_HD Float16 differences() const {
    Float16 out;
    Float4 before = Float4::zero();
    for (int k = 0; k < 4; ++k) {
      out.v[k] = v[k] - v[k].shiftedBehind(before);
      before = v[k];
    }
    return out;
  }
  /// Bit k: lane k is at most `bound`.
  GLINT_HD unsigned notAbove(float bound) const {
    return v[0].notAbove(bound) | v[1].notAbove(bound) << 4 | v[2].notAbove(bound) << 8 | v[3].notAbove(bound) << 12;
  }
  GLINT_HD float sum() const { return ((v[0] + v[1]) + (v[2] + v[3])).sum(); }
};

}  // namespace glint
