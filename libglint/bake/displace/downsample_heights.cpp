#include "glint/bake/displace/downsample_heights.h"

#include <tbb/parallel_for.h>

#include <complex>
#include <cstddef>
#include <new>
#include <numbers>

#include "glint/bake/common/fftw_plan.h"

namespace glint::bake {
namespace {

using Complex = std::complex<double>;

/// A complex field [rows][columns], and its Fourier transforms in place.
class Spectrum {
 public:
  Spectrum(int columns, int rows) : values_(allocate(static_cast<std::size_t>(columns) * rows)) {
    auto* data = reinterpret_cast<fftw_complex*>(values_.get());
    const auto plan = [&](int sign) {
      return makeFftwPlan([&](unsigned flags) { return fftw_plan_dft_2d(rows, columns, data, data, sign, flags); });
    };
    forward_ = plan(FFTW_FORWARD);
    backward_ = plan(FFTW_BACKWARD);
  }
  Complex& operator[](std::size_t k) { return values_.get()[k]; }
  void forward() { fftw_execute(forward_.get()); }
  void backward() { fftw_execute(backward_.get()); }

 private:
  static Complex* allocate(std::size_t count) {
    auto* memory = static_cast<Complex*>(fftw_malloc(sizeof(Complex) * count));
    if (memory == nullptr) throw std::bad_alloc();
    return memory;
  }
  std::unique_ptr<Complex, FftwFree> values_;
  FftwPlan forward_, backward_;
};

}  // namespace

std::vector<Vec2> meanSlopes(std::span<const float> heights, const CellGrid& grid) {
  const int columns = grid.columns, rows = grid.rows;
  const auto at = [&](int i, int j) {
    return static_cast<double>(
        heights[static_cast<std::size_t>(j % grid.height) * grid.width + static_cast<std::size_t>(i % grid.width)]);
  };
  const auto trapezoid = [](int k, int last) { return k == 0 || k == last ? 0.5 : 1.0; };  // heights are linear along the sides
  std::vector<Vec2> slopes(static_cast<std::size_t>(columns) * rows);
  tbb::parallel_for(0, rows, [&](int row) {
    for (int column = 0; column < columns; ++column) {
      const int i0 = grid.firstColumn(column), j0 = grid.firstRow(row);
      const int wide = grid.firstColumn(column + 1) - i0, high = grid.firstRow(row + 1) - j0;
      double x = 0, y = 0;
      for (int k = 0; k <= high; ++k) x += trapezoid(k, high) * (at(i0 + wide, j0 + k) - at(i0, j0 + k));
      for (int k = 0; k <= wide; ++k) y += trapezoid(k, wide) * (at(i0 + k, j0 + high) - at(i0 + k, j0));
      const double area = static_cast<double>(wide) * high;
      slopes[static_cast<std::size_t>(row) * columns + column] = {static_cast<float>(x / area), static_cast<float>(y / area)};
    }
  });
  return slopes;
}

std::vector<double> heightsFromSlopes(int columns, int rows, std::span<const Vec2> slopes, double mean) {
  const std::size_t count = slopes.size();
  // Transform both slopes at once: x as real part, y as imaginary part.
  Spectrum field(columns, rows);
  for (std::size_t k = 0; k < count; ++k) field[k] = {slopes[k].x, slopes[k].y};
  field.forward();
  const auto mirrored = [](int index, int size) { return index == 0 ? 0 : size - index; };
  const auto turn = [](int index, int size) { return std::polar(1.0, 2 * std::numbers::pi * index / size); };
  Spectrum result(columns, rows);
  tbb::parallel_for(0, rows, [&](int j) {
    const Complex ey = turn(j, rows);
    for (int i = 0; i < columns; ++i) {
      const std::size_t here = static_cast<std::size_t>(j) * columns + i;
      // Part the spectra of x and y, which are symmetric because x and y are real.
      const Complex a = field[here];
      const Complex b = std::conj(field[static_cast<std::size_t>(mirrored(j, rows)) * columns + mirrored(i, columns)]);
      const Complex sx = 0.5 * (a + b), sy = Complex(0, -0.5) * (a - b);
      // Spectra of the difference operators of Eq. 9 and of the Laplacian.
      const Complex ex = turn(i, columns);
      const Complex dx = 0.5 * (ex - 1.0) * (ey + 1.0), dy = 0.5 * (ey - 1.0) * (ex + 1.0);
      const double laplacian = 2 * ex.real() + 2 * ey.real() - 4;
      const double norm = std::norm(dx) + std::norm(dy) + kLaplacianWeight * laplacian * laplacian;
      result[here] =
          i == 0 && j == 0 ? Complex(mean * static_cast<double>(count)) : (std::conj(dx) * sx + std::conj(dy) * sy) / norm;
    }
  });
  result.backward();
  std::vector<double> heights(count);
  for (std::size_t k = 0; k < count; ++k) heights[k] = result[k].real() / static_cast<double>(count);
  return heights;
}

}  // namespace glint::bake
