#pragma once

// Private to libglint/api.

#include <cstdint>

#if defined(__x86_64__) && defined(__GNUC__)
/// There are kernels for AVX2 and F16C; call them only on processors that have these.
#define GLINT_WIDE_KERNELS 1
#endif

namespace glint::api {

#if defined(GLINT_WIDE_KERNELS)

/// Projection of a CP cluster without narrow columns on pixel (x, y) of its block, to the bit that of ClusterReader::pixel.
/// @param basis  X[16][columns] then Y[16][columns], prefix sums
void projectColumns(const std::int16_t* basis, int columns, int x, int y, const float* scales, float* projection);
void projectColumns(const float* basis, int columns, int x, int y, const float* scales, float* projection);

/// Dot product of a projection with a row of wide coefficients (i8, f16, f32), to the bit that of ClusterReader::dot.
/// @param columns  rounded up to a multiple of 4; what is read beyond the row meets zeros
float dotColumns(const float* projection, const std::int8_t* row, int columns);
float dotColumns(const float* projection, const std::uint16_t* row, int columns);
float dotColumns(const float* projection, const float* row, int columns);

#else

// Never called: there is no processor that has what they need.
template <class Basis>
void projectColumns(const Basis*, int, int, int, const float*, float*) {}
template <class Coefficient>
float dotColumns(const float*, const Coefficient*, int) {
  return 0;
}

#endif

}  // namespace glint::api
