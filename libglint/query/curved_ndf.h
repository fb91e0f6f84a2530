#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/half_vector.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/detail/common/texel_choice.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// Change of the half vector in the tangent frame from one pixel to the next, for a distant light. The frame turns with the normal,
/// so the half vector turns the other way in it; and the direction to the eye turns, too.
/// @param h    in the tangent frame
/// @param dn   change of the unit normal of the surface, without the map
/// @param dwo  change of the direction to the eye: minus that of the ray; all in the tangent frame
inline GLINT_HD Vec2 halfVectorDifferential(const HalfVector& h, Vec3 dn, Vec3 dwo) {
  const float scale = 0.5f / h.towards, along = h.disk.x * dwo.x + h.disk.y * dwo.y + h.cosine * dwo.z;
  return {scale * (dwo.x - h.disk.x * along) - h.cosine * dn.x, scale * (dwo.y - h.disk.y * along) - h.cosine * dn.y};
}

/// Half widths of the box of half vectors that a pixel sees.
///
/// For a filter of half a pixel the box is two pixels wide: boxes of neighbouring pixels cover each half vector equally often where
/// the frame lies along the rows of pixels, so that a highlight keeps its light wherever it falls.
/// @param dhdx, dhdy    halfVectorDifferential of the next pixel along x and along y
/// @param filter_sigma  deviation of the pixel's filter, pixels: kPixelFilterSigma, or sampleFilterSigma(n) for one of n samples
inline GLINT_HD Vec2 halfVectorSpread(Vec2 dhdx, Vec2 dhdy, float filter_sigma) {
  const float scale = 2 * filter_sigma;
  return {scale * std::sqrt(dhdx.x * dhdx.x + dhdy.x * dhdy.x), scale * std::sqrt(dhdx.y * dhdx.y + dhdy.y * dhdy.y)};
}

/// The NDF that a pixel sees on a curved surface: that of the footprint, averaged over the half vectors that the turning of the
/// surface spreads over the pixel. Without it, highlights of narrow lobes alias where a pixel covers more of a curve than the lobe is
/// wide.
///
/// Half vectors fill a box evenly. So a density is one mean of the model, and costs as much. Places in the pixel and half vectors
/// count as independent.
/// Holds a pointer to the model, which must outlive it. Thread-safe, allocates nothing.
template <NdfModel M>
class CurvedNdf {
 public:
  /// @param spread  half widths of the box of half vectors, from halfVectorSpread; what is not above 0 counts as 0
  GLINT_HD CurvedNdf(const M& model, Vec2 spread) : model_(&model), half_{halfWidth(spread.x), halfWidth(spread.y)} {}
  CurvedNdf(const M&& model, Vec2 spread) = delete;

  GLINT_HD const M& model() const { return *model_; }

  /// Density towards h, >= 0.
  GLINT_HD NdfValueOf<M> density(const Footprint& p, Vec2 h) const {
    if (isFlat()) return model_->density(p, h);
    if (!insideSquare(h)) return {};
    return model_->mean(p, around(h));
  }

  /// Average density over a box of half vectors. Along each axis the box and the spread of the pixel change places if the box is the
  /// narrower: the model answers the mean over the wider one, and Gauss's rule of three points adds up the other. The rule is exact
  /// for lobes wider than the narrower box; of lobes that are much narrower it may miss, or count twice, up to a fifth.
  GLINT_HD NdfValueOf<M> mean(const Footprint& p, const Box2& range) const {
    if (isFlat()) return model_->mean(p, range);
    const Vec2 centre = 0.5f * (range.low + range.high), half = {0.5f * range.width(), 0.5f * range.height()};
    if (!(half.x > 0 && half.y > 0)) return {};
    const Vec2 wide = {std::max(half.x, half_.x), std::max(half.y, half_.y)};
    const Vec2 narrow = {std::min(half.x, half_.x), std::min(half.y, half_.y)};
    constexpr float kNode = 0.7745966692414834f, kWeights[3] = {5.0f / 18, 8.0f / 18, 5.0f / 18};
    NdfValueOf<M> sum{};
    for (int j = 0; j < 3; ++j) {
      for (int i = 0; i < 3; ++i) {
        const Vec2 at =
            centre + Vec2{kNode * narrow.x * static_cast<float>(i - 1), kNode * narrow.y * static_cast<float>(j - 1)};
        sum = sum + (kWeights[i] * kWeights[j]) * model_->mean(p, {at - wide, at + wide});
      }
    }
    return sum;
  }

  /// Half vector with probability density `density`, which is its pdf: one of the model, moved by the digits of `xi` that the model
  /// does not need.
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    constexpr int kDigits = 13;  // of the 24 of a float
    xi = clampUnit(xi);
    return sample(p, xi, {lowerDigits(xi.x, kDigits), lowerDigits(xi.y, kDigits)});
  }
  /// The same from four random numbers.
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi, Vec2 offset) const {
    const HalfVectorSample drawn = model_->sample(p, xi);
    if (isFlat() || !(drawn.pdf > 0)) return drawn;
    const Vec2 turn = clampUnit(offset);
    const Vec2 h = drawn.h + Vec2{half_.x * (2 * turn.x - 1), half_.y * (2 * turn.y - 1)};
    return drawnAt(h, density(p, h));
  }

 private:
  static constexpr float kWidest = 0.5f;  ///< beyond it a pixel covers most of a ball, and nothing is sharp

  static GLINT_HD float halfWidth(float width) { return width > 0 ? std::min(width, float{kWidest}) : 0.0f; }
  GLINT_HD bool isFlat() const { return half_.x == 0 && half_.y == 0; }

  /// A box around h; one that has a width along both axes, or it would have no area.
  GLINT_HD Box2 around(Vec2 h) const {
    constexpr float kLeast = 1e-4f;
    const Vec2 half = {std::max(half_.x, kLeast), std::max(half_.y, kLeast)};
    return {h - half, h + half};
  }

  const M* model_;
  Vec2 half_;
};

}  // namespace glint
