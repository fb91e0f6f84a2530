#pragma once

#include <algorithm>

#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/manifold/near_sum.h"

namespace glint {

/// The weights of a footprint on a surface. A smooth surface with Boundary::clamp ends at the outermost texel centres: footprints whose
/// centre lies beyond are moved to its end.
inline GLINT_HD FootprintWeights weightsOf(const NearSurface& s, Footprint p) {
  const auto onSurface = [](float u, int texels) {
    const float border = 0.5f / static_cast<float>(texels);
    return std::clamp(wrapUnit(u), border, 1 - border);
  };
  if (s.surface == Surface::smooth && s.boundary == Boundary::clamp)
    p.centre = {onSurface(p.centre.x, s.map.width), onSurface(p.centre.y, s.map.height)};
  return {p, s.map.width, s.map.height, s.boundary};
}

/// Sum of the weights of all facets in a footprint.
GLINT_DEVICE_CALL inline GLINT_HD double nearTotal(const NearSurface& s, const FootprintWeights& w) {
  const bool smooth = s.surface == Surface::smooth, wrap = s.boundary == Boundary::wrap;
  const int lost = smooth ? 1 : 0;
  const int column_begin = wrap ? w.column_begin : std::max(w.column_begin, 0),
            row_begin = wrap ? w.row_begin : std::max(w.row_begin, 0);
  const int column_end = wrap ? w.column_end : std::min(w.column_end, s.map.width - lost);
  const int row_end = wrap ? w.row_end : std::min(w.row_end, s.map.height - lost);
  const bool cut = column_begin > w.column_begin || row_begin > w.row_begin || column_end < w.column_end || row_end < w.row_end;
  if (w.hasClosedFormTotal() && !cut) return w.closedFormTotal();
  double total = 0;
  if (!w.isBox() && w.whitening().slant == 0) {  // a product of sums over rows and over columns
    const FootprintWeights::Whitening white = w.whitening();
    const Vec2 c = w.centre();
    for (int half = 0; half < (smooth ? 2 : 1); ++half) {
      const float third = 1.0f / 3, x0 = 0.5f + (smooth ? (half == 0 ? 2 * third : third) : 0),
                  y0 = 0.5f + (smooth ? (half == 0 ? third : 2 * third) : 0);
      const auto sum = [](int begin, int end, float offset, float scale) {
        double out = 0;
        for (int k = begin; k < end; ++k) {
          const float d = scale * (static_cast<float>(k) + offset);
          out += double{std::exp(-0.5f * d * d)};
        }
        return out;
      };
      total += sum(column_begin, column_end, x0 - c.x, white.across) * sum(row_begin, row_end, y0 - c.y, white.along);
    }
    return smooth ? 0.5 * total : total;
  }
  for (int j = row_begin; j < row_end; ++j) {
    const auto columns = w.columnsIn(j, j + 1);
    const int end = std::min(columns.end, column_end);
    for (int i = std::max(columns.begin, column_begin); i < end; ++i)
      total += smooth ? double{w.triangle(i, j, 0)} + double{w.triangle(i, j, 1)} : double{w.texel(i, j)};
  }
  return total;
}

}  // namespace glint
