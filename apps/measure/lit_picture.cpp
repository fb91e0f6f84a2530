#include "measure/lit_picture.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
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

/// Radiance of all pixels, whose densities are answered by ask(footprint, half).
template <class Ask>
std::vector<float> radianceOf(const std::vector<LitPixel>& pixels, const Ask& ask) {
  std::vector<float> radiance(pixels.size());
  tbb::parallel_for(std::size_t{0}, pixels.size(), [&](std::size_t k) {
    const LitPixel& pixel = pixels[k];
    if (pixel.response > 0) radiance[k] = pixel.response * ask(pixel.footprint, pixel.half);
  });
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

LitTruth::LitTruth(const NormalMap& map, const NormalSearch& truth, lit::Shape shape, float sigma_texels, int size)
    : shape_(shape), sigma_texels_(sigma_texels), size_(size), pixels_(litPixels(map, shape, sigma_texels, size)) {
  radiance_ = radianceOf(pixels_, [&](const Footprint& p, Vec2 h) { return truth.density(p, h); });
}

double LitTruth::brightRadiance() const {
  constexpr double kBright = 0.98;
  std::vector<float> lit;
  for (std::size_t k = 0; k < pixels_.size(); ++k)
    if (pixels_[k].response > 0) lit.push_back(radiance_[k]);
  if (lit.empty()) return 0;
  const auto bright = lit.begin() + static_cast<std::ptrdiff_t>(kBright * static_cast<double>(lit.size() - 1));
  std::nth_element(lit.begin(), bright, lit.end());
  return double{*bright};
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
          {"picture", packed(radiance_)}};
}

nlohmann::json LitTruth::errorsOf(const api::OpenedNdf& ndf) const {
  const std::vector<float> radiance =
      radianceOf(pixels_, [&](const Footprint& p, Vec2 h) { return ndf.model().density(p, h); });
  double squares = 0, truths = kDark * kDark;
  for (std::size_t k = 0; k < radiance.size(); ++k) {
    const double right = double{radiance_[k]}, error = double{radiance[k]} - right;
    squares += error * error, truths += right * right;
  }
  return {{"scene", sceneName(shape_)},
          {"sigma_texels", sigma_texels_},
          {"as_asked", ndf.info().shapes.gaussians},
          {"rmse", std::sqrt(squares / truths)},
          {"flip", greyFlip(shown(radiance_), shown(radiance), size_, size_)},
          {"picture", packed(radiance)}};
}

std::vector<LitTruth> litTruths(const NormalMap& map, const std::vector<float>& sizes, int pixels) {
  const NormalSearch search(map, kBenchSigmaR);
  std::vector<LitTruth> truths;
  for (const lit::Shape shape : {lit::Shape::quad, lit::Shape::sphere}) {
    const std::size_t first = truths.size();
    for (const float sigma : sizes) truths.emplace_back(map, search, shape, sigma, pixels);
    for (std::size_t k = first; k < truths.size(); ++k) truths[k].setWhite(std::max(kDark, truths.back().brightRadiance()));
  }
  return truths;
}

}  // namespace glint::apps
