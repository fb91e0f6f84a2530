#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "glint/bake/sh/environment.h"
#include "glint/model/error.h"

namespace glint::bake {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr int kMaxHeight = 4096;
constexpr int kMaxSamples = 64;

Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

/// The nearest light that a ray from the origin hits.
struct Hit {
  float distance = kFar;
  float radiance[3] = {0, 0, 0};
};

void setRadiance(Hit& hit, const float radiance[3], const float* texel) {
  for (int c = 0; c < 3; ++c) hit.radiance[c] = radiance[c] * (texel ? texel[c] : 1);
}

void intersect(const RectangleLight& light, Vec3 direction, Hit& hit) {
  const Vec3 normal = cross(light.axis_u, light.axis_v);
  const float facing = dot(normal, direction);
  if (!(facing < 0)) return;
  const float distance = dot(normal, light.centre) / facing;
  if (!(distance > 0 && distance < hit.distance)) return;
  const Vec3 offset = distance * direction - light.centre;
  // Coordinates along the two axes, which need not be orthogonal.
  const float area = dot(normal, normal);
  const float u = dot(cross(offset, light.axis_v), normal) / area, v = dot(cross(light.axis_u, offset), normal) / area;
  if (!(std::fabs(u) <= 1 && std::fabs(v) <= 1)) return;
  hit.distance = distance;
  const int w = light.texture_width, h = light.texture_height;
  const float* texel = nullptr;
  if (w > 0) {
    const int i = std::min(static_cast<int>((u + 1) / 2 * static_cast<float>(w)), w - 1);
    const int j = std::min(static_cast<int>((v + 1) / 2 * static_cast<float>(h)), h - 1);
    texel = &light.texture[(static_cast<std::size_t>(j) * w + i) * 3];
  }
  setRadiance(hit, light.radiance, texel);
}

void intersect(const SphereLight& light, Vec3 direction, Hit& hit) {
  const float along = dot(direction, light.centre);
  const float inside = light.radius * light.radius - dot(light.centre, light.centre) + along * along;
  if (!(inside >= 0)) return;
  const float distance = along - std::sqrt(inside);
  if (!(distance > 0 && distance < hit.distance)) return;
  hit.distance = distance;
  const float* texel = nullptr;
  if (light.texture_width > 0) {
    const Vec3 n = distance * direction - light.centre;
    const float theta = std::acos(std::clamp(n.z / light.radius, -1.0f, 1.0f));
    float phi = std::atan2(n.y, n.x);
    if (phi < 0) phi += 2 * std::numbers::pi_v<float>;
    const int w = light.texture_width, h = light.texture_height;
    const int i = std::min(static_cast<int>(phi / (2 * std::numbers::pi_v<float>)*static_cast<float>(w)), w - 1);
    const int j = std::clamp(static_cast<int>((1 - theta / std::numbers::pi_v<float>)*static_cast<float>(h)), 0, h - 1);
    texel = &light.texture[(static_cast<std::size_t>(j) * w + i) * 3];
  }
  setRadiance(hit, light.radiance, texel);
}

void require(bool valid, const std::string& object, const char* what) {
  if (!valid) throw Error(ErrorCode::invalid_input, "light.shape", {}, object, what, "correct the light");
}

template <class Light>
void requireRadiance(const Light& light, const std::string& object) {
  for (const float r : light.radiance)
    require(std::isfinite(r) && r >= 0, object, "has a radiance that is negative or not finite");
  require(light.texture_width >= 0 && light.texture_height >= 0 &&
              light.texture.size() == 3 * static_cast<std::size_t>(light.texture_width) * light.texture_height,
          object, "has a texture of another size than it says");
  for (const float t : light.texture)
    require(std::isfinite(t) && t >= 0, object, "has a texture with negative pixels or pixels that are not finite");
}

void requireValid(std::span<const RectangleLight> rectangles, std::span<const SphereLight> spheres) {
  for (std::size_t k = 0; k < rectangles.size(); ++k) {
    const std::string object = "rectangle " + std::to_string(k);
    const Vec3 n = cross(rectangles[k].axis_u, rectangles[k].axis_v);
    require(std::isfinite(dot(n, n)) && dot(n, n) > 0, object, "has no area");
    require(std::isfinite(dot(rectangles[k].centre, rectangles[k].centre)), object, "has a centre that is not finite");
    requireRadiance(rectangles[k], object);
  }
  for (std::size_t k = 0; k < spheres.size(); ++k) {
    const std::string object = "sphere " + std::to_string(k);
    const float r = spheres[k].radius, distance2 = dot(spheres[k].centre, spheres[k].centre);
    require(std::isfinite(r) && r > 0 && std::isfinite(r * r), object, "has a radius that is not positive");
    require(std::isfinite(distance2) && distance2 > r * r, object, "is around the shading point");
    requireRadiance(spheres[k], object);
  }
}

}  // namespace

bool facesOrigin(const RectangleLight& light) { return dot(cross(light.axis_u, light.axis_v), light.centre) < 0; }

Environment renderAreaLights(std::span<const RectangleLight> rectangles, std::span<const SphereLight> spheres, int height,
                             int samples) {
  if (height < 1 || height > kMaxHeight || samples < 1 || samples > kMaxSamples)
    throw Error(ErrorCode::usage, "light.resolution", {}, {}, "a height of 1 to 4096 and 1 to 64 samples are possible");
  constexpr double kMostRays = 1 << 29;  // take about half a minute
  const double rays = 2.0 * height * height * samples * samples;
  if (rays > kMostRays)
    throw Error(ErrorCode::usage, "light.resolution", {}, {}, fmt::format("{:.2g} rays are too many to draw lights with", rays),
                fmt::format("give --area-samples of at most {} with this --area-height",
                            static_cast<int>(std::sqrt(kMostRays / 2) / height)));
  requireValid(rectangles, spheres);
  Environment environment;
  environment.width = 2 * height;
  environment.height = height;
  environment.rgb.resize(static_cast<std::size_t>(environment.width) * height * 3);
  constexpr double kPi = std::numbers::pi;
  tbb::parallel_for(0, height, [&](int j) {
    for (int i = 0; i < environment.width; ++i) {
      double sums[3] = {0, 0, 0};
      for (int s = 0; s < samples * samples; ++s) {
        // Rows of samples have equal shares of the pixel's solid angle: equal steps of cos(theta).
        const double low = std::cos(kPi * (1 - static_cast<double>(j) / height));
        const double high = std::cos(kPi * (1 - static_cast<double>(j + 1) / height));
        const double z = low + (high - low) * (s / samples + 0.5) / samples;
        const double phi = 2 * kPi * (i + (s % samples + 0.5) / samples) / environment.width;
        const double sine = std::sqrt(std::max(0.0, 1 - z * z));
        const Vec3 direction = {static_cast<float>(sine * std::cos(phi)), static_cast<float>(sine * std::sin(phi)),
                                static_cast<float>(z)};
        Hit hit;
        for (const RectangleLight& light : rectangles) intersect(light, direction, hit);
        for (const SphereLight& light : spheres) intersect(light, direction, hit);
        for (int c = 0; c < 3; ++c) sums[c] += hit.radiance[c];
      }
      float* pixel = &environment.rgb[(static_cast<std::size_t>(j) * environment.width + i) * 3];
      for (int c = 0; c < 3; ++c) pixel[c] = static_cast<float>(sums[c] / (samples * samples));
    }
  });
  return environment;
}

}  // namespace glint::bake
