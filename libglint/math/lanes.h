#pragma once

#include <cmath>
#include <cstdint>

#include "glint/math/device.h"
#include "glint/math/float4.h"

#if defined(__GNUC__) && !defined(__CUDACC__) && !defined(__CUDA__)
#define GLINT_LANES
#endif

namespace glint {

#ifdef GLINT_LANES
/// Inlined always: calls between functions that are compiled for different processors would pass vectors in different ways.
#define GLINT_LANE [[gnu::always_inline]] inline
#else
#define GLINT_LANE inline GLINT_HD
#endif

/// One float with the operations of Lanes8, for compilers and devices without vectors.
struct Lanes1 {
  static constexpr int kCount = 1;
  using Mask = bool;
  float v;

  static GLINT_HD Lanes1 all(float x) { return {x}; }
  static GLINT_HD Lanes1 load(const float* p) { return {*p}; }
  GLINT_HD void store(float* p) const { *p = v; }
  friend GLINT_HD Lanes1 operator+(Lanes1 a, Lanes1 b) { return {a.v + b.v}; }
  friend GLINT_HD Lanes1 operator-(Lanes1 a, Lanes1 b) { return {a.v - b.v}; }
  friend GLINT_HD Lanes1 operator*(Lanes1 a, Lanes1 b) { return {a.v * b.v}; }
  friend GLINT_HD Lanes1 operator/(Lanes1 a, Lanes1 b) { return {a.v / b.v}; }
  friend GLINT_HD Mask less(Lanes1 a, Lanes1 b) { return a.v < b.v; }
  friend GLINT_HD Lanes1 where(Mask mask, Lanes1 yes, Lanes1 no) { return mask ? yes : no; }
  friend GLINT_HD Lanes1 rootOf(Lanes1 a) { return {std::sqrt(a.v)}; }
};
/// Bit k: lane k of a mask.
inline GLINT_HD unsigned bitsOf(bool mask) { return mask ? 1u : 0u; }

#ifdef GLINT_LANES
/// Eight floats side by side, for functions that are marked GLINT_AVX2; elsewhere GCC takes selections apart, lane by lane.
struct Lanes8 {
  static constexpr int kCount = 8;
  typedef float Floats __attribute__((vector_size(32)));
  typedef std::int32_t Integers __attribute__((vector_size(32)));
  /// A bit for each lane of a comparison.
  struct Mask {
    Integers v;
  };
  Floats v;

  GLINT_LANE static Lanes8 all(float x) { return {Floats{x, x, x, x, x, x, x, x}}; }
  GLINT_LANE static Lanes8 load(const float* p) {
    Lanes8 out;
    __builtin_memcpy(&out.v, p, sizeof out.v);
    return out;
  }
  GLINT_LANE void store(float* p) const { __builtin_memcpy(p, &v, sizeof v); }
  GLINT_LANE friend Lanes8 operator+(const Lanes8& a, const Lanes8& b) { return {a.v + b.v}; }
  GLINT_LANE friend Lanes8 operator-(const Lanes8& a, const Lanes8& b) { return {a.v - b.v}; }
  GLINT_LANE friend Lanes8 operator*(const Lanes8& a, const Lanes8& b) { return {a.v * b.v}; }
  GLINT_LANE friend Lanes8 operator/(const Lanes8& a, const Lanes8& b) { return {a.v / b.v}; }
  GLINT_LANE friend Lanes8 rootOf(const Lanes8& a) {
    Lanes8 out;
#ifdef GLINT_SSE
    __m128 half[2];
    __builtin_memcpy(half, &a.v, sizeof half);
    half[0] = _mm_sqrt_ps(half[0]);
    half[1] = _mm_sqrt_ps(half[1]);
    __builtin_memcpy(&out.v, half, sizeof half);
#else
    for (int k = 0; k < 8; ++k) out.v[k] = std::sqrt(a.v[k]);
#endif
    return out;
  }
  GLINT_LANE friend Mask less(const Lanes8& a, const Lanes8& b) { return {a.v < b.v}; }
  GLINT_LANE friend Lanes8 where(const Mask& mask, const Lanes8& yes, const Lanes8& no) { return {mask.v ? yes.v : no.v}; }
  GLINT_LANE friend unsigned bitsOf(const Mask& mask) {
#ifdef GLINT_SSE
    __m128 half[2];
    __builtin_memcpy(half, &mask.v, sizeof half);
    return static_cast<unsigned>(_mm_movemask_ps(half[0])) | static_cast<unsigned>(_mm_movemask_ps(half[1])) << 4;
#else
    unsigned bits = 0;
    for (int k = 0; k < 8; ++k) bits |= (mask.v[k] != 0 ? 1u : 0u) << k;
    return bits;
#endif
  }
};

/// Lanes8 as four floats and four, for every processor. Each operation returns the same bits as that of Lanes8.
struct Lanes4x2 {
  static constexpr int kCount = 8;
  typedef float Floats __attribute__((vector_size(16)));
  typedef std::int32_t Integers __attribute__((vector_size(16)));
  /// A bit for each lane of a comparison.
  struct Mask {
    Integers low, high;
  };
  Floats low, high;

  GLINT_LANE static Lanes4x2 all(float x) { return {Floats{x, x, x, x}, Floats{x, x, x, x}}; }
  GLINT_LANE static Lanes4x2 load(const float* p) {
    Lanes4x2 out;
    __builtin_memcpy(&out.low, p, sizeof out.low);
    __builtin_memcpy(&out.high, p + 4, sizeof out.high);
    return out;
  }
  GLINT_LANE void store(float* p) const {
    __builtin_memcpy(p, &low, sizeof low);
    __builtin_memcpy(p + 4, &high, sizeof high);
  }
  GLINT_LANE friend Lanes4x2 operator+(const Lanes4x2& a, const Lanes4x2& b) { return {a.low + b.low, a.high + b.high}; }
  GLINT_LANE friend Lanes4x2 operator-(const Lanes4x2& a, const Lanes4x2& b) { return {a.low - b.low, a.high - b.high}; }
  GLINT_LANE friend Lanes4x2 operator*(const Lanes4x2& a, const Lanes4x2& b) { return {a.low * b.low, a.high * b.high}; }
  GLINT_LANE friend Lanes4x2 operator/(const Lanes4x2& a, const Lanes4x2& b) { return {a.low / b.low, a.high / b.high}; }
  GLINT_LANE friend Lanes4x2 rootOf(const Lanes4x2& a) { return {rootOf(a.low), rootOf(a.high)}; }
  GLINT_LANE friend Mask less(const Lanes4x2& a, const Lanes4x2& b) { return {a.low < b.low, a.high < b.high}; }
  GLINT_LANE friend Lanes4x2 where(const Mask& mask, const Lanes4x2& yes, const Lanes4x2& no) {
    return {mask.low ? yes.low : no.low, mask.high ? yes.high : no.high};
  }
  GLINT_LANE friend unsigned bitsOf(const Mask& mask) { return bitsOf(mask.low) | bitsOf(mask.high) << 4; }

 private:
  GLINT_LANE static Floats rootOf(Floats a) {
#ifdef GLINT_SSE
    return _mm_sqrt_ps(a);
#else
    for (int k = 0; k < 4; ++k) a[k] = std::sqrt(a[k]);
    return a;
#endif
  }
  GLINT_LANE static unsigned bitsOf(Integers mask) {
#ifdef GLINT_SSE
    return static_cast<unsigned>(_mm_movemask_ps(_mm_castsi128_ps(reinterpret_cast<__m128i>(mask))));
#else
    unsigned bits = 0;
    for (int k = 0; k < 4; ++k) bits |= (mask[k] != 0 ? 1u : 0u) << k;
    return bits;
#endif
  }
};
#endif

template <class V>
GLINT_LANE V lowerOf(const V& a, const V& b) {
  return where(less(a, b), a, b);
}
template <class V>
GLINT_LANE V upperOf(const V& a, const V& b) {
  return where(less(a, b), b, a);
}
template <class V>
GLINT_LANE V clampedOf(const V& x, const V& low, const V& high) {
  return lowerOf(upperOf(x, low), high);
}
template <class V>
GLINT_LANE V magnitudeOf(const V& a) {
  return upperOf(a, V::all(0) - a);
}

/// exp(-u) for u in [0, 20]; larger u and NaN count as 20. Relative error below 6e-5: the 32nd power of a polynomial.
template <class V>
GLINT_LANE V decayOf(const V& exponent) {
  const V u = lowerOf(V::all(0.5f) * exponent, V::all(10));
  V p = V::all(4.6325945e-07f) * u + V::all(-3.9215367e-05f);
  p = p * u + V::all(0.0019477608f);
  p = p * u + V::all(-0.06249295f);
  p = p * u + V::all(0.99999845f);
  p = p * p;
  p = p * p;
  p = p * p;
  p = p * p;
  return p * p;
}

/// Upper tail of the standard normal distribution, 1 - Phi(x) for x >= 0. Absolute error below 1e-6 (Abramowitz and Stegun, 7.1.28).
template <class V>
GLINT_LANE V normalTailOf(const V& x) {
  V p = V::all(5.382975e-06f) * x + V::all(4.8890637e-05f);
  p = p * x + V::all(3.8003574e-05f);
  p = p * x + V::all(0.0032776264f);
  p = p * x + V::all(0.021141006f);
  p = p * x + V::all(0.049867347f);
  p = p * x + V::all(1);
  p = p * p;
  p = p * p;
  p = p * p;
  p = p * p;
  return V::all(0.5f) / p;
}

/// Phi(x) - 1/2, an odd function.
template <class V>
GLINT_LANE V normalHalfOf(const V& x) {
  const V half = V::all(0.5f) - normalTailOf(magnitudeOf(x));
  return where(less(x, V::all(0)), V::all(0) - half, half);
}

}  // namespace glint
