#pragma once

#include <algorithm>

#include "glint/query/brdf/microfacet_brdf.h"

namespace glint {

/// A diffuse and a specular part with weights of their own: f = diffuse / pi + specular f_s (Gamboa 2018, Eq. 1, where rho_d
/// stands for diffuse / pi).
///
/// Reciprocal as f_s is. With diffuse + specular <= 1 in each channel it reflects no more than all light wherever f_s does so.
/// Samples come from the parts in proportion to their mean weights. Holds a copy of the specular BRDF, whose model must
/// outlive it. Thread-safe, allocates nothing.
/// @tparam Specular  evaluateWithPdf(wi, wo) -> BrdfValue and sample(wo, xi) -> BrdfSample: MicrofacetBrdf, LayeredBrdf
template <class Specular>
class WeightedBrdf {
 public:
  /// @param diffuse, specular  weights of the parts, each channel 0 to 1
  GLINT_HD WeightedBrdf(const Specular& part, Rgb diffuse, Rgb specular)
      : part_(part), diffuse_(diffuse), specular_(specular) {}

  GLINT_HD const Specular& specularPart() const { return part_; }

  /// The BRDF f, 1/sr, each channel >= 0; without the cosine wi.z.
  GLINT_HD Rgb evaluate(Vec3 wi, Vec3 wo) const { return evaluateWithPdf(wi, wo).f; }

  /// Density with which `sample(wo, .)` draws wi, per unit solid angle.
  GLINT_HD float pdf(Vec3 wi, Vec3 wo) const { return evaluateWithPdf(wi, wo).pdf; }

  /// `evaluate` and `pdf` together.
  GLINT_HD BrdfValue evaluateWithPdf(Vec3 wi, Vec3 wo) const {
    if (!(aboveHorizon(wi) && aboveHorizon(wo))) return {};
    const BrdfValue value = part_.evaluateWithPdf(wi, wo);
    const float share = specularShare();
    return {(1 / kPi) * diffuse_ + specular_ * value.f, share * value.pdf + (1 - share) * (wi.z / kPi)};
  }

  /// Draws wi: from the specular part, or in proportion to its cosine.
  /// @param xi  in [0, 1)^2
  GLINT_HD BrdfSample sample(Vec3 wo, Vec2 xi) const {
    if (!aboveHorizon(wo)) return {};
    const float share = specularShare();
    Vec3 wi;
    if (xi.x < share) {
      const BrdfSample drawn = part_.sample(wo, {std::min(xi.x / share, float{kBelowOne}), xi.y});
      if (!(drawn.pdf > 0)) return {};
      wi = drawn.wi;
    } else {
      const float rest = std::min((xi.x - share) / (1 - share), float{kBelowOne}), angle = 2 * kPi * xi.y;
      const float radius = std::sqrt(rest);
      wi = {radius * std::cos(angle), radius * std::sin(angle), std::sqrt(1 - rest)};
      if (!aboveHorizon(wi)) return {};
    }
    const BrdfValue value = evaluateWithPdf(wi, wo);
    if (!(value.pdf > 0)) return {};
    return {wi, (wi.z / value.pdf) * value.f, value.pdf};
  }

  /// Share of the samples that are drawn from the specular part.
  GLINT_HD float specularShare() const {
    const float diffuse = diffuse_.r + diffuse_.g + diffuse_.b, specular = specular_.r + specular_.g + specular_.b;
    return diffuse + specular > 0 ? specular / (diffuse + specular) : 1.0f;
  }

 private:
  Specular part_;
  Rgb diffuse_, specular_;
};

}  // namespace glint
