#pragma once

#include <algorithm>

#include "glint/math/fresnel.h"
#include "glint/math/vec.h"
#include "glint/query/brdf/smith.h"

namespace glint {

/// The factor by which Fresnel and masking scale a light integral: F G / (4 cos(wo)). F and G are taken in the mirror direction
/// at the surface's normal, and not under the integral (Gamboa 2018, Eq. 14). Radiance = transferFactor *
/// ShLightIntegral::value.
/// @param fresnel      reflectance at the angle of wo, in [0, 1]
/// @param shadowing    G of wo and its mirror direction, in [0, 1]
/// @param wo_dot_normal  cosine of the outgoing direction; the result is 0 at and below the surface
GLINT_HD inline float transferFactor(float fresnel, float shadowing, float wo_dot_normal) {
  return wo_dot_normal > 0 ? fresnel * shadowing / (4 * wo_dot_normal) : 0.0f;
}

/// transferFactor from the material and the masking of a surface: Fresnel at the angle of wo, G of wo and its mirror direction
/// with heights correlated. This is the complete code of a renderer for a pixel that sees `footprint` of an asset of kind
/// histogram-sat:
///
///   const HistogramNdf ndf(asset.get<HistogramSat>());
///   const SmithMasking masking(asset.get<HistogramSat>().slopes, sigma_r);
///   const ShLightIntegral light = query.integral(ndf, footprint, frame, wo_world, {}, scratch);
///   const Rgb integral = {light.value[0], light.value[1], light.value[2]};
///   const Rgb radiance = transferFactor(Fresnel::conductor(eta, k), masking, wo) * integral;
///
/// @param wo  outgoing direction in the tangent frame, unit; the result is 0 at and below the surface
GLINT_HD inline Rgb transferFactor(const Fresnel& fresnel, const SmithMasking& masking, Vec3 wo) {
  if (!(wo.z > 0)) return {};
  return wo.z * masking.visibility({-wo.x, -wo.y, wo.z}, wo) * fresnel.reflectance(wo.z);
}

/// Shadowed light from an exact unshadowed one: unshadowed * (sampled shadowed) / (sampled unshadowed), colour by colour
/// (Gamboa 2018, section 5.1, after Heitz et al. 2018). A renderer adds the samples that it traces anyway:
///
///   RatioEstimator shadow;
///   for each sample wi with density pdf:  shadow.add(light(wi) * brdf(wi) * cosine / pdf, visible(wi) ? 1 : 0);
///   radiance = shadow.shadowed(unshadowed)
///
/// Where nothing is in shadow the result is the unshadowed one without noise; where all is, it is 0; between, the noise is that
/// of the visibility only, and the result stays between 0 and the unshadowed one. Biased by O(1 / samples), consistent: the
/// ratio of means tends to the shadowed share of what the samples see.
class RatioEstimator {
 public:
  /// @param contribution  R, G, B of a sample over its pdf, >= 0, without visibility
  /// @param visibility    in [0, 1]
  GLINT_HD void add(const float contribution[3], float visibility) {
    for (int c = 0; c < 3; ++c) {
      open_[c] += double{contribution[c]};
      seen_[c] += double{contribution[c]} * double{visibility};
    }
    visible_ += double{visibility};
    ++count_;
  }

  /// Share of the light of a channel that is not shadowed, in [0, 1]. A channel without light takes the mean visibility of the
  /// samples; without samples nothing is known to be in shadow, and it is 1.
  GLINT_HD float share(int channel) const {
    if (open_[channel] > 0) return static_cast<float>(std::clamp(seen_[channel] / open_[channel], 0.0, 1.0));
    return count_ > 0 ? static_cast<float>(visible_ / count_) : 1.0f;
  }

  /// @param unshadowed  the channel's radiance without shadows, >= 0
  GLINT_HD float shadowed(int channel, float unshadowed) const { return unshadowed * share(channel); }

 private:
  double open_[3] = {0, 0, 0};
  double seen_[3] = {0, 0, 0};
  double visible_ = 0;
  int count_ = 0;
};

/// Shadowed light from an exact unshadowed one by a control variate: unshadowed - mean(sampled light that is hidden), colour by
/// colour (Gamboa 2018, Eq. 13). It takes the samples that RatioEstimator takes.
///
/// Unbiased at any number of samples, where RatioEstimator has a bias of O(1 / samples). Its noise is that of the hidden
/// light, with the full variance of the contributions: so it suits small shadows and samples that follow the light, and a
/// result may be below 0. In deep shadow the ratio has far less noise (tests/unit/shadow_estimators_test.cpp measures both).
class ControlVariateEstimator {
 public:
  /// @param contribution  R, G, B of a sample over its pdf, >= 0, without visibility. Unlike in a ratio, samples of 0 count too
  /// @param visibility    in [0, 1]
  GLINT_HD void add(const float contribution[3], float visibility) {
    for (int c = 0; c < 3; ++c) hidden_[c] += double{contribution[c]} * (1 - double{visibility});
    ++count_;
  }

  /// Mean light of a channel that is hidden; 0 without samples.
  GLINT_HD float hidden(int channel) const { return count_ > 0 ? static_cast<float>(hidden_[channel] / count_) : 0.0f; }

  /// @param unshadowed  the channel's radiance without shadows, >= 0
  /// @return may be negative: images that average over many pixels or frames need the negative values
  GLINT_HD float shadowed(int channel, float unshadowed) const { return unshadowed - hidden(channel); }

 private:
  double hidden_[3] = {0, 0, 0};
  int count_ = 0;
};

/// Shadowed light integral of all channels: draws `samples` light directions and asks the renderer's visibility.
/// @param unshadowed   R, G, B, e.g. ShLightIntegral::value
/// @param draw         draw(int k, float contribution[3]) -> Vec3: direction of sample k towards the light, and its radiance
///                     times the integrand over its pdf; contributions of 0 are not traced
/// @param visibility   visibility(Vec3 wi) -> float in [0, 1]
template <class Draw, class Visibility>
GLINT_HD void shadowedIntegral(const float unshadowed[3], int samples, Draw&& draw, Visibility&& visibility, float result[3]) {
  RatioEstimator estimator;
  for (int k = 0; k < samples; ++k) {
    float contribution[3] = {0, 0, 0};
    const Vec3 wi = draw(k, contribution);
    const bool matters = contribution[0] > 0 || contribution[1] > 0 || contribution[2] > 0;
    if (matters) estimator.add(contribution, visibility(wi));
  }
  for (int c = 0; c < 3; ++c) result[c] = estimator.shadowed(c, unshadowed[c]);
}

}  // namespace glint
