#include "glint/bake/compressed/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "glint/bake/compressed/kernels.cpp"
#include <hwy/foreach_target.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace glint::bake::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// No vector is wider than the padding of a row, so no kernel needs a loop for columns that are left over.
using Floats = hn::CappedTag<float, kColumnPadding>;

/// Computes one tile of C, kRows rows by kVectors vectors, whose sums stay in registers.
template <int kRows, int kVectors>
HWY_INLINE void tile(const StridedMatrix& a, const float* HWY_RESTRICT b, std::ptrdiff_t b_stride, float* HWY_RESTRICT c,
                     std::ptrdiff_t c_stride, int p, Store store) {
  const Floats d;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(Floats()));
  hn::Vec<Floats> sums[kRows][kVectors];
  for (int i = 0; i < kRows; ++i)
    for (int v = 0; v < kVectors; ++v) sums[i][v] = hn::Zero(d);
  const float* column = a.data;
  for (int k = 0; k < p; ++k, column += a.column_stride, b += b_stride) {
    hn::Vec<Floats> row[kVectors];
    for (int v = 0; v < kVectors; ++v) row[v] = hn::LoadU(d, b + v * kLanes);
    for (int i = 0; i < kRows; ++i) {
      const auto value = hn::Set(d, column[i * a.row_stride]);
      for (int v = 0; v < kVectors; ++v) sums[i][v] = hn::MulAdd(value, row[v], sums[i][v]);
    }
  }
  for (int i = 0; i < kRows; ++i) {
    for (int v = 0; v < kVectors; ++v) {
      float* out = c + i * c_stride + v * kLanes;
      if (store == Store::add) sums[i][v] = hn::Add(hn::LoadU(d, out), sums[i][v]);
      if (store == Store::subtract) sums[i][v] = hn::Sub(hn::LoadU(d, out), sums[i][v]);
      hn::StoreU(sums[i][v], d, out);
    }
  }
}

/// Computes all rows of one strip of columns of C.
template <int kRows, int kVectors>
HWY_INLINE void strip(StridedMatrix a, const float* b, std::ptrdiff_t b_stride, float* c, std::ptrdiff_t c_stride, int m, int p,
                      Store store) {
  int i = 0;
  for (; i + kRows <= m; i += kRows, a.data += kRows * a.row_stride, c += kRows * c_stride)
    tile<kRows, kVectors>(a, b, b_stride, c, c_stride, p, store);
  for (; i < m; ++i, a.data += a.row_stride, c += c_stride) tile<1, kVectors>(a, b, b_stride, c, c_stride, p, store);
}

void Multiply(const StridedMatrix& a, const float* b, std::ptrdiff_t b_stride, float* c, std::ptrdiff_t c_stride, int m, int n,
              int p, Store store) {
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(Floats()));
  int j = 0;
  for (; j + 2 * kLanes <= n; j += 2 * kLanes) strip<4, 2>(a, b + j, b_stride, c + j, c_stride, m, p, store);
  for (; j + kLanes <= n; j += kLanes) strip<8, 1>(a, b + j, b_stride, c + j, c_stride, m, p, store);
}

void AddGram(const float* a, std::ptrdiff_t a_stride, int rows, int n, float* c, std::ptrdiff_t c_stride) {
  for (int i = 0; i < n; i += kColumnPadding * 2)
    Multiply({a + i, 1, a_stride}, a, a_stride, c + i * c_stride, c_stride, kColumnPadding * 2, i + kColumnPadding * 2, rows,
             Store::add);
}

void KhatriRao(const float* x, const float* y, int columns, float* out) {
  const Floats d;
  for (int j = 0; j < 16; ++j)
    for (int i = 0; i < 16; ++i, out += columns)
      for (int r = 0; r < columns; r += static_cast<int>(hn::Lanes(d)))
        hn::StoreU(hn::Mul(hn::LoadU(d, x + i * columns + r), hn::LoadU(d, y + j * columns + r)), d, out + r);
}

void ContractY(const float* w, const float* y, int columns, float* out) {
  const Floats d;
  for (int i = 0; i < 16; ++i) {
    for (int r = 0; r < columns; r += static_cast<int>(hn::Lanes(d))) {
      auto sum = hn::Zero(d);
      for (int j = 0; j < 16; ++j)
        sum = hn::MulAdd(hn::LoadU(d, w + (16 * j + i) * columns + r), hn::LoadU(d, y + j * columns + r), sum);
      hn::StoreU(sum, d, out + i * columns + r);
    }
  }
}

void ContractX(const float* w, const float* x, int columns, float* out) {
  const Floats d;
  for (int j = 0; j < 16; ++j) {
    for (int r = 0; r < columns; r += static_cast<int>(hn::Lanes(d))) {
      auto sum = hn::Zero(d);
      for (int i = 0; i < 16; ++i)
        sum = hn::MulAdd(hn::LoadU(d, w + (16 * j + i) * columns + r), hn::LoadU(d, x + i * columns + r), sum);
      hn::StoreU(sum, d, out + j * columns + r);
    }
  }
}

bool InvertPositive(float* a, int n, int stride) {
  const Floats d;
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (int k = 0; k < n; ++k) {
    float* pivot_row = a + k * stride;
    const float pivot = pivot_row[k];
    if (!(pivot > 0)) return false;
    const float inverse = 1 / pivot;
    pivot_row[k] = 1;
    const auto scale = hn::Set(d, inverse);
    for (int j = 0; j < stride; j += lanes) hn::StoreU(hn::Mul(hn::LoadU(d, pivot_row + j), scale), d, pivot_row + j);
    for (int i = 0; i < n; ++i) {
      if (i == k) continue;
      float* row = a + i * stride;
      const auto factor = hn::Set(d, row[k]);
      row[k] = 0;
      for (int j = 0; j < stride; j += lanes)
        hn::StoreU(hn::NegMulAdd(factor, hn::LoadU(d, pivot_row + j), hn::LoadU(d, row + j)), d, row + j);
    }
  }
  return true;
}

}  // namespace glint::bake::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace glint::bake {

HWY_EXPORT(Multiply);
HWY_EXPORT(AddGram);
HWY_EXPORT(KhatriRao);
HWY_EXPORT(ContractY);
HWY_EXPORT(ContractX);
HWY_EXPORT(InvertPositive);

void multiply(StridedMatrix a, const float* b, std::ptrdiff_t b_stride, float* c, std::ptrdiff_t c_stride, int m, int n, int p,
              Store store) {
  HWY_DYNAMIC_DISPATCH(Multiply)(a, b, b_stride, c, c_stride, m, n, p, store);
}

void addGram(const float* a, std::ptrdiff_t a_stride, int rows, int n, float* c, std::ptrdiff_t c_stride) {
  HWY_DYNAMIC_DISPATCH(AddGram)(a, a_stride, rows, n, c, c_stride);
}

void khatriRao(const float* x, const float* y, int columns, float* out) { HWY_DYNAMIC_DISPATCH(KhatriRao)(x, y, columns, out); }

void contractY(const float* w, const float* y, int columns, float* out) { HWY_DYNAMIC_DISPATCH(ContractY)(w, y, columns, out); }

void contractX(const float* w, const float* x, int columns, float* out) { HWY_DYNAMIC_DISPATCH(ContractX)(w, x, columns, out); }

bool invertPositive(float* a, int n, int stride) { return HWY_DYNAMIC_DISPATCH(InvertPositive)(a, n, stride); }

}  // namespace glint::bake
#endif
