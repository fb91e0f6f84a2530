#include "measure/lit_picture.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "common/base64.h"
#include "glint/math/half.h"
#include "glint/model/slope_sums.h"
#include "glint/query/brdf/microfacet_brdf.h"
#include "glint/query/ray_footprint.h"
#include "measure/grey_flip.h"
#include "measure/normal_search.h"
#include "measure/workload.h"

namespace glint::apps {
namespace {

/// Towards the light: behind the surface and above, so that the middle of the plane mirrors it to the eye.
constexpr Vec3 kToLight = {0.06f, 0.705f, 0.7067f};

/// Radiance that counts as dark: far below a diffuse surface's .32 under the same light. Keeps errors of black pictures finite.
constexpr double kDark = 1e-3;

/// What a pixel sees; nothing where there is no surface.
std::optional<LitPixel> litPixel(const NormalMap& map, const SmithMasking& masking, const lit::Scene& scene,
                                 const lit::Ray& ray) {
  const std::optional<lit::Hit> hit = scene.intersect(ray);
  if (!hit) return {};
  const Vec3 s = lit::normalized(hit->dpdu), t = lit::cross(hit->normal, s);
  const auto local = [&](Vec3 w) { return Vec3{dot(w, s), dot(w, t), dot(w, hit->normal)}; };
  LitPixel pixel;
  const Vec2 middle = {0.5f, 0.5f};  // the middle of the map is in the middle of the picture
  pixel.footprint = footprintFromDifferentials(
      hit->uv + middle, uvDifferential(hit->dpdu, hit->dpdv, lit::stepOnSurface(ray, *hit, ray.dx)),
      uvDifferential(hit->dpdu, hit->dpdv, lit::stepOnSurface(ray, *hit, ray.dy)), map.width, map.height);
  const Vec3 wo = local(-1.0f * ray.direction), wi = local(lit::normalized(kToLight));
  if (!aboveHorizon(wo) || !aboveHorizon(wi)) return pixel;
  pixel.half = halfVectorOf(wi, wo).disk;
  pixel.response = masking.visibility(wi, wo) * wi.z;
  return pixel;
}

/// Radiance of all pixels, whose densities are answered by ask(footprint, half); nothing if that takes longer than `budget_s` seconds.
template <class Ask>
std::optional<std::vector<float>> radianceOf(const std::vector<LitPixel>& pixels, const Ask& ask, double budget_s) {
  using Clock = std::chrono::steady_clock;
  const Clock::time_point start = Clock::now();
  std::atomic<bool> late = false;
  std::vector<float> radiance(pixels.size());
  tbb::parallel_for(std::size_t{0}, pixels.size(), [&](std::size_t k) {
    const LitPixel& pixel = pixels[k];
    if (!(pixel.response > 0) || late) return;
    radiance[k] = pixel.response * ask(pixel.footprint, pixel.half);
    if (std::chrono::duration<double>(Clock::now() - start).count() > budget_s) late = true;
  });
  if (late) return {};
  return radiance;
}

/// Half-precision numbers, little-endian, as base64.
std::string packed(const std::vector<float>& radiance) {
  std::string bytes;
  for (const float value : radiance) {
    const std::uint16_t half = floatToHalf(value);
    bytes.push_back(static_cast<char>(half & 0xff));
    bytes.push_back(static_cast<char>(half >> 8));
  }
  return base64(bytes);
}

}  // namespace

std::string_view sceneName(lit::Shape shape) { return shape == lit::Shape::quad ? "plane" : "sphere"; }

std::vector<LitPixel> litPixels(const NormalMap& map, lit::Shape shape, float sigma_texels, int size) {
  const SmithMasking masking(slopesOf(map), kBenchSigmaR);
  // Footprints are as wide as the camera is far away.
  const auto middle = 0.5f * static_cast<float>(size);
  const LitPixel near = *litPixel(map, masking, lit::Scene(shape, 1), lit::Camera(1, size).ray(middle, middle));
  const Covariance& c = near.footprint.covariance;
  const float distance = sigma_texels / std::sqrt(std::sqrt(c.xx * c.yy - c.xy * c.xy));
  const lit::Scene scene(shape, distance);
  const lit::Camera camera(distance, size);
  std::vector<LitPixel> pixels;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      pixels.push_back(litPixel(map, masking, scene, camera.ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f))
                           .value_or(LitPixel{}));
  return pixels;
}

double screenWhite(std::vector<float> radiance) {
  constexpr double kClipped = 0.2;  // of the light, at most
  std::sort(radiance.begin(), radiance.end(), std::greater<>());
  double all = 0, brighter = 0;
  for (const float value : radiance) all += double{value};
  for (const float value : radiance) {
    brighter += double{value};
    if (brighter > kClipped * all) return std::max(kDark, double{value});
  }
  return kDark;
}

LitTruth::LitTruth(const NormalMap& map, const NormalSearch& search, lit::Shape shape, float sigma_texels, int size)
    : shape_(shape), sigma_texels_(sigma_texels), size_(size), pixels_(litPixels(map, shape, sigma_texels, size)) {
  radiance_ = *radianceOf(
      pixels_, [&](const Footprint& p, Vec2 h) { return search.density(p, h); }, std::numeric_limits<double>::infinity());
  white_ = screenWhite(radiance_);
}

std::vector<float> LitTruth::shown(const std::vector<float>& radiance) const {
  std::vector<float> screen;
  for (const float value : radiance) screen.push_back(std::clamp(value / static_cast<float>(white_), 0.0f, 1.0f));
  return screen;
}

nlohmann::json LitTruth::json() const {
  return {{"scene", sceneName(shape_)},
          {"sigma_texels", sigma_texels_},
          {"pixels", size_},
          {"white", white_},
          {"black_flip", greyFlip(shown(radiance_), std::vector<float>(radiance_.size()), size_, size_)},
          {"picture", packed(radiance_)}};
}

nlohmann::json LitTruth::errorsOf(const Density& density, bool as_asked, double budget_s) const {
  nlohmann::json errors = {{"scene", sceneName(shape_)}, {"sigma_texels", sigma_texels_}, {"as_asked", as_asked}};
  const std::optional<std::vector<float>> radiance = radianceOf(pixels_, density, budget_s);
  if (!radiance) {
    errors["given_up_s"] = budget_s;
    return errors;
  }
  double squares = 0, truths = kDark * kDark;
  for (std::size_t k = 0; k < radiance->size(); ++k) {
    const double right = double{radiance_[k]}, error = double{(*radiance)[k]} - right;
    squares += error * error, truths += right * right;
  }
  errors["rmse"] = std::sqrt(squares / truths);
  errors["flip"] = greyFlip(shown(radiance_), shown(*radiance), size_, size_);
  errors["picture"] = packed(*radiance);
  return errors;
}

std::vector<LitTruth> litTruths(const NormalMap& map, const std::vector<float>& sizes, int pixels) {
  const NormalSearch search(map, kBenchSigmaR);
  std::vector<LitTruth> truths;
  for (const lit::Shape shape : {lit::Shape::quad, lit::Shape::sphere})
    for (const float sigma : sizes) truths.emplace_back(map, search, shape, sigma, pixels);
  return truths;
}

}  // namespace glint::apps
