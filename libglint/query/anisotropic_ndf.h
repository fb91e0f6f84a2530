#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/gaussian.h"
#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// A Gaussian footprint as a sum of isotropic Gaussians of equal size along its long axis. Weights are > 0 and sum to 1.
struct IsotropicParts {
  static constexpr int kMost = 32;
  Footprint footprints[kMost];
  float weights[kMost];
  int count = 0;
};

/// Largest gap between neighbouring parts, in deviations of a part: their sum then ripples by 1 %. Gaps are larger only where
/// kMost parts are too few.
inline constexpr float kPartGap = 2;
/// Parts lie out to this many deviations of the footprint.
inline constexpr float kPartReach = 2.2f;
/// Aspect up to which IsotropicParts::kMost parts are enough: sqrt(1 + (kMost kPartGap / (2 kPartReach))^2).
inline constexpr float kMostAspect = 14.58f;
/// Widening of parts where they are too few, as a share of the square of the gap beyond kPartGap. Gaps miss texels of the
/// footprint, and wider parts see texels outside it. This share has the least squared error on a map of unrelated texels, to a
/// tenth (tests/unit/anisotropic_test.cpp).
inline constexpr float kPartWidening = 0.055f;

/// A footprint is round if its variance along its long axis exceeds the variance of its parts by less than this share.
inline constexpr float kRoundLength = 0.05f;

/// Parts of a footprint that winds round the map: spread evenly along the period that the footprint follows. `count` is 0 if
/// the footprint is shorter. Parts are as wide as the footprint is across, or wider where `most` parts are too few.
GLINT_DEVICE_CALL inline GLINT_HD IsotropicParts partsOfTurn(const Footprint& p, int width, int height, float narrowest_sigma,
                                                             int most) {
  constexpr double kTurns = 0.5;  // variance of turns from which on the footprint is even along them, to 5e-5
  const double w = width, h = height;
  const UsableCovariance c = usableCovariance(p.covariance, width, height);
  IsotropicParts parts;
  if (c.xx < kTurns * w * w && c.yy < kTurns * h * h) return parts;
  const AxisPair sigma = deviationsOf(c).scaled(1 / w, 1 / h);
  const PeriodFrame frame(sigma);
  const double wide = std::hypot(PeriodFrame::dot(frame.across, sigma.a), PeriodFrame::dot(frame.across, sigma.b));
  const double turns = std::fabs(sigma.cross()) / wide;
  if (turns * turns < kTurns) return parts;
  const Vec2 centre = {wrapUnit(p.centre.x), wrapUnit(p.centre.y)};
  if (wide * wide >= kTurns) {
    parts.footprints[0] = Footprint::isotropic(centre, static_cast<float>(std::max(w, h)));
    parts.weights[0] = 1;
    parts.count = 1;
    return parts;
  }
  const double length = std::hypot(w * frame.along_period[0], h * frame.along_period[1]);
  const double across = wide / std::hypot(frame.across[0] / w, frame.across[1] / h);
  const double narrow = std::max(across, double{narrowest_sigma});
  parts.count = static_cast<int>(std::clamp(std::ceil(length / (double{kPartGap} * narrow)), 2.0, 1.0 * most));
  const auto part_sigma = static_cast<float>(std::max(narrow, length / (double{kPartGap} * parts.count)));
  for (int k = 0; k < parts.count; ++k) {
    const double turn = (k + 0.5) / parts.count - 0.5;
    const double u = double{centre.x} + turn * frame.along_period[0], v = double{centre.y} + turn * frame.along_period[1];
    parts.footprints[k] =
        Footprint::isotropic({static_cast<float>(u - std::floor(u)), static_cast<float>(v - std::floor(v))}, part_sigma);
    parts.weights[k] = 1.0f / static_cast<float>(parts.count);
  }
  return parts;
}

/// Parts of a footprint on a map that ends (Boundary::clamp): only parts near the map, weighed by their share over the map.
/// Parts beyond the border are answered at the border.
GLINT_DEVICE_CALL inline GLINT_HD IsotropicParts partsOverMap(const Footprint& p, int width, int height, float narrowest_sigma,
                                                              int most) {
  const PrincipalAxes axes = principalAxes(positiveCovariance(p.covariance));
  const auto longest = static_cast<float>(axes.longest);
  const float narrow = std::max(static_cast<float>(axes.shortest), narrowest_sigma);
  const float along2 = longest * longest - narrow * narrow;
  IsotropicParts parts;
  if (!(along2 > kRoundLength * narrow * narrow)) {
    parts.footprints[0] = Footprint::isotropic(p.centre, std::max(narrow, longest));
    parts.weights[0] = 1;
    parts.count = 1;
    return parts;
  }
  // The stretch of the long axis, in texels from the centre, that comes within kPartReach deviations of a part of the map.
  const float along = std::sqrt(along2), size[2] = {static_cast<float>(width), static_cast<float>(height)};
  const float centre[2] = {wrapUnit(p.centre.x) * size[0], wrapUnit(p.centre.y) * size[1]};
  const float direction[2] = {static_cast<float>(axes.x), static_cast<float>(axes.y)};
  float low = -kPartReach * along, high = kPartReach * along;
  for (int k = 0; k < 2; ++k) {
    if (direction[k] == 0) continue;
    const float a = (-kPartReach * narrow - centre[k]) / direction[k];
    const float b = (size[k] + kPartReach * narrow - centre[k]) / direction[k];
    low = std::max(low, std::min(a, b));
    high = std::min(high, std::max(a, b));
  }
  parts.count = std::clamp(static_cast<int>(std::ceil((high - low) / (kPartGap * narrow))), 2, most);
  const float step = (high - low) / static_cast<float>(parts.count), sigma = std::max(narrow, step / kPartGap);
  float total = 0;
  for (int k = 0; k < parts.count; ++k) {
    const float x = low + (static_cast<float>(k) + 0.5f) * step, from_centre = x / along;
    float uv[2], inside = 1;
    for (int axis = 0; axis < 2; ++axis) {
      const float at = centre[axis] + x * direction[axis];
      inside *= gaussianMass(0, size[axis], at, sigma);
      uv[axis] = std::clamp(at / size[axis], 0.0f, float{kBelowOne});
    }
    parts.footprints[k] = Footprint::isotropic({uv[0], uv[1]}, sigma);
    parts.weights[k] = std::exp(-0.5f * from_centre * from_centre) * inside;
    total += parts.weights[k];
  }
  for (int k = 0; k < parts.count; ++k) parts.weights[k] /= total;
  return parts;
}

/// Splits a footprint along its long axis. The parts together have the first and second moments of the footprint.
///
/// The size is made usable first (usableCovariance). Footprints that wind round the map are split by `partsOfTurn`. Other parts
/// have the short deviation of the footprint, or `narrowest_sigma` if that is larger, and neighbours are at most kPartGap
/// deviations apart. Above an aspect of kMostAspect there are too few parts: they are wider and further apart, so that the
/// footprint keeps its length exactly and grows in width (kPartWidening). Boxes are split as the Gaussian of the same moments.
/// @param narrowest_sigma  texels; the model answers smaller footprints alike, e.g. finestSigma(shape) for a pyramid
///                         without normals
/// @param most             largest number of parts, 2 to IsotropicParts::kMost; fewer parts lower kMostAspect
/// @param boundary         with clamp, partsOverMap makes the parts
/// @return 1 part for round footprints, else 2 or more
inline GLINT_HD IsotropicParts isotropicParts(const Footprint& p, int width, int height, float narrowest_sigma = 0,
                                              int most = IsotropicParts::kMost, Boundary boundary = Boundary::wrap) {
  if (boundary == Boundary::clamp) return partsOverMap(p, width, height, narrowest_sigma, most);
  if (const IsotropicParts turn = partsOfTurn(p, width, height, narrowest_sigma, most); turn.count > 0) return turn;
  const PrincipalAxes axes = principalAxes(usableCovariance(p.covariance, width, height));
  const auto longest = static_cast<float>(axes.longest);
  const float narrow = std::max(static_cast<float>(axes.shortest), narrowest_sigma), narrow2 = narrow * narrow;
  const float gap_per_length = 2 * kPartReach / static_cast<float>(most);
  const float gap2 = gap_per_length * gap_per_length * (longest * longest - narrow2);
  const float sigma = std::sqrt(narrow2 + kPartWidening * std::max(0.0f, gap2 - kPartGap * kPartGap * narrow2));
  const float along2 = longest * longest - sigma * sigma;
  IsotropicParts parts;
  if (!(along2 > kRoundLength * sigma * sigma)) {
    parts.footprints[0] = Footprint::isotropic(p.centre, std::max(sigma, longest));
    parts.weights[0] = 1;
    parts.count = 1;
    return parts;
  }
  const float along = std::sqrt(along2);
  parts.count = std::clamp(static_cast<int>(std::ceil(2 * kPartReach * along / (kPartGap * sigma))), 2, most);
  const float step = 2 * kPartReach / static_cast<float>(parts.count), middle = 0.5f * static_cast<float>(parts.count - 1);
  float total = 0, moment = 0;
  for (int k = 0; k < parts.count; ++k) {
    const float x = step * (static_cast<float>(k) - middle);
    parts.weights[k] = std::exp(-0.5f * x * x);
    total += parts.weights[k];
    moment += parts.weights[k] * x * x;
  }
  const float stretch = along * std::sqrt(total / moment);
  const Vec2 unit = {static_cast<float>(axes.x / width), static_cast<float>(axes.y / height)};
  const Vec2 centre = {wrapUnit(p.centre.x), wrapUnit(p.centre.y)};
  for (int k = 0; k < parts.count; ++k) {
    const float x = step * (static_cast<float>(k) - middle);
    parts.footprints[k] = Footprint::isotropic(centre + (stretch * x) * unit, sigma);
    parts.weights[k] /= total;
  }
  return parts;
}

/// Answers stretched footprints from a model that knows only round footprints (PyramidNdf, CpNdf): as the sum of up to 32 round
/// footprints along the long axis, at that many times the cost. Round footprints are passed to the model unchanged.
///
/// Thread-safe, allocates nothing; the arrays of the model must outlive it.
template <NdfModel M>
class AnisotropicNdf {
 public:
  /// @param width, height    size of the map, texels
  /// @param narrowest_sigma  as for isotropicParts
  /// @param most_parts       largest number of parts of a footprint, clamped to 1 to IsotropicParts::kMost; 1: no splitting
  /// @param boundary         of the map
  GLINT_HD AnisotropicNdf(const M& model, int width, int height, float narrowest_sigma = 0,
                          int most_parts = IsotropicParts::kMost, Boundary boundary = Boundary::wrap)
      : model_(model),
        width_(width),
        height_(height),
        narrowest_sigma_(narrowest_sigma),
        most_parts_(std::clamp(most_parts, 1, int{IsotropicParts::kMost})),
        boundary_(boundary) {}
  /// For a model of a pyramid. If the model has no normals, parts are at least as wide as footprints of level 0.
  GLINT_HD AnisotropicNdf(const M& model, int most_parts = IsotropicParts::kMost) requires requires {
    model.shape();
  } : AnisotropicNdf(model, model.shape().width, model.shape().height, model.hasNormals() ? 0 : finestSigma(model.shape()),
                     most_parts, model.shape().boundary) {
  }

  /// The model of round footprints.
  GLINT_HD const M& round() const { return model_; }
  /// Whether a footprint is passed to the model unchanged.
  GLINT_HD bool isWhole(const Footprint& p) const {
    return most_parts_ == 1 || (p.covariance.xx == p.covariance.yy && p.covariance.xy == 0);
  }
  /// Of a footprint that is split.
  GLINT_HD IsotropicParts parts(const Footprint& p) const {
    return isotropicParts(p, width_, height_, narrowest_sigma_, std::max(most_parts_, 2), boundary_);
  }

  /// Density towards h, >= 0.
  GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (isWhole(p)) return model_.density(p, h);
    return summed(parts(p), [&](const Footprint& part) { return model_.density(part, h); });
  }

  /// Average density over the pixel of the model's images that holds h.
  GLINT_HD float pixelMean(const Footprint& p, Vec2 h) const requires requires(const M& m) { m.pixelMean(p, h); }
  {
    if (isWhole(p)) return model_.pixelMean(p, h);
    return summed(parts(p), [&](const Footprint& part) { return model_.pixelMean(part, h); });
  }

  /// Density in linear sRGB towards psi, of a model that has it (WaveNdf).
  GLINT_HD Rgb densityRgb(const Footprint& p, Vec2 psi) const requires requires(const M& m) { m.densityRgb(p, psi); }
  {
    if (isWhole(p)) return model_.densityRgb(p, psi);
    const IsotropicParts all = parts(p);
    Rgb sum;
    for (int k = 0; k < all.count; ++k) sum = sum + all.weights[k] * model_.densityRgb(all.footprints[k], psi);
    return sum;
  }

  /// Density of each channel towards psi, of a model that has channels (WaveNdf).
  /// @param out  [model.channels()]
  GLINT_HD void densitySpectrum(const Footprint& p, Vec2 psi, float* out) const requires requires(const M& m) {
    m.densitySpectrum(p, psi, out);
  }
  {
    if (isWhole(p)) return model_.densitySpectrum(p, psi, out);
    const IsotropicParts all = parts(p);
    for (int c = 0; c < model_.channels(); ++c) out[c] = 0;
    for (int k = 0; k < all.count; ++k)
      model_.forEachChannel(all.footprints[k], psi, [&](int c, float density) { out[c] += all.weights[k] * density; });
  }

  /// Average density over a box of half vectors.
  GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    if (isWhole(p)) return model_.mean(p, range);
    return summed(parts(p), [&](const Footprint& part) { return model_.mean(part, range); });
  }

  /// Chooses a part by its weight and draws from it. The pdf is the density of all parts.
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    if (isWhole(p)) return model_.sample(p, xi);
    const IsotropicParts all = parts(p);
    int chosen = 0;
    float left = xi.x > 0 ? xi.x : 0;
    while (chosen + 1 < all.count && left >= all.weights[chosen]) left -= all.weights[chosen++];
    const float rescaled = std::min(left / all.weights[chosen], float{kBelowOne});
    const HalfVectorSample drawn = model_.sample(all.footprints[chosen], {rescaled, xi.y});
    return drawn.pdf > 0
               ? HalfVectorSample{drawn.h, summed(all, [&](const Footprint& part) { return model_.density(part, drawn.h); })}
               : HalfVectorSample{};
  }

 private:
  template <class Value>
  static GLINT_HD float summed(const IsotropicParts& all, Value&& value) {
    float sum = 0;
    for (int k = 0; k < all.count; ++k) sum += all.weights[k] * value(all.footprints[k]);
    return sum;
  }

  M model_;
  int width_;
  int height_;
  float narrowest_sigma_;
  int most_parts_;
  Boundary boundary_;
};

}  // namespace glint
