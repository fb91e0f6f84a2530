#include "glint/bake/sh/gaussian_fit.h"

#include <tbb/parallel_for.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "glint/bake/common/counter_random.h"
#include "glint/model/error.h"

namespace glint::bake {
namespace {

constexpr int kStarts = 4;           // of which the one with the greatest likelihood goes on
constexpr int kStartRounds = 8;      // of each start
constexpr int kSteps = 400;          // of the amplitudes
constexpr std::size_t kChunk = 512;  // pixels of one task
constexpr float kLeastSharpness = 0.05f;

/// A pixel of the environment, or several averaged.
struct Pixel {
  Vec3 direction;
  float solid_angle;
  float rgb[3];
  float power;  ///< brightness times solid angle
};

struct Lobe {
  Vec3 axis;
  double sharpness = 1;
  double share = 0;  ///< of the power
};

/// Rows and columns of the environment that one pixel averages.
int blockOf(const Environment& e, int height) { return std::max(1, (e.height + height - 1) / height); }

std::vector<Pixel> pixelsOf(const Environment& e, int block) {
  const double pi = std::numbers::pi;
  const int rows = (e.height + block - 1) / block;
  std::vector<Pixel> pixels;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < 2 * rows; ++column) {
      double solid = 0, rgb[3] = {}, x = 0, y = 0, z = 0;
      for (int j = row * block; j < std::min(e.height, (row + 1) * block); ++j) {
        const double low = pi * (1 - (j + 1.0) / e.height), high = pi * (1 - double(j) / e.height), middle = 0.5 * (low + high);
        const double angle = (std::cos(low) - std::cos(high)) * pi / e.height;
        for (int i = column * block; i < std::min(e.width, (column + 1) * block); ++i) {
          const double phi = pi * (i + 0.5) / e.height;
          const float* pixel = &e.rgb[3 * (static_cast<std::size_t>(j) * e.width + static_cast<std::size_t>(i))];
          solid += angle;
          for (int c = 0; c < 3; ++c) rgb[c] += angle * pixel[c];
          x += angle * std::sin(middle) * std::cos(phi), y += angle * std::sin(middle) * std::sin(phi);
          z += angle * std::cos(middle);
        }
      }
      if (!(solid > 0)) continue;
      const double length = std::sqrt(x * x + y * y + z * z);
      Pixel p{{static_cast<float>(x / length), static_cast<float>(y / length), static_cast<float>(z / length)},
              static_cast<float>(solid),
              {},
              0};
      for (int c = 0; c < 3; ++c) p.rgb[c] = static_cast<float>(rgb[c] / solid);
      p.power = luminance({p.rgb[0], p.rgb[1], p.rgb[2]}) * p.solid_angle;
      pixels.push_back(p);
    }
  }
  return pixels;
}

/// Logarithm of the density of a lobe of integral 1 towards w.
double logDensity(const Lobe& lobe, Vec3 w) {
  const Vec3 d = w - lobe.axis;
  return std::log(lobe.sharpness / (-2 * std::numbers::pi * std::expm1(-2 * lobe.sharpness))) -
         0.5 * lobe.sharpness * double{dot(d, d)};
}

/// Chooses axes among the pixels, each new one in proportion to power times the squared distance to the nearest so far.
std::vector<Lobe> startLobes(const std::vector<Pixel>& pixels, int count, double most_sharpness, std::uint64_t seed) {
  std::vector<double> distance(pixels.size(), 4);
  std::vector<Lobe> lobes;
  for (int k = 0; k < count; ++k) {
    double total = 0;
    for (std::size_t p = 0; p < pixels.size(); ++p) total += pixels[p].power * distance[p];
    if (!(total > 0)) break;
    double left = total * randomPair(seed, 1, static_cast<std::uint64_t>(k)).x;
    std::size_t chosen = 0;
    for (std::size_t p = 0; p < pixels.size(); ++p) {
      const double weight = pixels[p].power * distance[p];
      if (weight > 0) chosen = p;
      if ((left -= weight) < 0) break;
    }
    lobes.push_back({pixels[chosen].direction, std::min(most_sharpness, 8.0 * count), 1.0 / count});
    for (std::size_t p = 0; p < pixels.size(); ++p) {
      const Vec3 d = pixels[p].direction - pixels[chosen].direction;
      distance[p] = std::min(distance[p], double{dot(d, d)});
    }
  }
  return lobes;
}

/// Sums over some pixels.
struct Sums {
  Eigen::ArrayXd shares, x, y, z;
  double likelihood = 0;
  explicit Sums(std::size_t lobes) {
    for (Eigen::ArrayXd* a : {&shares, &x, &y, &z}) *a = Eigen::ArrayXd::Zero(static_cast<Eigen::Index>(lobes));
  }
};

/// One round of expectation and maximisation.
/// @return logarithm of the likelihood before the round
double improve(const std::vector<Pixel>& pixels, double most_sharpness, std::vector<Lobe>& lobes) {
  const std::size_t chunks = (pixels.size() + kChunk - 1) / kChunk;
  std::vector<Sums> sums(chunks, Sums(lobes.size()));
  tbb::parallel_for(std::size_t{0}, chunks, [&](std::size_t c) {
    Eigen::ArrayXd logs(static_cast<Eigen::Index>(lobes.size()));
    for (std::size_t p = c * kChunk; p < std::min(pixels.size(), (c + 1) * kChunk); ++p) {
      if (!(pixels[p].power > 0)) continue;
      for (std::size_t k = 0; k < lobes.size(); ++k)
        logs(static_cast<Eigen::Index>(k)) =
            lobes[k].share > 0 ? std::log(lobes[k].share) + logDensity(lobes[k], pixels[p].direction) : -1e300;
      const double largest = logs.maxCoeff();
      Eigen::ArrayXd part = (logs - largest).exp();
      const double all = part.sum(), power = pixels[p].power;
      part *= power / all;
      sums[c].likelihood += power * (largest + std::log(all));
      const Vec3 w = pixels[p].direction;
      sums[c].shares += part, sums[c].x += w.x * part, sums[c].y += w.y * part, sums[c].z += w.z * part;
    }
  });
  Sums total(lobes.size());
  for (const Sums& s : sums) {
    total.shares += s.shares, total.x += s.x, total.y += s.y, total.z += s.z;
    total.likelihood += s.likelihood;
  }
  const double power = total.shares.sum();
  for (std::size_t k = 0; k < lobes.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const double length = std::sqrt(total.x(i) * total.x(i) + total.y(i) * total.y(i) + total.z(i) * total.z(i));
    lobes[k].share = total.shares(i) / power;
    if (!(length > 0 && total.shares(i) > 0)) continue;
    lobes[k].axis = {static_cast<float>(total.x(i) / length), static_cast<float>(total.y(i) / length),
                     static_cast<float>(total.z(i) / length)};
    const float norm = std::sqrt(dot(lobes[k].axis, lobes[k].axis));
    lobes[k].axis = (1 / norm) * lobes[k].axis;
    // The sharpness whose lobe has this mean length (Banerjee et al. 2005).
    const double r = std::min(length / total.shares(i), 1 - 1e-9);
    lobes[k].sharpness = std::clamp(r * (3 - r * r) / (1 - r * r), double{kLeastSharpness}, most_sharpness);
  }
  return total.likelihood;
}

std::vector<Lobe> bestLobes(const std::vector<Pixel>& pixels, const GaussianFitOptions& options, double most_sharpness) {
  std::vector<Lobe> best;
  double greatest = 0;
  for (int start = 0; start < kStarts; ++start) {
    std::vector<Lobe> lobes =
        startLobes(pixels, options.lobes, most_sharpness, options.seed * kStarts + static_cast<std::uint64_t>(start));
    double likelihood = 0;
    for (int round = 0; round < kStartRounds; ++round) likelihood = improve(pixels, most_sharpness, lobes);
    if (start > 0 && !(likelihood > greatest)) continue;
    greatest = likelihood, best = std::move(lobes);
  }
  for (int round = kStartRounds; round < options.rounds; ++round) improve(pixels, most_sharpness, best);
  std::erase_if(best, [](const Lobe& lobe) { return !(lobe.share > 0); });
  return best;
}

/// Values of lobes of amplitude 1 as means over pixels: those at the middles of pixels, scaled so that the light of a lobe is its
/// integral, however few pixels it covers; [pixels][lobes].
Eigen::MatrixXd valuesOf(const std::vector<Pixel>& pixels, const std::vector<Lobe>& lobes) {
  Eigen::MatrixXd values(static_cast<Eigen::Index>(pixels.size()), static_cast<Eigen::Index>(lobes.size()));
  for (Eigen::Index k = 0; k < values.cols(); ++k) {
    const Lobe& lobe = lobes[static_cast<std::size_t>(k)];
    const SphericalGaussian unit = {lobe.axis, static_cast<float>(lobe.sharpness), {}};
    double light = 0;
    for (Eigen::Index p = 0; p < values.rows(); ++p) {
      const Pixel& pixel = pixels[static_cast<std::size_t>(p)];
      values(p, k) = valueOf(unit, pixel.direction);
      light += pixel.solid_angle * values(p, k);
    }
    if (light > 0) values.col(k) *= double{integralOf(unit)} / light;
  }
  return values;
}

/// The amplitudes of the least squared error that are not negative, by multiplicative steps (Lee and Seung 2001); [lobes][3].
Eigen::MatrixXd amplitudesOf(const std::vector<Pixel>& pixels, const std::vector<Lobe>& lobes, const Eigen::MatrixXd& values) {
  const auto count = static_cast<Eigen::Index>(lobes.size());
  Eigen::VectorXd solid(values.rows());
  Eigen::MatrixXd light(values.rows(), 3);
  for (Eigen::Index p = 0; p < values.rows(); ++p) {
    const Pixel& pixel = pixels[static_cast<std::size_t>(p)];
    solid(p) = pixel.solid_angle;
    for (Eigen::Index c = 0; c < 3; ++c) light(p, c) = pixel.rgb[c];
  }
  const Eigen::MatrixXd weighed = solid.asDiagonal() * values;
  const Eigen::MatrixXd normal = values.transpose() * weighed, wanted = weighed.transpose() * light;
  Eigen::MatrixXd amplitudes(count, 3);
  const Eigen::RowVectorXd flux = solid.transpose() * light, of_lobes = solid.transpose() * values;
  for (Eigen::Index k = 0; k < count; ++k)
    amplitudes.row(k) = lobes[static_cast<std::size_t>(k)].share / std::max(1e-30, of_lobes(k)) * flux;
  for (int step = 0; step < kSteps; ++step)
    amplitudes = (amplitudes.array() * wanted.array() / (normal * amplitudes).array().max(1e-300)).matrix();
  // Keep the light of each colour.
  for (Eigen::Index c = 0; c < 3; ++c) {
    const double given = of_lobes * amplitudes.col(c);
    if (given > 0) amplitudes.col(c) *= flux(c) / given;
  }
  return amplitudes;
}

void check(const GaussianFitOptions& o) {
  const auto require = [](bool holds, const char* parameter, const char* range) {
    if (!holds)
      throw Error(ErrorCode::usage, "light.range", "", parameter, std::string("is not ") + range, "see the help text");
  };
  require(o.lobes >= 1 && o.lobes <= kMostGaussians, "--gaussians", "1 to 256");
  require(o.height >= 8 && o.height <= 1024, "height", "8 to 1024");
  require(o.rounds >= 1 && o.rounds <= 10000, "rounds", "1 to 10000");
}

}  // namespace

GaussianFit fitGaussians(const Environment& environment, const GaussianFitOptions& options) {
  check(options);
  requireUsable(environment);
  const int block = blockOf(environment, options.height);
  const std::vector<Pixel> pixels = pixelsOf(environment, block);
  if (std::none_of(pixels.begin(), pixels.end(), [](const Pixel& p) { return p.power > 0; }))
    throw Error(ErrorCode::invalid_input, "light.black", "", "environment", "has no light", "give an environment with light");
  // A lobe as wide as a pixel: 12 over the square of its side.
  const double side = std::numbers::pi * block / environment.height, most_sharpness = 12 / (side * side);
  const std::vector<Lobe> lobes = bestLobes(pixels, options, most_sharpness);
  const Eigen::MatrixXd values = valuesOf(pixels, lobes);
  const Eigen::MatrixXd amplitudes = amplitudesOf(pixels, lobes, values), fitted = values * amplitudes;
  GaussianFit fit;
  double difference = 0, norm = 0;
  for (Eigen::Index p = 0; p < fitted.rows(); ++p) {
    const Pixel& pixel = pixels[static_cast<std::size_t>(p)];
    for (Eigen::Index c = 0; c < 3; ++c) {
      difference += pixel.solid_angle * std::pow(fitted(p, c) - pixel.rgb[c], 2);
      norm += pixel.solid_angle * std::pow(pixel.rgb[c], 2);
    }
  }
  fit.error = std::sqrt(difference / norm);
  for (std::size_t k = 0; k < lobes.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    fit.lobes.push_back(
        {lobes[k].axis,
         static_cast<float>(lobes[k].sharpness),
         {static_cast<float>(amplitudes(i, 0)), static_cast<float>(amplitudes(i, 1)), static_cast<float>(amplitudes(i, 2))}});
  }
  std::stable_sort(fit.lobes.begin(), fit.lobes.end(), [](const SphericalGaussian& a, const SphericalGaussian& b) {
    return integralOf(a) * luminance(a.amplitude) > integralOf(b) * luminance(b.amplitude);
  });
  return fit;
}

}  // namespace glint::bake
