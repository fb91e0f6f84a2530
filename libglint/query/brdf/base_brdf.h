#pragma once

#include <cmath>

#include "glint/math/fresnel.h"
#include "glint/model/displacement.h"

namespace glint {

inline constexpr float kInversePi = 0.318309886183790672f;

/// Share of light that a conductor reflects; exactly 1 for eta 1 and k 0, which stands for a perfect mirror.
/// @param cosine  of the angle between light and half vector, 0 to 1
inline GLINT_HD float conductorFresnel(float cosine, float eta, float k) {
  return eta == 1 && k == 0 ? 1.0f : fresnelConductor(cosine, eta, k);
}

/// GGX distribution of normals around an axis, per unit area on the plane across the axis; c is the cosine to the axis.
inline GLINT_HD float ggxDensity(float c, float alpha) {
  const float a2 = alpha * alpha;
  const float t = (1 - c * c) + a2 * c * c;
  return c > 0 ? a2 * kInversePi / (t * t) : 0.0f;
}

/// Smith's masking of GGX for one direction; c is the cosine between the direction and the normal.
inline GLINT_HD float ggxMasking(float c, float alpha) {
  const float a2 = alpha * alpha;
  return c > 0 ? 2 * c / (c + std::sqrt(a2 + (1 - a2) * c * c)) : 0.0f;
}

/// f(wi, wo) cos(wi) cos(wo) of a facet with this normal; 0 if either direction is behind it. Symmetric in wi and wo.
inline GLINT_HD float baseTimesCosines(const BaseBrdf& base, Vec3 normal, Vec3 wi, Vec3 wo) {
  const float ci = dot(normal, wi), co = dot(normal, wo);
  if (ci <= 0 || co <= 0) return 0;
  if (base.kind == BaseBrdf::Kind::diffuse) return base.albedo * kInversePi * ci * co;
  const Vec3 sum = wi + wo;
  const float length = std::sqrt(dot(sum, sum));
  return 0.25f * conductorFresnel(0.5f * length, base.eta, base.k) * ggxDensity((ci + co) / length, base.alpha) *
         ggxMasking(ci, base.alpha) * ggxMasking(co, base.alpha);
}

}  // namespace glint
