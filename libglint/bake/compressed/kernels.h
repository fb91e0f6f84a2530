#pragma once

#include <cstddef>
#include <cstdint>

namespace glint::bake {

/// Rows of the matrices below have a multiple of this many floats. Padding at the end of a row is zero.
inline constexpr int kColumnPadding = 8;

/// @return `columns` rounded up to a multiple of kColumnPadding
constexpr int paddedColumns(int columns) { return (columns + kColumnPadding - 1) / kColumnPadding * kColumnPadding; }

/// A matrix that is read through two strides, in floats. Exchanging the strides transposes it at no cost.
struct StridedMatrix {
  const float* data = nullptr;
  std::ptrdiff_t row_stride = 0;
  std::ptrdiff_t column_stride = 1;
};

enum class Store : std::uint8_t { set, add, subtract };

/// C[m][n] = A B, C += A B, or C -= A B, in SIMD of the best instruction set of the machine.
/// @param a   m x p
/// @param b   p x n, rows contiguous, `b_stride` floats apart
/// @param c   m x n, rows contiguous, `c_stride` floats apart; overlaps neither input
/// @param n   a multiple of kColumnPadding
/// @note sums every element in the order of p, whatever m and n are
void multiply(StridedMatrix a, const float* b, std::ptrdiff_t b_stride, float* c, std::ptrdiff_t c_stride, int m, int n, int p,
              Store store = Store::set);

/// C[n][n] += A^T A for the lower triangle, and for the part of the upper triangle inside squares of 16 on the diagonal.
/// @param a  rows x n, n a multiple of 16
void addGram(const float* a, std::ptrdiff_t a_stride, int rows, int n, float* c, std::ptrdiff_t c_stride);

/// Column-wise Khatri-Rao product: out[16 y + x][r] = Y[y][r] X[x][r] for 16 x and 16 y.
/// @param columns  columns of X, Y and out, which is also their stride: a multiple of kColumnPadding
void khatriRao(const float* x, const float* y, int columns, float* out);

/// out[x][r] = sum over y of w[16 y + x][r] Y[y][r]; layouts as in khatriRao.
void contractY(const float* w, const float* y, int columns, float* out);

/// out[y][r] = sum over x of w[16 y + x][r] X[x][r]; layouts as in khatriRao.
void contractX(const float* w, const float* x, int columns, float* out);

/// Replaces a symmetric positive definite matrix by its inverse (Gauss-Jordan; the caller regularises).
/// @param a        n x n, rows `stride` floats apart
/// @param stride   a multiple of kColumnPadding; columns n..stride-1 are zero and stay so
/// @return false if a pivot is not positive; `a` is then useless
bool invertPositive(float* a, int n, int stride);

}  // namespace glint::bake
