#pragma once

#include <cstdint>
#include <optional>

#include "measure/lit_scene.h"

/// The surfaces of the pictures of glint-bench, by short names, and a ball that lies on the square.
namespace render {

using glint::dot;
using glint::Vec2;
using glint::Vec3;
using glint::apps::lit::Camera;
using glint::apps::lit::cross;
using glint::apps::lit::kRadiansPerDegree;
using glint::apps::lit::normalized;
using glint::apps::lit::Quad;
using glint::apps::lit::Ray;
using glint::apps::lit::Sphere;
using glint::apps::lit::stepOnSurface;

enum class Shape : std::uint8_t { quad, sphere, both };

/// A point that a ray sees.
struct Hit : glint::apps::lit::Hit {
  float curvature = 0;  ///< turn of the normal for a step on the surface, radians for each unit
};

/// A ball on a square, or one of them.
class Scene {
 public:
  Scene(Shape shape, float distance)
      : shape_(shape),
        quad_(glint::apps::lit::quadSeenFrom(distance)),
        sphere_(shape == Shape::sphere ? glint::apps::lit::sphereSeenFrom(distance)
                                       : Sphere{distance * kBeside, distance * kRadius}) {}

  /// The nearest point of a ray.
  std::optional<Hit> intersect(const Ray& ray) const {
    if (shape_ != Shape::quad)
      if (const auto hit = sphere_.intersect(ray)) return Hit{*hit, 1 / sphere_.radius};  // nothing is in front of the ball
    if (shape_ != Shape::sphere)
      if (const auto hit = quad_.intersect(ray)) return Hit{*hit, 0};
    return {};
  }

 private:
  static constexpr float kRadius = 0.13f;
  static constexpr Vec3 kBeside = {-0.15f, 0.05f, kRadius};

  Shape shape_;
  Quad quad_;
  Sphere sphere_;
};

}  // namespace render
