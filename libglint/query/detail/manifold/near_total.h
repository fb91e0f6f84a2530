#pragma once

#include <algorithm>
#include <cmath>

#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/manifold/near_sum.h"

namespace glint {

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
      const auto sum = [](int begin, int end, float centre, float offset, float scale) {
        double out = 0;
        for (int k = begin; k < end; ++k) {
          // The difference of texel and centre first: far from the origin their sums with the offset would be rounded.
          const float d = scale * (static_cast<float>(k) - centre + offset);
          out += double{std::exp(-0.5f * d * d)};
        }
        return out;
      };
      total += sum(column_begin, column_end, c.x, x0, white.across) * sum(row_begin, row_end, c.y, y0, white.along);
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

/// Squared radius of the ball for a footprint whose weights sum to `total`, deviations.
///
/// All texels of a narrow footprint may lie in its tail, so that `total` is smaller than the sum of the closed form. The ball then
/// grows until the mass outside, about exp(-radius^2 / 2) of the closed form, is the same share of `total`. kFewTexels is added because a
/// sum over few texels is not the integral: between two texels .8 is missing, and the functions of a lane need the rest.
inline GLINT_HD float nearReach2(const NearSurface& s, const FootprintWeights& w, double total) {
  constexpr float kFewTexels = 2;
  if (w.hasClosedFormTotal() || !(total > 0)) return s.reach2;
  return s.reach2 + kFewTexels + 2 * std::log(std::max(static_cast<float>(w.closedFormTotal() / total), 1.0f));
}

}  // namespace glint
