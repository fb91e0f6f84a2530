#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/half_vector.h"
#include "glint/math/tangents.h"
#include "glint/model/footprint.h"
#include "glint/model/map_slopes.h"
#include "glint/query/brdf/smith.h"
#include "glint/query/ndf_model.h"
#include "glint/query/ray_footprint.h"

namespace glint {

// How a map lies on a surface. Two steps bring a shading point to a map, and both are here:
//
//   texture coordinates (s, t) of the mesh  --TextureTransform-->  uv of the map, and the change of uv from pixel to pixel
//   directions at the shading point         --MapPlacement----->   half vectors of the map
//
// The first step is about positions: scale, rotation and offset of the texture. The second step is about directions. A map that
// is stretched in one direction is less steep along that direction, so its normals are others than the stored ones, and so is
// their density. PlacedNdf answers with the density of the surface. A map that keeps the shape of its texels (dp/du and dp/dv
// orthogonal, texels square) needs no MapPlacement: its half vectors are those of the frame (dp/du, dp/dv, n).

/// uv of a map as an affine function of the texture coordinates (s, t) of a mesh.
///
/// uv = (us s + ut t + u, vs s + vt t + v). A scale of 4 repeats the map four times over the mesh.
struct TextureTransform {
  double us = 1, ut = 0, vs = 0, vt = 1;  ///< derivatives of u and v by s and t
  double u = 0, v = 0;                    ///< uv at s = t = 0

  static GLINT_HD TextureTransform scale(double along_u, double along_v) { return {along_u, 0, 0, along_v, 0, 0}; }
  static GLINT_HD TextureTransform offset(double u, double v) { return {1, 0, 0, 1, u, v}; }
  /// Turns uv counter-clockwise about the origin, so that the picture on the mesh turns clockwise.
  static GLINT_HD TextureTransform rotation(double angle_rad) {
    const double c = std::cos(angle_rad), s = std::sin(angle_rad);
    return {c, -s, s, c, 0, 0};
  }

  /// This transform, and after it another one.
  GLINT_HD TextureTransform then(const TextureTransform& next) const {
    return {next.us * us + next.ut * vs, next.us * ut + next.ut * vt,        next.vs * us + next.vt * vs,
            next.vs * ut + next.vt * vt, next.us * u + next.ut * v + next.u, next.vs * u + next.vt * v + next.v};
  }

  /// uv at a point of the mesh, as the centre of a footprint: modulo the map, reduced as doubles.
  GLINT_HD Vec2 at(double s, double t) const { return wrappedUv(us * s + ut * t + u, vs * s + vt * t + v); }

  /// Change of uv for a change of (s, t): for the differentials of footprintFromDifferentials.
  GLINT_HD Vec2 change(Vec2 dst) const {
    return {static_cast<float>(us * double{dst.x} + ut * double{dst.y}),
            static_cast<float>(vs * double{dst.x} + vt * double{dst.y})};
  }

  /// dp/du (`s`) and dp/dv (`t`) of the map from dp/ds and dp/dt of the mesh. Both are 0 where the transform is singular.
  GLINT_HD Tangents tangents(Vec3 dpds, Vec3 dpdt) const {
    const double determinant = us * vt - ut * vs;
    if (!(std::fabs(determinant) > 0)) return {};
    const auto part = [&](double x) { return static_cast<float>(x / determinant); };
    return {part(vt) * dpds + part(-vs) * dpdt, part(-ut) * dpds + part(us) * dpdt};
  }
};

/// The linear map from texels of a normal map to the tangent plane of a shading point, and with it the change between half
/// vectors of the surface and half vectors of the map.
///
/// Let M have the columns dp/du / width and dp/dv / height in the frame of the surface: a step of one texel along each axis.
/// Heights of the map, in texels, are z scene units per texel high. Then slopes of the surface are (M / z)^-T times slopes of
/// the map, and with L = M / z
///
///   half vector of the map      h_m  =  (L^T h_xy, h_z), normalised
///   density on the surface      D(h) =  D_m(h_m) |det L| (h_m.z / h.z)^4
///
/// since the density of slopes is D h.z^4 per unit of slope, and its integral is kept. Thread-safe, allocates nothing.
class MapPlacement {
 public:
  /// A map on a surface with its texels square, one scene unit wide: directions of surface and map are the same.
  MapPlacement() = default;

  /// @param dpdu, dpdv       derivatives of the position by uv of the map, scene units: any lengths and any angle between them
  /// @param frame            tangents of the frame in which directions are given: unit vectors, orthogonal to each other and to
  ///                         the normal. They need not follow dpdu
  /// @param width, height    of the map, texels
  /// @param units_per_height scene units of a height of one texel: the size of a texel where the map was measured. 0: the mean
  ///                         size of a texel here, so that a map which is enlarged evenly keeps its normals
  /// @note where dpdu and dpdv are parallel, 0 or not finite, directions are kept and texels are one scene unit wide
  GLINT_HD MapPlacement(Vec3 dpdu, Vec3 dpdv, const Tangents& frame, int width, int height, float units_per_height = 0) {
    const float w = 1 / static_cast<float>(width), h = 1 / static_cast<float>(height);
    const Matrix m = {w * dot(frame.s, dpdu), h * dot(frame.s, dpdv), w * dot(frame.t, dpdu), h * dot(frame.t, dpdv)};
    const float determinant = std::fabs(m.determinant()), squares = m.xx * m.xx + m.xy * m.xy + m.yx * m.yx + m.yy * m.yy;
    if (!(determinant > kParallel * squares && squares < kLargest)) return;
    const float z = units_per_height > 0 ? units_per_height : std::sqrt(determinant);
    plane_ = m;
    slopes_ = m.times(1 / z);
  }

  /// The unit normal or half vector of the map that a unit normal or half vector of the surface is.
  /// @param n  z > 0
  GLINT_HD Vec3 toMap(Vec3 n) const {
    const Matrix& l = slopes_;
    return unit({l.xx * n.x + l.yx * n.y, l.xy * n.x + l.yy * n.y, n.z});
  }
  /// The inverse of toMap.
  GLINT_HD Vec3 toSurface(Vec3 n) const {
    const Matrix& l = slopes_;
    const float scale = 1 / l.determinant();
    return unit({scale * (l.yy * n.x - l.yx * n.y), scale * (l.xx * n.y - l.xy * n.x), n.z});
  }

  /// Density on the surface over density of the map: the area of the map's disk for a unit of area of the surface's disk.
  /// @param on_surface, on_map  one half vector in both frames
  GLINT_HD float densityFactor(Vec3 on_surface, Vec3 on_map) const {
    const float ratio = on_map.z / on_surface.z, square = ratio * ratio;
    return std::fabs(slopes_.determinant()) * square * square;
  }

  /// Moments of the slopes of the surface from those of the map.
  GLINT_HD MapSlopes toSurface(const MapSlopes& map) const {
    const Matrix inverse = slopes_.inverse();
    return {{inverse.xx * map.mean.x + inverse.yx * map.mean.y, inverse.xy * map.mean.x + inverse.yy * map.mean.y},
            inverse.transposed().covariance(map.covariance)};
  }

  /// A covariance of the tangent plane, scene units^2, in texels^2: the size of a footprint that is known on the surface.
  GLINT_HD Covariance toTexels(const Covariance& on_surface) const { return plane_.inverse().covariance(on_surface); }

 private:
  struct Matrix {
    float xx, xy, yx, yy;
    GLINT_HD float determinant() const { return xx * yy - xy * yx; }
    GLINT_HD Matrix times(float s) const { return {s * xx, s * xy, s * yx, s * yy}; }
    GLINT_HD Matrix transposed() const { return {xx, yx, xy, yy}; }
    GLINT_HD Matrix inverse() const { return Matrix{yy, -xy, -yx, xx}.times(1 / determinant()); }
    /// A C A^T.
    GLINT_HD Covariance covariance(const Covariance& c) const {
      const float ax = xx * c.xx + xy * c.xy, ay = xx * c.xy + xy * c.yy;
      const float bx = yx * c.xx + yy * c.xy, by = yx * c.xy + yy * c.yy;
      return {ax * xx + ay * xy, ax * yx + ay * yy, bx * yx + by * yy};
    }
  };

  static GLINT_HD Vec3 unit(Vec3 n) { return (1 / std::sqrt(dot(n, n))) * n; }

  static constexpr float kParallel = 1e-6f;  ///< as uvDifferential
  static constexpr float kLargest = 1e30f;

  Matrix plane_ = {1, 0, 0, 1};   ///< M, scene units per texel
  Matrix slopes_ = {1, 0, 0, 1};  ///< L
};

/// Answers for a surface on which a map is placed, from any model of the map: an NdfModel in the frame of the surface, for
/// MicrofacetBrdf and all else that takes one. Footprints stay in texels of the map.
///
/// The lobe of a facet is stretched with the map. Half vectors outside the disk are no directions and have density 0, also where
/// the model spills there.
///
/// Refers to the model, which must outlive it. Thread-safe, allocates nothing.
template <NdfModel M>
class PlacedNdf {
 public:
  GLINT_HD PlacedNdf(const M& model, const MapPlacement& placement) : model_(&model), placement_(placement) {}
  PlacedNdf(const M&& model, const MapPlacement& placement) = delete;

  GLINT_HD const M& model() const { return *model_; }
  GLINT_HD const MapPlacement& placement() const { return placement_; }

  /// Density towards h, >= 0. One density of the model.
  GLINT_HD float density(const Footprint& p, Vec2 h) const {
    const Place at = placeOf(h);
    return at.factor > 0 ? finitePositive(at.factor * model_->density(p, at.map)) : 0.0f;
  }

  /// Average density over a box of half vectors, which is no box on the map: the box is cut into cells at most kLargestCell
  /// wide, at most kMostCells along each axis, and each cell asks the model for the box of the same second moments. So means of
  /// rough maps err by up to 6 % of the largest mean (tests/unit/texture_transform_test.cpp).
  GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    const Box2 inside = insideSquare(range);
    if (!(range.area() > 0 && inside.width() > 0 && inside.height() > 0)) return 0;
    const int columns = cellsOf(inside.width()), rows = cellsOf(inside.height());
    const Vec2 cell = {inside.width() / static_cast<float>(columns), inside.height() / static_cast<float>(rows)};
    float sum = 0;
    for (int j = 0; j < rows; ++j)
      for (int i = 0; i < columns; ++i)
        sum += cellMean(p, inside.low + Vec2{(static_cast<float>(i) + 0.5f) * cell.x, (static_cast<float>(j) + 0.5f) * cell.y},
                        cell);
    return finitePositive(sum * cell.x * cell.y / range.area());
  }

  /// Draws a half vector of the map, and gives it in the frame of the surface. pdf and h are 0 outside the disk.
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    const HalfVectorSample drawn = model_->sample(p, xi);
    const float z2 = 1 - dot(drawn.h, drawn.h);
    if (!(drawn.pdf > 0 && z2 > 0)) return {};
    const Vec3 on_map = {drawn.h.x, drawn.h.y, std::sqrt(z2)}, h = placement_.toSurface(on_map);
    return drawnAt({h.x, h.y}, finitePositive(drawn.pdf * placement_.densityFactor(h, on_map)));
  }

 private:
  /// Cells of `mean`, disk units.
  static constexpr float kLargestCell = 0.0625f;
  static constexpr int kMostCells = 16;

  /// A half vector on the map, and the factor of its density; 0 if there is no such direction.
  struct Place {
    Vec2 map;
    float factor = 0;
  };

  GLINT_HD Place placeOf(Vec2 h) const {
    const float z2 = 1 - dot(h, h);
    if (!(z2 > 0)) return {};
    const Vec3 on_surface = {h.x, h.y, std::sqrt(z2)}, on_map = placement_.toMap(on_surface);
    return {{on_map.x, on_map.y}, placement_.densityFactor(on_surface, on_map)};
  }

  static GLINT_HD int cellsOf(float side) {
    return std::clamp(static_cast<int>(std::ceil(side / kLargestCell)), 1, int{kMostCells});
  }

  /// Mean density over a cell. The image of the cell has the half axes a and b on the map.
  GLINT_HD float cellMean(const Footprint& p, Vec2 centre, Vec2 cell) const {
    const Place at = placeOf(centre);
    if (!(at.factor > 0)) return 0;
    const Vec2 a = stepAlong(centre, {0.5f * cell.x, 0}), b = stepAlong(centre, {0, 0.5f * cell.y});
    const Vec2 half = {std::sqrt(a.x * a.x + b.x * b.x), std::sqrt(a.y * a.y + b.y * b.y)};
    return at.factor * model_->mean(p, {at.map - half, at.map + half});
  }

  /// Half of the way on the map from h - d to h + d. Steps that leave the disk end at h.
  GLINT_HD Vec2 stepAlong(Vec2 h, Vec2 d) const {
    const Place low = placeOf(h - d), high = placeOf(h + d), middle = placeOf(h);
    if (!(low.factor > 0)) return high.factor > 0 ? high.map - middle.map : Vec2{};
    return high.factor > 0 ? 0.5f * (high.map - low.map) : middle.map - low.map;
  }

  const M* model_;
  MapPlacement placement_;
};

/// Masking of a map that is placed on a surface, for a BRDF of PlacedNdf.
/// @param slopes   of the map, as stored
/// @param sigma_r  intrinsic roughness of its facets, which is stretched with the map
inline GLINT_HD SmithMasking placedMasking(const MapSlopes& slopes, float sigma_r, const MapPlacement& placement) {
  MapSlopes rough = slopes;
  rough.covariance.xx += sigma_r * sigma_r;
  rough.covariance.yy += sigma_r * sigma_r;
  return {placement.toSurface(rough), 0};
}

/// The footprint of a beam on a surface on which a map is placed, texels.
/// @param direction  unit vector towards the ray's origin, in the frame of the placement
/// @see footprintOfCone for maps with square texels
inline GLINT_HD Footprint footprintOfCone(RayCone cone, Vec2 uv, Vec3 direction, const MapPlacement& placement) {
  return Footprint::gaussian(uv, placement.toTexels(footprintOfCone(cone, uv, direction, 1.0f).covariance));
}

}  // namespace glint
