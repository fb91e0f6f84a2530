#pragma once

// Private to libglint/api.

#include <cstdint>

#if defined(__x86_64__) && defined(__GNUC__)
/// There are kernels for AVX2 and F16C; call them only on processors that have these.
#define GLINT_WIDE_KERNELS 1
#endif

namespace glint::api {

/// Whether this processor has what the kernels need.
bool hasWideKernels();

/// ColumnLayout of a cluster: where a projection holds its columns.
struct KernelLayout {
  int columns, wide, half, low, high;
};

/// tucker: numbers of the functions along each axis, and a + 16 b of each column.
struct CoreAxes {
  int rank_x, rank_y;
  const std::uint8_t* core;
};

/// Slices of cp clusters without narrow columns.
template <class Basis, class Coefficient>
struct ProductSlice {
  const Basis* basis;
  const float* scales;
  const Coefficient* row;
  int columns;
};

/// A part of one block axis, as sums up to its ends are interpolated: pixels that hold the ends, and how much of each is before
/// the end.
struct AxisPart {
  int low, high;
  float low_share, high_share;
};

/// Elements that kernels read or write beyond the last column: of a basis, scales, the core and a projection.
inline constexpr int kKernelMargin = 16;

#if defined(GLINT_WIDE_KERNELS)

// Projections of clusters, to the bit those of ClusterReader. `basis` is a cluster's, T float or the integer of prefix sums.

/// cp: ClusterReader::pixel.
void projectColumns(const std::int16_t* basis, const KernelLayout& layout, int x, int y, const float* scales,
                    float* projection);
void projectColumns(const float* basis, const KernelLayout& layout, int x, int y, const float* scales, float* projection);

/// tucker: ClusterReader::pixel.
void projectCore(const std::int16_t* basis, const CoreAxes& axes, const KernelLayout& layout, int x, int y, const float* scales,
                 float* projection);
void projectCore(const float* basis, const CoreAxes& axes, const KernelLayout& layout, int x, int y, const float* scales,
                 float* projection);

/// pca: ClusterReader::pixel.
void projectImages(const std::int32_t* basis, const KernelLayout& layout, int x, int y, const float* scales, float* projection);
void projectImages(const float* basis, const KernelLayout& layout, int x, int y, const float* scales, float* projection);

/// The same as ClusterReader::box. pca: `rows` and their weights, in the order in which they are added up.
void projectColumns(const std::int16_t* basis, const KernelLayout& layout, const AxisPart& x, const AxisPart& y,
                    const float* scales, float* projection);
void projectColumns(const float* basis, const KernelLayout& layout, const AxisPart& x, const AxisPart& y, const float* scales,
                    float* projection);
void projectCore(const std::int16_t* basis, const CoreAxes& axes, const KernelLayout& layout, const AxisPart& x,
                 const AxisPart& y, const float* scales, float* projection);
void projectCore(const float* basis, const CoreAxes& axes, const KernelLayout& layout, const AxisPart& x, const AxisPart& y,
                 const float* scales, float* projection);
void projectRows(const std::int32_t* const* rows, const float* weights, int count, const KernelLayout& layout,
                 const float* scales, float* projection);
void projectRows(const float* const* rows, const float* weights, int count, const KernelLayout& layout, const float* scales,
                 float* projection);

/// values[j] = dot product of a projection with row j of coefficients (i8, f16, f32), to the bit that of ClusterReader::dot.
/// @note what is read beyond a row, up to three elements, meets zeros
void dotFourRows(const float* projection, const KernelLayout& layout, const std::int8_t* const* rows, float* values);
void dotFourRows(const float* projection, const KernelLayout& layout, const std::uint16_t* const* rows, float* values);
void dotFourRows(const float* projection, const KernelLayout& layout, const float* const* rows, float* values);

/// values[j] = dot product of the row of slice j with its cluster's projection, which is not stored; for j < 8.
void dotEightSlices(const ProductSlice<std::int16_t, std::int8_t>* slices, int x, int y, float* values);
void dotEightSlices(const ProductSlice<std::int16_t, std::uint16_t>* slices, int x, int y, float* values);
void dotEightSlices(const ProductSlice<float, float>* slices, int x, int y, float* values);
void dotEightSlices(const ProductSlice<std::int16_t, std::int8_t>* slices, const AxisPart& x, const AxisPart& y, float* values);
void dotEightSlices(const ProductSlice<std::int16_t, std::uint16_t>* slices, const AxisPart& x, const AxisPart& y,
                    float* values);
void dotEightSlices(const ProductSlice<float, float>* slices, const AxisPart& x, const AxisPart& y, float* values);

/// Weighted sum of the pixels of some blocks by how much of their columns and rows is covered, to the bit that of
/// PyramidNdf::BlockCover::sum.
/// @param blocks, weights     [count]; each block [16][16], half-precision numbers >= 0
/// @param columns, rows       [16]; columns that are not covered are 0
/// @param first_row, end_row  rows that are covered
float sumCoveredPixels(const std::uint16_t* const* blocks, const float* weights, int count, const float* columns,
                       const float* rows, int first_row, int end_row);

/// sums[y] = sum of row y of a block: 2^112 times that of sumRows.
void sumPixelRows(const std::uint16_t* pixels, float* sums);

#else

// Never called: there is no processor that has what they need.
template <class Basis, class Part>
void projectColumns(const Basis*, const KernelLayout&, const Part&, const Part&, const float*, float*) {}
template <class Basis, class Part>
void projectCore(const Basis*, const CoreAxes&, const KernelLayout&, const Part&, const Part&, const float*, float*) {}
template <class Basis>
void projectRows(const Basis* const*, const float*, int, const KernelLayout&, const float*, float*) {}
template <class Basis>
void projectImages(const Basis*, const KernelLayout&, int, int, const float*, float*) {}
template <class Coefficient>
void dotFourRows(const float*, const KernelLayout&, const Coefficient* const*, float*) {}
template <class Basis, class Coefficient, class Part>
void dotEightSlices(const ProductSlice<Basis, Coefficient>*, const Part&, const Part&, float*) {}
inline float sumCoveredPixels(const std::uint16_t* const*, const float*, int, const float*, const float*, int, int) {
  return 0;
}
inline void sumPixelRows(const std::uint16_t*, float*) {}

#endif

}  // namespace glint::api
