#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/gaussian.h"
#include "glint/model/normal_map.h"
#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/common/half_vector_draw.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/detail/common/texel_choice.h"
#include "glint/query/detail/common/triangle_lobe.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// The ground truth: the NDF summed over the texels (Deng 2022, Eq. 2, with normalised footprint weights).
///
/// Exact for Gaussian and box footprints, flat and smooth surfaces. `Search::exhaustive` visits every texel of the footprint:
/// O(footprint area). `Search::pruned` descends the map's min-max pyramid of normals and skips squares of texels whose normals
/// are out of the lobe's reach (kLobeReach). Its answers differ by at most 3e-7 of a lobe's peak, and its cost is sublinear; it
/// needs `map.bounds`.
/// With Boundary::clamp a footprint sees only texels of the map. A smooth surface then ends at the outermost texel centres:
/// footprints whose centre lies beyond, in the outer half texel, are moved to the end of the surface, so that each sees some.
/// Thread-safe, allocates nothing; the map must outlive it.
class Reference {
 public:
  enum class Search { exhaustive, pruned };

  /// A reference without a map: only `hasMap` may be called.
  Reference() = default;
  GLINT_HD Reference(const NormalMap& map, float sigma_r, Surface surface = Surface::flat, Boundary boundary = Boundary::wrap,
                     Search search = Search::exhaustive)
      : map_(map),
        sigma_r_(sigma_r),
        surface_(surface),
        boundary_(boundary),
        search_(map.bounds_level_count > 0 ? search : Search::exhaustive) {}

  GLINT_HD bool hasMap() const { return map_.width > 0; }

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

  /// Draws a texel (or triangle) by its weight in the footprint, one of its normals, and a point of the lobe around the normal.
  /// The pdf is the density. Nothing is drawn where the point leaves [-1, 1]^2.
  ///
  /// O(rows + columns) of the footprint for Gaussians (O(area) if they are rotated and the boundary is clamped), O(1) for
  /// boxes, plus the cost of a density. Each choice uses up the leading digits of `xi` that are left; 24 bits are enough for
  /// one sample.
  GLINT_DEVICE_CALL GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    const DrawnHalfVector drawn = drawHalfVector(map_, grid(), weightsOf(grid(), p), sigma_r_, clampUnit(xi));
    return drawn.found ? drawnAt(drawn.h, density(p, drawn.h)) : HalfVectorSample{};
  }

  /// Visits every facet in a footprint: visitor(weight, normal) on a flat surface. Weights sum to the returned total.
  template <class Visitor>
  GLINT_HD double forEachTexel(const Footprint& p, Visitor&& visitor) const {
    const FootprintWeights weights = weightsOf(grid(), p);
    double total = 0;
    forEachCell(weights, [&](int i, int j) {
      const float w = weights.texel(i, j);
      if (w <= 0) return;
      total += double{w};
      visitor(w, normal(i, j));
    });
    return total;
  }

  /// Visits every triangle in a footprint: visitor(weight, n0, n1, n2) on a smooth surface. Weights sum to the returned total.
  template <class Visitor>
  GLINT_HD double forEachTriangle(const Footprint& p, Visitor&& visitor) const {
    const FootprintWeights weights = weightsOf(grid(), p);
    double total = 0;
    forEachCell(weights, [&](int i, int j) {
      if (!hasCell(i, j)) return;
      for (int half = 0; half < 2; ++half) {
        const float w = weights.triangle(i, j, half);
        if (w <= 0) continue;
        total += double{w};
        visitor(w, normal(i, j), half == 0 ? normal(i + 1, j) : normal(i, j + 1), normal(i + 1, j + 1));
      }
    });
    return total;
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

  GLINT_HD TexelGrid grid() const { return {map_.width, map_.height, surface_, boundary_}; }

  template <class Lobe>
  GLINT_HD double average(const Footprint& p, const Lobe& lobe) const {
    if (search_ == Search::pruned) return averagePruned(p, lobe);
    double sum = 0;
    const double total =
        surface_ == Surface::flat
            ? forEachTexel(p, [&](float w, Vec2 n) { sum += double{w} * double{lobe.facet(n)}; })
            : forEachTriangle(p, [&](float w, Vec2 a, Vec2 b, Vec2 c) { sum += double{w} * double{lobe.triangle(a, b, c)}; });
    return total > 0 ? sum / total : 0;
  }

  template <class Lobe>
  GLINT_HD double averagePruned(const Footprint& p, const Lobe& lobe) const {
    const FootprintWeights weights = weightsOf(grid(), p);
    const Box2 support = lobe.support();
    const float reach = kLobeReach * sigma_r_;
    double sum = 0;
    const auto leaf = [&](int i, int j) {  // texel (i, j) of the endless plane
      const Vec2 n = normal(i, j);
      if (surface_ == Surface::flat) {
        if (near(support, n, n, reach)) sum += double{weights.texel(i, j)} * double{lobe.facet(n)};
      } else if (hasCell(i, j)) {
        const Vec2 right = normal(i + 1, j), up = normal(i, j + 1), far = normal(i + 1, j + 1);
        sum += double{weights.triangle(i, j, 0)} * double{lobe.triangle(n, right, far)};
        sum += double{weights.triangle(i, j, 1)} * double{lobe.triangle(n, up, far)};
      }
    };
    forEachPeriod(weights, [&](const Window& w) { descend(weights, w, support, reach, leaf); });
    const double total =
        boundary_ == Boundary::wrap && weights.hasClosedFormTotal() ? weights.closedFormTotal() : totalWeight(p);
    return total > 0 ? sum / total : 0;
  }

  GLINT_DEVICE_CALL GLINT_HD double totalWeight(const Footprint& p) const {
    return surface_ == Surface::flat ? forEachTexel(p, [](float, Vec2) {}) : forEachTriangle(p, [](float, Vec2, Vec2, Vec2) {});
  }

  /// Texels [column_begin, column_end) x [row_begin, row_end) of the map, seen in the copy that starts at (offset_x, offset_y).
  struct Window {
    int offset_x, offset_y, column_begin, column_end, row_begin, row_end;
  };

  template <class Visitor>
  GLINT_HD void forEachPeriod(const FootprintWeights& weights, Visitor&& visitor) const {
    const bool wrap = boundary_ == Boundary::wrap;
    const int first_x = wrap ? floorTo(weights.column_begin, map_.width) : 0, last_x = wrap ? weights.column_end : map_.width;
    const int first_y = wrap ? floorTo(weights.row_begin, map_.height) : 0, last_y = wrap ? weights.row_end : map_.height;
    for (int y = first_y; y < last_y; y += map_.height) {
      const auto columns = weights.columnsIn(std::max(weights.row_begin, y), std::min(weights.row_end, y + map_.height));
      const int begin_x = std::max(first_x, wrap ? floorTo(columns.begin, map_.width) : 0);
      for (int x = begin_x; x < std::min(last_x, columns.end); x += map_.width) {
        const Window w = {x,
                          y,
                          std::max(columns.begin - x, 0),
                          std::min(columns.end - x, map_.width),
                          std::max(weights.row_begin - y, 0),
                          std::min(weights.row_end - y, map_.height)};
        if (w.column_begin < w.column_end && w.row_begin < w.row_end) visitor(w);
      }
    }
  }

  template <class Visitor>
  GLINT_HD void forEachCell(const FootprintWeights& weights, Visitor&& visitor) const {
    forEachPeriod(weights, [&](const Window& w) {
      for (int j = w.offset_y + w.row_begin; j < w.offset_y + w.row_end; ++j) {
        const auto columns = weights.columnsIn(j, j + 1);
        const int begin = std::max(w.offset_x + w.column_begin, columns.begin);
        const int end = std::min(w.offset_x + w.column_end, columns.end);
        for (int i = begin; i < end; ++i) visitor(i, j);
      }
    });
  }

  /// Visits the texels of a window, except squares of texels whose bounds of normals are out of the lobe's reach.
  template <class Leaf>
  GLINT_HD void descend(const FootprintWeights& weights, const Window& w, const Box2& support, float reach, Leaf&& leaf) const {
    struct Node {
      int level, i, j;
    };
    Node stack[4 * NormalMap::kMaxBoundsLevels + 4];
    int count = 0;
    const int extent = std::max(w.column_end - w.column_begin, w.row_end - w.row_begin);
    int top = 0;
    while (top + 1 < map_.bounds_level_count && (2 << top) < extent) ++top;
    for (int j = w.row_begin >> (top + 1); j <= (w.row_end - 1) >> (top + 1); ++j)
      for (int i = w.column_begin >> (top + 1); i <= (w.column_end - 1) >> (top + 1); ++i) stack[count++] = {top, i, j};
    while (count > 0) {
      const Node node = stack[--count];
      const NormalBoundsLevel& level = map_.bounds[node.level];
      const NormalBounds& box = level.nodes.data()[rowMajorIndex(node.i, node.j, level.columns)];
      if (!near(support, {box.low_x, box.low_y}, {box.high_x, box.high_y}, reach)) continue;
      for (int dj = 0; dj < 2; ++dj) {
        for (int di = 0; di < 2; ++di) {
          const int i = 2 * node.i + di, j = 2 * node.j + dj;
          const int shift = node.level;  // children cover 2^shift texels
          if ((i << shift) >= w.column_end || ((i + 1) << shift) <= w.column_begin) continue;
          if ((j << shift) >= w.row_end || ((j + 1) << shift) <= w.row_begin) continue;
          if (shift > 0) {  // a slanted footprint misses parts of its bounding box
            const auto columns = weights.columnsIn(w.offset_y + (j << shift), w.offset_y + ((j + 1) << shift));
            if (w.offset_x + (i << shift) >= columns.end || w.offset_x + ((i + 1) << shift) <= columns.begin) continue;
          }
          if (node.level > 0)
            stack[count++] = {node.level - 1, i, j};
          else
            leaf(w.offset_x + i, w.offset_y + j);
        }
      }
    }
  }

  GLINT_HD Vec2 normal(int i, int j) const { return map_.at(wrapIndex(i, map_.width), wrapIndex(j, map_.height)); }
  /// Cells in the last row and column reach over the border: they exist only with Boundary::wrap.
  GLINT_HD bool hasCell(int i, int j) const {
    return boundary_ == Boundary::wrap || (i + 1 < map_.width && j + 1 < map_.height);
  }

  NormalMap map_;
  float sigma_r_ = 0;
  Surface surface_ = Surface::flat;
  Boundary boundary_ = Boundary::wrap;
  Search search_ = Search::exhaustive;
};

static_assert(NdfModel<Reference>);

}  // namespace glint
