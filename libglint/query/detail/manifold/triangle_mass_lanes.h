#pragma once

#include "glint/math/lanes.h"
#include "glint/query/detail/manifold/triangle_lanes.h"

namespace glint {

/// Mass of a normal distribution around x within [-half, half]; all in deviations.
template <class V>
GLINT_LANE V massBetween(const V& x, const V& half) {
  return upperOf(normalHalfOf(half - x) + normalHalfOf(half + x), V::all(0));
}

/// Mean over a triangle of the mass that the lobe around each of its points puts into a box.
///
/// Along the longer side of the triangle's bounding box by Gauss-Legendre panels; across it in closed form. Triangles of any shape
/// lose no digits.
template <class V>
class TriangleMass {
 public:
  /// @param n     corners ax, ay, bx, by, cx, cy relative to the centre of the box, in deviations
  /// @param half  half sides of the box, deviations
  GLINT_LANE static V of(const V* n, Vec2 half) {
    const V zero = V::all(0);
    const auto extent = [](const V& a, const V& b, const V& c) {
      return upperOf(upperOf(a, b), c) - lowerOf(lowerOf(a, b), c);
    };
    // u is the shorter axis, v the longer one.
    const auto turned = less(extent(n[1], n[3], n[5]), extent(n[0], n[2], n[4]));
    V u[3], v[3];
    for (int k = 0; k < 3; ++k) {
      u[k] = where(turned, n[2 * k + 1], n[2 * k]);
      v[k] = where(turned, n[2 * k], n[2 * k + 1]);
    }
    const V half_u = where(turned, V::all(half.y), V::all(half.x)), half_v = where(turned, V::all(half.x), V::all(half.y));
    sort(u[0], v[0], u[1], v[1]);
    sort(u[1], v[1], u[2], v[2]);
    sort(u[0], v[0], u[1], v[1]);
    const V length = v[2] - v[0];
    const V share = where(less(zero, length), (v[1] - v[0]) / where(less(zero, length), length, V::all(1)), V::all(0.5f));
    const V opposite = u[0] + share * (u[2] - u[0]);  // the point of the longest edge beside the middle corner
    return share * part(u[0], v[0], u[1], opposite, v[1], half_u, half_v) +
           (V::all(1) - share) * part(u[2], v[2], u[1], opposite, v[1], half_u, half_v);
  }

 private:
  static constexpr float kReach = 4.3f;
  static constexpr float kPanel = 2.5f;  ///< of Gauss-Legendre with three nodes, deviations

  GLINT_LANE static void sort(V& u0, V& v0, V& u1, V& v1) {
    const auto swap = less(v1, v0);
    const V u = where(swap, u1, u0), v = where(swap, v1, v0);
    u1 = where(swap, u0, u1);
    v1 = where(swap, v0, v1);
    u0 = u;
    v0 = v;
  }

  /// Mean over the triangle between a tip and a base along u.
  GLINT_LANE static V part(const V& tip_u, const V& tip_v, const V& base_a, const V& base_b, const V& base_v, const V& half_u,
                           const V& half_v) {
    const V zero = V::all(0), one = V::all(1), step = base_v - tip_v;
    // The part of s in [0, 1] where the lobe reaches the box; chords run between tip + s (base_a - tip) and tip + s (base_b - tip).
    const V safe = where(less(magnitudeOf(step), V::all(1e-6f)), V::all(1e-6f), step), scale = one / safe,
            end = half_v + V::all(kReach);
    const V s_a = scale * (zero - end - tip_v), s_b = scale * (end - tip_v);
    const V low = clampedOf(lowerOf(s_a, s_b), zero, one), high = clampedOf(upperOf(s_a, s_b), zero, one);
    const V motion =
        (high - low) * upperOf(magnitudeOf(step), upperOf(magnitudeOf(base_a - tip_u), magnitudeOf(base_b - tip_u)));
    int panels = 1;
    while (panels < kMostPanels && bitsOf(less(V::all(kPanel * static_cast<float>(panels)), motion)) != 0) ++panels;
    const V width = V::all(1 / static_cast<float>(panels)) * (high - low);
    V sum = zero;
    for (int k = 0; k < panels; ++k) {
      constexpr float kNode[3] = {0.5f - 0.3872983346f, 0.5f, 0.5f + 0.3872983346f},
                      kWeight[3] = {5.0f / 18, 8.0f / 18, 5.0f / 18};
      for (int q = 0; q < 3; ++q) {
        const V s = low + V::all(static_cast<float>(k) + kNode[q]) * width;
        const V mass = massBetween(tip_v + s * step, half_v);
        const V a = tip_u + s * (base_a - tip_u), b = tip_u + s * (base_b - tip_u);
        sum = sum + V::all(2 * kWeight[q]) * s * mass * meanBetween(lowerOf(a, b), upperOf(a, b), half_u);
      }
    }
    return width * sum;
  }
  static constexpr int kMostPanels = 200;

  /// Mean over x in [a, b] of massBetween(x, half).
  GLINT_LANE static V meanBetween(const V& a, const V& b, const V& half) {
    const V chord = b - a, short_chord = V::all(0.1f);
    const V mean = (primitive(b, half) - primitive(a, half)) / upperOf(chord, short_chord);
    return where(less(chord, short_chord), massBetween(V::all(0.5f) * (a + b), half), mean);
  }
  /// Primitive over x of massBetween(x, half).
  GLINT_LANE static V primitive(const V& x, const V& half) {
    const V zero = V::all(0);
    return clampedOf(x, zero - half, half) + rounding(half + x) - rounding(half - x);
  }
  /// The integral of Phi, less that of the unit step: phi(z) - |z| (1 - Phi(|z|)).
  GLINT_LANE static V rounding(const V& z) {
    const V m = magnitudeOf(z);
    return V::all(0.398942280f) * decayOf(V::all(0.5f) * z * z) - m * normalTailOf(m);
  }
};

}  // namespace glint
