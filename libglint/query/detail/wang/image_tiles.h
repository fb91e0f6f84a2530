#pragma once

#include "glint/query/cp_ndf.h"
#include "glint/query/detail/pyramid/pyramid_reader.h"
#include "glint/query/detail/wang/tile_slices.h"
#include "glint/query/pyramid_ndf.h"

namespace glint {

// Images of tiles as a plane asks them. Both classes answer the same questions to images that are chosen already.

/// The images of a WangPyramid.
class PyramidTiles {
 public:
  using Asset = WangPyramid;

  GLINT_HD explicit PyramidTiles(const WangPyramid& asset) : reader_(asset.images) {}
  GLINT_HD const PyramidShape& shape() const { return reader_.shape(); }

  /// Whether an image has any density.
  GLINT_HD bool isUsable(const PyramidSlice&) const { return true; }
  /// Adds the pixels around a place, times the weights of the images.
  GLINT_HD void addWindow(const PyramidSlices& chosen, const PixelPlace& place, PixelWindow& sum) const {
    const PixelWindow part = reader_.window(chosen, place);
    for (int y = 0; y < PixelWindow::kSize; ++y)
      for (int x = 0; x < PixelWindow::kSize; ++x) sum.pixels[y][x] += part.pixels[y][x];
  }
  GLINT_HD float pixelMean(const PyramidSlices& chosen, const PixelPlace& place) const {
    return reader_.pixelMean(chosen, place);
  }
  /// Mean over a box, which has an area; may be below 0.
  GLINT_HD float mean(const PyramidSlices& chosen, const Box2& range, Pixels pixels) const {
    PyramidReader::PendingMean pending;
    reader_.beginMean(chosen, range, pixels, pending);
    return reader_.finishMean(range, pending);
  }
  /// Draws a pixel of an image in proportion to its value.
  /// @param xi  set to the digits that are left
  /// @return x = -1 if the image has no pixel
  GLINT_HD PixelPlace draw(const PyramidSlice& image, Vec2& xi) const {
    PyramidReader::Draw draw;
    draw.xi = xi;
    draw.chosen = image;
    reader_.findBlocks(draw);
    reader_.chooseBlock(draw);
    reader_.choosePixel(draw);
    xi = draw.xi;
    return draw.place;
  }

 private:
  PyramidReader reader_;
};

/// The images of a WangCp.
class CompressedTiles {
 public:
  using Asset = WangCp;

  GLINT_HD explicit CompressedTiles(const WangCp& asset) : images_(asset.images) {}
  GLINT_HD const PyramidShape& shape() const { return images_.shape(); }

  GLINT_HD bool isUsable(const PyramidSlice& slice) const { return ndf().density_scales.data()[images_.imageOf(slice)] > 0; }
  GLINT_HD void addWindow(const PyramidSlices& chosen, const PixelPlace& place, PixelWindow& sum) const {
    withReader(ndf(), [&](const auto& reader) {
      const PixelWindow part = images_.window(reader, chosen, place);
      for (int y = 0; y < PixelWindow::kSize; ++y)
        for (int x = 0; x < PixelWindow::kSize; ++x) sum.pixels[y][x] += part.pixels[y][x];
    });
  }
  GLINT_HD float pixelMean(const PyramidSlices& chosen, const PixelPlace& place) const {
    return images_.imageMean(chosen, place);
  }
  GLINT_HD float mean(const PyramidSlices& chosen, const Box2& range, Pixels pixels) const {
    return images_.signedImageMean(chosen, range, pixels);
  }
  GLINT_HD PixelPlace draw(const PyramidSlice& image, Vec2& xi) const {
    PyramidSlices alone;
    alone.levels[0] = image.level;
    for (int k = 0; k < 4; ++k) alone.images[k] = image.image, alone.weights[k] = k == 0 ? 1.0f : 0.0f;
    alone.count = 4;
    CpNdf::Draw draw = images_.chooseImage(alone, xi);
    images_.chooseBlock(draw);
    images_.findBlockSlice(draw);
    if (draw.possible) withReader(ndf(), [&](const auto& reader) { images_.choosePixel(reader, draw); });
    xi = draw.xi;
    return draw.place;
  }

 private:
  GLINT_HD const NdfCp& ndf() const { return images_.ndfCp(); }

  CpNdf images_;
};

}  // namespace glint
