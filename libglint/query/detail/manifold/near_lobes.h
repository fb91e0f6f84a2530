#pragma once

#include "glint/math/vec.h"
#include "glint/query/detail/manifold/triangle_lanes.h"
#include "glint/query/detail/manifold/triangle_mass_lanes.h"

namespace glint {

/// The lobe of a facet at a half vector, in units of its own deviation.
struct NearPoint {
  static constexpr int kNumbers = 5;
  Vec2 h;
  GLINT_HD Vec2 low() const { return h; }
  GLINT_HD Vec2 high() const { return h; }
  GLINT_HD Vec2 origin() const { return h; }
  template <class V>
  GLINT_LANE V squaredDistance(const V& x, const V& y) const {
    return x * x + y * y;
  }
  template <class V>
  GLINT_LANE V facet(const V& x, const V& y) const {
    return V::all(0.5f / kPi) * decayOf(V::all(0.5f) * (x * x + y * y));
  }
  template <class V>
  GLINT_LANE void prepare(const Corners<V>& c, V& far, unsigned&, float (*numbers)[V::kCount]) const {
    const TriangleFrames<V> f = TriangleFrames<V>::of(c);
    far = f.squaredDistance();
    f.left.store(numbers[0]);
    f.right.store(numbers[1]);
    f.apex.store(numbers[2]);
    f.base.store(numbers[3]);
    f.height.store(numbers[4]);
  }
  template <class V>
  GLINT_LANE V triangle(const V* n) const {
    return TriangleDensity<V>::of(TriangleFrames<V>{n[0], n[1], n[2], n[3], n[4]});
  }
};

/// The mass of the lobe of a facet in a box of half vectors. Positions are relative to the centre of the box, in deviations of the lobe.
struct NearBox {
  static constexpr int kNumbers = 6;
  Box2 box;
  Vec2 half;  ///< half sides, deviations
  GLINT_HD Vec2 low() const { return box.low; }
  GLINT_HD Vec2 high() const { return box.high; }
  GLINT_HD Vec2 origin() const { return 0.5f * (box.low + box.high); }
  template <class V>
  GLINT_LANE V squaredDistance(const V& x, const V& y) const {
    const V zero = V::all(0), dx = upperOf(magnitudeOf(x) - V::all(half.x), zero),
            dy = upperOf(magnitudeOf(y) - V::all(half.y), zero);
    return dx * dx + dy * dy;
  }
  template <class V>
  GLINT_LANE V facet(const V& x, const V& y) const {
    return massBetween(x, V::all(half.x)) * massBetween(y, V::all(half.y));
  }
  template <class V>
  GLINT_LANE void prepare(const Corners<V>& c, V& far, unsigned& whole, float (*numbers)[V::kCount]) const {
    const V zero = V::all(0);
    const V low_x = lowerOf(lowerOf(c.ax, c.bx), c.cx), high_x = upperOf(upperOf(c.ax, c.bx), c.cx);
    const V low_y = lowerOf(lowerOf(c.ay, c.by), c.cy), high_y = upperOf(upperOf(c.ay, c.by), c.cy);
    const V dx = upperOf(upperOf(low_x - V::all(half.x), V::all(-half.x) - high_x), zero);
    const V dy = upperOf(upperOf(low_y - V::all(half.y), V::all(-half.y) - high_y), zero);
    far = dx * dx + dy * dy;
    // Deepest reach of a corner: below 0 where the whole triangle lies inside by kInside.
    const V depth = upperOf(upperOf(high_x, zero - low_x) - V::all(half.x), upperOf(high_y, zero - low_y) - V::all(half.y));
    whole = bitsOf(less(depth, V::all(-kInside)));
    c.ax.store(numbers[0]);
    c.ay.store(numbers[1]);
    c.bx.store(numbers[2]);
    c.by.store(numbers[3]);
    c.cx.store(numbers[4]);
    c.cy.store(numbers[5]);
  }
  static constexpr float kInside = 4;  ///< the lobe has 6e-5 of its mass beyond
  template <class V>
  GLINT_LANE V triangle(const V* n) const {
    return TriangleMass<V>::of(n, half);
  }
};

}  // namespace glint
