#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/tiny_example.h"
#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/tiny/normal_lobe.h"
#include "glint/query/detail/tiny/normal_turn.h"

namespace glint {

/// The elements of an example: each texel's normal and, on a smooth surface, its Jacobian.
class ExampleElements {
 public:
  GLINT_HD explicit ExampleElements(const TinyExample& example)
      : normals_(example.normals.data()),
        size_(example.size()),
        wraps_(example.mode == TinyMode::tiled),
        smooth_(example.images.shape.surface == Surface::smooth) {}

  GLINT_HD bool smooth() const { return smooth_; }
  /// @param i, j  in [0, n)
  GLINT_HD Vec2 normal(int i, int j) const { return normals_[rowMajorIndex(i, j, size_)]; }
  /// Change of the normal per texel: columns are the changes along x and y. Zero on a flat surface.
  GLINT_HD Matrix2 jacobian(int i, int j) const {
    if (!smooth_) return {0, 0, 0, 0};
    const Vec2 x = difference(i, [&](int k) { return normal(k, j); }), y = difference(j, [&](int k) { return normal(i, k); });
    return {x.x, y.x, x.y, y.y};
  }
  /// Texel at a position of the example, clamped to it.
  /// @param x  texels from the lower left corner
  GLINT_HD int texelOf(float x) const { return std::clamp(static_cast<int>(std::floor(x)), 0, size_ - 1); }

 private:
  /// Central difference; an example that does not repeat has one-sided differences at its border.
  template <class Normal>
  GLINT_HD Vec2 difference(int k, Normal&& at) const {
    int before = k - 1, after = k + 1;
    if (wraps_) {
      before = before < 0 ? size_ - 1 : before, after = after == size_ ? 0 : after;
      return 0.5f * (at(after) - at(before));
    }
    before = std::max(before, 0), after = std::min(after, size_ - 1);
    return (1.0f / static_cast<float>(after - before)) * (at(after) - at(before));
  }

  const Vec2* normals_;
  int size_;
  bool wraps_, smooth_;
};

/// Deviation of the Gaussian that stands for an element, in sides of its square: sigma_h of Yan 2016, whose full width at half
/// maximum is the side.
inline constexpr float kSeedSigma = 0.42466090f;

/// The share of a Gaussian footprint in the elements of a smooth surface (Xing 2024, Eq. 1; Yan 2016).
///
/// Footprint and element are Gaussians of texture space. Their product is one too: its weight is the share of the element, and its
/// mean and covariance, carried to the disk by the Jacobian, are the element's normals that the footprint sees.
class ElementFootprint {
 public:
  /// @param c     covariance of the footprint, texels^2
  /// @param side  of an element, texels
  GLINT_HD ElementFootprint(const UsableCovariance& c, float side) {
    const double seed = double{kSeedSigma} * double{kSeedSigma} * double{side} * double{side};
    const double xx = c.xx + seed, yy = c.yy + seed, xy = c.xy, scale = seed / (xx * yy - xy * xy);
    toMean_ = {static_cast<float>(scale * yy), static_cast<float>(-scale * xy), static_cast<float>(-scale * xy),
               static_cast<float>(scale * xx)};
    inside_ = {static_cast<float>(seed * (1 - scale * yy)), static_cast<float>(seed * scale * xy),
               static_cast<float>(seed * (1 - scale * xx))};
  }

  /// Lobe of the normals that are seen.
  /// @param normal    of the element's middle
  /// @param jacobian  change of the normal per texel
  /// @param away      from the element's middle to the centre of the footprint, texels
  GLINT_HD NormalLobe lobe(Vec2 normal, const Matrix2& jacobian, Vec2 away, float sigma_r) const {
    const Vec2 mean = normal + jacobian * (toMean_ * away);
    const Vec2 x = {jacobian.xx, jacobian.xy}, y = {jacobian.yx, jacobian.yy};
    const auto form = [&](Vec2 a, Vec2 b) {
      return inside_.xx * a.x * b.x + inside_.xy * (a.x * b.y + a.y * b.x) + inside_.yy * a.y * b.y;
    };
    const float variance = sigma_r * sigma_r;
    return NormalLobe(mean, Covariance{form(x, x) + variance, form(x, y), form(y, y) + variance});
  }

 private:
  Matrix2 toMean_;
  Covariance inside_;
};

}  // namespace glint
