#pragma once

#include <algorithm>
#include <cmath>

#include "glint/math/vec.h"

namespace glint {

/// A 2x2 matrix: rows {xx, xy} and {yx, yy}.
struct Matrix2 {
  float xx = 1, xy = 0, yx = 0, yy = 1;

  GLINT_HD constexpr float determinant() const { return xx * yy - xy * yx; }
  /// @pre determinant() is not 0
  GLINT_HD constexpr Matrix2 inverse() const {
    const float scale = 1 / determinant();
    return {scale * yy, -scale * xy, -scale * yx, scale * xx};
  }
  friend GLINT_HD constexpr Vec2 operator*(const Matrix2& m, Vec2 v) {
    return {m.xx * v.x + m.xy * v.y, m.yx * v.x + m.yy * v.y};
  }
  friend GLINT_HD constexpr Matrix2 operator*(const Matrix2& a, const Matrix2& b) {
    return {a.xx * b.xx + a.xy * b.yx, a.xx * b.xy + a.xy * b.yy, a.yx * b.xx + a.yy * b.yx, a.yx * b.xy + a.yy * b.yy};
  }
};

/// The parts of a transform: rotation * (1 shear; 0 1) * (scale stretch, 0; 0, scale / stretch) * mirror.
struct TransformParts {
  float scale = 1, stretch = 1, shear = 0, angle_rad = 0;
  bool mirrored = false;  ///< x -> -x, first
};

inline GLINT_HD Matrix2 transformMatrix(const TransformParts& t) {
  const float x = t.mirrored ? -t.scale * t.stretch : t.scale * t.stretch, y = t.scale / t.stretch;
  const float c = std::cos(t.angle_rad), s = std::sin(t.angle_rad);
  return Matrix2{c, -s, s, c} * Matrix2{x, t.shear * y, 0, y};
}

/// How normals turn when a relief is moved with its surface by a matrix M, and its heights are multiplied by a factor.
///
/// The height at x becomes factor * height(M^-1 x). So gradients become B = factor M^-T times what they were, and slopes with
/// them. A rotation turns normals, a mirror mirrors them; a stretch along an axis makes slopes along this axis less steep.
class NormalTurn {
 public:
  NormalTurn() = default;
  /// @param matrix   not singular
  /// @param heights  factor of heights, > 0
  GLINT_HD NormalTurn(const Matrix2& matrix, float heights) {
    const Matrix2 inverse = matrix.inverse();
    slopes_ = {heights * inverse.xx, heights * inverse.yx, heights * inverse.xy, heights * inverse.yy};
    inverse_ = slopes_.inverse();
    per_area_ = std::fabs(inverse_.determinant());
    const float xx = slopes_.xx * slopes_.xx + slopes_.yx * slopes_.yx - 1;
    const float yy = slopes_.xy * slopes_.xy + slopes_.yy * slopes_.yy - 1;
    const float xy = slopes_.xx * slopes_.xy + slopes_.yx * slopes_.yy;
    constexpr float kRounding = 1e-5f;
    is_rigid_ = std::max({std::fabs(xx), std::fabs(yy), std::fabs(xy)}) < kRounding;
  }

  /// Whether it only rotates or mirrors.
  GLINT_HD bool isRigid() const { return is_rigid_; }

  /// The normal of the moved relief where the example has the normal n.
  GLINT_HD Vec2 turned(Vec2 n) const {
    const Vec2 b = slopes_ * n;
    if (is_rigid_) return b;
    const float length = std::sqrt(dot(b, b) + std::max(0.0f, 1 - dot(n, n)));
    return length > 0 ? (1 / length) * b : Vec2{};
  }

  /// Change of turned(n) when n changes by a column of `change`.
  GLINT_HD Matrix2 turned(Vec2 n, const Matrix2& change) const {
    const Vec2 b = slopes_ * n;
    const float length = std::sqrt(dot(b, b) + std::max(1e-6f, 1 - dot(n, n))), scale = 1 / length;
    const Vec2 h = scale * b;
    const auto column = [&](Vec2 d) {
      const Vec2 e = slopes_ * d;
      return scale * (e - (dot(h, e) - scale * dot(n, d)) * h);
    };
    const Vec2 x = column({change.xx, change.yx}), y = column({change.xy, change.yy});
    return {x.x, y.x, x.y, y.y};
  }

  /// A half vector of the plane in the frame of the example. Density of the plane = factor * density of the example there.
  struct Pulled {
    Vec2 h;
    float factor;  ///< 0 outside the unit circle, except for rigid turns
  };
  GLINT_HD Pulled pulledBack(Vec2 h) const {
    const Vec2 b = inverse_ * h;
    if (is_rigid_) return {b, 1};
    // Densities of slopes are those of the disk times z^4.
    const float z2 = 1 - dot(h, h), length2 = dot(b, b) + z2;
    if (!(z2 > 0 && length2 > 0)) return {h, 0};
    return {(1 / std::sqrt(length2)) * b, per_area_ / (length2 * length2)};
  }

  /// Change of pulledBack(h).h with h: its columns are the changes along x and y.
  GLINT_HD Matrix2 pullChange(Vec2 h) const {
    if (is_rigid_) return inverse_;
    const Vec2 b = inverse_ * h;
    const float length = std::sqrt(std::max(1e-12f, dot(b, b) + 1 - dot(h, h))), scale = 1 / length;
    const Vec2 n = scale * b;
    const auto column = [&](Vec2 d) {
      const Vec2 e = inverse_ * d;
      return scale * (e - (dot(n, e) - scale * dot(h, d)) * n);
    };
    const Vec2 x = column({1, 0}), y = column({0, 1});
    return {x.x, y.x, x.y, y.y};
  }

 private:
  Matrix2 slopes_;      ///< B
  Matrix2 inverse_;     ///< of B
  float per_area_ = 1;  ///< 1 / |det B|
  bool is_rigid_ = true;
};

}  // namespace glint
