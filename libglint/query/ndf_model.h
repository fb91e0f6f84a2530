#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <utility>

#include "glint/math/rgb.h"
#include "glint/math/vec.h"
#include "glint/model/footprint.h"

namespace glint {

/// A half vector drawn from a distribution of normals.
struct HalfVectorSample {
  Vec2 h;
  /// Density of h per unit projected area: the model's density over its integral; 0, and h = 0, if nothing can be drawn.
  float pdf = 0;
};

/// Whether a half vector is in the square outside which models have no density.
inline GLINT_HD bool insideSquare(Vec2 h) { return std::fabs(h.x) <= 1 && std::fabs(h.y) <= 1; }
/// The part of a box of half vectors inside that square.
inline GLINT_HD Box2 insideSquare(const Box2& range) {
  return {{std::max(range.low.x, -1.0f), std::max(range.low.y, -1.0f)},
          {std::min(range.high.x, 1.0f), std::min(range.high.y, 1.0f)}};
}

/// A sample at h; an empty sample where the density is 0.
inline GLINT_HD HalfVectorSample drawnAt(Vec2 h, float pdf) { return pdf > 0 ? HalfVectorSample{h, pdf} : HalfVectorSample{}; }

/// A density, or one for each of red, green and blue where the distribution depends on the wavelength.
template <class V>
concept NdfValue = std::same_as<V, float> || std::same_as<V, Rgb>;

/// The value that a model answers: the type of its density.
template <class M>
using NdfValueOf = decltype(std::declval<const M&>().density(Footprint{}, Vec2{}));

/// A distribution of microscopic normals, filtered over a footprint. Density is per unit projected area: its integral over the
/// disk is 1, and its value is the usual microfacet D(omega).
///
/// Half vectors are points of [-1, 1]^2, the square that NDF images cover. Only points with |h| < 1 are directions. The blur of
/// a facet may spill a little over the unit circle; models keep this density, so that sums stay exact. Outside the square the
/// density is 0. `mean` is the average of the density over a box, counting 0 outside the square.
/// Answers are finite for every question and for all numbers that a file may have.
/// `sample` draws half vectors in proportion to the density from two numbers in [0, 1). Its warp keeps stratification: equal
/// areas of [0, 1)^2 go to equal masses, neighbours mostly to neighbours. Numbers outside [0, 1) are clamped to it, NaN counts
/// as 0.
template <class M>
concept NdfModel = requires(const M& m, const Footprint& p, Vec2 h, Box2 range, Vec2 xi) {
  { m.density(p, h) } -> NdfValue;
  { m.mean(p, range) } -> std::same_as<NdfValueOf<M>>;
  { m.sample(p, xi) } -> std::same_as<HalfVectorSample>;
};

}  // namespace glint
