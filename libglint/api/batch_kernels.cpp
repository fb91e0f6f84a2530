// Compiled for AVX2 and F16C as a whole. Nothing but intrinsics may be included: an inline function of another header would be
// compiled for AVX2 too, and the linker might give that copy to those who run on older processors.
#include "glint/api/batch_kernels.h"

#if defined(GLINT_WIDE_KERNELS)

#include <immintrin.h>

namespace glint::api {
namespace {

constexpr int kWidth = 8;
constexpr int kBlockSide = 16;
static_assert(2 * kWidth <= kKernelMargin);

inline __m256 load(const float* at) { return _mm256_loadu_ps(at); }
inline __m256 load(const std::int8_t* at) {
  return _mm256_cvtepi32_ps(_mm256_cvtepi8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(at))));
}
inline __m256 load(const std::uint16_t* halves) {
  return _mm256_cvtph_ps(_mm_loadu_si128(reinterpret_cast<const __m128i*>(halves)));
}
inline __m256i loadIntegers(const std::int16_t* at) {
  return _mm256_cvtepi16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(at)));
}
inline __m256i loadIntegers(const std::int32_t* at) { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(at)); }
inline __m256 load(const std::int16_t* at) { return _mm256_cvtepi32_ps(loadIntegers(at)); }
inline __m256 load(const std::int32_t* at) { return _mm256_cvtepi32_ps(loadIntegers(at)); }

/// All bits where `inner`.
inline __m256 maskOf(bool inner) { return _mm256_castsi256_ps(_mm256_set1_epi32(inner ? -1 : 0)); }

/// at - before where `inner` is all bits, `at` where it is 0. Differences of integers are rounded once, as differenceOf does.
inline __m256 difference(const float* at, const float* before, __m256 inner) {
  return _mm256_sub_ps(load(at), _mm256_and_ps(load(before), inner));
}
inline __m256 difference(__m256i at, __m256i before, __m256 inner) {
  return _mm256_cvtepi32_ps(_mm256_sub_epi32(at, _mm256_and_si256(before, _mm256_castps_si256(inner))));
}
template <class T>
inline __m256 difference(const T* at, const T* before, __m256 inner) {
  return difference(loadIntegers(at), loadIntegers(before), inner);
}

/// Prefix sums along one axis: those at a pixel, those before it, and whether there are any.
template <class T>
struct Axis {
  Axis(const T* prefix, int columns, int pixel)
      : at(prefix + pixel * columns), before(pixel > 0 ? at - columns : at), inner(maskOf(pixel > 0)) {}
  /// Values of columns k to k + 7 at the pixel.
  __m256 operator()(int k) const { return difference(at + k, before + k, inner); }
  const T *at, *before;
  __m256 inner;
};

/// Sums over a part of an axis: interpolated prefix sums up to its end without those up to its start.
template <class T>
struct AxisSum {
  AxisSum(const T* prefix, int columns, const AxisPart& part)
      : low(prefix, columns, part.low, part.low_share), high(prefix, columns, part.high, part.high_share) {}
  __m256 operator()(int k) const { return _mm256_sub_ps(high(k), low(k)); }

  struct End {
    End(const T* prefix, int columns, int pixel, float share)
        : axis(prefix, columns, pixel), share_before(_mm256_set1_ps(1 - share)), share_at(_mm256_set1_ps(share)) {}
    __m256 operator()(int k) const {
      const __m256 before = _mm256_and_ps(load(axis.before + k), axis.inner);
      return _mm256_add_ps(_mm256_mul_ps(share_before, before), _mm256_mul_ps(share_at, load(axis.at + k)));
    }
    Axis<T> axis;
    __m256 share_before, share_at;
  } low, high;
};

/// Scales columns and stores them as the layout says. columns(k): eight from column k on.
template <class Columns>
inline void arrange(const KernelLayout& layout, const float* scales, float* projection, Columns columns) {
  const auto segment = [&](int first, int count, int place) {
    for (int j = 0; j < count; j += kWidth)
      _mm256_storeu_ps(projection + place + j, _mm256_mul_ps(load(scales + first + j), columns(first + j)));
    _mm_storeu_ps(projection + place + count, _mm_setzero_ps());  // up to a group of four
  };
  segment(0, layout.wide, 0);
  if (layout.half == 0) return;
  segment(layout.wide, layout.half, layout.low);
  segment(layout.wide + layout.half, layout.columns - layout.wide - layout.half, layout.high);
}

/// @tparam Along  Axis or AxisSum
template <template <class> class Along, class T, class Part>
inline void projectProducts(const T* basis, const KernelLayout& layout, const Part& x, const Part& y, const float* scales,
                            float* projection) {
  const Along<T> along_x(basis, layout.columns, x), along_y(basis + kBlockSide * layout.columns, layout.columns, y);
  arrange(layout, scales, projection, [&](int k) { return _mm256_mul_ps(along_x(k), along_y(k)); });
}

template <class T>
inline void projectDifferences(const T* basis, const KernelLayout& layout, int x, int y, const float* scales,
                               float* projection) {
  const int row = kBlockSide * layout.columns;
  const Axis<T> here(basis + y * row, layout.columns, x), below(basis + (y > 0 ? y - 1 : y) * row, layout.columns, x);
  const __m256 inner = maskOf(y > 0);
  arrange(layout, scales, projection, [&](int k) { return _mm256_sub_ps(here(k), _mm256_and_ps(below(k), inner)); });
}

template <class T>
inline void addRows(const T* const* rows, const float* weights, int count, const KernelLayout& layout, const float* scales,
                    float* projection) {
  arrange(layout, scales, projection, [&](int k) {
    __m256 sum = _mm256_setzero_ps();
    for (int j = 0; j < count; ++j) sum = _mm256_add_ps(sum, _mm256_mul_ps(_mm256_set1_ps(weights[j]), load(rows[j] + k)));
    return sum;
  });
}

/// Sixteen floats to look up.
struct Table {
  template <class Along>
  explicit Table(const Along& along) : first(along(0)), second(along(kWidth)) {}
  __m256 operator()(__m256i indices) const {
    const __m256 upper = _mm256_castsi256_ps(_mm256_slli_epi32(indices, 28));  // bit 3 to the sign
    return _mm256_blendv_ps(_mm256_permutevar8x32_ps(first, indices), _mm256_permutevar8x32_ps(second, indices), upper);
  }
  __m256 first, second;
};

template <template <class> class Along, class T, class Part>
inline void projectPairs(const T* basis, const CoreAxes& axes, const KernelLayout& layout, const Part& x, const Part& y,
                         const float* scales, float* projection) {
  const Table along_x(Along<T>(basis, axes.rank_x, x)), along_y(Along<T>(basis + kBlockSide * axes.rank_x, axes.rank_y, y));
  arrange(layout, scales, projection, [&](int k) {
    const __m256i pairs = _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(axes.core + k)));
    return _mm256_mul_ps(along_x(pairs), along_y(_mm256_srli_epi32(pairs, 4)));
  });
}

// Two rows of coefficients in the halves of a register, four columns of each.

inline __m256i bytesOf(const std::int8_t* a, const std::int8_t* b) {
  return _mm256_cvtepi8_epi32(_mm_unpacklo_epi32(_mm_loadu_si32(a), _mm_loadu_si32(b)));
}
inline __m256 loadTwo(const std::int8_t* a, const std::int8_t* b) { return _mm256_cvtepi32_ps(bytesOf(a, b)); }
inline __m256 loadTwo(const std::uint16_t* a, const std::uint16_t* b) {
  return _mm256_cvtph_ps(_mm_unpacklo_epi64(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(a)),
                                            _mm_loadl_epi64(reinterpret_cast<const __m128i*>(b))));
}
inline __m256 loadTwo(const float* a, const float* b) {
  return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(a)), _mm_loadu_ps(b), 1);
}
inline __m256 lowHalves(__m256i bytes) { return _mm256_cvtepi32_ps(_mm256_srai_epi32(_mm256_slli_epi32(bytes, 28), 28)); }
inline __m256 highHalves(__m256i bytes) { return _mm256_cvtepi32_ps(_mm256_srai_epi32(bytes, 4)); }

inline __m256 broadcast(const float* at) { return _mm256_broadcast_ps(reinterpret_cast<const __m128*>(at)); }

/// (0 + 2) + (1 + 3) of the four halves.
inline void storeSums(__m256 first, __m256 second, float* values) {
  // Lanes of each half: 0 + 2 of first and second, then 1 + 3.
  const __m256 pairs = _mm256_add_ps(_mm256_unpacklo_ps(first, second), _mm256_unpackhi_ps(first, second));
  const __m256 sums = _mm256_add_ps(pairs, _mm256_permute_ps(pairs, 0b01001110));
  // first[0], second[0] | first[1], second[1]
  const __m128 low = _mm256_castps256_ps128(sums), high = _mm256_extractf128_ps(sums, 1);
  _mm_storeu_ps(values, _mm_unpacklo_ps(low, high));
}

template <class T>
inline void dotRows(const float* projection, const KernelLayout& layout, const T* const* rows, float* values) {
  __m256 first = _mm256_setzero_ps(), second = first;
  for (int k = 0; k < layout.wide; k += 4) {
    const __m256 p = broadcast(projection + k);
    first = _mm256_add_ps(first, _mm256_mul_ps(p, loadTwo(rows[0] + k, rows[1] + k)));
    second = _mm256_add_ps(second, _mm256_mul_ps(p, loadTwo(rows[2] + k, rows[3] + k)));
  }
  if constexpr (sizeof(T) == 1) {
    for (int j = 0; j < layout.half; j += 4) {
      const int k = layout.wide + j;
      const __m256i a = bytesOf(rows[0] + k, rows[1] + k), b = bytesOf(rows[2] + k, rows[3] + k);
      const __m256 low = broadcast(projection + layout.low + j), high = broadcast(projection + layout.high + j);
      first = _mm256_add_ps(_mm256_add_ps(first, _mm256_mul_ps(low, lowHalves(a))), _mm256_mul_ps(high, highHalves(a)));
      second = _mm256_add_ps(_mm256_add_ps(second, _mm256_mul_ps(low, lowHalves(b))), _mm256_mul_ps(high, highHalves(b)));
    }
  }
  storeSums(first, second, values);
}

/// Bits of the first `count` lanes.
inline __m256 firstLanes(int count) {
  const __m256i lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
  return _mm256_castsi256_ps(_mm256_cmpgt_epi32(_mm256_set1_epi32(count), lanes));
}

template <template <class> class Along, class T, class C, class Part>
[[gnu::always_inline]] inline __m128 addProducts(const ProductSlice<T, C>& slice, const Part& x, const Part& y) {
  const int columns = slice.columns;
  const Along<T> along_x(slice.basis, columns, x), along_y(slice.basis + kBlockSide * columns, columns, y);
  __m128 sum = _mm_setzero_ps();
  const auto add = [&](__m256 products) {
    sum = _mm_add_ps(_mm_add_ps(sum, _mm256_castps256_ps128(products)), _mm256_extractf128_ps(products, 1));
  };
  const auto projection = [&](int k) { return _mm256_mul_ps(load(slice.scales + k), _mm256_mul_ps(along_x(k), along_y(k))); };
  int k = 0;
  for (; k + kWidth <= columns; k += kWidth) add(_mm256_mul_ps(projection(k), load(slice.row + k)));
  if (k < columns) {
    const __m256 kept = firstLanes(columns - k);
    add(_mm256_mul_ps(_mm256_and_ps(projection(k), kept), _mm256_and_ps(load(slice.row + k), kept)));
  }
  return sum;
}

template <template <class> class Along, class T, class C, class Part>
inline void dotProducts(const ProductSlice<T, C>* slices, const Part& x, const Part& y, float* values) {
  for (int j = 0; j < 8; j += 4) {
    __m128 a = addProducts<Along>(slices[j], x, y), b = addProducts<Along>(slices[j + 1], x, y),
           c = addProducts<Along>(slices[j + 2], x, y), d = addProducts<Along>(slices[j + 3], x, y);
    _MM_TRANSPOSE4_PS(a, b, c, d);
    _mm_storeu_ps(values + j, _mm_add_ps(_mm_add_ps(a, c), _mm_add_ps(b, d)));  // (0 + 2) + (1 + 3)
  }
}

/// Pixels of half precision, which may be anything in a file: what is infinite or no number becomes 2^16, as halfToFloat makes
/// numbers of them, too.
inline __m256 loadPixels(const std::uint16_t* pixels) { return _mm256_min_ps(load(pixels), _mm256_set1_ps(65536)); }

inline __m128 lowOf(__m256 a) { return _mm256_castps256_ps128(a); }
inline __m128 highOf(__m256 a) { return _mm256_extractf128_ps(a, 1); }

inline __m128 rowSum(const std::uint16_t* row) {
  const __m256 left = loadPixels(row), right = loadPixels(row + kWidth);
  return _mm_add_ps(_mm_add_ps(lowOf(left), highOf(left)), _mm_add_ps(lowOf(right), highOf(right)));
}

}  // namespace

float sumCoveredPixels(const std::uint16_t* const* blocks, const float* weights, int count, const float* columns,
                       const float* rows, int first_row, int end_row) {
  __m256 left = _mm256_setzero_ps(), right = left;
  for (int k = 0; k < count; ++k) {
    __m256 even_left = _mm256_setzero_ps(), even_right = even_left, odd_left = even_left, odd_right = even_left;
    const auto add = [&](int y, __m256& sum_left, __m256& sum_right) {
      const __m256 row = _mm256_set1_ps(rows[y]);
      sum_left = _mm256_add_ps(sum_left, _mm256_mul_ps(row, loadPixels(blocks[k] + y * kBlockSide)));
      sum_right = _mm256_add_ps(sum_right, _mm256_mul_ps(row, loadPixels(blocks[k] + y * kBlockSide + kWidth)));
    };
    int y = first_row;
    for (; y + 2 <= end_row; y += 2) add(y, even_left, even_right), add(y + 1, odd_left, odd_right);
    if (y < end_row) add(y, even_left, even_right);
    const __m256 weight = _mm256_set1_ps(weights[k]);
    left = _mm256_add_ps(left, _mm256_mul_ps(weight, _mm256_add_ps(even_left, odd_left)));
    right = _mm256_add_ps(right, _mm256_mul_ps(weight, _mm256_add_ps(even_right, odd_right)));
  }
  left = _mm256_mul_ps(load(columns), left);
  right = _mm256_mul_ps(load(columns + kWidth), right);
  const __m128 sum = _mm_add_ps(_mm_add_ps(lowOf(left), highOf(left)), _mm_add_ps(lowOf(right), highOf(right)));
  const __m128 pairs = _mm_add_ps(sum, _mm_movehl_ps(sum, sum));  // (0 + 2), (1 + 3)
  return _mm_cvtss_f32(_mm_add_ss(pairs, _mm_shuffle_ps(pairs, pairs, 1)));
}

void sumPixelRows(const std::uint16_t* pixels, float* sums) {
  for (int y = 0; y < kBlockSide; y += 4) {
    const std::uint16_t* four = pixels + y * kBlockSide;
    __m128 a = rowSum(four), b = rowSum(four + kBlockSide), c = rowSum(four + 2 * kBlockSide),
           d = rowSum(four + 3 * kBlockSide);
    _MM_TRANSPOSE4_PS(a, b, c, d);
    _mm_storeu_ps(sums + y, _mm_add_ps(_mm_add_ps(a, c), _mm_add_ps(b, d)));
  }
}

void projectColumns(const std::int16_t* basis, const KernelLayout& layout, int x, int y, const float* scales,
                    float* projection) {
  projectProducts<Axis>(basis, layout, x, y, scales, projection);
}
void projectColumns(const float* basis, const KernelLayout& layout, int x, int y, const float* scales, float* projection) {
  projectProducts<Axis>(basis, layout, x, y, scales, projection);
}

void projectCore(const std::int16_t* basis, const CoreAxes& axes, const KernelLayout& layout, int x, int y, const float* scales,
                 float* projection) {
  projectPairs<Axis>(basis, axes, layout, x, y, scales, projection);
}
void projectCore(const float* basis, const CoreAxes& axes, const KernelLayout& layout, int x, int y, const float* scales,
                 float* projection) {
  projectPairs<Axis>(basis, axes, layout, x, y, scales, projection);
}

void projectImages(const std::int32_t* basis, const KernelLayout& layout, int x, int y, const float* scales,
                   float* projection) {
  projectDifferences(basis, layout, x, y, scales, projection);
}
void projectImages(const float* basis, const KernelLayout& layout, int x, int y, const float* scales, float* projection) {
  projectDifferences(basis, layout, x, y, scales, projection);
}

void projectColumns(const std::int16_t* basis, const KernelLayout& layout, const AxisPart& x, const AxisPart& y,
                    const float* scales, float* projection) {
  projectProducts<AxisSum>(basis, layout, x, y, scales, projection);
}
void projectColumns(const float* basis, const KernelLayout& layout, const AxisPart& x, const AxisPart& y, const float* scales,
                    float* projection) {
  projectProducts<AxisSum>(basis, layout, x, y, scales, projection);
}
void projectCore(const std::int16_t* basis, const CoreAxes& axes, const KernelLayout& layout, const AxisPart& x,
                 const AxisPart& y, const float* scales, float* projection) {
  projectPairs<AxisSum>(basis, axes, layout, x, y, scales, projection);
}
void projectCore(const float* basis, const CoreAxes& axes, const KernelLayout& layout, const AxisPart& x, const AxisPart& y,
                 const float* scales, float* projection) {
  projectPairs<AxisSum>(basis, axes, layout, x, y, scales, projection);
}
void projectRows(const std::int32_t* const* rows, const float* weights, int count, const KernelLayout& layout,
                 const float* scales, float* projection) {
  addRows(rows, weights, count, layout, scales, projection);
}
void projectRows(const float* const* rows, const float* weights, int count, const KernelLayout& layout, const float* scales,
                 float* projection) {
  addRows(rows, weights, count, layout, scales, projection);
}

void dotFourRows(const float* projection, const KernelLayout& layout, const std::int8_t* const* rows, float* values) {
  dotRows(projection, layout, rows, values);
}
void dotFourRows(const float* projection, const KernelLayout& layout, const std::uint16_t* const* rows, float* values) {
  dotRows(projection, layout, rows, values);
}
void dotFourRows(const float* projection, const KernelLayout& layout, const float* const* rows, float* values) {
  dotRows(projection, layout, rows, values);
}

void dotEightSlices(const ProductSlice<std::int16_t, std::int8_t>* slices, int x, int y, float* values) {
  dotProducts<Axis>(slices, x, y, values);
}
void dotEightSlices(const ProductSlice<std::int16_t, std::uint16_t>* slices, int x, int y, float* values) {
  dotProducts<Axis>(slices, x, y, values);
}
void dotEightSlices(const ProductSlice<float, float>* slices, int x, int y, float* values) {
  dotProducts<Axis>(slices, x, y, values);
}
void dotEightSlices(const ProductSlice<std::int16_t, std::int8_t>* slices, const AxisPart& x, const AxisPart& y,
                    float* values) {
  dotProducts<AxisSum>(slices, x, y, values);
}
void dotEightSlices(const ProductSlice<std::int16_t, std::uint16_t>* slices, const AxisPart& x, const AxisPart& y,
                    float* values) {
  dotProducts<AxisSum>(slices, x, y, values);
}
void dotEightSlices(const ProductSlice<float, float>* slices, const AxisPart& x, const AxisPart& y, float* values) {
  dotProducts<AxisSum>(slices, x, y, values);
}

}  // namespace glint::api

#endif
