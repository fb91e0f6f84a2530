#include "glint/api/brdf_batch.h"

#include <algorithm>
#include <array>

#include "glint/query/detail/common/sampling.h"

namespace glint::api {
namespace {

/// The queries of a batch from `first` on.
template <class Strided>
Strided from(Strided a, std::size_t first) {
  if (a.data == nullptr) return a;
  const char* start = reinterpret_cast<const char*>(a.data) + static_cast<std::ptrdiff_t>(first) * a.stride_bytes;
  return {reinterpret_cast<decltype(a.data)>(start), a.stride_bytes};
}
FootprintArrays from(const FootprintArrays& p, std::size_t first) {
  FootprintArrays rest = p;
  for (StridedFloats FootprintArrays::*member :
       {&FootprintArrays::u, &FootprintArrays::v, &FootprintArrays::sigma, &FootprintArrays::xx, &FootprintArrays::xy,
        &FootprintArrays::yy, &FootprintArrays::ax, &FootprintArrays::ay, &FootprintArrays::bx, &FootprintArrays::by})
    rest.*member = from(p.*member, first);
  rest.spread_x = from(p.spread_x, first);
  rest.spread_y = from(p.spread_y, first);
  rest.precise_u = from(p.precise_u, first);
  rest.precise_v = from(p.precise_v, first);
  return rest;
}

/// Most queries of a batch that has its arrays on the stack.
constexpr std::size_t kPart = 256;

/// Evaluates with D from batches of densities, whose cache misses overlap. Batches have kPart queries, so that their arrays are on
/// the stack.
void evaluateByDensities(const AnyBrdf& b, std::size_t count, const FootprintArrays& footprints, const DirectionArrays& wi,
                         const DirectionArrays& wo, const BrdfValueArrays& out) {
  std::array<HalfVector, kPart> halves;
  std::array<float, kPart> found;
  for (std::size_t first = 0; first < count; first += kPart) {
    const std::size_t size = std::min(kPart, count - first);
    for (std::size_t k = 0; k < size; ++k) {
      const Vec3 i = wi[first + k], o = wo[first + k];
      halves[k] = aboveHorizon(i) && aboveHorizon(o) ? halfVectorOf(i, o) : HalfVector{};
    }
    constexpr std::ptrdiff_t kStride = sizeof(HalfVector);
    densities(b.model(), size, from(footprints, first), {{&halves[0].disk.x, kStride}, {&halves[0].disk.y, kStride}},
              found.data());
    b.at(Footprint{}, [&](const auto& brdf) {
      if constexpr (requires { brdf.valueOf(Vec3{}, Vec3{}, halves[0], 0.0f); })
        for (std::size_t k = 0; k < size; ++k)
          out.set(first + k,
                  halves[k].cosine > 0 ? brdf.valueOf(wi[first + k], wo[first + k], halves[k], found[k]) : BrdfValue{});
    });
  }
}

/// Samples with half vectors from batches of samples. A direction that is drawn evenly, or not at all, does not use its half
/// vector.
void sampleByHalfVectors(const AnyBrdf& b, std::size_t count, const FootprintArrays& footprints, const DirectionArrays& wo,
                         const HalfVectorArrays& xi, const BrdfSampleArrays& out) {
  using Brdf = MicrofacetBrdf<AnyNdf>;  // any model has the same share
  std::array<Vec2, kPart> points;
  std::array<float, kPart> x, y, pdfs;
  constexpr std::ptrdiff_t kStride = sizeof(Vec2);
  for (std::size_t first = 0; first < count; first += kPart) {
    const std::size_t size = std::min(kPart, count - first);
    for (std::size_t k = 0; k < size; ++k) {
      const Vec3 o = wo[first + k];
      points[k] = aboveHorizon(o) ? Brdf::modelPoint(o, clampUnit(xi[first + k])) : Vec2{};
    }
    samples(b.model(), size, from(footprints, first), {{&points[0].x, kStride}, {&points[0].y, kStride}},
            {x.data(), y.data(), pdfs.data()});
    for (std::size_t k = 0; k < size; ++k) {
      const Vec3 o = wo[first + k];
      const Vec2 at = clampUnit(xi[first + k]);
      const bool drawn = aboveHorizon(o) && !(at.x < Brdf::uniformShare(o));
      const Footprint footprint = drawn ? Footprint{} : footprints[first + k];
      out.set(first + k, b.at(footprint, drawn ? Vec2{} : footprints.spread(first + k), [&](const auto& brdf) {
        if constexpr (requires { brdf.sampleOf(o, HalfVectorSample{}); })
          if (drawn) return brdf.sampleOf(o, {{x[k], y[k]}, pdfs[k]});
        return brdf.sample(o, at);
      }));
    }
  }
}

}  // namespace

void brdfValues(const AnyBrdf& brdf, std::size_t count, const FootprintArrays& footprints, const DirectionArrays& wi,
                const DirectionArrays& wo, const BrdfValueArrays& out) {
  if (brdf.facets() == BrdfFacets::distribution) return evaluateByDensities(brdf, count, footprints, wi, wo, out);
  for (std::size_t k = 0; k < count; ++k) out.set(k, brdf.evaluateWithPdf(footprints[k], wi[k], wo[k]));
}

void brdfSamples(const AnyBrdf& brdf, std::size_t count, const FootprintArrays& footprints, const DirectionArrays& wo,
                 const HalfVectorArrays& xi, const BrdfSampleArrays& out) {
  if (brdf.facets() == BrdfFacets::distribution) return sampleByHalfVectors(brdf, count, footprints, wo, xi, out);
  for (std::size_t k = 0; k < count; ++k) out.set(k, brdf.sample(footprints[k], wo[k], xi[k]));
}

}  // namespace glint::api
