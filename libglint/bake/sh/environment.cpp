#include "glint/bake/sh/environment.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <memory>
#include <new>
#include <numbers>

#include "glint/bake/common/fftw_plan.h"
#include "glint/bake/sh/gauss_legendre.h"
#include "glint/model/counted.h"
#include "glint/model/error.h"
#include "glint/model/sh.h"
#include "glint/model/texel_name.h"

namespace glint::bake {
namespace {

constexpr double kPi = std::numbers::pi;

/// Fourier transforms of every row and channel, [3][height][width / 2 + 1]: sums over x of radiance exp(-2 pi i k x / width).
std::vector<std::complex<double>> rowSpectra(const Environment& environment) {
  const auto width = static_cast<std::size_t>(environment.width), bins = width / 2 + 1;
  const auto rows = static_cast<std::size_t>(environment.height);
  std::vector<std::complex<double>> spectra(3 * rows * bins);
  const std::unique_ptr<double, FftwFree> line(static_cast<double*>(fftw_malloc(sizeof(double) * width)));
  const std::unique_ptr<fftw_complex, FftwFree> sums(static_cast<fftw_complex*>(fftw_malloc(sizeof(fftw_complex) * bins)));
  if (!line || !sums) throw std::bad_alloc();
  const FftwPlan plan =
      makeFftwPlan([&](unsigned flags) { return fftw_plan_dft_r2c_1d(environment.width, line.get(), sums.get(), flags); });
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t j = 0; j < rows; ++j) {
      for (std::size_t x = 0; x < width; ++x) line.get()[x] = environment.rgb[(j * width + x) * 3 + c];
      fftw_execute(plan.get());
      const auto* from = reinterpret_cast<const std::complex<double>*>(sums.get());
      std::copy(from, from + bins, spectra.begin() + static_cast<std::ptrdiff_t>((c * rows + j) * bins));
    }
  }
  return spectra;
}

/// Integral of radiance exp(-i m phi) dphi over the pixels of one row and channel.
std::complex<double> rowIntegral(const std::complex<double>* spectrum, int width, int m) {
  const int k = m % width;
  const std::complex<double> sum = k <= width / 2 ? spectrum[k] : std::conj(spectrum[width - k]);
  const double half_pixel = kPi / width;
  const double pixel = m == 0 ? 2 * half_pixel : 2 * std::sin(m * half_pixel) / m;
  return sum * std::polar(pixel, -m * half_pixel);
}

/// Quadrature nodes over the polar angle. Each row of pixels has nodes of its own, so that integrals are exact although
/// radiance jumps between rows.
struct PolarNodes {
  std::vector<double> z, sine, weights;
  std::size_t per_row = 0;
};

PolarNodes polarNodes(int height, int band_limit) {
  PolarNodes nodes;
  const double step = kPi / height;
  // The phase of a function of band limit B advances by B * step radians in a row. 0.8 nodes for each radian and 4 more reach
  // double precision.
  const int n = 4 + static_cast<int>(0.8 * band_limit * step);
  nodes.per_row = static_cast<std::size_t>(n);
  for (int j = 0; j < height; ++j) {
    const GaussLegendre rule = gaussLegendre(n, kPi - (j + 1) * step, kPi - j * step);
    for (int k = 0; k < n; ++k) {
      const double theta = rule.nodes[static_cast<std::size_t>(k)];
      nodes.z.push_back(std::cos(theta));
      nodes.sine.push_back(std::sin(theta));
      nodes.weights.push_back(rule.weights[static_cast<std::size_t>(k)] * std::sin(theta));
    }
  }
  return nodes;
}

/// Computes the coefficients of one m: for each band l, sums over the nodes of P_l^m times the integrals of the rows against
/// cos(m phi) and sin(m phi), in three channels.
class OrderProjection {
 public:
  OrderProjection(const PolarNodes& nodes, int m) : nodes_(nodes), m_(m), before_(nodes.z.size()), current_(nodes.z.size()) {}

  /// Multiplies the integrals of the rows by the weights of the nodes.
  void setRows(const std::vector<std::complex<double>>& spectra, int width, int height) {
    const std::size_t bins = static_cast<std::size_t>(width) / 2 + 1;
    for (int c = 0; c < 3; ++c) {
      auto& real = factors_[2 * c];
      auto& imaginary = factors_[2 * c + 1];
      real.resize(nodes_.z.size());
      imaginary.resize(nodes_.z.size());
      for (int j = 0; j < height; ++j) {
        const auto row = rowIntegral(&spectra[(static_cast<std::size_t>(c) * height + j) * bins], width, m_);
        for (std::size_t k = j * nodes_.per_row; k < (j + 1) * nodes_.per_row; ++k) {
          real[k] = row.real() * nodes_.weights[k];
          imaginary[k] = -row.imag() * nodes_.weights[k];
        }
      }
    }
  }

  /// Computes all bands.
  void run(int band_limit, std::vector<double>& result) {
    const std::size_t count = shCount(band_limit);
    for (std::size_t k = 0; k < nodes_.z.size(); ++k) {
      double seed = 0.5 / std::sqrt(kPi);
      for (int m = 1; m <= m_; ++m) seed *= std::sqrt((2.0 * m + 1) / (2.0 * m)) * nodes_.sine[k];
      current_[k] = m_ > 0 ? seed * std::numbers::sqrt2 : seed;
    }
    for (int l = m_;; ++l) {
      for (int c = 0; c < 3; ++c) {
        result[static_cast<std::size_t>(c) * count + shIndex(l, m_)] = sum(factors_[2 * c]);
        if (m_ > 0) result[static_cast<std::size_t>(c) * count + shIndex(l, -m_)] = sum(factors_[2 * c + 1]);
      }
      if (l == band_limit) return;
      step(l + 1);
    }
  }

 private:
  double sum(const std::vector<double>& factors) const {
    double total = 0;
    for (std::size_t k = 0; k < factors.size(); ++k) total += factors[k] * current_[k];
    return total;
  }

  /// Recurrence of the normalised P_l^m over l.
  void step(int l) {
    const double ll = static_cast<double>(l) * l, mm = static_cast<double>(m_) * m_, p = l - 1.0;
    const double a = std::sqrt((4 * ll - 1) / (ll - mm)), b = l > m_ + 1 ? std::sqrt((p * p - mm) / (4 * p * p - 1)) : 0;
    for (std::size_t k = 0; k < current_.size(); ++k) before_[k] = a * (nodes_.z[k] * current_[k] - b * before_[k]);
    std::swap(before_, current_);
  }

  const PolarNodes& nodes_;
  int m_;
  std::vector<double> before_, current_;
  std::vector<double> factors_[6];
};

[[noreturn]] void refuse(const std::string& path, const char* rule, const std::string& what, const std::string& remedy) {
  throw Error(ErrorCode::invalid_input, rule, path, {}, what, remedy);
}

/// Refuses an environment with pixels for which `bad` is true. The error says how many there are, and where the first is.
template <class Bad>
void refusePixels(const Environment& e, const std::string& path, const char* rule, const char* what, Bad bad) {
  TexelTally found(e.width, e.height);
  for (std::size_t k = 0; k < e.rgb.size(); k += 3)
    if (bad(e.rgb[k]) || bad(e.rgb[k + 1]) || bad(e.rgb[k + 2])) found.add(k / 3);
  if (found.count() == 0) return;
  refuse(path, rule, counted(found.count(), {"pixel is", "pixels are"}) + " " + what + " (first at " + found.firstName() + ")",
         "repair the image; radiance is finite and not negative");
}

}  // namespace

const float* Environment::at(Vec3 direction) const {
  const double length = std::hypot(double{direction.x}, double{direction.y}, double{direction.z});
  const double theta = std::acos(std::clamp(direction.z / length, -1.0, 1.0));
  double phi = std::atan2(direction.y, direction.x);
  if (phi < 0) phi += 2 * kPi;
  const int i = std::min(static_cast<int>(phi / (2 * kPi) * width), width - 1);
  const int j = std::clamp(static_cast<int>((1 - theta / kPi) * height), 0, height - 1);
  return &rgb[(static_cast<std::size_t>(j) * static_cast<std::size_t>(width) + static_cast<std::size_t>(i)) * 3];
}

bool hasLightAbove(const Environment& environment) {
  // Rows are in order from the bottom. The middle row of an odd number of rows reaches above the horizon.
  const auto first = static_cast<std::ptrdiff_t>(environment.height / 2) * environment.width * 3;
  return std::any_of(environment.rgb.begin() + first, environment.rgb.end(), [](float radiance) { return radiance > 0; });
}

void requireUsable(const Environment& e, const std::string& path) {
  if (e.width < 1 || e.height < 1 || e.rgb.size() != 3 * static_cast<std::size_t>(e.width) * static_cast<std::size_t>(e.height))
    refuse(path, "environment.size", "the environment has no pixels", "give a latitude-longitude image of RGB");
  if (e.width != 2 * e.height)
    refuse(path, "environment.aspect",
           "the environment is " + std::to_string(e.width) + " x " + std::to_string(e.height) + ", not twice as wide as high",
           "convert it to a latitude-longitude image of 2:1");
  refusePixels(e, path, "environment.finite", "not finite", [](float v) { return !std::isfinite(v); });
  refusePixels(e, path, "environment.positive", "negative", [](float v) { return v < 0; });
}

std::vector<double> projectEnvironment(const Environment& environment, int band_limit) {
  requireUsable(environment);
  const std::vector<std::complex<double>> spectra = rowSpectra(environment);
  const PolarNodes nodes = polarNodes(environment.height, band_limit);
  std::vector<double> result(3 * shCount(band_limit));
  tbb::parallel_for(0, band_limit + 1, [&](int m) {
    OrderProjection projection(nodes, m);
    projection.setRows(spectra, environment.width, environment.height);
    projection.run(band_limit, result);
  });
  return result;
}

}  // namespace glint::bake
