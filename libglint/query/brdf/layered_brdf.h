#pragma once

#include <algorithm>

#include "glint/query/brdf/microfacet_brdf.h"

namespace glint {

/// A clear coat over a base: f = f_base (1 - F_coat) + f_coat (Xing 2024, section 6.4 and Eq. 3).
///
/// Each layer has its own distribution of normals, masking and Fresnel reflectance. F_coat is taken at the half vector, so that the
/// sum is reciprocal. Light that bounces between the layers, and refraction in the coat, are left out, as the paper leaves them.
/// Directions are as in MicrofacetBrdf. Holds copies of both; their models must outlive it. Thread-safe, allocates nothing.
template <NdfModel Base, NdfModel Coat>
class LayeredBrdf {
 public:
  /// Bounds of the share of samples that are drawn from the coat. In between it is the coat's reflectance towards wo.
  static constexpr float kLeastCoatShare = 0.25f, kMostCoatShare = 0.75f;

  /// @param coat_fresnel  the reflectance that `coat` was made with
  GLINT_HD LayeredBrdf(const MicrofacetBrdf<Base>& base, const MicrofacetBrdf<Coat>& coat, const Fresnel& coat_fresnel)
      : base_(base), coat_(coat), coat_fresnel_(coat_fresnel) {}

  GLINT_HD const MicrofacetBrdf<Base>& base() const { return base_; }
  GLINT_HD const MicrofacetBrdf<Coat>& coat() const { return coat_; }

  /// The BRDF f, 1/sr, each channel >= 0; without the cosine wi.z. One density of each layer.
  GLINT_HD Rgb evaluate(Vec3 wi, Vec3 wo) const { return evaluateWithPdf(wi, wo).f; }

  /// Density with which `sample(wo, .)` draws wi, per unit solid angle.
  GLINT_HD float pdf(Vec3 wi, Vec3 wo) const { return evaluateWithPdf(wi, wo).pdf; }

  /// `evaluate` and `pdf` together.
  GLINT_HD BrdfValue evaluateWithPdf(Vec3 wi, Vec3 wo) const {
    if (!(aboveHorizon(wi) && aboveHorizon(wo))) return {};
    const BrdfValue base = base_.evaluateWithPdf(wi, wo), coat = coat_.evaluateWithPdf(wi, wo);
    const Rgb f = coat_fresnel_.reflectance(halfVectorOf(wi, wo).towards);
    const Rgb passed = {1 - f.r, 1 - f.g, 1 - f.b};
    const float share = coatShare(wo);
    return {passed * base.f + coat.f, share * coat.pdf + (1 - share) * base.pdf};
  }

  /// Draws wi from one of the layers, chosen by coatShare.
  /// @param xi  in [0, 1)^2
  GLINT_HD BrdfSample sample(Vec3 wo, Vec2 xi) const {
    if (!aboveHorizon(wo)) return {};
    const float share = coatShare(wo);
    const bool from_coat = xi.x < share;
    const float rest = from_coat ? xi.x / share : (xi.x - share) / (1 - share);
    const Vec2 inside = {std::min(rest, float{kBelowOne}), xi.y};
    const BrdfSample drawn = from_coat ? coat_.sample(wo, inside) : base_.sample(wo, inside);
    if (!(drawn.pdf > 0)) return {};
    const BrdfValue value = evaluateWithPdf(drawn.wi, wo);
    if (!(value.pdf > 0)) return {};
    return {drawn.wi, (drawn.wi.z / value.pdf) * value.f, value.pdf};
  }

  /// Share of the samples that are drawn from the coat.
  GLINT_HD float coatShare(Vec3 wo) const {
    const Rgb f = coat_fresnel_.reflectance(wo.z);
    return std::clamp((f.r + f.g + f.b) / 3, float{kLeastCoatShare}, float{kMostCoatShare});
  }

 private:
  MicrofacetBrdf<Base> base_;
  MicrofacetBrdf<Coat> coat_;
  Fresnel coat_fresnel_;
};

}  // namespace glint
