#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "glint/math/gaussian.h"
#include "glint/model/wang_tiles.h"
#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/detail/common/texel_choice.h"
#include "glint/query/detail/common/triangle_lobe.h"
#include "glint/query/ndf_model.h"
#include "glint/query/wang_layout.h"

namespace glint {

/// The ground truth of a plane of Wang tiles: the NDF summed over the texels under the footprint, whichever tiles hold them. It
/// equals Reference on the explicit map of the plane (tests/unit/wang_reference_test.cpp).
///
/// The centre of a footprint is (u, v) in tiles: (1.5, 0) is the middle of the lower side of cell (1, 0). It does not wrap. Floats
/// lose texels far out, so move the origin to the cell of the point, and ask with the position in the cell:
///
///     const WangPlace place = plane.layout().placeOf(texel_x, texel_y);  // doubles, in texels
///     plane.movedTo(place.cell_x, place.cell_y).density(Footprint::isotropic(plane.layout().positionIn(place), sigma), h);
///
/// Gaussian and box footprints, flat and smooth surfaces are exact up to a deviation of kExactTiles tiles. Wider ones tend to the
/// mean of all tiles, which are equally frequent: from kFarTiles on the plane is asked by its mean, so that no footprint costs more
/// than a certain number of texels. What is lost is measured by the test.
/// O(texels under the footprint), at most 1600 tiles; O(texels of all tiles) beyond. Thread-safe, allocates nothing; the tiles must
/// outlive it.
class WangReference {
 public:
  /// Deviations of footprints, in tiles, along their longer axis: up to which they are exact, and from which the mean answers.
  static constexpr float kExactTiles = 2, kFarTiles = 3;

  GLINT_HD WangReference(const WangTiles& tiles, float sigma_r, Surface surface = Surface::flat)
      : tiles_(tiles), layout_(tiles), sigma_r_(sigma_r), surface_(surface) {}

  GLINT_HD const WangLayout& layout() const { return layout_; }

  /// The plane seen from another cell: its cell (0, 0) is cell (cell_x, cell_y) of the asset's plane.
  GLINT_HD WangReference movedTo(std::int64_t cell_x, std::int64_t cell_y) const {
    WangReference moved = *this;
    moved.origin_x_ = static_cast<std::uint64_t>(cell_x);
    moved.origin_y_ = static_cast<std::uint64_t>(cell_y);
    return moved;
  }

  /// Density towards h, per unit projected area; >= 0, finite.
  GLINT_DEVICE_CALL GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    return finitePositive(static_cast<float>(average(p, PointLobe{h, sigma_r_})));
  }

  /// Average density over a box of half vectors; 0 if the box is empty.
  GLINT_DEVICE_CALL GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    const Box2 box = insideSquare(range);
    if (!(box.width() > 0 && box.height() > 0)) return 0;
    return finitePositive(static_cast<float>(average(p, BoxLobe{box, sigma_r_}) / double{range.area()}));
  }

  /// Draws a texel (or triangle) by its weight, so a tile by its mass in the footprint, then one of its normals, and a point of the lobe
  /// around the normal. The pdf is the density. Nothing is drawn where the point leaves [-1, 1]^2.
  GLINT_DEVICE_CALL GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    xi = clampUnit(xi);
    const float far = farShare(p);
    Facet facet;
    if (xi.x < far) {
      xi.x = clampUnit(xi.x / far);
      facet = facetOfMean(xi);
    } else {
      xi.x = clampUnit((xi.x - far) / (1 - far));
      const Local local = localOf(p);
      const TexelChoice chosen = chooseTexel(local.weights, {tiles_.size, tiles_.size, surface_, Boundary::wrap}, xi);
      if (!chosen.found) return {};
      facet = facetAt(local, chosen.i, chosen.j, chosen.half);
    }
    Vec2 n = facet.normal;
    if (surface_ == Surface::smooth) {
      const float r = std::sqrt(xi.y);  // makes the point uniform in the triangle
      n = (1 - r) * n + (r * (1 - xi.x)) * facet.side + (r * xi.x) * facet.corner;
      xi = {lowerDigits(xi.x, 7), lowerDigits(xi.y, 7)};
    }
    const Vec2 h = n + sigma_r_ * Vec2{normalQuantile(xi.x), normalQuantile(xi.y)};
    return drawnAt(h, density(p, h));
  }

 private:
  struct PointLobe {
    Vec2 h;
    float sigma;
    GLINT_HD Box2 support() const { return {h, h}; }
    GLINT_HD float facet(Vec2 n) const { return gaussianDensity(n - h, sigma); }
    GLINT_HD float triangle(Vec2 a, Vec2 b, Vec2 c) const { return triangleDensity(a, b, c, h, sigma); }
  };
  struct BoxLobe {
    Box2 box;
    float sigma;
    GLINT_HD Box2 support() const { return box; }
    GLINT_HD float facet(Vec2 n) const { return lobeMass(box, n, sigma); }
    GLINT_HD float triangle(Vec2 a, Vec2 b, Vec2 c) const { return triangleMass(a, b, c, box, sigma); }
  };

  /// A footprint, and the cell whose lower left corner its texels are counted from.
  struct Local {
    std::uint64_t cell_x, cell_y;
    FootprintWeights weights;
  };
  GLINT_HD Local localOf(Footprint p) const {
    const WangCell cell = wangCell(p.centre, origin_x_, origin_y_);
    p.centre = cell.at;
    return {cell.x, cell.y, FootprintWeights(p, tiles_.size, tiles_.size, Boundary::clamp)};
  }

  /// Share of the mean of all tiles in the answer of a footprint, 0 to 1: linear in the variance.
  GLINT_HD float farShare(const Footprint& p) const {
    const UsableCovariance c = positiveCovariance(p.covariance);
    const double size = tiles_.size, mean = 0.5 * (c.xx + c.yy);
    const double longest = (mean + std::sqrt(std::max(0.0, mean * mean - c.determinant()))) / (size * size);
    constexpr double kBegin = double{kExactTiles} * double{kExactTiles}, kEnd = double{kFarTiles} * double{kFarTiles};
    return static_cast<float>(std::clamp((longest - kBegin) / (kEnd - kBegin), 0.0, 1.0));
  }

  template <class Lobe>
  GLINT_HD double average(const Footprint& p, const Lobe& lobe) const {
    const float far = farShare(p);
    double answer = 0;
    if (far < 1) answer += double{1 - far} * nearAverage(localOf(p), lobe);
    if (far > 0) answer += double{far} * tileAverage(lobe);
    return answer;
  }

  /// A texel's normal; on a smooth surface the normals of one of the two triangles that start there.
  struct Facet {
    Vec2 normal, side, corner;
  };

  /// Sum over the texels of the plane under a footprint, one cell after the other.
  template <class Lobe>
  GLINT_HD double nearAverage(const Local& local, const Lobe& lobe) const {
    const FootprintWeights& weights = local.weights;
    const int size = tiles_.size;
    Sums sums;
    sums.closed = weights.hasClosedFormTotal();
    for (int y = floorDiv(weights.row_begin, size); y * size < weights.row_end; ++y)
      for (int x = floorDiv(weights.column_begin, size); x * size < weights.column_end; ++x) {
        const int tile = tileAt(local, x, y), last_row = std::min(weights.row_end, (y + 1) * size);
        for (int j = std::max(weights.row_begin, y * size); j < last_row; ++j) {
          const auto columns = weights.columnsIn(j, j + 1);
          const int last_column = std::min(columns.end, (x + 1) * size);
          const Vec2* row = &tiles_.at(tile, 0, j - y * size);
          for (int i = std::max(columns.begin, x * size); i < last_column; ++i)
            addTexel(local, i, j, {row[i - x * size], {}, {}}, lobe, sums);
        }
      }
    const double total = sums.closed ? weights.closedFormTotal() : sums.weights;
    return total > 0 ? sums.values / total : 0;
  }

  struct Sums {
    double values = 0, weights = 0;
    bool closed = false;  ///< whether the sum of weights is known: then texels out of the lobe's reach need none
  };

  template <class Lobe>
  GLINT_HD void addFacet(float weight, const Facet& f, const Lobe& lobe, Sums& sums) const {
    sums.weights += double{weight};
    if (weight > 0 && reaches(lobe, f)) sums.values += double{weight} * double{valueOf(lobe, f)};
  }
  /// Adds a texel, or the two triangles that start at it.
  template <class Lobe>
  GLINT_HD void addTexel(const Local& local, int i, int j, const Facet& f, const Lobe& lobe, Sums& sums) const {
    if (surface_ == Surface::flat) {
      if (!sums.closed || reaches(lobe, f)) addFacet(local.weights.texel(i, j), f, lobe, sums);
      return;
    }
    for (int half = 0; half < 2; ++half) {
      const Facet triangle = facetAt(local, i, j, half);
      if (!sums.closed || reaches(lobe, triangle)) addFacet(local.weights.triangle(i, j, half), triangle, lobe, sums);
    }
  }

  template <class Lobe>
  GLINT_HD bool reaches(const Lobe& lobe, const Facet& f) const {
    const auto low = [](float a, float b, float c) { return std::min(std::min(a, b), c); };
    const auto high = [](float a, float b, float c) { return std::max(std::max(a, b), c); };
    const float reach = kLobeReach * sigma_r_;
    if (surface_ == Surface::flat) return near(lobe.support(), f.normal, f.normal, reach);
    return near(lobe.support(), {low(f.normal.x, f.side.x, f.corner.x), low(f.normal.y, f.side.y, f.corner.y)},
                {high(f.normal.x, f.side.x, f.corner.x), high(f.normal.y, f.side.y, f.corner.y)}, reach);
  }
  template <class Lobe>
  GLINT_HD float valueOf(const Lobe& lobe, const Facet& f) const {
    return surface_ == Surface::flat ? lobe.facet(f.normal) : lobe.triangle(f.normal, f.side, f.corner);
  }

  /// The NDF of the plane: the mean over all tiles. On smooth surfaces, triangles across the border of a tile are left out.
  template <class Lobe>
  GLINT_DEVICE_CALL GLINT_HD double tileAverage(const Lobe& lobe) const {
    const int last = lastOfMean(), halves = surface_ == Surface::flat ? 1 : 2;
    double sum = 0;
    for (int tile = 0; tile < tiles_.tile_count; ++tile)
      for (int j = 0; j < last; ++j)
        for (int i = 0; i < last; ++i)
          for (int half = 0; half < halves; ++half) {
            const Facet f = facetOfTile(tile, i, j, half);
            if (reaches(lobe, f)) sum += double{valueOf(lobe, f)};
          }
    return sum / (static_cast<double>(tiles_.tile_count) * last * last * halves);
  }

  /// Facet of the texel (i, j) from the lower left corner of a footprint's cell.
  GLINT_HD Facet facetAt(const Local& local, int i, int j, int half) const {
    if (surface_ == Surface::flat) return {normalAt(local, i, j), {}, {}};
    return {normalAt(local, i, j), half == 0 ? normalAt(local, i + 1, j) : normalAt(local, i, j + 1),
            normalAt(local, i + 1, j + 1)};
  }
  GLINT_HD Vec2 normalAt(const Local& local, int i, int j) const {
    const int x = floorDiv(i, tiles_.size), y = floorDiv(j, tiles_.size);
    return tiles_.at(tileAt(local, x, y), i - x * tiles_.size, j - y * tiles_.size);
  }
  /// Tile of the cell (x, y) cells from a footprint's.
  GLINT_HD int tileAt(const Local& local, int x, int y) const {
    const auto away = [](std::uint64_t cell, int cells) {
      return static_cast<std::int64_t>(cell + static_cast<std::uint64_t>(std::int64_t{cells}));
    };
    return layout_.tileAt(away(local.cell_x, x), away(local.cell_y, y));
  }

  GLINT_HD int lastOfMean() const { return surface_ == Surface::flat ? tiles_.size : tiles_.size - 1; }
  GLINT_HD Facet facetOfTile(int tile, int i, int j, int half) const {
    if (surface_ == Surface::flat) return {tiles_.at(tile, i, j), {}, {}};
    return {tiles_.at(tile, i, j), half == 0 ? tiles_.at(tile, i + 1, j) : tiles_.at(tile, i, j + 1),
            tiles_.at(tile, i + 1, j + 1)};
  }
  /// A facet of the plane's mean, each as likely. Uses up digits of xi.
  GLINT_HD Facet facetOfMean(Vec2& xi) const {
    const auto take = [](float& x, int count) {
      const float at = x * static_cast<float>(count);
      const int chosen = std::min(static_cast<int>(at), count - 1);
      x = clampUnit(at - static_cast<float>(chosen));
      return chosen;
    };
    const int tile = take(xi.x, tiles_.tile_count), i = take(xi.x, lastOfMean()), j = take(xi.y, lastOfMean());
    const int half = surface_ == Surface::flat ? 0 : take(xi.y, 2);
    xi = {lowerDigits(xi.x, 3), lowerDigits(xi.y, 3)};
    return facetOfTile(tile, i, j, half);
  }

  WangTiles tiles_;
  WangLayout layout_;
  float sigma_r_;
  Surface surface_;
  std::uint64_t origin_x_ = 0, origin_y_ = 0;
};

static_assert(NdfModel<WangReference>);

}  // namespace glint
