#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include "glint/math/vec.h"

namespace glint::bake {

/// A periodic height field as a triangulated surface. Lengths are in cells.
///
/// Vertex (i, j) has height heights[j][i]. Cell (i, j) lies between vertices (i, j) and (i + 1, j + 1) and is cut along the
/// diagonal from (i + 1, j) to (i, j + 1): facet 2 (j width + i) is the half at vertex (i, j), facet 2 (j width + i) + 1 the
/// other.
class HeightSurface {
 public:
  HeightSurface(int width, int height, std::span<const float> heights)
      : width_(width), height_(height), heights_(heights.data()) {}

  int width() const { return width_; }
  int height() const { return height_; }
  std::size_t cellCount() const { return static_cast<std::size_t>(width_) * height_; }
  std::size_t facetCount() const { return 2 * cellCount(); }
  std::span<const float> heights() const { return {heights_, cellCount()}; }

  float at(int i, int j) const { return heights_[static_cast<std::size_t>(j) * width_ + i]; }
  int nextColumn(int i) const { return i + 1 == width_ ? 0 : i + 1; }
  int nextRow(int j) const { return j + 1 == height_ ? 0 : j + 1; }

  /// dh/dx and dh/dy of a facet.
  Vec2 slope(std::size_t facet) const {
    const Corners c = corners(facet / 2);
    return facet % 2 == 0 ? Vec2{c.h10 - c.h00, c.h01 - c.h00} : Vec2{c.h11 - c.h01, c.h11 - c.h10};
  }

  /// Unit normal of a facet. 1 / z is the area of the facet over its projected area.
  Vec3 normal(std::size_t facet) const {
    const Vec2 s = slope(facet);
    const float z = 1 / std::sqrt(1 + dot(s, s));
    return {-s.x * z, -s.y * z, z};
  }

  /// A point of a facet: u and v cells along x and y from vertex (i, j), or for the other half of the cell, u and v cells
  /// backwards from vertex (i + 1, j + 1). u, v >= 0, u + v <= 1.
  Vec3 point(std::size_t facet, float u, float v) const {
    const std::size_t cell = facet / 2;
    const Corners c = corners(cell);
    const auto i = static_cast<float>(cell % static_cast<std::size_t>(width_));
    const auto j = static_cast<float>(cell / static_cast<std::size_t>(width_));
    if (facet % 2 == 0) return {i + u, j + v, c.h00 + u * (c.h10 - c.h00) + v * (c.h01 - c.h00)};
    return {i + 1 - u, j + 1 - v, c.h11 + u * (c.h01 - c.h11) + v * (c.h10 - c.h11)};
  }

  /// Corners of a facet: vertices, numbered j * width + i.
  std::array<std::size_t, 3> cornerTexels(std::size_t facet) const {
    const std::size_t cell = facet / 2, width = static_cast<std::size_t>(width_);
    const std::size_t i = cell % width, row = cell - i;
    const std::size_t right = i + 1 == width ? 0 : i + 1, up = row + width == cellCount() ? 0 : row + width;
    return {facet % 2 == 0 ? cell : up + right, row + right, up + i};
  }

  struct Corners {
    float h00, h10, h01, h11;
  };
  Corners corners(std::size_t cell) const {
    const int i = static_cast<int>(cell % static_cast<std::size_t>(width_)),
              j = static_cast<int>(cell / static_cast<std::size_t>(width_));
    const int i1 = nextColumn(i), j1 = nextRow(j);
    return {at(i, j), at(i1, j), at(i, j1), at(i1, j1)};
  }

 private:
  int width_;
  int height_;
  const float* heights_;
};

}  // namespace glint::bake
