#pragma once

#include "glint/model/ndf_pyramid.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/detail/pyramid/block_rows.h"
#include "glint/query/detail/pyramid/pyramid_reader.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"
#include "glint/query/reference.h"

namespace glint {

/// The NDF from a pyramid of images: exact (pixel means) at the centres of its levels, trilinear between them.
///
/// Footprints are answered as isotropic Gaussians of the same mean square size. Reference answers footprints below level 0 if
/// the normals are given; else level 0 does. Answers of footprints larger than the map tend to its mean (SliceChooser). The
/// density is constant over a pixel. Thread-safe, allocates nothing; the arrays must outlive it.
class PyramidNdf {
 public:
  GLINT_HD explicit PyramidNdf(const NdfPyramid& pyramid) : reader_(pyramid), chooser_(pyramid.shape) {}
  GLINT_HD PyramidNdf(const NdfPyramid& pyramid, const NormalMap& normals)
      : reader_(pyramid),
        chooser_(pyramid.shape),
        below_(Reference(normals, pyramid.shape.sigma_r, pyramid.shape.surface, pyramid.shape.boundary,
                         Reference::Search::pruned)) {}

  GLINT_HD const NdfPyramid& pyramid() const { return reader_.pyramid(); }
  GLINT_HD const PyramidShape& shape() const { return pyramid().shape; }
  /// Whether footprints below level 0 are answered from the texels.
  GLINT_HD bool hasNormals() const { return below_.hasMap(); }
  /// Whether this footprint is answered from the texels.
  GLINT_HD bool fromTexels(const Footprint& p) const { return hasNormals() && belowFinest(shape(), p); }

  /// Density towards h, >= 0; O(1): one pixel in each of 8 images.
  GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    if (fromTexels(p)) return below_.density(p, h);
    return reader_.pixelDensity(chooser_.choose(p), pixelPlace(shape(), h));
  }

  /// Draws an image by its weight, a block by its mass (Deng 2022, section 5.2), a pixel by its value, and a point evenly in
  /// the pixel. The pdf is the density, whose integral is that of the images: 1 within 1e-3 in every valid file, within 1e-5 as
  /// glint-pyramid builds them. O(stored blocks of one image + 256).
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    if (fromTexels(p)) return below_.sample(p, clampUnit(xi));
    PyramidReader::Draw draw = reader_.chooseImage(chooser_.choose(p), xi);
    reader_.findBlocks(draw);
    reader_.prefetchIndex(draw.slices);
    reader_.chooseBlock(draw);
    reader_.choosePixel(draw);
    if (draw.place.x < 0) return {};
    return drawnAt(pointInPixel(shape(), draw.place, draw.xi), reader_.pixelDensity(draw.slices, draw.place));
  }

  /// Average density over a box of half vectors, 0 if the box is empty. O(1) for each block that the box covers: the means of
  /// whole blocks are stored, and a block that is covered in part sums at most 256 pixels.
  GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    if (fromTexels(p)) return below_.mean(p, range);
    PyramidReader::PendingMean pending;
    reader_.beginMean(chooser_.choose(p), range, pending);
    return reader_.finishMean(range, pending);
  }

 private:
  PyramidReader reader_;
  SliceChooser chooser_;
  Reference below_;
};

static_assert(NdfModel<PyramidNdf>);

}  // namespace glint
