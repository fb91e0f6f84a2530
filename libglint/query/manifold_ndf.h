#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/near_normals.h"
#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/common/half_vector_draw.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/detail/common/texel_choice.h"
#include "glint/query/detail/manifold/near_sum.h"
#include "glint/query/detail/manifold/near_total.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// Reference made fast: the same weights and lobes, with a stated error.
///
/// A facet counts by two Gaussians, the footprint at its place and the lobe at its normal. Answers leave out facets beyond a ball in the
/// four-dimensional space of place and normal, in deviations. The ball is so large that the part that is left out integrates to at most
/// `loss` over the disk. The lobe over a triangle costs at most a fixed number of nodes, however large the triangle is (TriangleDensity).
/// Densities differ from those of Reference by less than `loss` at the default (root mean square over places, in each octave of footprint
/// size, over that of the density). Towards half vectors farther than the ball from all normals the density is 0.
///
/// The min-max pyramid of the map makes the cost of a query follow the number of facets near the half vector; maps without it are
/// answered too, more slowly. Takes a NormalMap, or the normals that an asset keeps. Gaussian and box footprints, flat and
/// smooth surfaces. Stores nothing. Thread-safe, allocates nothing; the
/// map must outlive it.
class ManifoldNdf {
 public:
  static constexpr float kLoss = 1e-3f;

  /// Without a map: only `hasMap` may be called.
  ManifoldNdf() = default;
  /// @param loss  largest share of the light that answers leave out, 1e-4 to .1; the functions of a lane err by about 1e-4 anyway
  GLINT_HD ManifoldNdf(const NearNormals& map, float sigma_r, Surface surface = Surface::flat,
                       Boundary boundary = Boundary::wrap, float loss = kLoss)
      : s_{map, sigma_r, surface, boundary, squaredRadius(loss)} {}

  GLINT_HD bool hasMap() const { return s_.map.width > 0; }

  /// Density towards h, per unit projected area; >= 0, finite.
  GLINT_DEVICE_CALL GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    return densityIn(weightsOf(s_.grid(), p), h);
  }

  /// Average density over a box of half vectors; 0 if the box is empty.
  GLINT_DEVICE_CALL GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    const Box2 box = insideSquare(range);
    if (!(box.width() > 0 && box.height() > 0)) return 0;
    const FootprintWeights weights = weightsOf(s_.grid(), p);
    const NearBox lobe{box, (0.5f / s_.sigma_r) * Vec2{box.width(), box.height()}};
    const double total = nearTotal(s_, weights);
    if (!(total > 0)) return 0;
    const double sum = nearSum(s_, weights, lobe, nearReach2(s_, weights, total));
    return finitePositive(static_cast<float>(sum / (total * double{range.area()})));
  }

  /// Draws a texel (or triangle) by its weight in the footprint, one of its normals, and a point of the lobe around the normal. The pdf is
  /// the density, whose integral is 1 within `loss`. Nothing is drawn where the point leaves [-1, 1]^2.
  GLINT_DEVICE_CALL GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    const FootprintWeights weights = weightsOf(s_.grid(), p);
    const DrawnHalfVector drawn = drawHalfVector(s_.map, s_.grid(), weights, s_.sigma_r, clampUnit(xi));
    return drawn.found && insideSquare(drawn.h) ? drawnAt(drawn.h, densityIn(weights, drawn.h)) : HalfVectorSample{};
  }

 private:
  /// Squared radius of the ball outside which a normal distribution in four dimensions has the mass `loss`: (1 + x) exp(-x) with
  /// x = radius^2 / 2.
  static GLINT_HD float squaredRadius(float loss) {
    const float target = -std::log(std::clamp(loss, 1e-4f, 0.1f));
    float x = target;
    for (int k = 0; k < 30; ++k) x = target + std::log(1 + x);
    return 2 * x;
  }

  GLINT_HD float densityIn(const FootprintWeights& weights, Vec2 h) const {
    const double total = nearTotal(s_, weights), variance = double{s_.sigma_r} * double{s_.sigma_r};
    if (!(total > 0)) return 0;
    const double sum = nearSum(s_, weights, NearPoint{h}, nearReach2(s_, weights, total));
    return finitePositive(static_cast<float>(sum / (total * variance)));
  }

  NearSurface s_;
};

static_assert(NdfModel<ManifoldNdf>);

}  // namespace glint
