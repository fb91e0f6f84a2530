#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/gaussian.h"
#include "glint/model/displacement.h"
#include "glint/query/brdf/base_brdf.h"

namespace glint {

/// Centre of a lobe as a direction.
inline GLINT_HD Vec3 lobeCentre(const VmfLobe& lobe) {
  return {lobe.mu.x, lobe.mu.y, std::sqrt(std::max(0.0f, 1 - dot(lobe.mu, lobe.mu)))};
}

/// Mean cosine to the centre of a von Mises-Fisher lobe: coth(kappa) - 1 / kappa.
inline GLINT_HD float vmfMeanCosine(float kappa) {
  if (kappa < 0.1f) return kappa / 3 * (1 - kappa * kappa / 15);
  const float e = std::exp(-2 * kappa);
  return (1 + e) / (1 - e) - 1 / kappa;
}

/// Density of a von Mises-Fisher lobe over the sphere (Wu 2019, below Eq. 4). Does not overflow for any kappa.
/// @param cosine  to the centre
inline GLINT_HD float vmfDensity(float cosine, float kappa) {
  if (kappa < 1e-4f) return 0.25f * kInversePi;
  return 0.5f * kInversePi * kappa / (1 - std::exp(-2 * kappa)) * std::exp(kappa * (cosine - 1));
}

/// Moments of the cosines between the normals of a lobe and one direction, which the diffuse term needs. Cosines are taken to
/// be normally distributed.
struct LobeFacing {
  float cosine = 0;   ///< dot(mu, w)
  float lit = 0;      ///< mean of max(0, dot(n, w))
  float visible = 0;  ///< share of normals with dot(n, w) > 0
};

/// Moments of a lobe's normals: E[n n^T] = spread I + bias mu mu^T + mean^2 mu mu^T.
struct LobeMoments {
  float mean = 0;    ///< A = mean cosine
  float spread = 0;  ///< A / kappa
  float bias = 0;    ///< 1 - 3 A / kappa - A^2
};

inline GLINT_HD LobeMoments lobeMoments(float kappa) {
  const float mean = vmfMeanCosine(kappa);
  const float spread = kappa < 0.1f ? (1 - kappa * kappa / 15) / 3 : mean / kappa;
  return {mean, spread, 1 - 3 * spread - mean * mean};
}

inline GLINT_HD LobeFacing lobeFacing(const LobeMoments& moments, Vec3 centre, Vec3 direction) {
  LobeFacing facing;
  facing.cosine = dot(centre, direction);
  const float mean = moments.mean * facing.cosine;
  const float deviation = std::sqrt(std::max(1e-12f, moments.spread + moments.bias * facing.cosine * facing.cosine));
  const float t = mean / deviation;
  constexpr float kInvSqrt2Pi = 0.398942280401432678f;
  facing.visible = 0.5f * (1 + std::erf(kInvSqrt2 * t));
  facing.lit = std::max(0.0f, mean * facing.visible + deviation * kInvSqrt2Pi * std::exp(-0.5f * t * t));
  return facing;
}

/// Mean over the normals of a lobe of max(0, dot(n, wi)) max(0, dot(n, wo)), to first order in the correlation of the two
/// cosines: exact when all normals face both directions. May be slightly below 0 where hardly any normal faces both.
inline GLINT_HD float lobeCosines(const LobeMoments& moments, const LobeFacing& i, const LobeFacing& o, float cosine_io) {
  const float covariance = moments.spread * cosine_io + moments.bias * i.cosine * o.cosine;
  return i.lit * o.lit + covariance * i.visible * o.visible;
}

/// Roughness of a GGX lobe that is spread over the normals of a von Mises-Fisher lobe: variances of slopes add, 1 / kappa for
/// the lobe and alpha^2 / 2 for the facet.
inline GLINT_HD float spreadRoughness(float alpha, float kappa) { return std::sqrt(alpha * alpha + 2 / std::max(kappa, 1.0f)); }

/// Mean over the normals of a lobe of f cos(wi) cos(wo) of a GGX facet, without Fresnel's factor: the facet's distribution
/// widened by the lobe's, seen towards the half vector, masked at the normal that is likeliest to reflect.
inline GLINT_HD float ggxLobe(float alpha, Vec3 centre, float kappa, Vec3 wi, Vec3 wo, Vec3 half) {
  const float a2 = alpha * alpha;
  const float width = a2 + 2 / std::max(kappa, 1.0f);
  const float share = a2 / width;  // share of the facet's own roughness in the width
  const Vec3 sum = share * centre + (1 - share) * half;
  const float scale = 1 / std::sqrt(std::max(1e-12f, dot(sum, sum)));
  const float ci = std::max(0.0f, scale * dot(sum, wi)), co = std::max(0.0f, scale * dot(sum, wo));
  const float c = std::max(0.0f, dot(centre, half));
  const float t = (1 - c * c) + width * c * c;
  const float density = width * kInversePi / (t * t);
  return 0.25f * density * ggxMasking(ci, alpha) * ggxMasking(co, alpha);
}

}  // namespace glint
