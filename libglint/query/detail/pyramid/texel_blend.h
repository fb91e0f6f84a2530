#pragma once

#include <algorithm>
#include <optional>

#include "glint/model/ndf_pyramid.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"
#include "glint/query/manifold_ndf.h"

namespace glint {

/// Variance of the smallest footprint that the images of level 0 see as it is asked for, texels^2. It exceeds the variance of
/// level 0 by the variance that linear interpolation between two centres adds: a sixth of the squared gap.
inline GLINT_HD float smallestSeenVariance(const PyramidShape& shape) {
  const float finest = finestSigma(shape), gap = shape.levels[0].stride / shape.overlap;
  return finest * finest + gap * gap / 6;
}

/// Answers footprints below level 0 of a pyramid from the texels, and blends texels and images above it.
///
/// At the size of level 0 images of neighbouring centres see a wider footprint than the one that is asked for. So the share of the
/// texels falls from 1 at the size of level 0 to 0 where the images see the footprint that is asked for (smallestSeenVariance). A
/// change of 1 % in size then changes the density by at most 3 % (root mean square over half vectors).
class TexelBlend {
 public:
  /// Without normals: images answer everything.
  TexelBlend() = default;
  GLINT_HD TexelBlend(const PyramidShape& shape, const NearNormals& normals)
      : texels_(normals, shape.sigma_r, shape.surface, shape.boundary) {
    const float finest = finestSigma(shape);
    const auto width = static_cast<float>(shape.width), height = static_cast<float>(shape.height);
    largest_u_ = width * width;
    largest_v_ = height * height;
    end_ = smallestSeenVariance(shape);
    per_range_ = 1 / (end_ - finest * finest);
  }

  /// The normals that an asset keeps, if there are any.
  GLINT_HD TexelBlend(const PyramidShape& shape, const std::optional<NearNormals>& kept)
      : TexelBlend(kept ? TexelBlend(shape, *kept) : TexelBlend()) {}

  GLINT_HD bool hasNormals() const { return texels_.hasMap(); }

  /// Share of the texels in the answer of a footprint, 0 to 1.
  GLINT_HD float share(const Footprint& p) const {
    if (!hasNormals()) return 0;
    const float left = per_range_ * (end_ - isotropicVariance(largest_u_, largest_v_, p.covariance));
    return left < 1 ? std::max(left, 0.0f) : 1.0f;
  }

  /// @param images  returns the density of the images towards h
  template <class Images>
  GLINT_HD float density(const Footprint& p, Vec2 h, Images&& images) const {
    return blend(
        share(p), [&] { return texels_.density(p, h); }, images);
  }
  /// @param images  returns the mean of the images over the range
  template <class Images>
  GLINT_HD float mean(const Footprint& p, const Box2& range, Images&& images) const {
    return blend(
        share(p), [&] { return texels_.mean(p, range); }, images);
  }

  /// Chooses texels or images by their share, with xi.x. The pdf is the blended density.
  /// @param draw     draw(xi): a sample of the images
  /// @param density  density(h): of the images
  template <class Draw, class Density>
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi, Draw&& draw, Density&& density) const {
    const float part = share(p);
    if (!(part > 0)) return draw(xi);
    if (!(part < 1)) return texels_.sample(p, clampUnit(xi));
    xi = clampUnit(xi);
    if (xi.x < part) {
      const HalfVectorSample drawn = texels_.sample(p, {clampUnit(xi.x / part), xi.y});
      return drawn.pdf > 0 ? HalfVectorSample{drawn.h, part * drawn.pdf + (1 - part) * density(drawn.h)} : drawn;
    }
    const HalfVectorSample drawn = draw(Vec2{clampUnit((xi.x - part) / (1 - part)), xi.y});
    return drawn.pdf > 0 ? HalfVectorSample{drawn.h, part * texels_.density(p, drawn.h) + (1 - part) * drawn.pdf} : drawn;
  }

 private:
  template <class Texels, class Images>
  static GLINT_HD float blend(float share, Texels&& texels, Images&& images) {
    if (!(share > 0)) return images();
    if (!(share < 1)) return texels();
    return share * texels() + (1 - share) * images();
  }

  ManifoldNdf texels_;
  float largest_u_ = 0, largest_v_ = 0;  // texels^2
  float end_ = 0;                        // variance from which on the images answer alone, texels^2
  float per_range_ = 0;
};

}  // namespace glint
