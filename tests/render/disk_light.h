#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "glint/math/gaussian.h"
#include "glint/math/half_vector.h"
#include "glint/math/tangents.h"
#include "scene.h"

namespace render {

/// A part of a light, seen from a shading point.
struct LightPart {
  glint::Box2 range;    ///< half vectors of the part
  Vec3 wi;              ///< direction to the middle of the part
  glint::HalfVector h;  ///< half vector of the middle
  float share = 0;      ///< solid angle of the range over that of the light; 0 below the horizon
};

/// A disk of constant radiance, far away, of irradiance 1. Its half vectors fill an ellipse of the disk of directions, to first
/// order in the light's diameter. The ellipse is cut into strips along x, and each strip is answered as the box of its area: so a
/// light needs a few means and no random numbers, and is the same light for every model.
class DiskLight {
 public:
  static constexpr int kMostParts = 8;

  /// @param diameter  angle, degrees, > 0
  explicit DiskLight(float diameter) : radius_(0.5f * diameter * kRadiansPerDegree) {
    // Half vectors turn half as much as the light.
    parts_ = std::clamp(static_cast<int>(std::ceil(radius_ / kStripHeight)), 1, int{kMostParts});
  }

  int partCount() const { return parts_; }

  /// @param axis, wo  direction to the light and to the eye, tangent frame, above the horizon
  /// @param out       room for partCount() parts
  /// @return partCount()
  std::size_t parts(Vec3 axis, Vec3 wo, std::span<LightPart> out) const {
    const Vec2 centre = glint::halfVectorOf(axis, wo).disk;
    const glint::Tangents frame = glint::tangentsOf(axis);
    const auto axisOf = [&](Vec3 tangent) {  // of the ellipse
      const Vec3 high = normalized(axis + radius_ * tangent) + wo, low = normalized(axis - radius_ * tangent) + wo;
      const Vec3 a = normalized(high), b = normalized(low);
      return Vec2{0.5f * (a.x - b.x), 0.5f * (a.y - b.y)};
    };
    const Vec2 s = axisOf(frame.s), t = axisOf(frame.t);
    const float height = std::sqrt(s.y * s.y + t.y * t.y), slant = (s.x * s.y + t.x * t.y) / height;
    const float width = std::fabs(s.x * t.y - s.y * t.x) / height;
    for (int k = 0; k < parts_; ++k) {
      LightPart& part = out[static_cast<std::size_t>(k)];
      const float low = height * along(k), high = height * along(k + 1), y = 0.5f * (low + high);
      const float area = glint::kPi * width * height * (shareBelow(along(k + 1)) - shareBelow(along(k)));
      const float half = 0.5f * area / (high - low), x = centre.x + slant * y / height;
      part.range = {{x - half, centre.y + low}, {x + half, centre.y + high}};
      part.h = glint::halfVectorAt({x, centre.y + y}, wo);
      part.wi = glint::reflected(wo, part.h);
      const float solid_angle = part.range.area() * glint::incidentToProjected(1, part.h);
      part.share = part.h.cosine > 0 && glint::aboveHorizon(part.wi) ? solid_angle / (glint::kPi * radius_ * radius_) : 0;
    }
    return static_cast<std::size_t>(parts_);
  }

 private:
  static constexpr float kStripHeight = 0.025f;  // disk units: five deviations of the lobe of a facet

  /// Lower border of a strip, in -1 .. 1.
  float along(int k) const { return -1 + 2 * static_cast<float>(k) / static_cast<float>(parts_); }
  /// Share of a disk's area below a chord.
  static float shareBelow(float y) { return 0.5f + (y * std::sqrt(std::max(0.0f, 1 - y * y)) + std::asin(y)) / glint::kPi; }

  float radius_;
  int parts_;
};

}  // namespace render
