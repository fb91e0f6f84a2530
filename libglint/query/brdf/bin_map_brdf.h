#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>

#include "glint/query/bin_map_ndf.h"
#include "glint/query/brdf/microfacet_brdf.h"

namespace glint {

/// The micro-BRDF form of a bin map (Atanasov 2021, Eq. 5, 11 and 15): every texel is a facet of Beckmann microfacets around
/// its own normal t, which shadow and mask each other, and the map shadows and masks the facets:
///
///   f = F(wo . h) Gx(wi, wo) / (4 wi.z wo.z) * sum over texels of share * D(h, t) G(wi, wo, t) / t.z
///
/// with D the Beckmann distribution of the NDF's roughness in the frame of t, G its Smith term in that frame, Gx that of the
/// map's slopes. As the roughness falls this becomes MicrofacetBrdf of the same BinMapNdf; where facets are rough or steep it
/// keeps what that loses: lobes are round about each facet's normal instead of round in the disk, and no facet shines through
/// its own back.
///
/// Other than the paper:
///  - its Eq. 3 weighs texels by their share of the surface, and leaves out 1 / t.z. A share is of area seen from above, and a
///    facet is 1 / t.z times larger. Without the factor steep maps lose energy (a map tilted by 60 degrees half of it).
///  - its Eq. 18 leaves out h . t, which makes the pdf integrate to more than 1; here the pdf is that of `sample`.
///  - G and Gx see both directions with heights correlated, 1 / (1 + Lambda(i) + Lambda(o)), as everywhere in this library.
///  - bins count texel by texel with their own normals, and only many at once as one lobe: see BinMapNdf.
///
/// Reciprocal, but for rounding. Energy: with F = 1 the integral of f wi.z over wi is at most the facet area that the footprint
/// turns towards wo over that which masks it, as in MicrofacetBrdf: at most 1 on average over a map so far as its slopes are
/// normal. Directions below the horizon (or within kHorizon of it), longer than 1, or not finite get 0 from everything here.
/// Thread-safe, allocates nothing.
/// @tparam Masking  G_x: SmithMasking, or GtrMasking for flakes of a GTR distribution
template <class Masking = SmithMasking>
class BasicBinMapBrdf {
 public:
  /// Takes the masking from the slopes of the whole map, which the bin map stores.
  GLINT_HD BasicBinMapBrdf(const BinMapNdf& ndf, const Footprint& footprint,
                           const Fresnel& fresnel) requires std::same_as<Masking, SmithMasking>
      : BasicBinMapBrdf(ndf, footprint, SmithMasking(ndf.map().slopes, 0), fresnel) {}
  /// @param masking  masking by the map without roughness, since each facet adds its own
  GLINT_HD BasicBinMapBrdf(const BinMapNdf& ndf, const Footprint& footprint, const Masking& masking, const Fresnel& fresnel)
      : ndf_(ndf), footprint_(footprint), masking_(masking), fresnel_(fresnel) {}

  GLINT_HD const BinMapNdf& ndf() const { return ndf_; }
  GLINT_HD const Masking& masking() const { return masking_; }

  /// The BRDF f, 1/sr, each channel >= 0; without the cosine wi.z. Costs a density, and two error functions for each facet in
  /// reach.
  GLINT_HD Rgb evaluate(Vec3 wi, Vec3 wo) const {
    if (!(aboveHorizon(wi) && aboveHorizon(wo))) return {};
    const HalfVector h = halfVectorOf(wi, wo);
    return response(wi, wo, h, sums(wi, wo, h));
  }

  /// Density with which `sample(wo, .)` draws wi, per unit solid angle.
  GLINT_HD float pdf(Vec3 wi, Vec3 wo) const {
    if (!(aboveHorizon(wi) && aboveHorizon(wo))) return 0;
    const HalfVector h = halfVectorOf(wi, wo);
    return static_cast<float>(sums(wi, wo, h).drawn / (4 * double{h.towards}));
  }

  /// `evaluate` and `pdf` together, at the cost of one of them.
  GLINT_HD BrdfValue evaluateWithPdf(Vec3 wi, Vec3 wo) const {
    if (!(aboveHorizon(wi) && aboveHorizon(wo))) return {};
    const HalfVector h = halfVectorOf(wi, wo);
    const Sums s = sums(wi, wo, h);
    return {response(wi, wo, h, s), static_cast<float>(s.drawn / (4 * double{h.towards}))};
  }

  /// Draws wi (Atanasov 2021, section 5.3): a point of the footprint, a Beckmann microfacet of the texel there, and wo mirrored
  /// at the microfacet. The leading digits of xi choose the point, the other digits the microfacet.
  ///
  /// pdf and weight are 0 for microfacets that are turned away from wo and for reflections below the horizon. Weights are at
  /// most 1 / (A(wo) t.z (h . t)) for the steepest facet t near h, A the projected area of SmithMasking.
  GLINT_HD BrdfSample sample(Vec3 wo, Vec2 xi) const {
    if (!aboveHorizon(wo)) return {};
    Vec2 normal;
    if (!ndf_.sampleNormal(footprint_, xi, normal)) return {};
    const Frame t(normal);
    const float radius = ndf_.sigma() * FacetLobe::radius(xi.x), angle = 2 * kPi * xi.y;
    const Vec3 m = t.world({radius * std::cos(angle), radius * std::sin(angle), 1});
    const float twice = 2 * dot(m, wo) / dot(m, m);
    const Vec3 wi = twice * m + -1.0f * wo;
    if (!(twice > 0 && aboveHorizon(wi))) return {};
    const HalfVector h = halfVectorOf(wi, wo);
    const Sums s = sums(wi, wo, h);
    const auto density = static_cast<float>(s.drawn / (4 * double{h.towards}));
    if (!(density > 0)) return {};
    return {wi, (wi.z / density) * response(wi, wo, h, s), density};
  }

 private:
  /// t.z of facets is at least this: codes of normals next to the rim of the disk may lie beyond it.
  static constexpr float kSteepest = 1e-3f;
  /// Deviation of the normals of a bin over the cosine to a direction, above which kGrazingPoints facets along each axis
  /// replace the bin.
  static constexpr float kGrazingSpread = 0.2f;
  static constexpr int kGrazingPoints = 6;

  /// The frame of a facet: along the azimuth of its slope, across the azimuth, and its normal.
  struct Frame {
    GLINT_HD explicit Frame(Vec2 n) {
      const float length = std::sqrt(dot(n, n)), r = std::min(length, float{kRim});
      const Vec2 azimuth = length > 0 ? (1 / length) * n : Vec2{1, 0};
      const float z = std::sqrt((1 - r) * (1 + r));
      along = {z * azimuth.x, z * azimuth.y, -r};
      across = {-azimuth.y, azimuth.x, 0};
      normal = {r * azimuth.x, r * azimuth.y, z};
    }
    GLINT_HD Vec3 local(Vec3 w) const { return {dot(w, along), dot(w, across), dot(w, normal)}; }
    GLINT_HD Vec3 world(Vec3 w) const { return w.x * along + w.y * across + w.z * normal; }

    static constexpr float kRim = 1 - 0.5f * kSteepest * kSteepest;
    Vec3 along, across, normal;
  };

  /// Sums over the facets of a footprint towards one half vector.
  struct Sums {
    double reflected = 0;  ///< sum of share D G / t.z
    double drawn = 0;      ///< sum of share D (h . t): density per unit solid angle of h
  };

  GLINT_HD Rgb response(Vec3 wi, Vec3 wo, const HalfVector& h, const Sums& s) const {
    return static_cast<float>(s.reflected) * (masking_.visibility(wi, wo) * fresnel_.reflectance(h.towards));
  }

  GLINT_HD Sums sums(Vec3 wi, Vec3 wo, const HalfVector& half) const {
    const Vec3 h = {half.disk.x, half.disk.y, half.cosine};
    Sums sums;
    ndf_.forEachFacet(footprint_, {half.disk, half.disk}, [&](const BinFacet& f) { add(f, wi, wo, h, sums); });
    return sums;
  }

  /// Replaces a facet that stands for many by a grid of facets with equal weights and the same mean and covariance, because
  /// masking and frame are not linear in the normal. Where a direction grazes the facet, some of its normals are turned away
  /// from the direction, and the grid needs more points.
  GLINT_HD void add(const BinFacet& f, Vec3 wi, Vec3 wo, Vec3 h, Sums& sums) const {
    if (f.spread.xx == 0 && f.spread.yy == 0) {
      addFacet(f.weight, f.normal, wi, wo, h, sums);
      return;
    }
    const float x = std::sqrt(f.spread.xx), along = x > 0 ? f.spread.xy / x : 0;
    const float across = std::sqrt(std::max(0.0f, f.spread.yy - along * along));
    const Vec3 mean = Frame(f.normal).normal;
    const float grazing = std::min(std::fabs(dot(wi, mean)), std::fabs(dot(wo, mean)));
    const bool turned = std::max(f.spread.xx, f.spread.yy) > kGrazingSpread * kGrazingSpread * grazing * grazing;
    const int points = turned ? kGrazingPoints : 2;
    const auto part = static_cast<float>(points), step = std::sqrt(12 / (part * part - 1));
    for (int k = 0; k < points * points; ++k) {
      const float s = step * (static_cast<float>(k % points) - 0.5f * (part - 1));
      const float t = step * (static_cast<float>(k / points) - 0.5f * (part - 1));
      addFacet(f.weight / double{part * part}, f.normal + Vec2{s * x, s * along + t * across}, wi, wo, h, sums);
    }
  }

  GLINT_HD void addFacet(double weight, Vec2 normal, Vec3 wi, Vec3 wo, Vec3 h, Sums& sums) const {
    const Frame t(normal);
    const Vec3 local = t.local(h);
    if (!(local.z > 0)) return;
    const float variance = ndf_.sigma() * ndf_.sigma();
    const Covariance slopes = {variance, 0, variance};
    const float lobe = FacetLobe::density(slopes, {local.x / local.z, local.y / local.z});
    if (lobe == 0) return;
    const float cosine2 = local.z * local.z, distribution = lobe / (cosine2 * cosine2);
    sums.drawn += weight * double{distribution} * double{local.z};
    const Vec3 i = t.local(wi), o = t.local(wo);
    if (!(i.z > 0 && o.z > 0)) return;
    sums.reflected += weight * double{distribution} * double{SmithMasking({{0, 0}, slopes}, 0).g2(i, o)} / double{t.normal.z};
  }

  BinMapNdf ndf_;
  Footprint footprint_;
  Masking masking_;
  Fresnel fresnel_;
};

/// With the masking of a map whose slopes are normally distributed.
using BinMapBrdf = BasicBinMapBrdf<SmithMasking>;

}  // namespace glint
