#pragma once

#include <cmath>

#include "glint/model/ndf_pyramid.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/detail/pyramid/block_rows.h"
#include "glint/query/detail/pyramid/pyramid_reader.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"
#include "glint/query/detail/pyramid/texel_blend.h"
#include "glint/query/interpolation.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// The NDF from a pyramid of images.
///
/// Footprints are answered as isotropic Gaussians of the same mean square size. Between the centres and the sizes of the images
/// see Interpolation. ManifoldNdf answers footprints below level 0 from the normals of the map, given or kept in the asset, blended
/// with the images up to a fifth above it (TexelBlend). Without normals level 0 answers them, too wide (smallestSigma). Answers
/// of footprints larger than the
/// map tend to its mean (SliceChooser). Between the half vectors of a pixel see Pixels. Thread-safe, allocates nothing; the arrays
/// must outlive it.
class PyramidNdf {
 public:
  GLINT_HD explicit PyramidNdf(const NdfPyramid& pyramid, Interpolation interpolation = Interpolation::footprint,
                               Pixels pixels = Pixels::smooth)
      : reader_(pyramid),
        chooser_(pyramid.shape, interpolation),
        pixels_(pixels),
        below_(pyramid.shape, pyramid.near_normals) {}
  /// @param normals  a NormalMap or NearNormals; instead of those that the asset keeps
  GLINT_HD PyramidNdf(const NdfPyramid& pyramid, const NearNormals& normals,
                      Interpolation interpolation = Interpolation::footprint, Pixels pixels = Pixels::smooth)
      : reader_(pyramid), chooser_(pyramid.shape, interpolation), pixels_(pixels), below_(pyramid.shape, normals) {}

  GLINT_HD const NdfPyramid& pyramid() const { return reader_.pyramid(); }
  GLINT_HD const PyramidShape& shape() const { return pyramid().shape; }
  GLINT_HD const PyramidReader& reader() const { return reader_; }
  GLINT_HD const SliceChooser& chooser() const { return chooser_; }
  GLINT_HD Pixels pixels() const { return pixels_; }
  /// Whether footprints below level 0 are answered from the texels.
  GLINT_HD bool hasNormals() const { return below_.hasNormals(); }
  /// Whether the texels have a share in the answer of this footprint.
  GLINT_HD bool fromTexels(const Footprint& p) const { return below_.share(p) > 0; }
  /// Deviation of the smallest footprint that is answered as wide as it is asked for, texels; 0 with normals. Smaller ones are
  /// answered up to this wide.
  GLINT_HD float smallestSigma() const { return hasNormals() ? 0 : std::sqrt(smallestSeenVariance(shape())); }

  /// Density towards h, >= 0; O(1): nine pixels, or one (Pixels), in each of 16 or 32 images, or of 8 (Interpolation).
  GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    return below_.density(p, h, [&] { return imageDensity(p, h); });
  }

  /// Average of the density over the pixel of the images that holds h, >= 0; O(1): one pixel in each image.
  GLINT_HD float pixelMean(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    const PixelPlace place = pixelPlace(shape(), h);
    return below_.mean(p, boxOfPixel(shape(), place), [&] { return reader_.pixelMean(chooser_.choose(p), place); });
  }

  /// Draws an image by its weight, a block by its mass (Deng 2022, section 5.2), a pixel by its value, and a point in the pixel
  /// by its density. The pdf is the density, whose integral is that of the images: 1 within 1e-3 in every valid file, within 1e-5 as
  /// glint-pyramid builds them. O(stored blocks of one image + 256).
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    return below_.sample(
        p, xi, [&](Vec2 x) { return imageSample(p, x); }, [&](Vec2 h) { return insideSquare(h) ? imageDensity(p, h) : 0.0f; });
  }

  /// Average density over a box of half vectors, >= 0, 0 if the box is empty: exact over whole pixels. Edges that cut pixels
  /// see BoxEdge. O(1) for each block that the box covers: the means of whole blocks are stored, and a block that is covered in
  /// part sums at most 256 pixels.
  GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    return below_.mean(p, range, [&] {
      PyramidReader::PendingMean pending;
      reader_.beginMean(chooser_.choose(p), range, pixels_, pending);
      return reader_.finishMean(range, pending);
    });
  }

 private:
  GLINT_HD float imageDensity(const Footprint& p, Vec2 h) const {
    const PyramidSlices chosen = chooser_.choose(p);
    const PixelPlace place = pixelPlace(shape(), h);
    if (pixels_ == Pixels::constant) return reader_.pixelMean(chosen, place);
    return splineDensity(shape(), reader_.window(chosen, place), h);
  }

  GLINT_HD HalfVectorSample imageSample(const Footprint& p, Vec2 xi) const {
    PyramidReader::Draw draw = reader_.chooseImage(chooser_.choose(p), xi);
    reader_.findBlocks(draw);
    reader_.prefetchIndex(draw.slices);
    reader_.chooseBlock(draw);
    reader_.choosePixel(draw);
    if (draw.place.x < 0) return {};
    if (pixels_ == Pixels::constant)
      return drawnAt(pointInPixel(shape(), draw.place, draw.xi), reader_.pixelMean(draw.slices, draw.place));
    return splineSample(shape(), draw.place, reader_.window(draw.slices, draw.place), draw.xi);
  }

  PyramidReader reader_;
  SliceChooser chooser_;
  Pixels pixels_;
  TexelBlend below_;
};

static_assert(NdfModel<PyramidNdf>);

}  // namespace glint
