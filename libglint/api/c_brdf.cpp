#include <algorithm>
#include <cstddef>
#include <memory>

#include "glint/api/any_brdf.h"
#include "glint/api/brdf_batch.h"
#include "glint/api/c_support.h"
#include "glint/api/plane_position.h"
#include "glint/query/light/environment.h"

namespace glint::api::c {

/// Shares the distribution with its handle, which may be closed before.
struct BrdfBody {
  std::shared_ptr<const NdfBody> ndf;
  AnyBrdf brdf;
};

}  // namespace glint::api::c

namespace {

using namespace glint;
using namespace glint::api::c;

/// The footprint that a BRDF is asked for. On a plane without end its centre keeps the whole parts, as far as floats have them.
Footprint footprintFor(const api::AnyBrdf& brdf, const glint_footprint& p) {
  Footprint footprint = footprintOf(p);
  if (api::isEndless(brdf.model())) footprint.centre = {static_cast<float>(p.u), static_cast<float>(p.v)};
  return footprint;
}

constexpr float kMostIndex = 1e3f, kLeastDielectric = 1e-3f;

static_assert(offsetof(glint_brdf_options, k) + 3 * sizeof(float) == sizeof(glint_brdf_options),
              "padding at the end would be read as a member by a later library");

bool inRange(float value, float least) { return value >= least && value <= kMostIndex; }

/// @return null if the options can be used, else the fault
const char* takeOptions(const glint_brdf_options* from, glint_brdf_options& to) {
  to = GLINT_BRDF_OPTIONS_INIT;
  if (from == nullptr) return nullptr;
  if (const char* fault = takeSized(*from, sizeof to, to)) return fault;
  if (to.facets != GLINT_FACETS_OF_DISTRIBUTION && to.facets != GLINT_FACETS_BECKMANN) return "unknown facets";
  const auto all = [](const float(&values)[3]) {
    return std::all_of(values, values + 3, [](float value) { return inRange(value, 0); });
  };
  switch (to.fresnel) {
    case GLINT_FRESNEL_MIRROR:
      return nullptr;
    case GLINT_FRESNEL_DIELECTRIC:
      return inRange(to.eta[0], kLeastDielectric) ? nullptr : "eta of a dielectric is not in 1e-3 to 1e3";
    case GLINT_FRESNEL_CONDUCTOR:
      return all(to.eta) && all(to.k) ? nullptr : "eta and k of a conductor are not in 0 to 1e3";
  }
  return "unknown fresnel";
}

Fresnel fresnelOf(const glint_brdf_options& o) {
  if (o.fresnel == GLINT_FRESNEL_DIELECTRIC) return Fresnel::dielectric(o.eta[0]);
  if (o.fresnel == GLINT_FRESNEL_CONDUCTOR) return Fresnel::conductor({o.eta[0], o.eta[1], o.eta[2]}, {o.k[0], o.k[1], o.k[2]});
  return Fresnel::mirror();
}

/// The fault of the arguments that both batches have; null if there is none.
const char* faultOf(const glint_brdf* brdf, const glint_footprints* footprints, const glint_directions* wo) {
  if (const char* fault = faultOf(brdf)) return fault;
  if (footprints == nullptr) return "footprints is null";
  if (!complete(wo)) return "x, y and z of wo must be given";
  return missingIn(*footprints);
}

}  // namespace

glint_status glint_brdf_create(const glint_ndf* ndf, const glint_brdf_options* options, glint_brdf** brdf) {
  if (const char* fault = faultOf(ndf)) return usage("glint_brdf_create", fault);
  if (brdf == nullptr) return usage("glint_brdf_create", "brdf is null");
  glint_brdf_options given;
  if (const char* fault = takeOptions(options, given)) return usage("glint_brdf_options", fault);
  const auto facets = given.facets == GLINT_FACETS_BECKMANN ? api::BrdfFacets::beckmann : api::BrdfFacets::distribution;
  return guarded([&] {
    const NdfBody& body = ndf->body();
    *brdf = new glint_brdf(std::make_shared<BrdfBody>(BrdfBody{ndf->shared(), {body.opened, fresnelOf(given), facets}}));
  });
}

void glint_brdf_destroy(glint_brdf* brdf) { glint_brdf::close(brdf); }

glint_status glint_brdf_evaluate(const glint_brdf* brdf, const glint_footprint* footprint, const float wi[3], const float wo[3],
                                 float f[3], float* pdf) {
  if (!isOpen(brdf) || footprint == nullptr || wi == nullptr || wo == nullptr)
    return badArgument("glint_brdf_evaluate", {{brdf, "brdf"}, {footprint, "footprint"}, {wi, "wi"}, {wo, "wo"}});
  if (f == nullptr && pdf == nullptr) return usage("glint_brdf_evaluate", "f and pdf are null");
  const api::BrdfValueArrays out = {f, pdf};
  const api::AnyBrdf& any = brdf->body().brdf;
  out.set(0, any.at(footprintFor(any, *footprint), spreadOf(*footprint),
                    [&](const auto& b) { return b.evaluateWithPdf(vectorOf(wi), vectorOf(wo)); }));
  return GLINT_OK;
}

glint_status glint_brdf_sample(const glint_brdf* brdf, const glint_footprint* footprint, const float wo[3], float xi1,
                               float xi2, float wi[3], float weight[3], float* pdf) {
  if (!isOpen(brdf) || footprint == nullptr || wo == nullptr || wi == nullptr || weight == nullptr || pdf == nullptr)
    return badArgument("glint_brdf_sample",
                       {{brdf, "brdf"}, {footprint, "footprint"}, {wo, "wo"}, {wi, "wi"}, {weight, "weight"}, {pdf, "pdf"}});
  const api::BrdfSampleArrays out = {wi, weight, pdf};
  const api::AnyBrdf& any = brdf->body().brdf;
  out.set(0, any.at(footprintFor(any, *footprint), spreadOf(*footprint), [&](const auto& b) {
    return b.sample(vectorOf(wo), clampUnit(Vec2{xi1, xi2}));
  }));
  return GLINT_OK;
}

glint_status glint_brdf_evaluate_batch(const glint_brdf* brdf, size_t count, const glint_footprints* footprints,
                                       const glint_directions* wi, const glint_directions* wo, float* f, float* pdfs) {
  if (count == 0) return GLINT_OK;
  if (const char* fault = faultOf(brdf, footprints, wo)) return usage("glint_brdf_evaluate_batch", fault);
  if (!complete(wi)) return usage("glint_brdf_evaluate_batch", "x, y and z of wi must be given");
  if (f == nullptr && pdfs == nullptr) return usage("glint_brdf_evaluate_batch", "f and pdfs are null");
  api::brdfValues(brdf->body().brdf, count, arraysOf(*footprints), arraysOf(*wi), arraysOf(*wo), {f, pdfs});
  return GLINT_OK;
}

glint_status glint_brdf_sample_batch(const glint_brdf* brdf, size_t count, const glint_footprints* footprints,
                                     const glint_directions* wo, glint_floats xi1, glint_floats xi2, float* wi, float* weights,
                                     float* pdfs) {
  if (count == 0) return GLINT_OK;
  if (const char* fault = faultOf(brdf, footprints, wo)) return usage("glint_brdf_sample_batch", fault);
  if (xi1.data == nullptr || xi2.data == nullptr) return usage("glint_brdf_sample_batch", "xi1 and xi2 must be given");
  if (wi == nullptr || weights == nullptr || pdfs == nullptr)
    return usage("glint_brdf_sample_batch", "wi, weights and pdfs must be given");
  api::brdfSamples(brdf->body().brdf, count, arraysOf(*footprints), arraysOf(*wo), {arrayOf(xi1), arrayOf(xi2)},
                   {wi, weights, pdfs});
  return GLINT_OK;
}

namespace {

// Lobes are read where the caller has them: both structs are the same seven floats.
static_assert(sizeof(glint_spherical_gaussian) == sizeof(SphericalGaussian) &&
              offsetof(glint_spherical_gaussian, sharpness) == offsetof(SphericalGaussian, sharpness) &&
              offsetof(glint_spherical_gaussian, amplitude) == offsetof(SphericalGaussian, amplitude));
static_assert(GLINT_MOST_LOBE_CELLS == kMostLobeCells);

SphericalGaussians lobesOf(const glint_spherical_gaussian* lobes, std::size_t count) {
  return {reinterpret_cast<const SphericalGaussian*>(lobes), count};
}

/// Calls ask(brdf) with the microfacet BRDF of a footprint.
template <class Ask>
glint_status askMicrofacets(const char* where, const glint_brdf* brdf, const glint_footprint& footprint, Ask&& ask) {
  const api::AnyBrdf& any = brdf->body().brdf;
  if (any.facets() == api::BrdfFacets::beckmann)
    return usage(where, "Beckmann facets have no averages over half vectors; make the BRDF with GLINT_FACETS_OF_DISTRIBUTION");
  if (any.facets() == api::BrdfFacets::waves)
    return usage(where, "colours of diffraction have no averages over half vectors; take glint_brdf_evaluate and _sample");
  any.at(footprintFor(any, footprint), spreadOf(footprint), [&](const auto& b) {
    if constexpr (requires { b.valueOf(Vec3{}, Vec3{}, HalfVector{}, 0.0f); }) ask(b);
  });
  return GLINT_OK;
}

}  // namespace

glint_status glint_lobes_reflected(const glint_brdf* brdf, const glint_footprint* footprint, const float wo[3],
                                   const glint_spherical_gaussian* lobes, size_t count, int32_t cells, float radiance[3]) {
  if (!isOpen(brdf) || footprint == nullptr || wo == nullptr || (lobes == nullptr && count > 0) || radiance == nullptr)
    return badArgument("glint_lobes_reflected",
                       {{brdf, "brdf"}, {footprint, "footprint"}, {wo, "wo"}, {radiance, "radiance"}, {lobes, "lobes"}});
  if (cells < 0 || cells > kMostLobeCells) return usage("glint_lobes_reflected", "cells is not in 1 to 8; give 0 for 3");
  return askMicrofacets("glint_lobes_reflected", brdf, *footprint, [&](const auto& b) {
    set(radiance, prefilteredRadiance(b, vectorOf(wo), lobesOf(lobes, count), cells == 0 ? kLobeCells : cells));
  });
}

glint_status glint_lobes_shares(const glint_brdf* brdf, const glint_footprint* footprint, const float wo[3],
                                const glint_spherical_gaussian* lobes, size_t count, float* shares) {
  if (count == 0) return GLINT_OK;
  if (!isOpen(brdf) || footprint == nullptr || wo == nullptr || lobes == nullptr || shares == nullptr)
    return badArgument("glint_lobes_shares",
                       {{brdf, "brdf"}, {footprint, "footprint"}, {wo, "wo"}, {lobes, "lobes"}, {shares, "shares"}});
  return askMicrofacets("glint_lobes_shares", brdf, *footprint, [&](const auto& b) {
    [[maybe_unused]] const LightSampler sampler(b, vectorOf(wo), lobesOf(lobes, count), shares);
  });
}

glint_status glint_lobes_sample(const glint_spherical_gaussian* lobes, size_t count, const float* shares, float xi1, float xi2,
                                float wi[3], float radiance[3], float* pdf) {
  if ((lobes == nullptr && count > 0) || (shares == nullptr && count > 0) || wi == nullptr || radiance == nullptr ||
      pdf == nullptr)
    return badArgument("glint_lobes_sample",
                       {{wi, "wi"}, {radiance, "radiance"}, {pdf, "pdf"}, {lobes, "lobes"}, {shares, "shares"}});
  const LightSample drawn = LightSampler(lobesOf(lobes, count), shares).sample(clampUnit(Vec2{xi1, xi2}));
  set(wi, drawn.wi);
  set(radiance, drawn.radiance);
  *pdf = drawn.pdf;
  return GLINT_OK;
}

glint_status glint_lobes_evaluate(const glint_spherical_gaussian* lobes, size_t count, const float* shares, const float w[3],
                                  float radiance[3], float* pdf) {
  if ((lobes == nullptr && count > 0) || w == nullptr) return badArgument("glint_lobes_evaluate", {{w, "w"}, {lobes, "lobes"}});
  if (radiance == nullptr && pdf == nullptr) return usage("glint_lobes_evaluate", "radiance and pdf are null");
  if (pdf != nullptr && shares == nullptr && count > 0) return usage("glint_lobes_evaluate", "shares is null, and pdf is not");
  const SphericalGaussians all = lobesOf(lobes, count);
  if (radiance != nullptr) set(radiance, radianceAlong(all, vectorOf(w)));
  if (pdf != nullptr) *pdf = LightSampler(all, shares).pdf(vectorOf(w));
  return GLINT_OK;
}
