#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/model/tiny_example.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/detail/pyramid/block_rows.h"
#include "glint/query/detail/pyramid/pyramid_reader.h"
#include "glint/query/detail/tiny/scattered_pieces.h"
#include "glint/query/detail/tiny/tiled_pieces.h"
#include "glint/query/detail/tiny/tiny_pieces.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// The NDF of a plane without end that is covered by copies of a small example (Xing 2024).
///
/// A footprint's centre counts in cells of n texels and does not wrap; sizes are in texels of the plane. Far out, where floats have
/// no digits left for a position in a cell, give the cell to movedTo(). Boxes count as Gaussians of the same second moments.
///
/// The footprint is carried to the frames of the examples that it covers and weighs tiles there, or elements where it covers few.
/// The work is bounded: at most 128 images and 128 lobes, of 96 examples. A half vector is carried to an example's frame as NormalTurn says, with the
/// change of area; so a facet's roughness is stretched as the relief is, in images, and is sigma_r in elements.
/// Thread-safe, allocates nothing; the arrays must outlive it.
class TinyExampleNdf {
 public:
  GLINT_HD explicit TinyExampleNdf(const TinyExample& example)
      : example_(example), reader_(example.images), tiled_(example), scattered_(example) {}

  /// The same plane with another origin: cells count from cell (x, y).
  GLINT_HD TinyExampleNdf movedTo(std::int64_t cell_x, std::int64_t cell_y) const {
    TinyExampleNdf moved = *this;
    moved.cell_x_ = cell_x, moved.cell_y_ = cell_y;
    return moved;
  }

  GLINT_HD const TinyExample& example() const { return example_; }
  /// Deviation, texels, from which on every footprint is answered by the mean of the plane; 0: none is, but weights of tiles tend to
  /// even ones.
  GLINT_HD float largestSigma() const { return isTiled() ? 0 : scattered_.largestSigma(); }

  /// Density towards h, >= 0.
  GLINT_DEVICE_CALL GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    TinyPieces pieces;
    collect(p, pieces);
    return density(pieces, h);
  }

  /// Average density over a box of half vectors; 0 if the box is empty. Exact over images that do not turn; over those that do, the
  /// box is divided into at most 16 x 16 boxes, each carried to the example's frame as a box of the same second moments.
  GLINT_DEVICE_CALL GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    const Box2 box = insideSquare(range);
    const float area = range.area();
    if (!(box.width() > 0 && box.height() > 0)) return 0;
    TinyPieces pieces;
    collect(p, pieces);
    float mass = pieces.background > 0 ? pieces.background * background().mass(box) : 0;
    for (int k = 0; k < pieces.lobe_count; ++k) mass += pieces.lobe_weights[k] * pieces.lobes[k].mass(box);
    if (pieces.mean > 0) mass += pieces.mean * massOf(meanSlice(), box);
    for (int e = 0; e < pieces.example_count; ++e)
      if (pieces.first[e] >= 0) mass += massOf(pieces, e, box);
    return finitePositive(mass / area);
  }

  /// Draws a piece by its weight and a half vector from it. The pdf is the density.
  GLINT_DEVICE_CALL GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    xi = clampUnit(xi);
    TinyPieces pieces;
    collect(p, pieces);
    const int lobes = pieces.lobe_count, images = pieces.image_count;
    const auto weight = [&](int k) {
      if (k < lobes) return pieces.lobe_weights[k];
      if (k < lobes + images) return pieces.weights[k - lobes];
      return k == lobes + images ? pieces.background : pieces.mean;
    };
    const int k = chooseIndex(lobes + images + 2, 1, weight, xi.x);
    Vec2 h;
    if (k < 0) return {};
    if (k < lobes || k == lobes + images) {
      h = (k < lobes ? pieces.lobes[k] : background()).sample(xi);
    } else {
      const bool is_mean = k > lobes + images;
      const HalfVectorSample drawn = drawFrom(is_mean ? meanSlice() : sliceOf(pieces, k - lobes), xi);
      if (!(drawn.pdf > 0)) return {};
      h = drawn.h;
      if (!is_mean) {
        const NormalTurn& turn = pieces.turns[exampleOf(pieces, k - lobes)];
        if (!turn.isRigid() && !(dot(h, h) < 1)) return {};
        h = turn.turned(h);
      }
    }
    return insideSquare(h) ? drawnAt(h, density(pieces, h)) : HalfVectorSample{};
  }

 private:
  GLINT_HD bool isTiled() const { return example_.mode == TinyMode::tiled; }

  GLINT_HD void collect(const Footprint& p, TinyPieces& pieces) const {
    const PlanePoint point = pointOf(p.centre);
    if (!isTiled()) return scattered_.collect(point, p.covariance, pieces);
    tiled_.collect(point, p.covariance, pieces);
    pieces.normalise(1);
  }

  /// Position of a centre that is given in cells; numbers that are not finite become 0.
  GLINT_HD PlanePoint pointOf(Vec2 uv) const {
    constexpr float kFar = 1e18f;
    const auto usable = [](float x) { return std::fabs(x) < kFar ? x : 0.0f; };
    const Vec2 cells = {usable(uv.x), usable(uv.y)};
    const float x = std::floor(cells.x), y = std::floor(cells.y), n = static_cast<float>(example_.size());
    // Sums wrap: a cell may be any number of 64 bits.
    const auto moved = [](std::int64_t origin, float cells_away) {
      return static_cast<std::int64_t>(static_cast<std::uint64_t>(origin) +
                                       static_cast<std::uint64_t>(static_cast<std::int64_t>(cells_away)));
    };
    return {moved(cell_x_, x), moved(cell_y_, y), {n * (cells.x - x), n * (cells.y - y)}};
  }

  GLINT_HD NormalLobe background() const { return NormalLobe(Vec2{}, example_.background_sigma_r); }

  /// One image as the slices that PyramidReader reads.
  static GLINT_HD PyramidSlices oneSlice(int level, int image) {
    PyramidSlices slices;
    slices.levels[0] = level;
    for (int k = 0; k < 4; ++k) slices.images[k] = static_cast<std::uint32_t>(image), slices.weights[k] = k == 0 ? 1.0f : 0.0f;
    slices.count = 4;
    return slices;
  }
  GLINT_HD PyramidSlices meanSlice() const { return oneSlice(example_.meanLevel(), 0); }
  GLINT_HD PyramidSlices sliceOf(const TinyPieces& pieces, int k) const { return oneSlice(pieces.levels[k], pieces.images[k]); }

  /// Calls visitor(slices) for the images of an example, in groups that PyramidReader takes. Images of an example have one level.
  template <class Visitor>
  static GLINT_HD void forEachGroup(const TinyPieces& pieces, int example, Visitor&& visitor) {
    int k = pieces.first[example];
    while (k >= 0) {
      PyramidSlices slices;
      for (; k >= 0 && slices.count < PyramidSlices::kMost; k = pieces.next[k]) {
        slices.levels[slices.count / 4] = pieces.levels[k];
        slices.images[slices.count] = static_cast<std::uint32_t>(pieces.images[k]);
        slices.weights[slices.count++] = pieces.weights[k];
      }
      for (; slices.count % 4 != 0; ++slices.count)
        slices.images[slices.count] = slices.images[0], slices.weights[slices.count] = 0;
      visitor(slices);
    }
  }
  static GLINT_HD int exampleOf(const TinyPieces& pieces, int image) {
    for (int e = 0; e < pieces.example_count; ++e)
      for (int k = pieces.first[e]; k >= 0; k = pieces.next[k])
        if (k == image) return e;
    return 0;
  }

  GLINT_HD float density(const TinyPieces& pieces, Vec2 h) const {
    const PyramidShape& shape = example_.images.shape;
    float sum = pieces.background > 0 ? pieces.background * background().density(h) : 0;
    for (int k = 0; k < pieces.lobe_count; ++k) sum += pieces.lobe_weights[k] * pieces.lobes[k].density(h);
    if (pieces.mean > 0) sum += pieces.mean * splineDensity(shape, reader_.window(meanSlice(), pixelPlace(shape, h)), h);
    for (int e = 0; e < pieces.example_count; ++e) {
      if (pieces.first[e] < 0) continue;
      const NormalTurn::Pulled pulled = pieces.turns[e].pulledBack(h);
      if (!(pulled.factor > 0 && insideSquare(pulled.h))) continue;
      PixelWindow window;
      const PixelPlace place = pixelPlace(shape, pulled.h);
      forEachGroup(pieces, e, [&](const PyramidSlices& slices) {
        const PixelWindow part = reader_.window(slices, place);
        for (int y = 0; y < PixelWindow::kSize; ++y)
          for (int x = 0; x < PixelWindow::kSize; ++x) window.pixels[y][x] += part.pixels[y][x];
      });
      sum += pulled.factor * splineDensity(shape, window, pulled.h);
    }
    return finitePositive(sum);
  }

  GLINT_HD float massOf(const PyramidSlices& slices, const Box2& box) const {
    PyramidReader::PendingMean pending;
    reader_.beginMean(slices, box, Pixels::smooth, pending);
    return box.area() * reader_.finishMean(box, pending);
  }

  /// Mass of the images of an example in a box of half vectors of the plane.
  GLINT_HD float massOf(const TinyPieces& pieces, int example, const Box2& box) const {
    constexpr int kMostParts = 16;
    const NormalTurn& turn = pieces.turns[example];
    float mass = 0;
    const auto add = [&](const Box2& part, float factor) {
      if (!(part.width() > 0 && part.height() > 0)) return;
      forEachGroup(pieces, example, [&](const PyramidSlices& slices) { mass += factor * massOf(slices, part); });
    };
    if (isTiled()) {
      add(box, 1);
      return mass;
    }
    const float pixel = 2 / static_cast<float>(example_.images.shape.resolution);
    const auto parts = [&](float side) {
      return std::clamp(static_cast<int>(std::ceil(2 * side / pixel)), 1, int{kMostParts});
    };
    const int columns = parts(box.width()), rows = parts(box.height());
    const float w = box.width() / static_cast<float>(columns), h = box.height() / static_cast<float>(rows);
    for (int j = 0; j < rows; ++j) {
      for (int i = 0; i < columns; ++i) {
        const Vec2 middle = box.low + Vec2{(static_cast<float>(i) + 0.5f) * w, (static_cast<float>(j) + 0.5f) * h};
        const NormalTurn::Pulled pulled = turn.pulledBack(middle);
        if (!(pulled.factor > 0)) continue;
        const Matrix2 change = turn.pullChange(middle);
        const Vec2 half = {0.5f * std::sqrt(change.xx * change.xx * w * w + change.xy * change.xy * h * h),
                           0.5f * std::sqrt(change.yx * change.yx * w * w + change.yy * change.yy * h * h)};
        const Box2 part = {pulled.h - half, pulled.h + half};
        const float mean_share = pulled.factor * w * h / (4 * half.x * half.y);
        add(part, mean_share);
      }
    }
    return mass;
  }

  /// Draws from one image.
  GLINT_HD HalfVectorSample drawFrom(const PyramidSlices& slices, Vec2 xi) const {
    PyramidReader::Draw draw = reader_.chooseImage(slices, xi);
    reader_.findBlocks(draw);
    reader_.chooseBlock(draw);
    reader_.choosePixel(draw);
    if (draw.place.x < 0) return {};
    return splineSample(example_.images.shape, draw.place, reader_.window(draw.slices, draw.place), draw.xi);
  }

  TinyExample example_;
  PyramidReader reader_;
  TiledPieces tiled_;
  ScatteredPieces scattered_;
  std::int64_t cell_x_ = 0, cell_y_ = 0;
};

static_assert(NdfModel<TinyExampleNdf>);

}  // namespace glint
