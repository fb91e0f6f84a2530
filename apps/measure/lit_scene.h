#pragma once

#include <cmath>
#include <cstdint>
#include <optional>

#include "glint/math/vec.h"

/// Surfaces in front of a camera. World: x right, y away from the eye, z up; one unit is the width of the map. So a camera that
/// moves away sees more of the map in each pixel.
namespace glint::apps::lit {

constexpr float kRadiansPerDegree = 0.0174532925f;

inline Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline Vec3 normalized(Vec3 a) { return (1 / std::sqrt(dot(a, a))) * a; }

/// A point that a ray sees.
struct Hit {
  float distance = 0;  ///< along the ray
  Vec3 position, normal;
  Vec2 uv;
  Vec3 dpdu, dpdv;  ///< change of the position with uv
};

/// A ray, and the change of its unit direction from one pixel to the next.
struct Ray {
  Vec3 origin, direction, dx, dy;
};

/// Change of the position on the tangent plane of a hit for a change of the ray's direction.
inline Vec3 stepOnSurface(const Ray& ray, const Hit& hit, Vec3 turn) {
  const float slide = dot(turn, hit.normal) / dot(ray.direction, hit.normal);
  return hit.distance * (turn - slide * ray.direction);
}

/// A square on the plane z = 0 around the origin; uv is (x, y).
struct Quad {
  float half_side;

  std::optional<Hit> intersect(const Ray& ray) const {
    if (!(ray.direction.z < 0)) return {};
    const float distance = -ray.origin.z / ray.direction.z;
    const Vec3 p = ray.origin + distance * ray.direction;
    if (std::fabs(p.x) > half_side || std::fabs(p.y) > half_side) return {};
    return Hit{distance, p, {0, 0, 1}, {p.x, p.y}, {1, 0, 0}, {0, 1, 0}};
  }
};

/// A ball. u is the arc from the middle towards +x, v the arc round the x axis: uv has the scale of the world along u
/// everywhere, and along v on the great circle x = 0.
struct Sphere {
  Vec3 centre;
  float radius;

  std::optional<Hit> intersect(const Ray& ray) const {
    const Vec3 from = ray.origin - centre;
    const float b = dot(from, ray.direction);
    const Vec3 nearest = from - b * ray.direction;  // precise where the eye is far
    const float inside = radius * radius - dot(nearest, nearest);
    if (!(inside > 0)) return {};
    const float distance = -b - std::sqrt(inside);
    const Vec3 n = normalized(from + distance * ray.direction);
    const float latitude = std::asin(n.x), longitude = std::atan2(n.y, n.z);
    const Vec3 dpdu = {std::cos(latitude), -n.x * std::sin(longitude), -n.x * std::cos(longitude)};
    const Vec3 dpdv = {0, n.z, -n.y};
    return Hit{distance, centre + radius * n, n, {radius * latitude, radius * longitude}, dpdu, dpdv};
  }
};

/// A pinhole camera that looks at the origin from the front and above. All sizes of the scene grow with the distance, so that
/// surfaces fill the picture alike at every distance, and only the texels of a pixel become more.
class Camera {
 public:
  /// @param distance  from the origin, map widths, > 0
  /// @param size      of the square picture, pixels
  Camera(float distance, int size) : size_(size) {
    const float elevation = kElevation * kRadiansPerDegree;
    const Vec3 back = {0, -std::cos(elevation), std::sin(elevation)};
    origin_ = distance * back;
    forward_ = -1.0f * back;
    up_ = cross({1, 0, 0}, forward_);
    pixel_ = 2 * std::tan(0.5f * kFieldOfView * kRadiansPerDegree) / static_cast<float>(size);
  }

  /// @param x, y  in pixels, from the left and from the top of the picture
  Ray ray(float x, float y) const {
    const float middle = 0.5f * static_cast<float>(size_);
    const Vec3 to = forward_ + (pixel_ * (x - middle)) * Vec3{1, 0, 0} + (pixel_ * (middle - y)) * up_;
    const float scale = 1 / std::sqrt(dot(to, to));
    const Vec3 direction = scale * to;
    const auto turn = [&](Vec3 step) { return scale * (step - dot(step, direction) * direction); };
    return {origin_, direction, turn({pixel_, 0, 0}), turn(-pixel_ * up_)};
  }

 private:
  static constexpr float kElevation = 45;    // degrees
  static constexpr float kFieldOfView = 35;  // degrees

  int size_;
  float pixel_;
  Vec3 origin_, forward_, up_;
};

/// The square that fills the picture of a camera at a distance.
inline Quad quadSeenFrom(float distance) { return {0.32f * distance}; }
/// The ball that fills the picture of a camera at a distance.
inline Sphere sphereSeenFrom(float distance) { return {{}, 0.26f * distance}; }

enum class Shape : std::uint8_t { quad, sphere };

/// A square or a ball.
class Scene {
 public:
  Scene(Shape shape, float distance) : shape_(shape), quad_(quadSeenFrom(distance)), sphere_(sphereSeenFrom(distance)) {}

  /// The nearest point of a ray.
  std::optional<Hit> intersect(const Ray& ray) const {
    return shape_ == Shape::sphere ? sphere_.intersect(ray) : quad_.intersect(ray);
  }

 private:
  Shape shape_;
  Quad quad_;
  Sphere sphere_;
};

}  // namespace glint::apps::lit
