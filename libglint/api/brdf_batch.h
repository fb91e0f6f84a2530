#pragma once

#include <cstddef>

#include "glint/api/any_brdf.h"
#include "glint/api/batch.h"

namespace glint::api {

/// Directions as a structure of arrays.
struct DirectionArrays {
  StridedFloats x, y, z;
  Vec3 operator[](std::size_t k) const { return {x[k], y[k], z[k]}; }
};

/// Values of a BRDF, contiguous. Either array may be nullptr: not wanted.
struct BrdfValueArrays {
  float* f;     ///< red, green and blue of query k at 3 k, 1/sr
  float* pdfs;  ///< per unit solid angle

  void set(std::size_t k, const BrdfValue& value) const {
    if (f != nullptr) f[3 * k] = value.f.r, f[3 * k + 1] = value.f.g, f[3 * k + 2] = value.f.b;
    if (pdfs != nullptr) pdfs[k] = value.pdf;
  }
};

/// Directions that a BRDF has drawn, contiguous.
struct BrdfSampleArrays {
  float* wi;       ///< x, y and z of query k at 3 k
  float* weights;  ///< red, green and blue of query k at 3 k
  float* pdfs;     ///< per unit solid angle

  void set(std::size_t k, const BrdfSample& drawn) const {
    wi[3 * k] = drawn.wi.x, wi[3 * k + 1] = drawn.wi.y, wi[3 * k + 2] = drawn.wi.z;
    weights[3 * k] = drawn.weight.r, weights[3 * k + 1] = drawn.weight.g, weights[3 * k + 2] = drawn.weight.b;
    pdfs[k] = drawn.pdf;
  }
};

/// out[k] = AnyBrdf::evaluateWithPdf of query k, for k < count, to 1e-6 of its size. Densities are asked in batches, whose cache
/// misses overlap.
/// @note thread-safe, allocates nothing; split a batch over threads as you like
void brdfValues(const AnyBrdf& brdf, std::size_t count, const FootprintArrays& footprints, const DirectionArrays& wi,
                const DirectionArrays& wo, const BrdfValueArrays& out);

/// out[k] = AnyBrdf::sample of query k. Else as brdfValues.
void brdfSamples(const AnyBrdf& brdf, std::size_t count, const FootprintArrays& footprints, const DirectionArrays& wo,
                 const HalfVectorArrays& xi, const BrdfSampleArrays& out);

}  // namespace glint::api
