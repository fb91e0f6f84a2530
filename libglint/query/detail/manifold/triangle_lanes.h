#pragma once

#include <cstddef>

#include "glint/math/gaussian.h"
#include "glint/math/lanes.h"

namespace glint {

/// Corners of triangles of the disk.
template <class V>
struct Corners {
  V ax, ay, bx, by, cx, cy;
};

/// Triangles of the disk in frames of their own, in deviations of the lobe around h, which is the origin. The longest edge lies along
/// x from (left, base) to (right, base); the apex is at (apex, base + height). `height` may be negative.
template <class V>
struct TriangleFrames {
  V left, right, apex, base, height;

  GLINT_LANE static TriangleFrames of(const Corners<V>& corners) {
    const V &ax = corners.ax, &ay = corners.ay, &bx = corners.bx, &by = corners.by, &cx = corners.cx, &cy = corners.cy;
    const auto squared = [](const V& x, const V& y) { return x * x + y * y; };
    const V ab = squared(bx - ax, by - ay), bc = squared(cx - bx, cy - by), ca = squared(ax - cx, ay - cy);
    // Turns the corners until the edge from p to q is the longest.
    const auto first = less(ab, bc);
    V px = where(first, bx, ax), py = where(first, by, ay);
    V qx = where(first, cx, bx), qy = where(first, cy, by);
    V rx = where(first, ax, cx), ry = where(first, ay, cy);
    V longest = where(first, bc, ab);
    const auto second = less(longest, ca);
    px = where(second, cx, px), py = where(second, cy, py);
    qx = where(second, ax, qx), qy = where(second, ay, qy);
    rx = where(second, bx, rx), ry = where(second, by, ry);
    longest = where(second, ca, longest);
    const V length = rootOf(longest);
    const auto is_point = less(length, V::all(1e-6f));
    const V scale = V::all(1) / where(is_point, V::all(1), length);
    const V ux = where(is_point, V::all(1), scale * (qx - px)), uy = where(is_point, V::all(0), scale * (qy - py));
    TriangleFrames out;
    out.left = ux * px + uy * py;
    out.right = out.left + length;
    out.apex = ux * rx + uy * ry;
    out.base = ux * py - uy * px;
    out.height = ux * (ry - py) - uy * (rx - px);
    return out;
  }

  /// Lower bound of the squared distance of the triangle from h.
  GLINT_LANE V squaredDistance() const {
    const V zero = V::all(0), top = base + height;
    const V x = upperOf(upperOf(left, zero - right), zero);
    const V y = upperOf(upperOf(lowerOf(base, top), zero - upperOf(base, top)), zero);
    return x * x + y * y;
  }
};

/// Mean of the standard normal density over a triangle: 2 / length times the integral over s in [0, 1] of phi(y(s)) (Phi(x(s)) - 1/2)
/// along the right side less that along the left side (Green's theorem; the base adds nothing). The height is divided out, so thin
/// triangles and segments lose no digits.
///
/// Each side is integrated by one Gauss-Legendre rule where |x| < kSaturated, and in closed form elsewhere: at most ten nodes, however large
/// the triangle is. Error below 1e-3 of the peak (tests/unit/manifold_test.cpp).
template <class V>
class TriangleDensity {
 public:
  GLINT_LANE static V of(const TriangleFrames<V>& t) {
    const V zero = V::all(0), one = V::all(1);
    const V length = t.right - t.left;
    const TriangleDensity d(t.base, t.height);
    // Chords within reach of h.
    V low, high;
    const V flat = V::all(kFlat);
    crossing(t.base, where(less(magnitudeOf(t.height), flat), flat, t.height), V::all(kReach), low, high);
    low = clampedOf(low, zero, one);
    high = clampedOf(high, zero, one);
    // Short triangles divide differences of Phi by a small length, so they are saturated later.
    const V saturated = upperOf(V::all(kSaturated), V::all(kSaturated + 2) - V::all(0.5f) * length);
    Side right, left;
    right.clip(t.right, lowerOf(t.apex - t.right, zero - flat), saturated, low, high);
    left.clip(t.left, upperOf(t.apex - t.left, flat), saturated, low, high);
    // Where a side is beyond kSaturated, Phi - 1/2 is 1/2 or -1/2: the right side begins at its largest x, the left side at its smallest,
    // also where rounding says otherwise.
    const V centre = V::all(0.5f) * (low + high);
    const V outer = V::all(0.5f) * (d.primitive(right.begin, centre) + d.primitive(right.end, centre) +
                                    d.primitive(left.begin, centre) + d.primitive(left.end, centre)) -
                    d.primitive(low, centre) - d.primitive(high, centre);
    const V inner = d.integral(right, left);
    const V scale = V::all(2) / upperOf(length, V::all(kPointLength));
    const V large = scale * (outer + inner);
    // Tiny triangles: the value at the centroid.
    const V third = V::all(1.0f / 3), x = third * (t.left + t.right + t.apex), y = t.base + third * t.height;
    const V point = V::all(kPeak) * decayOf(V::all(0.5f) * (x * x + y * y));
    return upperOf(where(less(length, V::all(kPointLength)), point, large), zero);
  }

 private:
  static constexpr float kSaturated = 3.5f;  ///< |Phi - 1/2| is 1/2 beyond, within 2.3e-4
  static constexpr float kReach = 4.3f;      ///< phi is 1e-4 of its peak beyond
  static constexpr float kPointLength = 0.05f;
  static constexpr float kPeak = 0.5f / kPi;
  static constexpr float kLine = 0.398942280f;  ///< 1 / sqrt(2 pi)
  static constexpr float kFlat = 1e-6f;

  GLINT_LANE TriangleDensity(const V& y, const V& dy) : base(y), height(dy) {}

  V base, height;

  /// Where x0 + s dx passes -end and end, in order. dx is not 0.
  GLINT_LANE static void crossing(const V& x0, const V& dx, const V& end, V& low, V& high) {
    const V scale = V::all(1) / dx, a = scale * (V::all(0) - end - x0), b = scale * (end - x0);
    low = lowerOf(a, b);
    high = upperOf(a, b);
  }

  struct Side {
    V x, step, begin, end;
    GLINT_LANE void clip(const V& x0, const V& dx, const V& saturated, const V& low, const V& high) {
      x = x0;
      step = dx;
      crossing(x0, dx, saturated, begin, end);
      begin = clampedOf(begin, low, high);
      end = clampedOf(end, low, high);
    }
  };

  /// A primitive of phi(base + s height) over s.
  GLINT_LANE V primitive(const V& s, const V& centre) const {
    const V h = height, steep = magnitudeOf(h);
    // Steep: difference of Phi. Flat: Taylor series around the centre.
    const V closed = normalHalfOf(base + s * h) / where(less(steep, V::all(kSeries)), V::all(1), h);
    const V y = base + centre * h, d = s - centre, e = h * d, yy = y * y;
    const V series = V::all(kLine) * decayOf(V::all(0.5f) * yy) * d *
                     (V::all(1) - V::all(0.5f) * y * e + V::all(1.0f / 6) * (yy - V::all(1)) * e * e -
                      V::all(1.0f / 24) * y * (yy - V::all(3)) * e * e * e);
    return where(less(steep, V::all(kSeries)), series, closed);
  }
  static constexpr float kSeries = 0.4f;

  template <int kNodes>
  GLINT_LANE V rule(const Side& right, const Side& left) const;

  GLINT_LANE V integral(const Side& right, const Side& left) const {
    const auto length = [&](const Side& side) {
      const V d = side.end - side.begin;
      return d * d * (side.step * side.step + height * height);
    };
    const V longest = upperOf(length(right), length(left));
    const auto within = [&](float l) { return bitsOf(less(V::all(l * l), longest)) == 0; };
    if (within(2)) return rule<3>(right, left);
    if (within(3)) return rule<4>(right, left);
    if (within(5)) return rule<6>(right, left);
    if (within(7)) return rule<8>(right, left);
    return rule<10>(right, left);
  }

  GLINT_LANE V sideAt(const Side& side, float node) const {
    const V s = side.begin + V::all(node) * (side.end - side.begin);
    const V y = base + s * height;
    return decayOf(V::all(0.5f) * y * y) * normalHalfOf(side.x + s * side.step);
  }
};

/// Half of the nodes and weights of Gauss-Legendre rules on [-1, 1], which are symmetric; a middle node first.
template <int kNodes>
struct GaussLegendre {
  static constexpr std::size_t kHalf = (std::size_t{kNodes} + 1) / 2;
  float node[kHalf], weight[kHalf];
};
inline GLINT_HD constexpr GaussLegendre<3> gaussLegendre(const GaussLegendre<3>&) {
  return {{0, 0.7745966692f}, {0.8888888889f, 0.5555555556f}};
}
inline GLINT_HD constexpr GaussLegendre<4> gaussLegendre(const GaussLegendre<4>&) {
  return {{0.3399810436f, 0.8611363116f}, {0.6521451549f, 0.3478548451f}};
}
inline GLINT_HD constexpr GaussLegendre<6> gaussLegendre(const GaussLegendre<6>&) {
  return {{0.2386191861f, 0.6612093865f, 0.9324695142f}, {0.4679139346f, 0.3607615730f, 0.1713244924f}};
}
inline GLINT_HD constexpr GaussLegendre<8> gaussLegendre(const GaussLegendre<8>&) {
  return {{0.1834346425f, 0.5255324099f, 0.7966664774f, 0.9602898565f},
          {0.3626837834f, 0.3137066459f, 0.2223810345f, 0.1012285363f}};
}
inline GLINT_HD constexpr GaussLegendre<10> gaussLegendre(const GaussLegendre<10>&) {
  return {{0.1488743390f, 0.4333953941f, 0.6794095683f, 0.8650633667f, 0.9739065285f},
          {0.2955242247f, 0.2692667193f, 0.2190863625f, 0.1494513492f, 0.0666713443f}};
}

template <class V>
template <int kNodes>
GLINT_LANE V TriangleDensity<V>::rule(const Side& right, const Side& left) const {
  constexpr GaussLegendre<kNodes> gauss = gaussLegendre(GaussLegendre<kNodes>{});
  V r = V::all(0), l = V::all(0);
  for (int k = 0; k < (kNodes + 1) / 2; ++k) {
    const float node = 0.5f * gauss.node[k];
    const V weight = V::all(0.5f * gauss.weight[k] * kLine);
    r = r + weight * sideAt(right, 0.5f + node);
    l = l + weight * sideAt(left, 0.5f + node);
    if (kNodes % 2 == 1 && k == 0) continue;
    r = r + weight * sideAt(right, 0.5f - node);
    l = l + weight * sideAt(left, 0.5f - node);
  }
  return r * (right.end - right.begin) - l * (left.end - left.begin);
}

}  // namespace glint
