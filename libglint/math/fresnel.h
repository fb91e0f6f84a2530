#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/math/rgb.h"

namespace glint {

/// Share of unpolarised light that a smooth dielectric reflects.
/// @param cosine  between the direction and the facet's normal; clamped to [0, 1], NaN counts as 0
/// @param eta     refractive index of the inside over that of the outside, > 0; below 1 there is total reflection
/// @return in [0, 1]
inline GLINT_HD float fresnelDielectric(float cosine, float eta) {
  const float c = cosine > 0 ? std::min(cosine, 1.0f) : 0.0f;
  const float sine2_inside = (1 - c * c) / (eta * eta);
  if (!(sine2_inside < 1)) return 1;
  const float inside = std::sqrt(1 - sine2_inside);
  const float parallel = (eta * c - inside) / (eta * c + inside);
  const float perpendicular = (c - eta * inside) / (c + eta * inside);
  const float reflected = 0.5f * (parallel * parallel + perpendicular * perpendicular);
  return reflected >= 0 ? reflected : 1.0f;  // NaN comes from an infinite index, which reflects everything
}

/// Share of unpolarised light that a smooth conductor of refractive index eta + i k (relative to the outside) reflects.
/// @param cosine  as for a dielectric
/// @return in [0, 1]; with k = 0 and eta >= 1 the share that a dielectric reflects
inline GLINT_HD float fresnelConductor(float cosine, float eta, float k) {
  const float c = cosine > 0 ? std::min(cosine, 1.0f) : 0.0f;
  const float c2 = c * c, s2 = 1 - c2;
  // a + i b is the complex index times the cosine inside. Real arithmetic, since device code has no std::complex.
  const float difference = eta * eta - k * k - s2;
  const float a2_plus_b2 = std::sqrt(difference * difference + 4 * eta * eta * k * k);
  const float a = std::sqrt(std::max(0.0f, 0.5f * (a2_plus_b2 + difference)));
  const float perpendicular = (a2_plus_b2 + c2 - 2 * a * c) / (a2_plus_b2 + c2 + 2 * a * c);
  const float steep = s2 * s2, mixed = 2 * a * c * s2;
  const float parallel = perpendicular * (c2 * a2_plus_b2 + steep - mixed) / (c2 * a2_plus_b2 + steep + mixed);
  const float reflected = 0.5f * (perpendicular + parallel);
  return reflected >= 0 ? std::min(reflected, 1.0f) : 1.0f;  // NaN is 0/0 at an index of exactly 0, which reflects everything
}

/// The material of facets: the share of light that they reflect.
class Fresnel {
 public:
  /// Facets that reflect everything: for furnace tests, and for reflectance applied elsewhere.
  static GLINT_HD constexpr Fresnel mirror() { return {}; }
  /// @param eta, k  real and imaginary part of the refractive index of each channel, relative to the outside
  static GLINT_HD constexpr Fresnel conductor(Rgb eta, Rgb k) { return {Kind::conductor, eta, k}; }
  /// Reflection only: refracted light is lost.
  static GLINT_HD constexpr Fresnel dielectric(float eta) { return {Kind::dielectric, Rgb::grey(eta), {}}; }

  /// Reflectance towards `cosine`, each channel in [0, 1].
  GLINT_HD Rgb reflectance(float cosine) const {
    switch (kind_) {
      case Kind::mirror:
        break;
      case Kind::dielectric:
        return Rgb::grey(fresnelDielectric(cosine, eta_.r));
      case Kind::conductor:
        return {fresnelConductor(cosine, eta_.r, k_.r), fresnelConductor(cosine, eta_.g, k_.g),
                fresnelConductor(cosine, eta_.b, k_.b)};
    }
    return Rgb::grey(1);
  }

 private:
  enum class Kind : std::uint8_t { mirror, dielectric, conductor };

  constexpr Fresnel() = default;
  GLINT_HD constexpr Fresnel(Kind kind, Rgb eta, Rgb k) : kind_(kind), eta_(eta), k_(k) {}

  Kind kind_ = Kind::mirror;
  Rgb eta_;
  Rgb k_;
};

}  // namespace glint
