#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/vec.h"

namespace glint {

// All changes of variable between incident directions, half vectors and points of the disk are here. With a fixed wo:
//
//   density per projected area of h  --(* h.z)-->  per solid angle of h  --(/ 4 wo.h)-->  per solid angle of wi
//
// since dhx dhy = h.z dw(h), and dw(wi) = 4 (wo . h) dw(h).

/// Directions with a cosine below this count as below the horizon and reflect no light. Keeps 1 / cosine finite.
inline constexpr float kHorizon = 1e-6f;

/// Whether a vector is at most as long as a rounded unit vector. False for NaN.
inline GLINT_HD bool isDirection(Vec3 w) { return dot(w, w) < 1.001f; }
/// Whether a direction is above the horizon, so that a BRDF can be asked for it.
inline GLINT_HD bool aboveHorizon(Vec3 w) { return w.z > kHorizon && isDirection(w); }

/// The normal of a facet between two directions.
struct HalfVector {
  Vec2 disk;          ///< projection of the normal on the disk
  float cosine = 0;   ///< h.z; 0 if there is no such normal
  float towards = 0;  ///< wo . h = wi . h
};

/// @param wi, wo  unit vectors above the horizon
inline GLINT_HD HalfVector halfVectorOf(Vec3 wi, Vec3 wo) {
  const Vec3 sum = wi + wo;
  const float scale = 1 / std::sqrt(dot(sum, sum));
  return {{scale * sum.x, scale * sum.y}, scale * sum.z, scale * dot(sum, wo)};
}

/// The half vector at a point of the disk, seen from wo; its cosine is 0 where the point is not inside the disk.
inline GLINT_HD HalfVector halfVectorAt(Vec2 disk, Vec3 wo) {
  const float square = 1 - dot(disk, disk);
  if (!(square > 0)) return {disk, 0, 0};
  const float cosine = std::sqrt(square);
  return {disk, cosine, disk.x * wo.x + disk.y * wo.y + cosine * wo.z};
}

/// wo mirrored at the half vector.
inline GLINT_HD Vec3 reflected(Vec3 wo, const HalfVector& h) {
  const float twice = 2 * h.towards;
  return {twice * h.disk.x - wo.x, twice * h.disk.y - wo.y, twice * h.cosine - wo.z};
}

/// Factor from the density of h per unit projected area to the density of wi per unit solid angle, wi being wo mirrored at h.
inline GLINT_HD float projectedToIncident(float density, const HalfVector& h) { return density * h.cosine / (4 * h.towards); }

/// Factor from the density of wi per unit solid angle to the density of its half vector per unit projected area.
inline GLINT_HD float incidentToProjected(float density, const HalfVector& h) { return density * (4 * h.towards) / h.cosine; }

}  // namespace glint
