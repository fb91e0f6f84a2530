#pragma once

// Private to libglint/api.

#include "glint/api/batch.h"

namespace glint::api {

/// Batches of a compressed model.
void compressedDensities(const CpNdf& model, std::size_t count, const FootprintArrays& footprints,
                         const HalfVectorArrays& halves, float* out);
void compressedMeans(const CpNdf& model, std::size_t count, const FootprintArrays& footprints, const RangeArrays& ranges,
                     float* out);
void compressedSamples(const CpNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& xi,
                       const SampleArrays& out);

}  // namespace glint::api
