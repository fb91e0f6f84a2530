#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/normal_map.h"
#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/common/sampling.h"

namespace glint {

/// The properties of a map on which the weights of texels depend.
struct TexelGrid {
  int width, height;
  Surface surface;
  Boundary boundary;
};

/// The weights of a footprint on a map. A smooth surface with Boundary::clamp ends at the outermost texel centres: footprints whose
/// centre lies beyond, in the outer half texel, are moved to the end of the surface.
inline GLINT_HD FootprintWeights weightsOf(const TexelGrid& grid, Footprint p) {
  const auto onSurface = [](float u, int texels) {
    const float border = 0.5f / static_cast<float>(texels);
    return std::clamp(wrapUnit(u), border, 1 - border);
  };
  if (grid.surface == Surface::smooth && grid.boundary == Boundary::clamp)
    p.centre = {onSurface(p.centre.x, grid.width), onSurface(p.centre.y, grid.height)};
  return {p, grid.width, grid.height, grid.boundary};
}

/// A texel of the endless plane, or one of the two triangles of the cell that starts there.
struct TexelChoice {
  bool found = false;  ///< false: no texel has a weight
  int i = 0, j = 0, half = 0;
};

/// The digits of u below about 2^-bits as a number in [0, 1): uniform, and nearly independent of the leading digits. The factor
/// is no power of two, so that u on a regular grid give spread results too.
inline GLINT_HD float lowerDigits(float u, int bits) {
  const double scaled = static_cast<double>(u) * 1.2360679774997896 * static_cast<double>(1 << bits);
  return clampUnit(static_cast<float>(scaled - std::floor(scaled)));
}

/// Chooses among the weights of a footprint, texel by texel or triangle by triangle, exactly in proportion.
///
/// For a Gaussian, chooses a row by its sum and a column in the row. On a periodic map the sum of a row has a closed form where
/// the Gaussian is at least a texel wide (to 5e-9, Poisson's formula); other rows are added up. For a box, draws a point evenly
/// from the parallelogram and takes the texel under it.
class TexelChooser {
 public:
  GLINT_HD TexelChooser(const FootprintWeights& weights, const TexelGrid& grid) : weights_(weights), grid_(grid) {
    const int lost = smooth() ? 1 : 0;  // the last row and column of a smooth clamped map begin no cell
    if (grid.boundary == Boundary::wrap) {
      columns_ = {weights.column_begin, weights.column_end};
      rows_ = {weights.row_begin, weights.row_end};
    } else {
      columns_ = {std::max(weights.column_begin, 0), std::min(weights.column_end, grid.width - lost)};
      rows_ = {std::max(weights.row_begin, 0), std::min(weights.row_end, grid.height - lost)};
    }
  }

  GLINT_HD TexelChoice choose(Vec2& xi) const { return weights_.isBox() ? underPoint(xi) : ofGaussian(xi); }

 private:
  struct Range {
    int begin = 0, end = 0;
  };

  GLINT_HD bool smooth() const { return grid_.surface == Surface::smooth; }
  GLINT_HD float weight(int i, int j, int half) const {
    return smooth() ? weights_.triangle(i, j, half) : weights_.texel(i, j);
  }

  /// Positions at which row (j, half) is weighed: texel centres, or centroids of triangles.
  GLINT_HD Vec2 offset(int half) const {
    if (!smooth()) return {0.5f, 0.5f};
    constexpr float kThird = 1.0f / 3;
    return Vec2{0.5f, 0.5f} + (half == 0 ? Vec2{2 * kThird, kThird} : Vec2{kThird, 2 * kThird});
  }

  GLINT_HD Range columnsOf(const FootprintWeights::Line& line, int half) const {
    const float middle = line.mean - offset(half).x, reach = (kFootprintReach + 0.5f) * line.sigma + 1;
    const auto column = [&](float x) {
      return static_cast<int>(std::clamp(std::floor(x), static_cast<float>(columns_.begin), static_cast<float>(columns_.end)));
    };
    return {column(middle - reach), std::min(column(middle + reach) + 1, columns_.end)};
  }

  GLINT_HD double rowWeight(int row) const {
    const int j = smooth() ? row >> 1 : row, half = smooth() ? row & 1 : 0;
    const auto line = weights_.gaussianLine(static_cast<float>(j) + offset(half).y);
    if (grid_.boundary == Boundary::wrap && line.sigma >= 1) return line.share;
    const Range range = columnsOf(line, half);
    double sum = 0;
    for (int i = range.begin; i < range.end; ++i) sum += double{weight(i, j, half)};
    return sum;
  }

  /// Chooses an index in [begin, end) in proportion to weight(k), like chooseIndex, with sums in double.
  template <class Weight>
  static GLINT_HD bool choose(Range range, Weight&& weight, float& xi, int& chosen) {
    double total = 0;
    for (int k = range.begin; k < range.end; ++k) total += weight(k);
    double rest = double{xi} * total, share = 0;
    for (int k = range.begin; k < range.end; ++k) {
      const double w = weight(k);
      if (!(w > 0)) continue;
      if (share > 0) rest -= share;
      chosen = k;
      share = w;
      if (rest < w) break;
    }
    if (!(share > 0)) return false;
    xi = clampUnit(static_cast<float>(rest / share));
    return true;
  }

  GLINT_HD TexelChoice ofGaussian(Vec2& xi) const {
    TexelChoice texel;
    const int per_row = smooth() ? 2 : 1;
    int row = 0;
    if (!choose(
            {rows_.begin * per_row, rows_.end * per_row}, [&](int r) { return rowWeight(r); }, xi.y, row))
      return texel;
    texel.j = smooth() ? row >> 1 : row;
    texel.half = smooth() ? row & 1 : 0;
    const Range columns = columnsOf(weights_.gaussianLine(static_cast<float>(texel.j) + offset(texel.half).y), texel.half);
    texel.found = choose(
        columns, [&](int i) { return double{weight(i, texel.j, texel.half)}; }, xi.x, texel.i);
    return texel;
  }

  GLINT_HD TexelChoice underPoint(Vec2& xi) const {
    const float border = smooth() ? 0.5f : 0.0f;
    const Box2 map = {{border, border}, {static_cast<float>(grid_.width) - border, static_cast<float>(grid_.height) - border}};
    const SmallPolygon shape = weights_.localShape(grid_.boundary == Boundary::clamp ? &map : nullptr);
    if (shape.count < 3 || !(std::fabs(shape.twiceSignedArea()) > 0)) return {};
    double x = 0, y = 0;
    weights_.fromLocal(pointIn(shape, xi), x, y);
    x -= double{border}, y -= double{border};
    TexelChoice texel;
    texel.found = true;
    texel.i = static_cast<int>(std::floor(x));
    texel.j = static_cast<int>(std::floor(y));
    if (grid_.boundary == Boundary::clamp) {  // rounding can move the texel out of the map
      texel.i = std::clamp(texel.i, columns_.begin, columns_.end - 1);
      texel.j = std::clamp(texel.j, rows_.begin, rows_.end - 1);
    }
    texel.half = smooth() && y - std::floor(y) > x - std::floor(x) ? 1 : 0;
    xi = {lowerDigits(xi.x, 11), lowerDigits(xi.y, 11)};
    return texel;
  }

  /// Draws a point evenly from a convex polygon: from its coordinates for the whole square, else from its fan of triangles.
  static GLINT_HD Vec2 pointIn(const SmallPolygon& shape, Vec2 xi) {
    if (shape.count == 4 && std::fabs(shape.twiceSignedArea()) >= 8) return {2 * xi.x - 1, 2 * xi.y - 1};
    const auto triangle = [&](int k) {
      const Vec2 a = shape.corners[k + 1] - shape.corners[0], b = shape.corners[k + 2] - shape.corners[0];
      return std::fabs(a.x * b.y - a.y * b.x);
    };
    const int k = std::max(chooseIndex(shape.count - 2, std::fabs(shape.twiceSignedArea()), triangle, xi.x), 0);
    const float r = std::sqrt(xi.x);
    return (1 - r) * shape.corners[0] + (r * (1 - xi.y)) * shape.corners[k + 1] + (r * xi.y) * shape.corners[k + 2];
  }

  const FootprintWeights& weights_;
  TexelGrid grid_;
  Range columns_, rows_;
};

inline GLINT_HD TexelChoice chooseTexel(const FootprintWeights& weights, const TexelGrid& grid, Vec2& xi) {
  return TexelChooser(weights, grid).choose(xi);
}

}  // namespace glint
