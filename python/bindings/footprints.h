#pragma once

#include <optional>

#include "arrays.h"

namespace glint::python {

/// Footprints of a batch: centres as floats or doubles, and a size of one form.
class Footprints {
 public:
  Footprints(std::optional<Rows> uv, std::optional<DoubleRows> precise_uv, std::optional<Rows> sigma,
             std::optional<Rows> covariance, std::optional<Rows> box, std::optional<Rows> spread)
      : uv_(std::move(uv)),
        precise_uv_(std::move(precise_uv)),
        sigma_(std::move(sigma)),
        covariance_(std::move(covariance)),
        box_(std::move(box)),
        spread_(std::move(spread)) {}

  std::size_t count() const { return uv_ ? uv_->shape(0) : precise_uv_->shape(0); }

  /// As the C interface takes them, from query number `first` on.
  glint_footprints from(std::size_t first) const {
    glint_footprints p = {};
    if (uv_) p.u = member(*uv_, 0, first), p.v = member(*uv_, 1, first);
    if (precise_uv_) p.precise_u = member(*precise_uv_, 0, first), p.precise_v = member(*precise_uv_, 1, first);
    if (sigma_) p.sigma = member(*sigma_, 0, first);
    if (covariance_)
      p.xx = member(*covariance_, 0, first), p.xy = member(*covariance_, 1, first), p.yy = member(*covariance_, 2, first);
    if (box_) {
      p.ax = member(*box_, 0, first), p.ay = member(*box_, 1, first);
      p.bx = member(*box_, 2, first), p.by = member(*box_, 3, first);
    }
    if (spread_) p.spread_x = member(*spread_, 0, first), p.spread_y = member(*spread_, 1, first);
    return p;
  }

  /// Footprint of one query, for functions without a batch.
  glint_footprint at(std::size_t k) const {
    const glint_footprints p = from(k);
    glint_footprint one = {};
    one.u = uv_ ? double{*p.u.data} : *p.precise_u.data;
    one.v = uv_ ? double{*p.v.data} : *p.precise_v.data;
    if (sigma_) {
      one = glint_footprint_isotropic(one.u, one.v, *p.sigma.data);
    } else if (covariance_) {
      one.kind = GLINT_FOOTPRINT_GAUSSIAN;
      one.m[0] = *p.xx.data, one.m[1] = *p.xy.data, one.m[2] = *p.yy.data;
    } else {
      one = glint_footprint_box(one.u, one.v, *p.ax.data, *p.ay.data, *p.bx.data, *p.by.data);
    }
    if (spread_) one.spread[0] = *p.spread_x.data, one.spread[1] = *p.spread_y.data;
    return one;
  }

 private:
  std::optional<Rows> uv_;
  std::optional<DoubleRows> precise_uv_;
  std::optional<Rows> sigma_, covariance_, box_, spread_;
};

void bindFootprints(nb::module_& m);

}  // namespace glint::python
