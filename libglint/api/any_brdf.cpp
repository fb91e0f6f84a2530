#include "glint/api/any_brdf.h"

#include <string>

namespace glint::api {
namespace {

/// Distributions of psi are asked by WaveBrdf, whatever is asked for.
BrdfFacets usedFacets(const OpenedNdf& opened, BrdfFacets facets) {
  return facets == BrdfFacets::distribution && isWave(opened.model()) ? BrdfFacets::waves : facets;
}

SmithMasking maskingOf(const OpenedNdf& opened, BrdfFacets facets) {
  if (facets == BrdfFacets::waves && !isWave(opened.model()))
    throw Error(ErrorCode::unsupported, "api.facets", opened.path().string(), "",
                "waves are answered by a wave-pyramid or wave-cp, and this is of kind " + std::string(opened.asset().kind()),
                "open an asset of one of these kinds, or take facets of the distribution");
  if (facets != BrdfFacets::beckmann) return opened.masking();
  if (!std::holds_alternative<BinMapNdf>(opened.model()))
    throw Error(ErrorCode::unsupported, "api.facets", opened.path().string(), "",
                "Beckmann facets are the texels of a bin-map, and this is of kind " + std::string(opened.asset().kind()),
                "open an asset of kind bin-map, or take facets of the distribution");
  // Beckmann facets mask themselves, so the roughness is no part of the map's masking.
  return {opened.slopes(), 0};
}

}  // namespace

AnyBrdf::AnyBrdf(const OpenedNdf& opened, const Fresnel& fresnel, BrdfFacets facets)
    : model_(opened.model()), masking_(maskingOf(opened, facets)), fresnel_(fresnel), facets_(usedFacets(opened, facets)) {}

}  // namespace glint::api
