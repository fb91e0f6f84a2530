#include <algorithm>
#include <array>
#include <variant>

#include "glint/api/c_support.h"
#include "glint/query/brdf/bin_map_brdf.h"
#include "glint/query/brdf/microfacet_brdf.h"
#include "glint/query/detail/common/sampling.h"

struct glint_brdf {
  const glint_ndf* ndf;
  glint::Fresnel fresnel;
  glint::SmithMasking masking;
  bool beckmann;
};

namespace {

using namespace glint;
using namespace glint::api::c;

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

/// Calls ask(brdf) with the BRDF of a footprint.
template <class Ask>
auto atFootprint(const glint_brdf& b, const Footprint& footprint, Ask&& ask) {
  const api::AnyNdf& model = b.ndf->opened.model();
  if (b.beckmann) return ask(BinMapBrdf(std::get<BinMapNdf>(model), footprint, b.masking, b.fresnel));
  return std::visit([&](const auto& m) { return ask(MicrofacetBrdf(m, footprint, b.masking, b.fresnel)); }, model);
}

/// The arrays of a batch of values; null: not wanted.
struct Values {
  float* f;
  float* pdf;

  void set(std::size_t k, const BrdfValue& value) const {
    if (f != nullptr) glint::api::c::set(f + 3 * k, value.f);
    if (pdf != nullptr) pdf[k] = value.pdf;
  }
};

/// The queries of a batch from `first` on.
api::StridedFloats from(api::StridedFloats a, std::size_t first) {
  if (a.data == nullptr) return a;
  const char* start = reinterpret_cast<const char*>(a.data) + static_cast<std::ptrdiff_t>(first) * a.stride_bytes;
  return {reinterpret_cast<const float*>(start), a.stride_bytes};
}
api::FootprintArrays from(const api::FootprintArrays& p, std::size_t first) {
  return {from(p.u, first),  from(p.v, first),  from(p.sigma, first), from(p.xx, first), from(p.xy, first),
          from(p.yy, first), from(p.ax, first), from(p.ay, first),    from(p.bx, first), from(p.by, first)};
}

/// Most queries of a batch that has its arrays on the stack.
constexpr std::size_t kPart = 256;

/// Evaluates with D from batches of densities, whose cache misses overlap. Batches have kPart queries, so that their arrays are on
/// the stack.
void evaluateByDensities(const glint_brdf& b, std::size_t count, const api::FootprintArrays& footprints,
                         const DirectionArrays& wi, const DirectionArrays& wo, const Values& out) {
  std::array<HalfVector, kPart> halves;
  std::array<float, kPart> densities;
  const api::AnyNdf& model = b.ndf->opened.model();
  for (std::size_t first = 0; first < count; first += kPart) {
    const std::size_t size = std::min(kPart, count - first);
    for (std::size_t k = 0; k < size; ++k) {
      const Vec3 i = wi[first + k], o = wo[first + k];
      halves[k] = aboveHorizon(i) && aboveHorizon(o) ? halfVectorOf(i, o) : HalfVector{};
    }
    constexpr std::ptrdiff_t kStride = sizeof(HalfVector);
    api::densities(model, size, from(footprints, first), {{&halves[0].disk.x, kStride}, {&halves[0].disk.y, kStride}},
                   densities.data());
    atFootprint(b, Footprint{}, [&](const auto& brdf) {
      if constexpr (requires { brdf.valueOf(Vec3{}, Vec3{}, halves[0], 0.0f); })
        for (std::size_t k = 0; k < size; ++k)
          out.set(first + k,
                  halves[k].cosine > 0 ? brdf.valueOf(wi[first + k], wo[first + k], halves[k], densities[k]) : BrdfValue{});
    });
  }
}

/// The arrays of a batch of samples.
struct Samples {
  float* wi;
  float* weights;
  float* pdfs;

  void set(std::size_t k, const BrdfSample& drawn) const {
    glint::api::c::set(wi + 3 * k, drawn.wi);
    glint::api::c::set(weights + 3 * k, drawn.weight);
    pdfs[k] = drawn.pdf;
  }
};

/// Samples with half vectors from batches of samples. A direction that is drawn evenly, or not at all, does not use its half
/// vector.
void sampleByHalfVectors(const glint_brdf& b, std::size_t count, const api::FootprintArrays& footprints,
                         const DirectionArrays& wo, const api::HalfVectorArrays& xi, const Samples& out) {
  using Brdf = MicrofacetBrdf<Reference>;  // any model has the same share
  std::array<Vec2, kPart> points;
  std::array<float, kPart> x, y, pdfs;
  constexpr std::ptrdiff_t kStride = sizeof(Vec2);
  for (std::size_t first = 0; first < count; first += kPart) {
    const std::size_t size = std::min(kPart, count - first);
    for (std::size_t k = 0; k < size; ++k) {
      const Vec3 o = wo[first + k];
      points[k] = aboveHorizon(o) ? Brdf::modelPoint(o, clampUnit(xi[first + k])) : Vec2{};
    }
    api::samples(b.ndf->opened.model(), size, from(footprints, first), {{&points[0].x, kStride}, {&points[0].y, kStride}},
                 {x.data(), y.data(), pdfs.data()});
    for (std::size_t k = 0; k < size; ++k) {
      const Vec3 o = wo[first + k];
      const Vec2 at = clampUnit(xi[first + k]);
      const bool drawn = aboveHorizon(o) && !(at.x < Brdf::uniformShare(o));
      out.set(first + k, atFootprint(b, drawn ? Footprint{} : footprints[first + k], [&](const auto& brdf) {
                if constexpr (requires { brdf.sampleOf(o, HalfVectorSample{}); })
                  if (drawn) return brdf.sampleOf(o, {{x[k], y[k]}, pdfs[k]});
                return brdf.sample(o, at);
              }));
    }
  }
}

/// The fault of the arguments that both batches have; null if there is none.
const char* faultOf(const glint_brdf* brdf, const glint_footprints* footprints, const glint_directions* wo) {
  if (brdf == nullptr) return "brdf is null";
  if (footprints == nullptr) return "footprints is null";
  if (!complete(wo)) return "x, y and z of wo must be given";
  return missingIn(*footprints);
}

}  // namespace

glint_status glint_brdf_create(const glint_ndf* ndf, const glint_brdf_options* options, glint_brdf** brdf) {
  if (ndf == nullptr) return usage("glint_brdf_create", "ndf is null");
  if (brdf == nullptr) return usage("glint_brdf_create", "brdf is null");
  glint_brdf_options given;
  if (const char* fault = takeOptions(options, given)) return usage("glint_brdf_options", fault);
  const bool beckmann = given.facets == GLINT_FACETS_BECKMANN;
  return guarded([&] {
    if (beckmann && !std::holds_alternative<BinMapNdf>(ndf->opened.model()))
      throw Error(ErrorCode::unsupported, "api.facets", "", "glint_brdf_options.facets",
                  "Beckmann facets are the texels of a bin-map, and this is of kind " + ndf->kind,
                  "open an asset of kind bin-map, or take GLINT_FACETS_OF_DISTRIBUTION");
    // Beckmann facets mask themselves, so the roughness is no part of the map's masking. In D, the roughness adds to the slopes.
    const float sigma_r = beckmann ? 0 : ndf->opened.info().sigma_r;
    *brdf = new glint_brdf{ndf, fresnelOf(given), SmithMasking(ndf->opened.slopes(), sigma_r), beckmann};
  });
}

void glint_brdf_destroy(glint_brdf* brdf) { delete brdf; }

glint_status glint_brdf_evaluate(const glint_brdf* brdf, const glint_footprint* footprint, const float wi[3], const float wo[3],
                                 float f[3], float* pdf) {
  if (brdf == nullptr || footprint == nullptr || wi == nullptr || wo == nullptr)
    return nullArgument("glint_brdf_evaluate", {{brdf, "brdf"}, {footprint, "footprint"}, {wi, "wi"}, {wo, "wo"}});
  if (f == nullptr && pdf == nullptr) return usage("glint_brdf_evaluate", "f and pdf are null");
  const Values out = {f, pdf};
  out.set(0, atFootprint(*brdf, footprintOf(*footprint),
                         [&](const auto& b) { return b.evaluateWithPdf(vectorOf(wi), vectorOf(wo)); }));
  return GLINT_OK;
}

glint_status glint_brdf_sample(const glint_brdf* brdf, const glint_footprint* footprint, const float wo[3], float xi1,
                               float xi2, float wi[3], float weight[3], float* pdf) {
  if (brdf == nullptr || footprint == nullptr || wo == nullptr || wi == nullptr || weight == nullptr || pdf == nullptr)
    return nullArgument("glint_brdf_sample",
                        {{brdf, "brdf"}, {footprint, "footprint"}, {wo, "wo"}, {wi, "wi"}, {weight, "weight"}, {pdf, "pdf"}});
  const BrdfSample drawn = atFootprint(*brdf, footprintOf(*footprint), [&](const auto& b) {
    return b.sample(vectorOf(wo), clampUnit(Vec2{xi1, xi2}));
  });
  set(wi, drawn.wi);
  set(weight, drawn.weight);
  *pdf = drawn.pdf;
  return GLINT_OK;
}

glint_status glint_brdf_evaluate_batch(const glint_brdf* brdf, size_t count, const glint_footprints* footprints,
                                       const glint_directions* wi, const glint_directions* wo, float* f, float* pdfs) {
  if (count == 0) return GLINT_OK;
  if (const char* fault = faultOf(brdf, footprints, wo)) return usage("glint_brdf_evaluate_batch", fault);
  if (!complete(wi)) return usage("glint_brdf_evaluate_batch", "x, y and z of wi must be given");
  if (f == nullptr && pdfs == nullptr) return usage("glint_brdf_evaluate_batch", "f and pdfs are null");
  const api::FootprintArrays p = arraysOf(*footprints);
  const DirectionArrays i(*wi), o(*wo);
  const Values out = {f, pdfs};
  if (!brdf->beckmann) {
    evaluateByDensities(*brdf, count, p, i, o, out);
    return GLINT_OK;
  }
  for (std::size_t k = 0; k < count; ++k)
    out.set(k, atFootprint(*brdf, p[k], [&](const auto& b) { return b.evaluateWithPdf(i[k], o[k]); }));
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
  const api::FootprintArrays p = arraysOf(*footprints);
  const DirectionArrays o(*wo);
  const api::HalfVectorArrays xi = {arrayOf(xi1), arrayOf(xi2)};
  const Samples out = {wi, weights, pdfs};
  if (!brdf->beckmann) {
    sampleByHalfVectors(*brdf, count, p, o, xi, out);
    return GLINT_OK;
  }
  for (std::size_t k = 0; k < count; ++k)
    out.set(k, atFootprint(*brdf, p[k], [&](const auto& b) { return b.sample(o[k], clampUnit(xi[k])); }));
  return GLINT_OK;
}
