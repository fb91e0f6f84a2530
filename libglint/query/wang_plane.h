#pragma once

#include <cmath>
#include <cstdint>

#include "glint/query/anisotropic_ndf.h"
#include "glint/query/detail/wang/image_tiles.h"
#include "glint/query/detail/wang/tile_slices.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// The NDF of a plane of Wang tiles, from images of the tiles (Deng 2022, section 5.5).
///
/// A density, or a mean over half vectors, is the sum over the tiles that the footprint meets: of an image of each tile, times
/// the share of the footprint in the tile. Between the centres and the sizes of images see Interpolation::footprint. A stretched
/// footprint is up to 32 round ones, as in AnisotropicNdf. Beyond the last level answers tend to the mean of all tiles, so that no
/// footprint costs more than those of the last level. Below level 0 the images answer, too wide, as PyramidNdf without normals.
///
/// The centre of a footprint is (u, v) in tiles, and does not wrap. Floats lose texels far out: give the cell to movedTo(), as for
/// WangReference. Thread-safe, allocates nothing; the arrays of the asset must outlive it.
/// @tparam Images  PyramidTiles or CompressedTiles
template <class Images>
class WangPlane {
 public:
  using Asset = typename Images::Asset;

  /// @param most_parts  largest number of round footprints that stand for a stretched one; 1: one of the same mean square size
  GLINT_HD explicit WangPlane(const Asset& asset, Pixels pixels = Pixels::smooth, int most_parts = IsotropicParts::kMost)
      : images_(asset),
        chooser_(asset.plane, asset.images.shape),
        pixels_(pixels),
        most_parts_(std::clamp(most_parts, 1, int{IsotropicParts::kMost})),
        narrowest_(finestSigma(asset.images.shape)) {}

  GLINT_HD const WangLayout& layout() const { return chooser_.layout(); }
  GLINT_HD const PyramidShape& shape() const { return images_.shape(); }

  /// The plane seen from another cell: its cell (0, 0) is cell (cell_x, cell_y) of the asset's plane.
  GLINT_HD WangPlane movedTo(std::int64_t cell_x, std::int64_t cell_y) const {
    WangPlane moved = *this;
    moved.origin_x_ = static_cast<std::uint64_t>(cell_x);
    moved.origin_y_ = static_cast<std::uint64_t>(cell_y);
    return moved;
  }

  /// Density towards h, >= 0; O(1): nine pixels, or one (Pixels), of 16 or 32 images inside a tile, of up to four times as many at
  /// a corner.
  GLINT_DEVICE_CALL GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    const PixelPlace pixel = pixelPlace(shape(), h);
    if (pixels_ == Pixels::constant) return finitePositive(pixelMeanOf(p, pixel));
    return splineDensity(shape(), windowOf(p, pixel), h);
  }

  /// Average of the density over the pixel of the images that holds h, >= 0.
  GLINT_DEVICE_CALL GLINT_HD float pixelMean(const Footprint& p, Vec2 h) const {
    return insideSquare(h) ? finitePositive(pixelMeanOf(p, pixelPlace(shape(), h))) : 0.0f;
  }

  /// Average density over a box of half vectors, >= 0, 0 if the box is empty: as PyramidNdf::mean or CpNdf::mean.
  GLINT_DEVICE_CALL GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    if (!(range.width() > 0 && range.height() > 0)) return 0;
    const PlacedFootprint placed = place(p);
    float sum = 0;
    forEachPart(placed, [&](const Footprint& part, float weight) {
      TileSlices slices;
      choose(part, placed, slices);
      forEachGroup(slices, [&](const PyramidSlices& group) { sum += weight * images_.mean(group, range, pixels_); });
    });
    return finitePositive(sum);
  }

  /// Draws an image by its weight, and so a tile by the share of the footprint in it; then a pixel of the image, and a point in the
  /// pixel. The pdf is the density.
  GLINT_DEVICE_CALL GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    xi = clampUnit(xi);
    const PlacedFootprint placed = place(p);
    const Footprint part = chosenPart(placed.footprint, xi.x);
    TileSlices slices;
    choose(part, placed, slices);
    const int k = chooseIndex(
        slices.count, 1, [&](int i) { return slices.weights[i]; }, xi.x);
    if (k < 0) return {};
    const PixelPlace pixel = images_.draw(slices[k], xi);
    if (pixel.x < 0) return {};
    if (pixels_ == Pixels::constant) return drawnAt(pointInPixel(shape(), pixel, xi), finitePositive(pixelMeanOf(p, pixel)));
    return splineSample(shape(), pixel, windowOf(p, pixel), xi);
  }

 private:
  GLINT_HD bool isWhole(const Footprint& p) const {
    return most_parts_ == 1 || (p.covariance.xx == p.covariance.yy && p.covariance.xy == 0);
  }

  /// A footprint whose centre lies in a cell: [0, 1)^2 from its lower left corner.
  struct PlacedFootprint {
    std::uint64_t cell_x, cell_y;
    Footprint footprint;
  };
  GLINT_HD PlacedFootprint place(Footprint p) const { return place(p, origin_x_, origin_y_); }
  static GLINT_HD PlacedFootprint place(Footprint p, std::uint64_t from_x, std::uint64_t from_y) {
    const WangCell cell = wangCell(p.centre, from_x, from_y);
    p.centre = cell.at;
    return {cell.x, cell.y, p};
  }

  /// The round footprints of a stretched one. Their centres are on a map that is too large to be met twice, around its middle.
  static constexpr int kMapTiles = 64;
  GLINT_HD IsotropicParts partsOf(const Footprint& p) const {
    Footprint moved = p;
    moved.centre = {0.5f, 0.5f};
    const int size = kMapTiles * chooser_.size();
    IsotropicParts parts = isotropicParts(moved, size, size, narrowest_, std::max(most_parts_, 2), Boundary::wrap);
    const auto back = [](float at, float centre) { return centre + float{kMapTiles} * (at - 0.5f); };
    for (int k = 0; k < parts.count; ++k)
      parts.footprints[k].centre = {back(parts.footprints[k].centre.x, p.centre.x),
                                    back(parts.footprints[k].centre.y, p.centre.y)};
    return parts;
  }
  template <class Visit>
  GLINT_HD void forEachPart(const PlacedFootprint& placed, Visit&& visit) const {
    const Footprint& p = placed.footprint;
    if (isWhole(p)) return visit(p, 1.0f);
    const IsotropicParts parts = partsOf(p);
    for (int k = 0; k < parts.count; ++k) visit(parts.footprints[k], parts.weights[k]);
  }
  /// Chooses a part by its weight, and keeps the digits of xi that are left.
  GLINT_HD Footprint chosenPart(const Footprint& p, float& xi) const {
    if (isWhole(p)) return p;
    const IsotropicParts parts = partsOf(p);
    const int k = chooseIndex(
        parts.count, 1, [&](int i) { return parts.weights[i]; }, xi);
    return parts.footprints[k < 0 ? 0 : k];
  }

  /// The images of a round footprint, whose centre counts from a cell.
  GLINT_HD void choose(const Footprint& p, const PlacedFootprint& from, TileSlices& slices) const {
    const PlacedFootprint placed = place(p, from.cell_x, from.cell_y);
    chooser_.choose(
        placed.cell_x, placed.cell_y, placed.footprint.centre, p.covariance,
        [&](const PyramidSlice& slice) { return images_.isUsable(slice); }, slices);
  }

  GLINT_HD PixelWindow windowOf(const Footprint& p, const PixelPlace& pixel) const {
    const PlacedFootprint placed = place(p);
    PixelWindow sum;
    forEachPart(placed, [&](const Footprint& part, float weight) {
      TileSlices slices;
      choose(part, placed, slices);
      PixelWindow window;
      forEachGroup(slices, [&](const PyramidSlices& group) { images_.addWindow(group, pixel, window); });
      for (int y = 0; y < PixelWindow::kSize; ++y)
        for (int x = 0; x < PixelWindow::kSize; ++x) sum.pixels[y][x] += weight * window.pixels[y][x];
    });
    return sum;
  }
  GLINT_HD float pixelMeanOf(const Footprint& p, const PixelPlace& pixel) const {
    const PlacedFootprint placed = place(p);
    float sum = 0;
    forEachPart(placed, [&](const Footprint& part, float weight) {
      TileSlices slices;
      choose(part, placed, slices);
      forEachGroup(slices, [&](const PyramidSlices& group) { sum += weight * images_.pixelMean(group, pixel); });
    });
    return sum;
  }

  Images images_;
  TileChooser chooser_;
  Pixels pixels_;
  int most_parts_;
  float narrowest_;  // deviation of the footprints of level 0, texels
  std::uint64_t origin_x_ = 0, origin_y_ = 0;
};

static_assert(NdfModel<WangPlane<PyramidTiles>> && NdfModel<WangPlane<CompressedTiles>>);

}  // namespace glint
