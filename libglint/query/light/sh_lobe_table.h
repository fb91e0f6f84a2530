#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>

#include "glint/math/half.h"
#include "glint/math/vec.h"
#include "glint/model/sh.h"

namespace glint {

/// Turned roughness lobes from a table (Gamboa 2018, section 6.2). Blends the lobes of the four nearest directions of the grid.
/// Blending blurs detail that is finer than the grid: bands above about the number of rows are lost between grid points. So the
/// grid must be four times as fine as the lobe is wide. Evaluating harmonics (ShAccumulator) is exact, and faster if the table
/// does not fit a cache.
class ShLobeTable {
 public:
  GLINT_HD explicit ShLobeTable(const ShLobes& lobes) : lobes_(lobes) {}

  /// Adds weight times the lobe towards a unit direction.
  /// @param out  shCount(order) elements; order at most that of the lobes, whose grid must not be 0 x 0
  GLINT_HD void add(Vec3 direction, float weight, int order, std::span<float> out) const {
    const float pi = std::numbers::pi_v<float>;
    float phi = std::atan2(direction.y, direction.x);
    if (phi < 0) phi += 2 * pi;
    const float row = std::acos(std::clamp(direction.z, -1.0f, 1.0f)) / pi * static_cast<float>(lobes_.grid.rows - 1);
    const float column = phi / (2 * pi) * static_cast<float>(lobes_.grid.columns);
    const int r = std::min(static_cast<int>(row), lobes_.grid.rows - 2), c = static_cast<int>(column);
    const float fr = row - static_cast<float>(r), fc = column - static_cast<float>(c);
    addDirection(r, c, weight * (1 - fr) * (1 - fc), order, out);
    addDirection(r, c + 1, weight * (1 - fr) * fc, order, out);
    addDirection(r + 1, c, weight * fr * (1 - fc), order, out);
    addDirection(r + 1, c + 1, weight * fr * fc, order, out);
  }

 private:
  GLINT_HD void addDirection(int row, int column, float weight, int order, std::span<float> out) const {
    const std::size_t direction = static_cast<std::size_t>(row) * static_cast<std::size_t>(lobes_.grid.columns) +
                                  static_cast<std::size_t>(column % lobes_.grid.columns);
    const std::size_t start = direction * shCount(lobes_.order), count = shCount(order);
    float* to = out.data();
    if (lobes_.precision == ShPrecision::f32) {
      const float* from = static_cast<const float*>(lobes_.coefficients) + start;
      for (std::size_t k = 0; k < count; ++k) to[k] += weight * from[k];
    } else {
      const std::uint16_t* from = static_cast<const std::uint16_t*>(lobes_.coefficients) + start;
      for (std::size_t k = 0; k < count; ++k) to[k] += weight * halfToFloat(from[k]);
    }
  }

  ShLobes lobes_;
};

}  // namespace glint
