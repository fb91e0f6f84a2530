#pragma once

#include <cstdint>

#include "glint/math/spherical_gaussian.h"
#include "glint/query/brdf/microfacet_brdf.h"

namespace glint {

/// Methods to find the range of half vectors of a lobe.
enum class LobeRange : std::uint8_t {
  moments,  ///< the box that has the second moments of the lobe's half vectors seen from wo
  support,  ///< a square of side 2 theta / pi around the axis's half vector (Deng 2022, Eq. 8 and 9), of a lobe of amplitude 1
  /// the same with the lobe's own amplitude A in Eq. 8: lobes below epsilon, .3 in the unit of radiance, are asked as points
  support_of_amplitude,
};

/// Most cells along each axis of a lobe.
inline constexpr int kMostLobeCells = 8;
/// Cells along each axis with the best accuracy for the cost, which is 9 means.
inline constexpr int kLobeCells = 3;

/// Half the extent, in deviations, of a lobe that is cut into n x n cells. Chosen so that the cells, each filled evenly with
/// its share of the lobe, together have the variance of the lobe.
inline GLINT_HD float lobeExtent(int cells) {
  constexpr float kExtents[kMostLobeCells] = {1.732f, 1.732f, 1.994f, 2.181f, 2.326f, 2.444f, 2.542f, 2.626f};
  return kExtents[std::clamp(cells, 1, int{kMostLobeCells}) - 1];
}

/// Mean density over a range of half vectors. Very small ranges are answered as points.
template <NdfModel M>
GLINT_HD float meanAround(const MicrofacetBrdf<M>& brdf, Vec2 h, float side_x, float side_y) {
  constexpr float kSmallestSide = 1e-3f;  // a third of a pixel at 512^2; differences of prefix sums lose digits below
  if (std::max(side_x, side_y) < kSmallestSide) return brdf.model().density(brdf.footprint(), h);
  const Vec2 half = {0.5f * std::max(side_x, kSmallestSide), 0.5f * std::max(side_y, kSmallestSide)};
  return brdf.model().mean(brdf.footprint(), Box2{h - half, h + half});
}

/// Radiance towards wo of one cell of a lobe. D is averaged over the half vectors of the cell; all other terms are taken at the
/// centre of the cell.
/// @param centre, side  of the square cell, on the plane of directionAt
/// @return radiance of a lobe of integral 1 that lies in the cell
template <NdfModel M>
GLINT_HD Rgb cellRadiance(const MicrofacetBrdf<M>& brdf, Vec3 wo, const SphericalGaussian& light, const Tangents& frame,
                          Vec2 centre, float side) {
  const Vec3 wi = directionAt(light, frame, centre);
  if (!aboveHorizon(wi)) return {};
  const HalfVector h = halfVectorOf(wi, wo);
  const auto step = [&](Vec2 d) {  // of the half vector across the cell
    const Vec3 from = directionAt(light, frame, centre - d) + wo, to = directionAt(light, frame, centre + d) + wo;
    const float a = 1 / std::sqrt(std::max(dot(from, from), 1e-8f)), b = 1 / std::sqrt(std::max(dot(to, to), 1e-8f));
    return Vec2{b * to.x - a * from.x, b * to.y - a * from.y};
  };
  const Vec2 s = step({0.5f * side, 0}), t = step({0, 0.5f * side});
  const float density = meanAround(brdf, h.disk, std::sqrt(s.x * s.x + t.x * t.x), std::sqrt(s.y * s.y + t.y * t.y));
  return density * wi.z * brdf.response(wi, wo, h);
}

/// Radiance towards wo with the paper's range: a square around the half vector of the lobe's axis.
/// @param amplitude  A of Eq. 8
template <NdfModel M>
GLINT_HD Rgb supportRadiance(const MicrofacetBrdf<M>& brdf, Vec3 wo, const SphericalGaussian& light, float amplitude = 1) {
  if (!aboveHorizon(light.axis)) return {};
  const HalfVector h = halfVectorOf(light.axis, wo);
  const float side = supportSide(compactSupport(amplitude, light.sharpness));
  return meanAround(brdf, h.disk, side, side) * light.axis.z * brdf.response(light.axis, wo, h);
}

/// Radiance that a surface reflects towards wo from one spherical Gaussian, without sampling: the NDF is averaged over the half
/// vectors of the lobe by range queries, and Fresnel, masking and cosine are taken at the centre of each cell (Deng 2022,
/// section 5.4, with one cell and LobeRange::support).
///
/// The lobe is cut into cells x cells; more follow a wide lobe's shape, and the horizon, more closely. The error is that of the
/// footprint's NDF varying within a box and of the boxes' alignment. With the default cells and a Beckmann NDF it is 2 % for
/// lobes of sharpness 30 and more and 7 % from 3 on (tests/unit/environment_test.cpp); a lobe of sharpness 1, half the sky,
/// comes out up to half as bright again at grazing wo.
/// NDFs of few facets err more, because the lobe is even inside each cell: on metallic flakes and for lobes of sharpness 100 to
/// 1000 the root mean square error is 6 to 10 % with the default cells, and 2 % with kMostLobeCells (same test). The relative
/// error of a view that reflects little of the light can be far larger. Give more cells there, or sample the lobe.
/// @param cells  1 to kMostLobeCells; the ranges by support have one
/// @return 0 for wo below the horizon and for lobes that are not usable (isUsable)
template <NdfModel M>
GLINT_HD Rgb prefilteredRadiance(const MicrofacetBrdf<M>& brdf, Vec3 wo, const SphericalGaussian& light, int cells = kLobeCells,
                                 LobeRange range = LobeRange::moments) {
  if (!aboveHorizon(wo) || !isUsable(light)) return {};
  const Rgb flux = integralOf(light) * light.amplitude;
  if (range == LobeRange::support) return flux * supportRadiance(brdf, wo, light);
  if (range == LobeRange::support_of_amplitude) return flux * supportRadiance(brdf, wo, light, luminance(light.amplitude));
  const int n = std::clamp(cells, 1, int{kMostLobeCells});
  const float sigma = 1 / std::sqrt(light.sharpness), extent = std::min(lobeExtent(n), 1.41421356f / sigma);
  const float step = 2 * extent / static_cast<float>(n), side = sigma * step;
  const Tangents frame = tangentsOf(light.axis);
  const float whole = gaussianMass(-extent, extent, 0, 1);
  const auto low = [&](int k) { return -extent + step * static_cast<float>(k); };
  Rgb sum;
  for (int j = 0; j < n; ++j) {
    const float row = gaussianMass(low(j), low(j + 1), 0, 1) / whole;
    for (int i = 0; i < n; ++i) {
      const float share = row * gaussianMass(low(i), low(i + 1), 0, 1) / whole;
      const Vec2 centre = {sigma * (low(i) + 0.5f * step), sigma * (low(j) + 0.5f * step)};
      sum = sum + share * cellRadiance(brdf, wo, light, frame, centre, side);
    }
  }
  return flux * sum;
}

/// Radiance from all lobes.
template <NdfModel M>
GLINT_HD Rgb prefilteredRadiance(const MicrofacetBrdf<M>& brdf, Vec3 wo, const SphericalGaussians& lights,
                                 int cells = kLobeCells) {
  Rgb sum;
  for (std::size_t k = 0; k < lights.count; ++k) sum = sum + prefilteredRadiance(brdf, wo, lights.lobes[k], cells);
  return sum;
}

/// Fills the probability of each lobe by its power: its integral times the luminance of its amplitude, over that of all.
/// Lobes that are not usable, or darker than black, have 0; all have 0 where there is no light.
/// @param shares  room for lights.count numbers
inline GLINT_HD void powerShares(const SphericalGaussians& lights, float* shares) {
  double total = 0;
  for (std::size_t k = 0; k < lights.count; ++k) {
    const SphericalGaussian& light = lights.lobes[k];
    shares[k] = isUsable(light) ? std::max(0.0f, integralOf(light) * luminance(light.amplitude)) : 0.0f;
    total += double{shares[k]};
  }
  for (std::size_t k = 0; k < lights.count; ++k)
    shares[k] = total > 0 && std::isfinite(total) ? static_cast<float>(double{shares[k]} / total) : 0.0f;
}

/// Radiance from one lobe that is chosen by its power, over its probability: the estimator of Deng 2022, section 5.4. Its
/// mean is the sum over all lobes with the same range, at the cost of one lobe; its noise is that of the choice.
/// prefilteredRadiance of all lobes has no noise, and costs as many ranges as there are lobes (tests/unit/one_lobe_test.cpp
/// compares them at equal cost).
/// @param shares  of powerShares
/// @param xi      in [0, 1)
template <NdfModel M>
GLINT_HD Rgb oneLobeRadiance(const MicrofacetBrdf<M>& brdf, Vec3 wo, const SphericalGaussians& lights, const float* shares,
                             float xi, int cells = 1, LobeRange range = LobeRange::support) {
  float left = xi > 0 ? xi : 0;
  std::size_t chosen = lights.count;
  for (std::size_t k = 0; k < lights.count; ++k) {
    if (!(shares[k] > 0)) continue;
    if (chosen != lights.count) left -= shares[chosen];
    chosen = k;  // if rounding leaves a rest, the last lobe with light gets it
    if (left < shares[k]) break;
  }
  if (chosen == lights.count) return {};
  return (1 / shares[chosen]) * prefilteredRadiance(brdf, wo, lights.lobes[chosen], cells, range);
}

/// A direction drawn towards the lights.
struct LightSample {
  Vec3 wi;
  Rgb radiance;   ///< radiance of all lobes along wi
  float pdf = 0;  ///< per unit solid angle; 0 if there is no light
};

/// Importance sampling of a list of lobes for one BRDF and wo. Chooses a lobe by its contribution to the radiance towards wo,
/// then draws a direction from the lobe.
///
/// A lobe's contribution is its prefiltered radiance with one cell; kFluxShare of the samples choose by flux alone, so that
/// every lobe that gives light can be chosen. Directions may lie below the horizon: there the BRDF is 0. Colours count by their
/// luminance; lobes of luminance 0 or less are never chosen.
class LightSampler {
 public:
  static constexpr float kFluxShare = 0.1f;

  /// Computes the contributions of all lobes, at the cost of one mean for each lobe.
  /// @param shares  room for lights.count numbers, filled here with the probability of each lobe; must outlive the sampler
  template <NdfModel M>
  GLINT_HD LightSampler(const MicrofacetBrdf<M>& brdf, Vec3 wo, const SphericalGaussians& lights, float* shares)
      : lights_(lights), shares_(shares) {
    float total = 0, total_flux = 0;
    for (std::size_t k = 0; k < lights.count; ++k) {
      shares[k] = positive(luminance(prefilteredRadiance(brdf, wo, lights.lobes[k], 1)));
      total += shares[k];
      total_flux += flux(k);
    }
    if (!(total_flux > 0 && total_flux < kLargest)) {
      for (std::size_t k = 0; k < lights.count; ++k) shares[k] = 0;
      return;
    }
    const bool by_contribution = total > 0 && total < kLargest;
    const float flux_share = by_contribution ? kFluxShare : 1.0f;
    for (std::size_t k = 0; k < lights.count; ++k)
      shares[k] = flux_share * (flux(k) / total_flux) + (by_contribution ? (1 - kFluxShare) * (shares[k] / total) : 0.0f);
  }

  /// Samples by probabilities that another sampler has filled for the same lobes.
  GLINT_HD LightSampler(const SphericalGaussians& lights, const float* shares) : lights_(lights), shares_(shares) {}

  /// @param xi  in [0, 1)^2
  /// @note O(lobes)
  GLINT_HD LightSample sample(Vec2 xi) const {
    float left = xi.x > 0 ? xi.x : 0;
    std::size_t chosen = lights_.count;
    for (std::size_t k = 0; k < lights_.count; ++k) {
      if (!(shares_[k] > 0)) continue;
      if (chosen != lights_.count) left -= shares_[chosen];
      chosen = k;  // if rounding leaves a rest, the last lobe with light gets it
      if (left < shares_[k]) break;
    }
    if (chosen == lights_.count) return {};
    const Vec3 wi = sampleDirection(lights_.lobes[chosen], {std::min(left / shares_[chosen], float{kBelowOne}), xi.y});
    return {wi, radianceAlong(lights_, wi), pdf(wi)};
  }

  /// Density with which `sample` draws wi, per unit solid angle.
  GLINT_HD float pdf(Vec3 wi) const {
    float sum = 0;
    for (std::size_t k = 0; k < lights_.count; ++k)
      if (shares_[k] > 0) sum += shares_[k] * valueOf(lights_.lobes[k], wi) / integralOf(lights_.lobes[k]);
    return sum;
  }

 private:
  static constexpr float kLargest = 1e37f;

  static GLINT_HD float positive(float value) { return value > 0 ? value : 0.0f; }
  GLINT_HD float flux(std::size_t k) const {
    const SphericalGaussian& light = lights_.lobes[k];
    return isUsable(light) ? positive(integralOf(light) * luminance(light.amplitude)) : 0.0f;
  }

  SphericalGaussians lights_;
  const float* shares_;
};

}  // namespace glint
