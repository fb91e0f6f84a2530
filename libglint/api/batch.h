#pragma once

#include <cstddef>
#include <cstring>

#include "glint/api/any_ndf.h"
#include "glint/model/footprint.h"

namespace glint::api {

/// Floats at equal distances: an array, one member of an array of structs, or (stride 0) one value for all queries.
struct StridedFloats {
  const float* data = nullptr;  ///< nullptr: not given
  std::ptrdiff_t stride_bytes = sizeof(float);

  float operator[](std::size_t k) const {
    float value;
    std::memcpy(&value, reinterpret_cast<const char*>(data) + static_cast<std::ptrdiff_t>(k) * stride_bytes, sizeof value);
    return value;
  }
};

/// Doubles at equal distances, as StridedFloats.
struct StridedDoubles {
  const double* data = nullptr;  ///< nullptr: not given
  std::ptrdiff_t stride_bytes = sizeof(double);

  double operator[](std::size_t k) const {
    double value;
    std::memcpy(&value, reinterpret_cast<const char*>(data) + static_cast<std::ptrdiff_t>(k) * stride_bytes, sizeof value);
    return value;
  }
};

/// Footprints as a structure of arrays: centres, and one of the three ways to give a size. Where several ways are given, the
/// first counts.
struct FootprintArrays {
  StridedFloats u, v;            ///< centres, uv; required, or precise_u and precise_v
  StridedFloats sigma;           ///< isotropic Gaussians: deviation, texels
  StridedFloats xx, xy, yy;      ///< Gaussians: covariance, texels^2; xy not given: 0
  StridedFloats ax, ay, bx, by;  ///< boxes: half axes, texels
  /// Centres as doubles, for positions far out in a tiled texture. Where given, they count instead of u and v.
  StridedDoubles precise_u = {}, precise_v = {};
  /// On curved surfaces, half widths of the box of half vectors that each pixel sees: halfVectorSpread. Both or neither.
  StridedFloats spread_x = {}, spread_y = {};

  bool curved() const { return spread_x.data != nullptr; }
  Vec2 spread(std::size_t k) const { return curved() ? Vec2{spread_x[k], spread_y[k]} : Vec2{}; }

  Footprint operator[](std::size_t k) const {
    const Vec2 centre = precise_u.data ? wrappedUv(precise_u[k], precise_v[k]) : Vec2{u[k], v[k]};
    if (sigma.data) return Footprint::isotropic(centre, sigma[k]);
    if (xx.data) return Footprint::gaussian(centre, {xx[k], xy.data ? xy[k] : 0.0f, yy[k]});
    return Footprint::box(centre, {ax[k], ay[k]}, {bx[k], by[k]});
  }
};

/// Half vectors as a structure of arrays.
struct HalfVectorArrays {
  StridedFloats x, y;
  Vec2 operator[](std::size_t k) const { return {x[k], y[k]}; }
};

/// Boxes of half vectors as a structure of arrays.
struct RangeArrays {
  StridedFloats x0, y0, x1, y1;
  Box2 operator[](std::size_t k) const { return {{x0[k], y0[k]}, {x1[k], y1[k]}}; }
};

/// Half vectors that are drawn, and their pdfs; all contiguous.
struct SampleArrays {
  float *x, *y, *pdf;

  void set(std::size_t k, const HalfVectorSample& drawn) const {
    x[k] = drawn.h.x;
    y[k] = drawn.h.y;
    pdf[k] = drawn.pdf;
  }
};

/// out[k] = density of query k, for k < count. Each value is that of a single query to 1e-6 of itself: products and sums may be
/// fused or in another order. Degenerate queries follow the rules of single queries.
///
/// Pyramids with constant pixels overlap the cache misses of many queries if all footprints of the batch are round. If one
/// footprint is split into parts, all queries are asked one by one. All else gains only the cost of the calls: each query has
/// enough work to hide its own misses.
/// Footprints with a spread are answered by CurvedNdf, one query at a time.
/// @note thread-safe, allocates nothing; split a batch over threads as you like
void densities(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& halves,
               float* out);

/// out[k] = mean density over the box of query k.
void means(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const RangeArrays& ranges, float* out);

/// Draws the half vector of query k from the density of its footprint, with xi[k] in [0, 1)^2.
void samples(const AnyNdf& model, std::size_t count, const FootprintArrays& footprints, const HalfVectorArrays& xi,
             const SampleArrays& out);

}  // namespace glint::api
