#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/model/wang_images.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"
#include "glint/query/wang_layout.h"

namespace glint {

/// The images of tiles that answer a footprint. Weights are > 0 but for padding and sum to 1. Images k to k + 3 have one level, for
/// k a multiple of 4.
struct TileSlices {
  /// Most centres of a level along one axis, times the tiles that each meets: 4 centres, 1 + 2 WangGrid::kMostMargins tiles.
  static constexpr int kMostAlong = 4 * (1 + 2 * WangGrid::kMostMargins);
  static constexpr int kMost = 2 * kMostAlong * kMostAlong;

  int levels[kMost / 4];
  std::uint32_t images[kMost];
  float weights[kMost];
  int count = 0;  ///< a multiple of 4

  GLINT_HD int level(int k) const { return levels[k / 4]; }
  GLINT_HD PyramidSlice operator[](int k) const { return {level(k), images[k], weights[k]}; }
};

/// Calls visit(PyramidSlices) for all images, a group after the other.
template <class Visit>
GLINT_HD void forEachGroup(const TileSlices& all, Visit&& visit) {
  for (int first = 0; first < all.count; first += PyramidSlices::kMost) {
    PyramidSlices group;
    group.count = std::min(all.count - first, int{PyramidSlices::kMost});
    for (int k = 0; k < group.count; k += 4) group.levels[k / 4] = all.levels[(first + k) / 4];
    for (int k = 0; k < group.count; ++k) group.images[k] = all.images[first + k], group.weights[k] = all.weights[first + k];
    visit(group);
  }
}

/// Chooses the images of tiles that answer a round footprint: the centres as SliceChooser does it, and at each centre every tile
/// that the image of the centre meets.
class TileChooser {
 public:
  /// @param shape  of one tile: PyramidShape of WangPyramid::images
  GLINT_HD TileChooser(const WangImages& plane, const PyramidShape& shape)
      : plane_(plane), layout_(plane.tiles), chooser_(tileShape(plane, shape)), levels_(shape.footprintLevels()) {
    const auto size = static_cast<float>(shape.width);
    largest_ = size * size;
  }

  GLINT_HD const WangLayout& layout() const { return layout_; }
  GLINT_HD int size() const { return plane_.tiles.size; }

  /// @param cell_x, cell_y  cell of the plane
  /// @param at              position in the cell, [0, 1)^2
  /// @param usable          usable(slice): whether an image has any density
  template <class Usable>
  GLINT_HD void choose(std::uint64_t cell_x, std::uint64_t cell_y, Vec2 at, const Covariance& covariance, Usable&& usable,
                       TileSlices& out) const {
    const float variance = isotropicVariance(largest_, largest_, covariance);
    const LevelPlace level = chooser_.levelFor(variance);
    out.count = 0;
    float total = 0;
    for (int k = 0; k < 2; ++k) {
      const float share = k == 0 ? 1 - level.t : level.t;
      if (!(share > 0)) continue;
      level.first + k < levels_ ? addLevel(level.first + k, share, cell_x, cell_y, at, variance, usable, total, out)
                                : addMean(share, total, out);
    }
    // What was left out is spread over what is there, so that all weights sum to 1.
    const float scale = total > 0 ? 1 / total : 0;
    for (int k = 0; k < out.count; ++k) out.weights[k] *= scale;
  }

 private:
  /// Images with less than this weight are left out: rounding of weights, and products of two small shares at corners.
  static constexpr float kNegligible = 1e-5f;

  /// The shape of one tile whose columns are those of the tile alone, which is what SliceChooser asks for.
  static GLINT_HD PyramidShape tileShape(const WangImages& plane, PyramidShape shape) {
    for (int l = 0; l < shape.footprintLevels(); ++l) shape.levels[l].columns = shape.levels[l].rows = plane.grids[l].columns;
    return shape;
  }

  /// Along one axis, the images of centres in the tiles that they meet.
  struct Along {
    int cells[TileSlices::kMostAlong];   ///< from the cell of the footprint
    int places[TileSlices::kMostAlong];  ///< column or row of the image in its tile
    float shares[TileSlices::kMostAlong];
    int count = 0;
  };
  static GLINT_HD Along along(const WangGrid& grid, int first, const float (&weights)[4]) {
    Along found;
    const int n = grid.columns, side = grid.side();
    for (int k = 0; k < 4; ++k) {
      if (!(weights[k] > 0)) continue;
      // The first cell whose tile has an image at the centre, and the place of the centre in the tile.
      const int from_end = first + k - n - grid.margin;
      int cell = floorDiv(from_end, n) + 1;
      for (int place = first + k - cell * n + grid.margin; place >= 0 && found.count < TileSlices::kMostAlong;
           place -= n, ++cell) {
        const float share = place < side ? weights[k] * grid.masses.data()[place] : 0.0f;
        if (!(share > kNegligible)) continue;
        found.cells[found.count] = cell, found.places[found.count] = place;
        found.shares[found.count++] = share;
      }
    }
    return found;
  }

  template <class Usable>
  GLINT_HD void addLevel(int level, float share, std::uint64_t cell_x, std::uint64_t cell_y, Vec2 at, float variance,
                         const Usable& usable, float& total, TileSlices& out) const {
    const WangGrid& grid = plane_.grids[level];
    const SliceChooser::Centres centres = chooser_.centresAround(level, at, variance);
    const Along x = along(grid, centres.column, centres.across), y = along(grid, centres.row, centres.up);
    // Few cells follow each other in rows and columns, so that the last tile found mostly serves again.
    int known_x = 0, known_y = 0, tile = -1;
    for (int j = 0; j < y.count; ++j) {
      for (int i = 0; i < x.count; ++i) {
        const float weight = share * x.shares[i] * y.shares[j];
        if (!(weight > kNegligible)) continue;
        if (tile < 0 || known_x != x.cells[i] || known_y != y.cells[j]) {
          known_x = x.cells[i], known_y = y.cells[j];
          tile = layout_.tileAt(moved(cell_x, known_x), moved(cell_y, known_y));
        }
        const PyramidSlice slice = {
            level, static_cast<std::uint32_t>((tile * grid.side() + y.places[j]) * grid.side() + x.places[i]), weight};
        if (usable(slice)) add(slice, total, out);
      }
    }
    pad(out);
  }

  GLINT_HD void addMean(float share, float& total, TileSlices& out) const {
    add({levels_, 0, share}, total, out);
    pad(out);
  }

  static GLINT_HD std::int64_t moved(std::uint64_t cell, int by) {
    return static_cast<std::int64_t>(cell + static_cast<std::uint64_t>(std::int64_t{by}));
  }
  static GLINT_HD void add(const PyramidSlice& slice, float& total, TileSlices& out) {
    out.levels[out.count / 4] = slice.level;
    out.images[out.count] = slice.image;
    out.weights[out.count++] = slice.weight;
    total += slice.weight;
  }
  /// Fills the last group of four with images of weight 0.
  static GLINT_HD void pad(TileSlices& out) {
    for (; out.count % 4 != 0; ++out.count) out.images[out.count] = out.images[out.count - 1], out.weights[out.count] = 0;
  }

  WangImages plane_;
  WangLayout layout_;
  SliceChooser chooser_;
  int levels_;     // of footprints
  float largest_;  // square of the size of a tile, texels^2
};

}  // namespace glint
