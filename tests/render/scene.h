#pragma once

#include "measure/lit_scene.h"

/// The scene of the pictures of glint-bench, by short names.
namespace render {

using glint::dot;
using glint::Vec2;
using glint::Vec3;
using glint::apps::Camera;
using glint::apps::cross;
using glint::apps::Hit;
using glint::apps::kRadiansPerDegree;
using glint::apps::normalized;
using glint::apps::Quad;
using glint::apps::Ray;
using glint::apps::Scene;
using glint::apps::Shape;
using glint::apps::Sphere;
using glint::apps::stepOnSurface;

}  // namespace render
