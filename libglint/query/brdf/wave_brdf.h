#pragma once

#include "glint/query/brdf/microfacet_brdf.h"

namespace glint {

/// A model that answers colours of psi beside their mean: WaveNdf, or AnisotropicNdf of it.
template <class M>
concept WaveModel = NdfModel<M> && requires(const M& m, const Footprint& p, Vec2 psi) {
  { m.densityRgb(p, psi) } -> std::same_as<Rgb>;
};

/// The BRDF of one shading point under wave optics: f = D*(psi) F G2 / 4, psi = ((wi + wo) / 2)_xy (Deng 2022, Eq. 3).
///
/// Directions as for MicrofacetBrdf. For a fixed wo, psi moves half as fast as wi: d(psi) = wi.z d(omega_i) / 4. So f wi.z integrates
/// over wi to the integral of D* F G2 over the psi that can be reached: at most 1 in grey. A flat mirror is white.
/// Eq. 3 takes the phase of normal incidence at all angles. Orders of a grating stay where the grating equation has them; the
/// slopes of facets are exact near normal incidence, and too steep by 2 / (wi.z + wo.z) towards grazing angles.
/// Reciprocal. Colours outside the gamut are cut at 0, so each channel is >= 0.
///
/// Holds a pointer to the model, which must outlive it. Thread-safe, allocates nothing.
template <WaveModel M>
class WaveBrdf {
 public:
  /// @param footprint  any; the model says which it answers exactly
  GLINT_HD WaveBrdf(const M& model, const Footprint& footprint, const SmithMasking& masking, const Fresnel& fresnel)
      : model_(&model), footprint_(footprint), masking_(masking), fresnel_(fresnel) {}
  WaveBrdf(const M&& model, const Footprint&, const SmithMasking&, const Fresnel&) = delete;

  /// The BRDF f, 1/sr, each channel >= 0; without the cosine wi.z.
  GLINT_HD Rgb evaluate(Vec3 wi, Vec3 wo) const {
    if (!(aboveHorizon(wi) && aboveHorizon(wo))) return {};
    return 0.25f * (colour(psiOf(wi, wo)) * response(wi, wo));
  }

  /// Density with which `sample(wo, .)` draws wi, per unit solid angle: p(psi) wi.z / 4, p the mean of the channels.
  GLINT_HD float pdf(Vec3 wi, Vec3 wo) const {
    if (!(aboveHorizon(wi) && aboveHorizon(wo))) return 0;
    return 0.25f * wi.z * model_->density(footprint_, psiOf(wi, wo));
  }

  /// `evaluate` and `pdf` together.
  GLINT_HD BrdfValue evaluateWithPdf(Vec3 wi, Vec3 wo) const { return {evaluate(wi, wo), pdf(wi, wo)}; }

  /// Draws wi: psi from the mean of the channels, and wi = 2 psi - wo in the plane. The weight is F G2 times a channel over the
  /// mean of the channels. Where psi cannot be reached from wo, pdf and weight are 0.
  /// @param xi  in [0, 1)^2
  GLINT_HD BrdfSample sample(Vec3 wo, Vec2 xi) const {
    if (!aboveHorizon(wo)) return {};
    const HalfVectorSample drawn = model_->sample(footprint_, xi);
    const Vec2 plane = {2 * drawn.h.x - wo.x, 2 * drawn.h.y - wo.y};
    const float square = 1 - dot(plane, plane);
    if (!(drawn.pdf > 0 && square > 0)) return {};
    const Vec3 wi = {plane.x, plane.y, std::sqrt(square)};
    if (!aboveHorizon(wi)) return {};
    const float pdf = 0.25f * wi.z * drawn.pdf;
    if (!(pdf > 0)) return {};
    return {wi, (1 / drawn.pdf) * (colour(drawn.h) * response(wi, wo)), pdf};
  }

 private:
  static GLINT_HD Vec2 psiOf(Vec3 wi, Vec3 wo) { return {0.5f * (wi.x + wo.x), 0.5f * (wi.y + wo.y)}; }

  GLINT_HD Rgb colour(Vec2 psi) const { return finitePositive(model_->densityRgb(footprint_, psi)); }

  GLINT_HD Rgb response(Vec3 wi, Vec3 wo) const {
    return masking_.g2(wi, wo) * fresnel_.reflectance(halfVectorOf(wi, wo).towards);
  }

  const M* model_;
  Footprint footprint_;
  SmithMasking masking_;
  Fresnel fresnel_;
};

}  // namespace glint
