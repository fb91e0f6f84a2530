#include "glint/bake/sh/environment.h"

#include <libsharp/sharp.h>
#include <libsharp/sharp_almhelpers.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <memory>
#include <numbers>

#include "glint/bake/sh/gauss_legendre.h"
#include "glint/model/counted.h"
#include "glint/model/error.h"
#include "glint/model/sh.h"
#include "glint/model/texel_name.h"

namespace glint::bake {
namespace {

constexpr double kPi = std::numbers::pi;

struct DestroyRings {
  void operator()(sharp_geom_info* rings) const { sharp_destroy_geom_info(rings); }
};
struct DestroyBands {
  void operator()(sharp_alm_info* bands) const { sharp_destroy_alm_info(bands); }
};
using Rings = std::unique_ptr<sharp_geom_info, DestroyRings>;
using Bands = std::unique_ptr<sharp_alm_info, DestroyBands>;

/// Quadrature over the polar angle: each row of pixels has rings of its own, all of which read the pixels of the row. So
/// integrals are exact although radiance jumps between rows.
Rings makeRings(int width, int height, int band_limit) {
  const double step = kPi / height;
  // The phase of a function of band limit B advances by B * step radians in a row. 0.8 nodes for each radian and 4 more reach
  // double precision.
  const int per_row = 4 + static_cast<int>(0.8 * band_limit * step), count = per_row * height;
  std::vector<double> angles, weights;
  std::vector<std::ptrdiff_t> first_pixels;
  for (int j = 0; j < height; ++j) {
    const GaussLegendre rule = gaussLegendre(per_row, kPi - (j + 1) * step, kPi - j * step);
    for (int k = 0; k < per_row; ++k) {
      const double angle = rule.nodes[static_cast<std::size_t>(k)];
      angles.push_back(angle);
      weights.push_back(rule.weights[static_cast<std::size_t>(k)] * std::sin(angle));
      first_pixels.push_back(static_cast<std::ptrdiff_t>(j) * width);
    }
  }
  const std::vector<int> pixels(angles.size(), width), strides(angles.size(), 1);
  const std::vector<double> azimuths(angles.size(), kPi / width);  // of the centres of the first pixels
  sharp_geom_info* rings = nullptr;
  sharp_make_geom_info(count, pixels.data(), first_pixels.data(), strides.data(), azimuths.data(), angles.data(),
                       weights.data(), &rings);
  return Rings(rings);
}

Bands makeBands(int band_limit) {
  sharp_alm_info* bands = nullptr;
  sharp_make_triangular_alm_info(band_limit, band_limit, 1, &bands);
  return Bands(bands);
}

/// Complex coefficients, in the order of `bands`, of an environment that is a point at the centre of each pixel.
/// @param channel  0 to 2: red, green or blue
std::vector<std::complex<double>> projectCentres(const Environment& environment, int channel, const Rings& rings,
                                                 const Bands& bands) {
  std::vector<double> pixels;
  for (std::size_t k = static_cast<std::size_t>(channel); k < environment.rgb.size(); k += 3)
    pixels.push_back(double{environment.rgb[k]});
  std::vector<std::complex<double>> coefficients(static_cast<std::size_t>(sharp_alm_count(bands.get())));
  void *from = pixels.data(), *to = coefficients.data();
  // Without OpenMP: oneTBB starts the threads, as many as were asked for.
  sharp_execute(SHARP_YtW, 0, &to, &from, rings.get(), bands.get(), SHARP_DP | SHARP_NO_OPENMP, nullptr, nullptr);
  return coefficients;
}

/// Integral of exp(-i m phi) over the width of a pixel whose centre is at phi = 0.
double pixelIntegral(int m, int width) {
  const double half_pixel = kPi / width;
  return m == 0 ? 2 * half_pixel : 2 * std::sin(m * half_pixel) / m;
}

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
  const Rings rings = makeRings(environment.width, environment.height, band_limit);
  const Bands bands = makeBands(band_limit);
  const std::size_t count = shCount(band_limit);
  std::vector<double> result(3 * count);
  tbb::parallel_for(0, 3, [&](int channel) {
    const std::vector<std::complex<double>> complex = projectCentres(environment, channel, rings, bands);
    double* real = &result[static_cast<std::size_t>(channel) * count];
    for (int m = 0; m <= band_limit; ++m) {
      // Real harmonics here have sqrt(2) and no sign (-1)^m.
      const double factor = (m == 0       ? 1
                             : m % 2 == 0 ? std::numbers::sqrt2
                                          : -std::numbers::sqrt2) *
                            pixelIntegral(m, environment.width);
      for (int l = m; l <= band_limit; ++l) {
        const std::complex<double> c = complex[static_cast<std::size_t>(sharp_alm_index(bands.get(), l, m))];
        real[shIndex(l, m)] = factor * c.real();
        if (m > 0) real[shIndex(l, -m)] = -factor * c.imag();
      }
    }
  });
  return result;
}

}  // namespace glint::bake
