#pragma once

#include "glint/math/fresnel.h"
#include "glint/math/half_vector.h"
#include "glint/query/brdf/smith.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// A direction drawn by a BRDF.
struct BrdfSample {
  Vec3 wi;
  Rgb weight;     ///< f wi.z / pdf; 0 where pdf is 0
  float pdf = 0;  ///< per unit solid angle; 0 if the sample is not a direction above the horizon
};

/// A BRDF towards one direction, and the density with which it is sampled.
struct BrdfValue {
  Rgb f;          ///< 1/sr, without the cosine wi.z
  float pdf = 0;  ///< of wi for the given wo, per unit solid angle
};

/// The microfacet BRDF of one shading point: f = D F G2 / (4 wi.z wo.z), with D from any model of the NDF.
///
/// Directions are unit vectors of the tangent frame, +z up, both away from the surface; radiance comes along wi and leaves
/// along wo. Directions below the horizon (or within kHorizon of it), longer than 1, or not finite get 0 from everything here.
///
/// Reciprocal: f(wi, wo) = f(wo, wi), but for rounding. `sample` is not: its pdf depends on which direction is given.
///
/// Energy: with F = 1, the integral of f wi.z over wi is at most A_D(wo) / A(wo), the facet area that the footprint's D turns
/// towards wo over that of the normal distribution of slopes which masks it (SmithMasking). It is at most 1 where D is that
/// distribution, and on average over the map so far as its slopes are normal; a single footprint that leans towards wo can
/// exceed 1, as a tilted facet does. What bounces between facets is lost, so white facets give less than 1.
///
/// Half vectors that D spills outside the unit disk are no directions: they are never evaluated, and a sample of them has pdf
/// and weight 0. So the pdf integrates to less than 1: samples outside the disk and facets that reflect below the horizon are
/// missing.
///
/// Holds a pointer to the model, which must outlive it. Thread-safe, allocates nothing.
template <NdfModel M>
class MicrofacetBrdf {
 public:
  /// Largest share of samples that are drawn evenly from the hemisphere instead of from D; see `sample`.
  static constexpr float kUniformShare = 0.125f;

  /// @param footprint  any; the model says which it answers exactly
  GLINT_HD MicrofacetBrdf(const M& model, const Footprint& footprint, const SmithMasking& masking, const Fresnel& fresnel)
      : model_(&model), footprint_(footprint), masking_(masking), fresnel_(fresnel) {}
  MicrofacetBrdf(const M&& model, const Footprint&, const SmithMasking&, const Fresnel&) = delete;

  GLINT_HD const M& model() const { return *model_; }
  GLINT_HD const Footprint& footprint() const { return footprint_; }
  GLINT_HD const SmithMasking& masking() const { return masking_; }

  /// The BRDF f, 1/sr, each channel >= 0; without the cosine wi.z. One density.
  GLINT_HD Rgb evaluate(Vec3 wi, Vec3 wo) const {
    if (!(aboveHorizon(wi) && aboveHorizon(wo))) return {};
    const HalfVector h = halfVectorOf(wi, wo);
    return model_->density(footprint_, h.disk) * response(wi, wo, h);
  }

  /// f / D: Fresnel and G2 / (4 wi.z wo.z). For integrals in which D is filtered and the rest is not.
  /// @param wi, wo  above the horizon
  GLINT_HD Rgb response(Vec3 wi, Vec3 wo, const HalfVector& h) const {
    return masking_.visibility(wi, wo) * fresnel_.reflectance(h.towards);
  }

  /// Density with which `sample(wo, .)` draws wi, per unit solid angle. One density.
  GLINT_HD float pdf(Vec3 wi, Vec3 wo) const {
    if (!(aboveHorizon(wi) && aboveHorizon(wo))) return 0;
    const HalfVector h = halfVectorOf(wi, wo);
    return mixed(model_->density(footprint_, h.disk), h, wo);
  }

  /// `evaluate` and `pdf` together. One density.
  GLINT_HD BrdfValue evaluateWithPdf(Vec3 wi, Vec3 wo) const {
    if (!(aboveHorizon(wi) && aboveHorizon(wo))) return {};
    const HalfVector h = halfVectorOf(wi, wo);
    return valueOf(wi, wo, h, model_->density(footprint_, h.disk));
  }

  /// `evaluate` and `pdf` from a density towards h that is known already.
  /// @param wi, wo  above the horizon
  GLINT_HD BrdfValue valueOf(Vec3 wi, Vec3 wo, const HalfVector& h, float density) const {
    return {density * response(wi, wo, h), mixed(density, h, wo)};
  }

  /// Draws wi: a half vector from D, mirrored; or, with probability uniformShare(wo), evenly from the hemisphere.
  ///
  /// From D alone the weight F G2 (wo . h) / (wo.z h.z) grows without bound towards the horizon. With the share s and the
  /// projected area A of SmithMasking, each channel of the weight is at most 2 / ((1 - s) A(wo) wo.z), and at most
  /// pi D(h) / (2 s A(wo)): the first is 2 at normal incidence, where nothing is drawn evenly, and
  /// the second holds down to the horizon. D is at most 1 / (2 pi sigma_r^2).
  /// @param xi  in [0, 1)^2
  GLINT_HD BrdfSample sample(Vec3 wo, Vec2 xi) const {
    if (!aboveHorizon(wo)) return {};
    const float share = uniformShare(wo);
    if (xi.x < share) return sampleUniform(wo, {xi.x / share, xi.y});
    return sampleOf(wo, model_->sample(footprint_, modelPoint(wo, xi)));
  }

  /// The random numbers with which `sample` asks the model, where xi.x >= uniformShare(wo).
  static GLINT_HD Vec2 modelPoint(Vec3 wo, Vec2 xi) {
    const float share = uniformShare(wo);
    return {std::min((xi.x - share) / (1 - share), float{kBelowOne}), xi.y};
  }

  /// The sample for a half vector that the model has drawn at modelPoint.
  /// @param wo  above the horizon
  GLINT_HD BrdfSample sampleOf(Vec3 wo, const HalfVectorSample& drawn) const {
    const HalfVector h = halfVectorAt(drawn.h, wo);
    if (!(drawn.pdf > 0 && h.cosine > 0)) return {};
    const Vec3 wi = reflected(wo, h);
    if (!aboveHorizon(wi)) return {};
    return weighted(wi, wo, h, drawn.pdf);
  }

  /// Share of samples that are drawn evenly from the hemisphere. Is 0 at normal incidence, where weights are bounded without
  /// it.
  static GLINT_HD float uniformShare(Vec3 wo) { return kUniformShare * std::max(0.0f, 1 - wo.z * wo.z); }

 private:
  GLINT_HD float mixed(float density, const HalfVector& h, Vec3 wo) const {
    const float share = uniformShare(wo);
    return (1 - share) * projectedToIncident(density, h) + share * (0.5f / kPi);
  }

  GLINT_HD BrdfSample weighted(Vec3 wi, Vec3 wo, const HalfVector& h, float density) const {
    const float pdf = mixed(density, h, wo);
    if (!(pdf > 0)) return {};
    return {wi, (wi.z * density / pdf) * response(wi, wo, h), pdf};
  }

  GLINT_HD BrdfSample sampleUniform(Vec3 wo, Vec2 xi) const {
    const float radius = std::sqrt(std::max(0.0f, 1 - xi.x * xi.x)), angle = 2 * kPi * xi.y;
    const Vec3 wi = {radius * std::cos(angle), radius * std::sin(angle), xi.x};
    if (!aboveHorizon(wi)) return {};
    const HalfVector h = halfVectorOf(wi, wo);
    return weighted(wi, wo, h, model_->density(footprint_, h.disk));
  }

  const M* model_;
  Footprint footprint_;
  SmithMasking masking_;
  Fresnel fresnel_;
};

}  // namespace glint
