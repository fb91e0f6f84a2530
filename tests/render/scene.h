#pragma once

#include "measure/lit_scene.h"

/// The scene of the pictures of glint-bench, by short names.
namespace render {

using glint::dot;
using glint::Vec2;
using glint::Vec3;
using glint::apps::lit::Camera;
using glint::apps::lit::cross;
using glint::apps::lit::Hit;
using glint::apps::lit::kRadiansPerDegree;
using glint::apps::lit::normalized;
using glint::apps::lit::Quad;
using glint::apps::lit::Ray;
using glint::apps::lit::Scene;
using glint::apps::lit::Shape;
using glint::apps::lit::Sphere;
using glint::apps::lit::stepOnSurface;

}  // namespace render
