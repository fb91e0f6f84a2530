#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/normal_map.h"
#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/detail/common/texel_choice.h"
#include "glint/query/detail/manifold/near_sum.h"
#include "glint/query/detail/manifold/near_total.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// Reference made fast: the same weights and lobes, with a stated error.
///
/// A facet counts by two Gaussians, the footprint at its place and the lobe at its normal. Answers leave out facets beyond a ball in the
/// four-dimensional space of place and normal, in deviations. The ball is so large that what is left out integrates to at most `loss`
/// over the disk. The lobe over a triangle costs the same for triangles of every size (TriangleDensity, TriangleMass). Answers differ from
/// those of Reference by about half of `loss` (root mean square over places of one footprint size, over that of the density).
///
/// The min-max pyramid of the map makes the cost of a query follow the number of facets near the half vector; maps without it are
/// answered too, more slowly. Gaussian and box footprints, flat and smooth surfaces. Stores nothing. Thread-safe, allocates nothing; the
/// map must outlive it.
class ManifoldNdf {
 public:
  static constexpr float kLoss = 1e-3f;

  /// Without a map: only `hasMap` may be called.
  ManifoldNdf() = default;
  /// @param loss  largest share of the light that answers leave out, 1e-6 to .1
  GLINT_HD ManifoldNdf(const NormalMap& map, float sigma_r, Surface surface = Surface::flat, Boundary boundary = Boundary::wrap,
                       float loss = kLoss)
      : s_{map, sigma_r, surface, boundary, squaredRadius(loss)} {}

  GLINT_HD bool hasMap() const { return s_.map.width > 0; }

  /// Density towards h, per unit projected area; >= 0, finite.
  GLINT_DEVICE_CALL GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    return densityIn(weightsOf(s_, p), h);
  }

  /// Average density over a box of half vectors; 0 if the box is empty.
  GLINT_DEVICE_CALL GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    const Box2 box = insideSquare(range);
    if (!(box.width() > 0 && box.height() > 0)) return 0;
    const FootprintWeights weights = weightsOf(s_, p);
    const NearBox lobe{box, (0.5f / s_.sigma_r) * Vec2{box.width(), box.height()}};
    const double total = nearTotal(s_, weights);
    return total > 0 ? finitePositive(static_cast<float>(nearSum(s_, weights, lobe) / (total * double{range.area()}))) : 0.0f;
  }

  /// Draws a texel (or triangle) by its weight in the footprint, one of its normals, and a point of the lobe around the normal. The pdf is
  /// the density, whose integral is 1 within `loss`. Nothing is drawn where the point leaves [-1, 1]^2.
  GLINT_DEVICE_CALL GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    xi = clampUnit(xi);
    const FootprintWeights weights = weightsOf(s_, p);
    const TexelChoice texel = chooseTexel(weights, {s_.map.width, s_.map.height, s_.surface, s_.boundary}, xi);
    if (!texel.found) return {};
    Vec2 n = normal(texel.i, texel.j);
    if (s_.surface == Surface::smooth) {
      const Vec2 side = texel.half == 0 ? normal(texel.i + 1, texel.j) : normal(texel.i, texel.j + 1);
      const Vec2 far = normal(texel.i + 1, texel.j + 1);
      const float r = std::sqrt(xi.y);  // makes the point uniform in the triangle
      n = (1 - r) * n + (r * (1 - xi.x)) * side + (r * xi.x) * far;
      xi = {lowerDigits(xi.x, 7), lowerDigits(xi.y, 7)};
    }
    const Vec2 h = n + s_.sigma_r * Vec2{normalQuantile(xi.x), normalQuantile(xi.y)};
    return insideSquare(h) ? drawnAt(h, densityIn(weights, h)) : HalfVectorSample{};
  }

 private:
  /// Squared radius of the ball outside which a normal distribution in four dimensions has the mass `loss`: (1 + x) exp(-x) with
  /// x = radius^2 / 2.
  static GLINT_HD float squaredRadius(float loss) {
    const float target = -std::log(std::clamp(loss, 1e-6f, 0.1f));
    float x = target;
    for (int k = 0; k < 30; ++k) x = target + std::log(1 + x);
    return 2 * x;
  }

  GLINT_HD float densityIn(const FootprintWeights& weights, Vec2 h) const {
    const double total = nearTotal(s_, weights), variance = double{s_.sigma_r} * double{s_.sigma_r};
    return total > 0 ? finitePositive(static_cast<float>(nearSum(s_, weights, NearPoint{h}) / (total * variance))) : 0.0f;
  }
  GLINT_HD Vec2 normal(int i, int j) const { return s_.map.at(wrapIndex(i, s_.map.width), wrapIndex(j, s_.map.height)); }

  NearSurface s_;
};

static_assert(NdfModel<ManifoldNdf>);

}  // namespace glint
