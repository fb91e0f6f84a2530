#pragma once

#include <cstdint>
#include <utility>
#include <variant>

#include "glint/api/any_ndf.h"
#include "glint/api/wave_colours.h"
#include "glint/query/brdf/bin_map_brdf.h"
#include "glint/query/brdf/microfacet_brdf.h"
#include "glint/query/brdf/wave_brdf.h"
#include "glint/query/curved_ndf.h"
#include "glint/query/detail/common/sampling.h"

namespace glint::api {

/// What the facets of a BRDF are.
enum class BrdfFacets : std::uint8_t {
  distribution,  ///< mirrors, as dense as the NDF says: MicrofacetBrdf
  beckmann,      ///< kind bin-map: texels are facets of Beckmann microfacets that mask themselves: BinMapBrdf
  waves,         ///< kinds wave-pyramid and wave-cp, and only there: WaveBrdf. `distribution` of these kinds is the same
};

/// A BRDF over a texture, of an asset of any kind that answers an NDF: a model, masking by the slopes of the map, and what the
/// facets are made of. Every question names the footprint. MicrofacetBrdf, BinMapBrdf and WaveBrdf have the
/// contracts of the answers.
///
/// Points into the mapped asset, so the OpenedNdf must outlive it (it may be moved). Thread-safe; questions allocate nothing.
class AnyBrdf {
 public:
  /// Kind normals: sums the slopes of all texels once where the asset does not hold them.
  /// @throws Error  unsupported: Beckmann facets of another kind than bin-map, or waves of another kind than wave-pyramid and wave-cp
  AnyBrdf(const OpenedNdf& opened, const Fresnel& fresnel, BrdfFacets facets = BrdfFacets::distribution);
  AnyBrdf(const OpenedNdf&& opened, const Fresnel& fresnel, BrdfFacets facets = BrdfFacets::distribution) = delete;

  const AnyNdf& model() const { return model_; }
  const SmithMasking& masking() const { return masking_; }
  const Fresnel& fresnel() const { return fresnel_; }
  BrdfFacets facets() const { return facets_; }

  /// Calls ask(brdf) with the MicrofacetBrdf, BinMapBrdf or WaveBrdf of a footprint, to ask it more than once. Returns the answer of ask.
  template <class Ask>
  auto at(const Footprint& footprint, Ask&& ask) const {
    if (facets_ == BrdfFacets::beckmann) return ask(BinMapBrdf(std::get<BinMapNdf>(model_), footprint, masking_, fresnel_));
    const auto askFacets = [&] { return ask(MicrofacetBrdf(model_, footprint, masking_, fresnel_)); };
    if (facets_ != BrdfFacets::waves) return askFacets();
    return askWave(
        model_, [&](const auto& wave) { return ask(WaveBrdf(wave, footprint, masking_, fresnel_)); }, askFacets);
  }

  /// The same on a curved surface, whose pixel sees a box of half vectors: the BRDF of a CurvedNdf.
  /// @param spread  half widths of the box, from halfVectorSpread. Beckmann facets and waves have no means, and leave it out
  template <class Ask>
  auto at(const Footprint& footprint, Vec2 spread, Ask&& ask) const {
    if (!(spread.x > 0 || spread.y > 0) || facets_ != BrdfFacets::distribution) return at(footprint, ask);
    const CurvedNdf<AnyNdf> averaged(model_, spread);
    return ask(MicrofacetBrdf(averaged, footprint, masking_, fresnel_));
  }

  /// The BRDF f, 1/sr, each channel >= 0; without the cosine wi.z.
  Rgb evaluate(const Footprint& footprint, Vec3 wi, Vec3 wo) const {
    return at(footprint, [&](const auto& brdf) { return brdf.evaluate(wi, wo); });
  }

  /// Density with which `sample` draws wi for this wo, per unit solid angle.
  float pdf(const Footprint& footprint, Vec3 wi, Vec3 wo) const {
    return at(footprint, [&](const auto& brdf) { return brdf.pdf(wi, wo); });
  }

  /// `evaluate` and `pdf` together, at the cost of one of them.
  BrdfValue evaluateWithPdf(const Footprint& footprint, Vec3 wi, Vec3 wo) const {
    return at(footprint, [&](const auto& brdf) { return brdf.evaluateWithPdf(wi, wo); });
  }

  /// Draws wi for a view wo.
  /// @param xi  in [0, 1)^2; others are clamped, NaN counts as 0
  BrdfSample sample(const Footprint& footprint, Vec3 wo, Vec2 xi) const {
    return at(footprint, [&](const auto& brdf) { return brdf.sample(wo, clampUnit(xi)); });
  }

 private:
  AnyNdf model_;
  SmithMasking masking_;
  Fresnel fresnel_;
  BrdfFacets facets_;
};

}  // namespace glint::api
