#include "glint/bake/wave/coherent_images.h"

#include <tbb/parallel_for.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "glint/bake/common/simd.h"

namespace glint::bake {
namespace {

/// Windows end at this many deviations of the coherence area, where it is 4e-5 of its height. The power at samples then repeats the
/// product of two windows, exp(-(L / 2 sigma)^2), to 2e-9.
constexpr double kWindowReach = 4.5;
/// Samples beyond a pixel that correct its sum.
constexpr int kTapReach = 4;

/// The next even number with no prime factor above 7, which transforms are fast for.
int fastSize(int least) {
  for (int size = least + least % 2;; size += 2) {
    int rest = size;
    for (const int prime : {2, 3, 5, 7})
      while (rest % prime == 0) rest /= prime;
    if (rest == 1) return size;
  }
}

/// Weights b[0], b[1], ... of a sample and its neighbours on both sides, whose sum is the mean of the power over the sample's cell.
///
/// Power is a sum of exp(2 pi i x k) over lags x, in windows, at samples k. A cell's mean multiplies each by sinc(x); the weights do so
/// by b[0] + 2 sum b[n] cos(2 pi n x). Least squares over lags, weighed by the coherence area's correlation exp(-(x L / 2 sigma)^2).
Eigen::Vector<double, kTapReach> cellTaps(const WaveGrid& grid) {
  constexpr int kLags = 500;
  Eigen::Matrix<double, kTapReach, kTapReach> normal = Eigen::Matrix<double, kTapReach, kTapReach>::Zero();
  Eigen::Vector<double, kTapReach> right = Eigen::Vector<double, kTapReach>::Zero();
  for (int k = 1; k <= kLags; ++k) {
    const double x = 0.5 * k / kLags, lag = 0.5 * x * grid.window_um() / grid.coherence_um, weight = std::exp(-2 * lag * lag);
    const double angle = std::numbers::pi * x, wanted = std::sin(angle) / angle - 1;
    Eigen::Vector<double, kTapReach> terms;
    for (int n = 0; n < kTapReach; ++n) terms[n] = 2 * (std::cos(2 * angle * (n + 1)) - 1);
    normal += weight * terms * terms.transpose();
    right += weight * wanted * terms;
  }
  // Where windows are long, all lags are near 0 and terms are alike: the ridge keeps their weights small.
  normal.diagonal().array() += 1e-9 * normal.trace();
  return normal.ldlt().solve(right);
}

/// Weights of the samples from kTapReach before a pixel to kTapReach after it.
std::vector<float> pixelTaps(const WaveGrid& grid) {
  const Eigen::Vector<double, kTapReach> side = cellTaps(grid);
  std::vector<double> taps(static_cast<std::size_t>(grid.samples_per_pixel + 2 * kTapReach), 0.0);
  for (int cell = 0; cell < grid.samples_per_pixel; ++cell) {
    const int at = cell + kTapReach;
    taps[at] += 1 - 2 * side.sum();
    for (int n = 1; n <= kTapReach; ++n) taps[at - n] += side[n - 1], taps[at + n] += side[n - 1];
  }
  return {taps.begin(), taps.end()};
}

/// phasors[c] = exp(2 pi i turns[c]), for |turns| <= 1/2, to 1e-6.
GLINT_MULTIVERSION void phasorsOf(const float* turns, int count, float* phasors) {
  for (int c = 0; c < count; ++c) {
    // Sine and cosine of half the angle, a in [-pi/2, pi/2], by their series; then of the angle.
    const float a = 3.14159265f * turns[c], s = a * a;
    const float sine =
        a * (1 + s * (-1.0f / 6 + s * (1.0f / 120 + s * (-1.0f / 5040 + s * (1.0f / 362880 - s * (1.0f / 39916800))))));
    const float cosine =
        1 + s * (-0.5f + s * (1.0f / 24 + s * (-1.0f / 720 + s * (1.0f / 40320 + s * (-1.0f / 3628800 + s / 479001600)))));
    phasors[2 * c] = 1 - 2 * sine * sine;
    phasors[2 * c + 1] = 2 * sine * cosine;
  }
}

/// turns[c] = -2 h / lambda - half the frequency of a sample, less whole turns.
GLINT_MULTIVERSION void turnsOf(const double* row, const int* places, const double* const* weights, int count,
                                double per_height, double first_turn, double turn_per_sample, float* turns) {
  const double *w0 = weights[0], *w1 = weights[1], *w2 = weights[2], *w3 = weights[3];
  for (int c = 0; c < count; ++c) {
    const double* h = row + places[c];
    const double height = w0[c] * h[0] + w1[c] * h[1] + w2[c] * h[2] + w3[c] * h[3];
    const double turn = per_height * height + first_turn + turn_per_sample * c;
    turns[c] = static_cast<float>(turn - std::floor(turn + 0.5));
  }
}

/// out[c] = scale window[c] in[c], complex.
GLINT_MULTIVERSION void windowRow(const float* in, const float* window, float scale, int count, float* out) {
  for (int c = 0; c < count; ++c) {
    const float w = scale * window[c];
    out[2 * c] = w * in[2 * c];
    out[2 * c + 1] = w * in[2 * c + 1];
  }
}

GLINT_MULTIVERSION void powerOf(const float* in, int count, float* out) {
  for (int c = 0; c < count; ++c) out[c] = in[2 * c] * in[2 * c] + in[2 * c + 1] * in[2 * c + 1];
}

GLINT_MULTIVERSION void addScaled(const float* in, float scale, int count, float* out) {
  for (int c = 0; c < count; ++c) out[c] += scale * in[c];
}

int wrapped(int k, int size) { return ((k % size) + size) % size; }

}  // namespace

WaveGrid waveGrid(double wavelength_um, double coherence_um, int resolution, double largest_psi) {
  WaveGrid grid;
  grid.wavelength_um = wavelength_um;
  grid.coherence_um = coherence_um;
  grid.resolution = resolution;
  const double sample_um = wavelength_um * resolution / 4;  // window of one sample a pixel
  grid.samples_per_pixel = std::max(2, static_cast<int>(std::ceil(2 * kWindowReach * coherence_um / sample_um)));
  const auto pixels = static_cast<int>(std::ceil(std::max(largest_psi, 2.0 / resolution) * resolution / 2));
  grid.size = fastSize(2 * pixels * grid.samples_per_pixel);
  grid.step_um = grid.samples_per_pixel * sample_um / grid.size;
  grid.half_pixels = std::min(grid.size / (2 * grid.samples_per_pixel), resolution / 2);
  return grid;
}

PhaseRows::PhaseRows(const HeightSpline& spline, double texel_um, const WaveGrid& grid, double left_um, int columns)
    : spline_(spline), texel_um_(texel_um), grid_(grid), left_um_(left_um), columns_(columns) {
  places_.resize(static_cast<std::size_t>(columns));
  for (auto& weights : weights_) weights.resize(static_cast<std::size_t>(columns));
  for (int c = 0; c < columns; ++c) {
    double t, w[4];
    places_[c] = HeightSpline::placeOf((left_um + c * grid.step_um) / texel_um, spline.width(), t);
    HeightSpline::weights(t, w);
    for (int k = 0; k < 4; ++k) weights_[k][c] = w[k];
  }
}

void PhaseRows::compute(std::ptrdiff_t first, int count) {
  first_ = first;
  samples_.resize(static_cast<std::size_t>(count) * static_cast<std::size_t>(columns_));
  tbb::parallel_for(0, count, [&](int k) {
    std::vector<double> row;
    std::vector<float> turns(static_cast<std::size_t>(columns_));
    const auto r = static_cast<double>(first + k);
    spline_.rowAt(r * grid_.step_um / texel_um_, row);
    const double* weights[4] = {weights_[0].data(), weights_[1].data(), weights_[2].data(), weights_[3].data()};
    const double half = -0.5 / grid_.size;  // turns of half a frequency
    turnsOf(row.data(), places_.data(), weights, columns_, -2 * texel_um_ / grid_.wavelength_um, half * r, half, turns.data());
    phasorsOf(turns.data(), columns_,
              reinterpret_cast<float*>(samples_.data() + static_cast<std::size_t>(k) * static_cast<std::size_t>(columns_)));
  });
}

CoherentImager::CoherentImager(const WaveGrid& grid) : grid_(grid), plan_(makeSquarePlan(grid.size)), taps_(pixelTaps(grid)) {}

CoherentImager::Scratch::Scratch(const WaveGrid& grid) {
  const auto size = static_cast<std::size_t>(grid.size);
  field = makeFftwfBuffer(size * size);
  for (auto& axis : window) axis.resize(size);
  power.resize(size * size);
  bands.resize(static_cast<std::size_t>(grid.pixels()) * size);
}

double CoherentImager::transform(const PhaseRows& rows, double x_um, double y_um, Scratch& s) const {
  const int size = grid_.size;
  const double centre[2] = {x_um - rows.left_um(), y_um};
  std::ptrdiff_t first[2];
  double squares[2] = {0, 0};
  for (int axis = 0; axis < 2; ++axis) {
    first[axis] = std::llround(centre[axis] / grid_.step_um) - size / 2;
    for (int k = 0; k < size; ++k) {
      const double t = (static_cast<double>(first[axis] + k) * grid_.step_um - centre[axis]) / grid_.coherence_um;
      s.window[axis][k] = static_cast<float>(std::exp(-0.5 * t * t));
      squares[axis] += double{s.window[axis][k]} * s.window[axis][k];
    }
  }
  for (int r = 0; r < size; ++r)
    windowRow(reinterpret_cast<const float*>(rows.row(first[1] + r) + first[0]), s.window[0].data(), s.window[1][r], size,
              reinterpret_cast<float*>(s.field.get() + static_cast<std::ptrdiff_t>(r) * size));
  runSquarePlan(plan_, s.field.get());
  powerOf(reinterpret_cast<const float*>(s.field.get()), size * size, s.power.data());
  // Parseval: the power of all samples sums to size^2 times the squares of the window, which is A_c in the discrete.
  return 1 / (static_cast<double>(size) * size * squares[0] * squares[1]);
}

void CoherentImager::image(const PhaseRows& rows, double x_um, double y_um, Scratch& s, float* out) const {
  const double share = transform(rows, x_um, y_um, s);
  const int size = grid_.size, pixels = grid_.pixels(), m = grid_.samples_per_pixel;
  const auto taps = static_cast<int>(taps_.size());
  const double pixel = 2.0 / grid_.resolution;
  const auto scale = static_cast<float>(share / (pixel * pixel));
  const auto sampleOf = [&](int p, int tap) { return wrapped((p - grid_.half_pixels) * m - kTapReach + tap, size); };
  // Sums the samples of each row of pixels, then of each pixel.
  std::fill(s.bands.begin(), s.bands.end(), 0.0f);
  for (int p = 0; p < pixels; ++p)
    for (int tap = 0; tap < taps; ++tap)
      addScaled(s.power.data() + static_cast<std::ptrdiff_t>(sampleOf(p, tap)) * size, scale * taps_[tap], size,
                s.bands.data() + static_cast<std::ptrdiff_t>(p) * size);
  for (int x = 0; x < pixels; ++x)
    for (int y = 0; y < pixels; ++y) {
      const float* band = s.bands.data() + static_cast<std::ptrdiff_t>(y) * size;
      float sum = 0;
      for (int tap = 0; tap < taps; ++tap) sum += taps_[tap] * band[sampleOf(x, tap)];
      out[y * pixels + x] = std::max(sum, 0.0f);
    }
}

double CoherentImager::borderShare(const PhaseRows& rows, double x_um, double y_um, Scratch& s) const {
  constexpr double kBorder = 0.9;
  const double share = transform(rows, x_um, y_um, s);
  const int size = grid_.size, first = static_cast<int>(kBorder * size / 2);
  const auto isBorder = [&](int k) { return k >= first && k < size - first; };
  double sum = 0;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      if (isBorder(y) || isBorder(x)) sum += s.power[static_cast<std::size_t>(y) * size + x];
  return share * sum;
}

}  // namespace glint::bake
