#include "glint/bake/wave/height_spline.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace glint::bake {
namespace {

/// Turns values along a periodic line into the coefficients of their cubic B-spline, by one filter in each direction. The pole is
/// sqrt(3) - 2, so that kReach terms of the periodic sum are exact to the last bit.
/// @param extended  [count + 2 kReach], a buffer
void filterLine(double* line, std::ptrdiff_t stride, int count, std::vector<double>& extended) {
  constexpr double kPole = -0.2679491924311227, kGain = 6;
  constexpr int kReach = 32;
  extended.resize(static_cast<std::size_t>(count) + 2 * kReach);
  for (int k = -kReach; k < count + kReach; ++k)
    extended[static_cast<std::size_t>(k + kReach)] = line[stride * (((k % count) + count) % count)];
  const auto last = static_cast<std::ptrdiff_t>(extended.size()) - 1;
  for (std::ptrdiff_t k = 1; k <= last; ++k) extended[k] += kPole * extended[k - 1];
  extended[last] *= -kPole / (1 - kPole * kPole);
  for (std::ptrdiff_t k = last - 1; k >= 0; --k) extended[k] = kPole * (extended[k + 1] - extended[k]);
  for (int k = 0; k < count; ++k) line[stride * k] = kGain * extended[static_cast<std::size_t>(k + kReach)];
}

}  // namespace

HeightSpline::HeightSpline(const HeightMap& map)
    : width_(map.width), height_(map.height), coefficients_(map.heights.begin(), map.heights.end()) {
  tbb::parallel_for(0, height_, [&](int j) {
    std::vector<double> line;
    filterLine(&coefficient(0, j), 1, width_, line);
  });
  tbb::parallel_for(0, width_, [&](int i) {
    std::vector<double> line;
    filterLine(&coefficient(i, 0), width_, height_, line);
  });
}

void HeightSpline::weights(double t, double (&w)[4]) {
  const double u = 1 - t;
  w[0] = u * u * u / 6;
  w[1] = (4 - 3 * t * t * (2 - t)) / 6;
  w[2] = (4 - 3 * u * u * (2 - u)) / 6;
  w[3] = t * t * t / 6;
}

int HeightSpline::placeOf(double coordinate, int count, double& t) {
  const double x = coordinate - 0.5, cell = std::floor(x);
  t = x - cell;
  const auto first = static_cast<std::ptrdiff_t>(cell) - 1;
  return static_cast<int>(((first % count) + count) % count);
}

double HeightSpline::at(double x, double y) const {
  double tx, ty, wx[4], wy[4];
  const int i = placeOf(x, width_, tx), j = placeOf(y, height_, ty);
  weights(tx, wx);
  weights(ty, wy);
  double sum = 0;
  for (int b = 0; b < 4; ++b)
    for (int a = 0; a < 4; ++a) sum += wx[a] * wy[b] * coefficient((i + a) % width_, (j + b) % height_);
  return sum;
}

void HeightSpline::rowAt(double y, std::vector<double>& row) const {
  double t, w[4];
  const int first = placeOf(y, height_, t);
  weights(t, w);
  const double* rows[4];
  for (int k = 0; k < 4; ++k) rows[k] = &coefficients_[static_cast<std::size_t>((first + k) % height_) * width_];
  row.resize(static_cast<std::size_t>(width_) + 3);
  for (int i = 0; i < width_; ++i) row[i] = w[0] * rows[0][i] + w[1] * rows[1][i] + w[2] * rows[2][i] + w[3] * rows[3][i];
  for (int i = 0; i < 3; ++i) row[width_ + i] = row[i % width_];
}

HeightSpline::Steepest HeightSpline::steepest() const {
  std::vector<Steepest> rows(static_cast<std::size_t>(height_));
  tbb::parallel_for(0, height_, [&](int j) {
    Steepest& best = rows[static_cast<std::size_t>(j)];
    best.j = j;
    // Smoothed across, the slope of the spline at texel (i, j) and half a texel further.
    const auto acrossRows = [&](int i) { return (coefficient(i, j - 1) + 4 * coefficient(i, j) + coefficient(i, j + 1)) / 6; };
    const auto acrossColumns = [&](int i, int row) {
      return (coefficient(i - 1, row) + 4 * coefficient(i, row) + coefficient(i + 1, row)) / 6;
    };
    const auto slope = [](double a, double b, double c, double d) {
      return std::max(std::abs(0.5 * (c - a)), std::abs(0.625 * (c - b) + 0.125 * (d - a)));
    };
    for (int i = 0; i < width_; ++i) {
      const double along_u = slope(acrossRows(i - 1), acrossRows(i), acrossRows(i + 1), acrossRows((i + 2) % width_));
      const double along_v =
          slope(acrossColumns(i, j - 1), acrossColumns(i, j), acrossColumns(i, j + 1), acrossColumns(i, (j + 2) % height_));
      if (std::max(along_u, along_v) > best.slope) best.slope = std::max(along_u, along_v), best.i = i;
    }
  });
  Steepest all;
  for (const Steepest& row : rows)
    if (row.slope > all.slope) all = row;
  return all;
}

}  // namespace glint::bake
