#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/gaussian.h"

namespace glint {

/// Density towards h of a facet whose normals fill a triangle of the disk evenly: the average over the triangle of the Gaussian
/// lobe around h. Works for triangles of any shape, also for a segment or a point.
///
/// Along the longest edge the integral is an error function; across it, Gauss-Legendre panels no longer than one deviation.
inline GLINT_HD float triangleDensity(Vec2 n0, Vec2 n1, Vec2 n2, Vec2 h, float sigma) {
  const float inverse_sigma = 1 / sigma;
  Vec2 p[3] = {inverse_sigma * (n0 - h), inverse_sigma * (n1 - h), inverse_sigma * (n2 - h)};
  const auto squaredEdge = [&](int k) {
    const Vec2 e = p[(k + 1) % 3] - p[k];
    return dot(e, e);
  };
  const int longest = squaredEdge(0) >= squaredEdge(1) ? (squaredEdge(0) >= squaredEdge(2) ? 0 : 2)
                                                       : (squaredEdge(1) >= squaredEdge(2) ? 1 : 2);
  const Vec2 a = p[longest], b = p[(longest + 1) % 3], apex = p[(longest + 2) % 3];
  const float length = std::sqrt(squaredEdge(longest));
  // Frame: x along the edge a-b, y towards the apex. Chord s in [0, 1] runs between a + s (apex - a) and b + s (apex - b).
  const Vec2 along = length > 0 ? (1 / length) * (b - a) : Vec2{1, 0};
  const Vec2 across = {-along.y, along.x};
  const float y0 = dot(across, a), y1 = dot(across, apex);
  const float a0 = dot(along, a), a1 = dot(along, apex), b0 = dot(along, b);

  float s_low = 0, s_high = 1;  // chords within reach of h
  if (std::fabs(y1 - y0) > 1e-6f) {
    const float sa = (-kLobeReach - y0) / (y1 - y0), sb = (kLobeReach - y0) / (y1 - y0);
    s_low = std::clamp(std::min(sa, sb), 0.0f, 1.0f);
    s_high = std::clamp(std::max(sa, sb), 0.0f, 1.0f);
  } else if (std::fabs(y0) > kLobeReach) {
    return 0;
  }
  const float motion = (s_high - s_low) * std::max({std::fabs(y1 - y0), std::fabs(a1 - a0), std::fabs(a1 - b0)});
  if (!(motion >= 0)) return 0;  // NaN in the question, or in a normal of a file
  const int panels = std::max(static_cast<int>(std::min(std::ceil(motion), 256.0f)), 1);
  constexpr float kNode[3] = {-0.7745966692414834f, 0, 0.7745966692414834f};
  constexpr float kWeight[3] = {5.0f / 18, 8.0f / 18, 5.0f / 18};
  float sum = 0;
  for (int k = 0; k < panels; ++k) {
    for (int q = 0; q < 3; ++q) {
      const float s = s_low + (s_high - s_low) * (static_cast<float>(k) + 0.5f + 0.5f * kNode[q]) / static_cast<float>(panels);
      const float y = y0 + s * (y1 - y0), left = a0 + s * (a1 - a0), right = b0 + s * (a1 - b0);
      const float chord = right - left;
      // Mean of the standard normal density along the chord; its midpoint value when the chord is too short for a difference.
      const float middle = 0.5f * (left + right);
      const float mean_along = chord > 0.05f
                                   ? 0.5f * (std::erf(right * kInvSqrt2) - std::erf(left * kInvSqrt2)) / chord
                                   : std::exp(-0.5f * middle * middle) * (1 - chord * chord * (1 - middle * middle) / 24) *
                                         (0.5f * std::sqrt(2 / kPi));
      sum += kWeight[q] * (1 - s) * mean_along * std::exp(-0.5f * y * y);
    }
  }
  const float normalisation = 0.5f * std::sqrt(2 / kPi);  // factor of the Gaussian across the edge
  return 2 * (s_high - s_low) / static_cast<float>(panels) * sum * normalisation * inverse_sigma * inverse_sigma;
}

/// Average over a triangle of the disk of the mass that the lobe around each of its points puts into a box.
///
/// Halves the longest edge until pieces are about a deviation long, then applies a rule of degree 5; pieces that lie deep
/// inside or far outside the box need no halving.
/// @return 0 for a triangle that does not fit into the square [-1, 1]^2; only a broken file has one
inline GLINT_HD float triangleMass(Vec2 n0, Vec2 n1, Vec2 n2, const Box2& box, float sigma) {
  constexpr float kDiagonal2 = 8.1f;  // squared diagonal of the square, plus rounding
  const Vec2 edges[3] = {n1 - n0, n2 - n1, n0 - n2};
  for (const Vec2 e : edges)
    if (!(dot(e, e) <= kDiagonal2)) return 0;
  struct Piece {
    Vec2 a, b, c;
    float share;
  };
  constexpr int kDepth = 40;
  Piece stack[kDepth + 1];
  int count = 0;
  stack[count++] = {n0, n1, n2, 1};
  const float reach = kLobeReach * sigma;
  float mass = 0;
  while (count > 0) {
    const Piece t = stack[--count];
    const Vec2 low = {std::min({t.a.x, t.b.x, t.c.x}), std::min({t.a.y, t.b.y, t.c.y})};
    const Vec2 high = {std::max({t.a.x, t.b.x, t.c.x}), std::max({t.a.y, t.b.y, t.c.y})};
    if (!near(box, low, high, reach)) continue;
    if (low.x >= box.low.x + reach && high.x <= box.high.x - reach && low.y >= box.low.y + reach &&
        high.y <= box.high.y - reach) {
      mass += t.share;
      continue;
    }
    const float ab = dot(t.b - t.a, t.b - t.a), bc = dot(t.c - t.b, t.c - t.b), ca = dot(t.a - t.c, t.a - t.c);
    const float longest = std::max({ab, bc, ca});
    if (longest > sigma * sigma && count + 2 <= kDepth) {
      const Vec2 p = longest == ab ? t.a : longest == bc ? t.b : t.c;
      const Vec2 q = longest == ab ? t.b : longest == bc ? t.c : t.a;
      const Vec2 r = longest == ab ? t.c : longest == bc ? t.a : t.b;
      const Vec2 m = 0.5f * (p + q);
      stack[count++] = {p, m, r, 0.5f * t.share};
      stack[count++] = {m, q, r, 0.5f * t.share};
      continue;
    }
    // Radon's seven points, degree 5.
    constexpr float kA = 0.10128650732345633f, kB = 0.47014206410511505f;
    constexpr float kWA = 0.12593918054482717f, kWB = 0.13239415278850616f, kWC = 0.225f;
    const Vec2 middle = (1.0f / 3) * (t.a + t.b + t.c);
    const auto value = [&](float x, float y, float z) { return lobeMass(box, x * t.a + y * t.b + z * t.c, sigma); };
    mass += t.share * (kWC * lobeMass(box, middle, sigma) +
                       kWA * (value(1 - 2 * kA, kA, kA) + value(kA, 1 - 2 * kA, kA) + value(kA, kA, 1 - 2 * kA)) +
                       kWB * (value(1 - 2 * kB, kB, kB) + value(kB, 1 - 2 * kB, kB) + value(kB, kB, 1 - 2 * kB)));
  }
  return mass;
}

}  // namespace glint
