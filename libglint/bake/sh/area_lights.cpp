#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

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

/// Texel of a sphere at a normal of unit length; null without a texture.
const float* texelOf(const SphereLight& light, Vec3 n) {
  if (light.texture_width == 0) return nullptr;
  const float theta = std::acos(std::clamp(n.z, -1.0f, 1.0f));
  float phi = std::atan2(n.y, n.x);
  if (phi < 0) phi += 2 * std::numbers::pi_v<float>;
  const int w = light.texture_width, h = light.texture_height;
  const int i = std::min(static_cast<int>(phi / (2 * std::numbers::pi_v<float>)*static_cast<float>(w)), w - 1);
  const int j = std::clamp(static_cast<int>((1 - theta / std::numbers::pi_v<float>)*static_cast<float>(h)), 0, h - 1);
  return &light.texture[(static_cast<std::size_t>(j) * w + i) * 3];
}

void intersect(const SphereLight& light, Vec3 direction, Hit& hit) {
  const float along = dot(direction, light.centre);
  const Vec3 across = light.centre - along * direction;
  const float inside = light.radius * light.radius - dot(across, across);
  if (!(inside >= 0)) return;
  const float distance = along - std::sqrt(inside);
  if (!(distance > 0 && distance < hit.distance)) return;
  hit.distance = distance;
  setRadiance(hit, light.radiance, texelOf(light, 1 / light.radius * (distance * direction - light.centre)));
}

/// Solid angle of a pixel of an environment.
double pixelSolidAngle(int height, int row) {
  const double step = std::numbers::pi / height;
  return step * (std::cos(std::numbers::pi - step * (row + 1)) - std::cos(std::numbers::pi - step * row));
}

/// A light is drawn from its own points where fewer rays than this lie across it.
constexpr double kFewRays = 24;

double angleBetween(Vec3 a, Vec3 b) {
  const Vec3 normal = cross(a, b);
  return std::atan2(std::sqrt(double{dot(normal, normal)}), double{dot(a, b)});
}

/// Angles that a light spans, radians.
struct Extent {
  double u, v;
  double least() const { return std::min(u, v); }
};

Extent extentOf(const RectangleLight& light) {
  return {angleBetween(light.centre - light.axis_u, light.centre + light.axis_u),
          angleBetween(light.centre - light.axis_v, light.centre + light.axis_v)};
}

double sineOf(const SphereLight& light) { return light.radius / std::sqrt(double{dot(light.centre, light.centre)}); }

Extent extentOf(const SphereLight& light) {
  const double width = 2 * std::asin(sineOf(light));
  return {width, width};
}

/// A place of a light as the origin sees it.
struct LightPoint {
  Vec3 direction;      ///< of unit length
  float distance;      ///< less than that of all lights behind
  double solid_angle;  ///< of the part of the light that the point stands for
  Hit own;             ///< the light's radiance there
};

/// Numbers of parts of a rectangle along its axes, so that parts are at most `spacing` wide as the origin sees them.
struct PartCounts {
  int columns, rows;
};

PartCounts partsOf(const RectangleLight& light, double spacing) {
  constexpr int kPlaces = 16;  // along each axis, among which the nearest is looked for
  constexpr double kFewest = 8, kMost = 1 << 16;
  constexpr std::int64_t kMostParts = 1 << 22;
  double nearest2 = std::numeric_limits<double>::infinity();
  const auto along = [](int k) { return 2 * static_cast<float>(k) / (kPlaces - 1) - 1; };
  for (int j = 0; j < kPlaces; ++j) {
    for (int i = 0; i < kPlaces; ++i) {
      const Vec3 place = light.centre + along(i) * light.axis_u + along(j) * light.axis_v;
      nearest2 = std::min(nearest2, double{dot(place, place)});
    }
  }
  const auto count = [&](Vec3 axis) {
    const double parts = 2 * std::sqrt(dot(axis, axis) / std::max(nearest2, 1e-30)) / spacing;
    return static_cast<int>(std::clamp(std::ceil(parts), kFewest, kMost));
  };
  PartCounts parts = {count(light.axis_u), count(light.axis_v)};
  while (std::int64_t{parts.columns} * parts.rows > kMostParts) (parts.columns > parts.rows ? parts.columns : parts.rows) /= 2;
  return parts;
}

/// Mean of the texels of a part of a rectangle, times its radiance.
Hit meanRadiance(const RectangleLight& light, const PartCounts& parts, int column, int row) {
  Hit own;
  float mean[3] = {1, 1, 1};
  if (const int w = light.texture_width, h = light.texture_height; w > 0) {
    const auto first = [](int part, int count, int texels) { return static_cast<int>(std::int64_t{part} * texels / count); };
    const auto end = [](int part, int count, int texels) {
      return static_cast<int>((std::int64_t{part + 1} * texels + count - 1) / count);
    };
    double sums[3] = {0, 0, 0}, texels = 0;
    for (int j = first(row, parts.rows, h); j < end(row, parts.rows, h); ++j) {
      for (int i = first(column, parts.columns, w); i < end(column, parts.columns, w); ++i, ++texels)
        for (int c = 0; c < 3; ++c) sums[c] += light.texture[(static_cast<std::size_t>(j) * w + i) * 3 + c];
    }
    for (int c = 0; c < 3; ++c) mean[c] = static_cast<float>(sums[c] / texels);
  }
  setRadiance(own, light.radiance, mean);
  return own;
}

/// Calls visit(point) for points all over a light, at most `spacing` apart.
template <class Visit>
void forEachPoint(const RectangleLight& light, double spacing, const Visit& visit) {
  const PartCounts parts = partsOf(light, spacing);
  const Vec3 normal = cross(light.axis_u, light.axis_v);
  for (int j = 0; j < parts.rows; ++j) {
    for (int i = 0; i < parts.columns; ++i) {
      const auto u = static_cast<float>(2 * (i + 0.5) / parts.columns - 1),
                 v = static_cast<float>(2 * (j + 0.5) / parts.rows - 1);
      const Vec3 place = light.centre + u * light.axis_u + v * light.axis_v;
      const double distance = std::sqrt(double{dot(place, place)});
      const double area = -4.0 * dot(normal, place) / (distance * parts.columns * parts.rows);  // as it is seen
      if (area > 0)
        visit({static_cast<float>(1 / distance) * place, static_cast<float>(distance), area / (distance * distance),
               meanRadiance(light, parts, i, j)});
    }
  }
}

template <class Visit>
void forEachPoint(const SphereLight& light, double /*spacing*/, const Visit& visit) {
  constexpr int kRings = 32, kAround = 64;
  const double distance = std::sqrt(double{dot(light.centre, light.centre)}), sine = sineOf(light);
  const double depth = sine * sine / (1 + std::sqrt(1 - sine * sine));  // 1 - cosine, without loss for small lights
  const double solid_angle = 2 * std::numbers::pi * depth / (kRings * kAround);
  const Vec3 axis = static_cast<float>(1 / distance) * light.centre;
  const Vec3 other = std::fabs(axis.z) < 0.9f ? Vec3{0, 0, 1} : Vec3{1, 0, 0};
  const Vec3 sideways = cross(other, axis);
  const Vec3 s = 1 / std::sqrt(dot(sideways, sideways)) * sideways, t = cross(axis, s);
  for (int ring = 0; ring < kRings; ++ring) {
    const double drop = depth * (ring + 0.5) / kRings, radius = std::sqrt(drop * (2 - drop));
    // A small sphere is seen as a disc: of its normals, this part points sideways.
    const double outwards = std::sqrt((ring + 0.5) / kRings), inwards = std::sqrt(1 - outwards * outwards);
    for (int k = 0; k < kAround; ++k) {
      const double phi = 2 * std::numbers::pi * (k + 0.5) / kAround;
      const Vec3 across = static_cast<float>(std::cos(phi)) * s + static_cast<float>(std::sin(phi)) * t;
      const Vec3 normal = static_cast<float>(outwards) * across - static_cast<float>(inwards) * axis;
      Hit own;
      setRadiance(own, light.radiance, texelOf(light, normal));
      visit({static_cast<float>(1 - drop) * axis + static_cast<float>(radius) * across,
             static_cast<float>(distance) - light.radius, solid_angle, own});
    }
  }
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
    require(std::isfinite(distance2), object, "has a centre that is not finite, or too far away");
    require(distance2 > r * r, object, "is around the shading point");
    requireRadiance(spheres[k], object);
  }
}

}  // namespace

bool facesOrigin(const RectangleLight& light) { return dot(cross(light.axis_u, light.axis_v), light.centre) < 0; }

namespace {

/// All lights, and which of them are small: drawn from their own points.
class Lights {
 public:
  Lights(std::span<const RectangleLight> rectangles, std::span<const SphereLight> spheres, double ray_spacing)
      : rectangles_(rectangles), spheres_(spheres) {
    const auto isSmall = [&](const auto& light) { return extentOf(light).least() < kFewRays * ray_spacing; };
    for (const RectangleLight& light : rectangles) small_rectangles_.push_back(isSmall(light));
    for (const SphereLight& light : spheres) small_spheres_.push_back(isSmall(light));
  }

  /// The nearest light in a direction.
  /// @param is_small  whether it is a small one
  Hit nearest(Vec3 direction, bool& is_small) const {
    Hit hit;
    const auto meet = [&](const auto& lights, const std::vector<bool>& small) {
      for (std::size_t k = 0; k < lights.size(); ++k) {
        const float before = hit.distance;
        intersect(lights[k], direction, hit);
        if (hit.distance < before) is_small = small[k];
      }
    };
    meet(rectangles_, small_rectangles_);
    meet(spheres_, small_spheres_);
    return hit;
  }

  /// Calls visit(light) for the small ones.
  template <class Visit>
  void forEachSmall(const Visit& visit) const {
    for (std::size_t k = 0; k < rectangles_.size(); ++k)
      if (small_rectangles_[k]) visit(rectangles_[k]);
    for (std::size_t k = 0; k < spheres_.size(); ++k)
      if (small_spheres_[k]) visit(spheres_[k]);
  }

 private:
  std::span<const RectangleLight> rectangles_;
  std::span<const SphereLight> spheres_;
  std::vector<bool> small_rectangles_, small_spheres_;
};

/// Adds a small light from its own points, where no other light stands before it.
template <class Light>
void addPoints(const Light& light, const Lights& lights, double spacing, Environment& environment) {
  constexpr float kRounding = 1e-4f;  // of distances, so that a light does not hide itself
  forEachPoint(light, spacing, [&](const LightPoint& point) {
    bool is_small = false;
    if (lights.nearest(point.direction, is_small).distance < (1 - kRounding) * point.distance) return;
    const auto pixel = static_cast<std::size_t>(environment.at(point.direction) - environment.rgb.data());
    const auto row = static_cast<int>(pixel / 3 / static_cast<std::size_t>(environment.width));
    const double share = point.solid_angle / pixelSolidAngle(environment.height, row);
    for (std::size_t c = 0; c < 3; ++c) environment.rgb[pixel + c] += static_cast<float>(share * point.own.radiance[c]);
  });
}

}  // namespace

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
  const double ray_spacing = kPi / height / samples;
  const Lights lights(rectangles, spheres, ray_spacing);
  tbb::parallel_for(0, height, [&](int j) {
    for (int i = 0; i < environment.width; ++i) {
      double sums[3] = {0, 0, 0};
      for (int s = 0; s < samples * samples; ++s) {
        // Rows of samples have equal shares of the pixel's solid angle: equal steps of cos(theta).
        const double low = std::cos(kPi * (1 - static_cast<double>(j) / height));
        const double high = std::cos(kPi * (1 - static_cast<double>(j + 1) / height));
        // Neighbours around the axis are shifted against each other: else rings of rays would enter a light near the pole at once.
        constexpr double kGoldenShare = 0.6180339887498949;
        const double shift = std::fmod(kGoldenShare * (i * samples + s % samples), 1.0);
        const double z = low + (high - low) * (s / samples + shift) / samples;
        const double phi = 2 * kPi * (i + (s % samples + 0.5) / samples) / environment.width;
        const double sine = std::sqrt(std::max(0.0, 1 - z * z));
        const Vec3 direction = {static_cast<float>(sine * std::cos(phi)), static_cast<float>(sine * std::sin(phi)),
                                static_cast<float>(z)};
        bool is_small = false;
        const Hit hit = lights.nearest(direction, is_small);
        for (int c = 0; c < 3 && !is_small; ++c) sums[c] += hit.radiance[c];
      }
      float* pixel = &environment.rgb[(static_cast<std::size_t>(j) * environment.width + i) * 3];
      for (int c = 0; c < 3; ++c) pixel[c] = static_cast<float>(sums[c] / (samples * samples));
    }
  });
  lights.forEachSmall([&](const auto& light) { addPoints(light, lights, ray_spacing, environment); });
  return environment;
}

}  // namespace glint::bake
