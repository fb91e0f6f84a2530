#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/footprint.h"

namespace glint {

/// Deviation of the pixel filter that `footprintFromDifferentials` assumes, in pixels: the usual Gaussian filter of renderers.
inline constexpr float kPixelFilterSigma = 0.5f;
/// Deviation of the pixel filter for one of several jittered samples of a pixel, pixels: 0.5 / sqrt(samples), the part of the pixel
/// that the sample stands for. The filter that the renderer weighs samples by does the rest. A whole pixel's footprint at every
/// jittered sample would filter twice.
/// @param samples  of a pixel, 1 at least
inline GLINT_HD float sampleFilterSigma(int samples) {
  return kPixelFilterSigma / std::sqrt(static_cast<float>(std::max(1, samples)));
}
/// Half axes are cut to this length (texels), so that their squares are finite.
inline constexpr float kLongestAxis = 1e15f;

/// A vector of texels with finite components, at most kLongestAxis each; components that are NaN become 0.
inline GLINT_HD Vec2 finiteAxis(Vec2 a) {
  const auto finite = [](float x) { return x == x ? std::clamp(x, -kLongestAxis, float{kLongestAxis}) : 0.0f; };
  return {finite(a.x), finite(a.y)};
}

/// The Gaussian footprint of a pixel from a renderer's ray differentials.
///
/// Its covariance is filter_sigma^2 (a a^T + b b^T), where a and b are the steps in texels from a pixel to its neighbour along
/// x and along y: the image of a round pixel filter in texture space. NaN counts as 0, infinite lengths as kLongestAxis, and a
/// footprint without extent as the narrowest. So every input gives a footprint that every model answers.
/// @param uv             centre; the texture is periodic. wrappedUv makes it of doubles, which positions far out need
/// @param duvdx, duvdy   change of uv from one pixel to the next
/// @param width, height  of the map, texels
/// @param filter_sigma   deviation of the pixel filter, pixels
inline GLINT_HD Footprint footprintFromDifferentials(Vec2 uv, Vec2 duvdx, Vec2 duvdy, int width, int height,
                                                     float filter_sigma = kPixelFilterSigma) {
  const float to_x = filter_sigma * static_cast<float>(width), to_y = filter_sigma * static_cast<float>(height);
  const Vec2 a = finiteAxis({to_x * duvdx.x, to_y * duvdx.y}), b = finiteAxis({to_x * duvdy.x, to_y * duvdy.y});
  return Footprint::gaussian(uv, {a.x * a.x + b.x * b.x, a.x * a.y + b.x * b.y, a.y * a.y + b.y * b.y});
}

/// Change of uv for a step on the surface, by least squares: for renderers that have only dp/du and dp/dv.
/// @param dpdu, dpdv  derivatives of the position, any units
/// @param step        on the tangent plane, e.g. dp/dx of a ray differential, same units
/// @return 0 where dpdu and dpdv are parallel, 0 or not finite
inline GLINT_HD Vec2 uvDifferential(Vec3 dpdu, Vec3 dpdv, Vec3 step) {
  const float uu = dot(dpdu, dpdu), uv = dot(dpdu, dpdv), vv = dot(dpdv, dpdv);
  const float determinant = uu * vv - uv * uv;
  constexpr float kParallel = 1e-6f;  // squared sine of the smallest angle between dpdu and dpdv that floats distinguish from 0
  if (!(determinant > kParallel * uu * vv)) return {};
  const float su = dot(dpdu, step), sv = dot(dpdv, step);
  const Vec2 d = {(vv * su - uv * sv) / determinant, (uu * sv - uv * su) / determinant};
  return std::isfinite(d.x) && std::isfinite(d.y) ? d : Vec2{};
}

/// The width of a path as a Gaussian beam, for indirect bounces, which have no ray differentials (Deng 2022, section 5.3). The
/// filter of a pixel gives the first beam.
struct RayCone {
  float width = 0;   ///< deviation across the ray at the last hit, scene units
  float spread = 0;  ///< deviation of directions, radians
};

/// The beam after a distance: variances from width and from spread add.
inline GLINT_HD RayCone propagated(RayCone cone, float distance) {
  const float widening = cone.spread * distance;
  return {std::sqrt(cone.width * cone.width + widening * widening), cone.spread};
}

/// The beam after reflection by facets whose slopes have the deviation `slope_sigma` per axis: directions deviate by twice the
/// angle. For a GGX or Beckmann lobe slope_sigma is alpha / sqrt(2). For a map it is sqrt(mean variance of its slopes +
/// sigma_r^2). The spread is at most that of the whole hemisphere.
inline GLINT_HD RayCone bounced(RayCone cone, float slope_sigma) {
  constexpr float kHemisphere = 0.75f;  // radians: RMS angle per axis of a hemisphere seen evenly by projected area
  const float turned = 2 * std::atan(slope_sigma);
  return {cone.width, std::min(std::sqrt(cone.spread * cone.spread + turned * turned), kHemisphere)};
}

/// The footprint of a beam on a surface.
/// @param uv              centre, see footprintFromDifferentials
/// @param direction       unit vector of the tangent frame towards the ray's origin: the footprint is stretched along it by
///                        1 / z
/// @param texels_per_unit texels in one scene unit, > 0
/// @note sizes that are NaN count as 0, infinite ones as kLongestAxis; grazing rays stretch at most kMostStretch times
inline GLINT_HD Footprint footprintOfCone(RayCone cone, Vec2 uv, Vec3 direction, float texels_per_unit) {
  constexpr float kMostStretch = 64;
  const float size = finiteAxis({cone.width * texels_per_unit, 0}).x;
  const float across = size * size, length2 = direction.x * direction.x + direction.y * direction.y;
  if (!(length2 > 0)) return Footprint::gaussian(uv, {across, 0, across});
  const float cosine = direction.z > 1 / kMostStretch ? std::min(direction.z, 1.0f) : 1 / kMostStretch;
  const float more = across * (1 / (cosine * cosine) - 1) / length2;
  return Footprint::gaussian(uv, {across + more * direction.x * direction.x, more * direction.x * direction.y,
                                  across + more * direction.y * direction.y});
}

}  // namespace glint
