#pragma once

#include "glint/query/detail/common/footprint_weights.h"
#include "glint/query/detail/tiny/normal_turn.h"

namespace glint {

/// A covariance seen through a matrix: m c m^T.
inline GLINT_HD UsableCovariance movedCovariance(const Covariance& c, const Matrix2& m) {
  const double xx = m.xx, xy = m.xy, yx = m.yx, yy = m.yy;
  const double ax = xx * double{c.xx} + xy * double{c.xy}, ay = xx * double{c.xy} + xy * double{c.yy};
  const double bx = yx * double{c.xx} + yy * double{c.xy}, by = yx * double{c.xy} + yy * double{c.yy};
  return {ax * xx + ay * xy, ax * yx + ay * yy, bx * yx + by * yy};
}

}  // namespace glint
