#pragma once

#include <cstddef>
#include <cstdint>

#include "glint/math/vec.h"
#include "glint/model/normal_map.h"

namespace glint {

/// Type of the normals that an asset keeps.
enum class NearType : std::uint8_t {
  f32,  ///< Vec2 and NormalBounds, as a normal map has them
  i16,  ///< NormalCode and CodeBounds
};

/// A normal in 16 bits along each axis: the code times NearNormals::step.
struct NormalCode {
  std::int16_t x, y;
};
static_assert(sizeof(NormalCode) == 4);

/// NormalBounds in codes: the box of the codes that it bounds.
struct CodeBounds {
  std::int16_t low_x, low_y, high_x, high_y;
};
static_assert(sizeof(CodeBounds) == 8);

/// One level of the min-max pyramid of NearNormals, as NormalBoundsLevel.
struct NearBoundsLevel {
  int columns = 0;
  int rows = 0;
  const void* nodes = nullptr;  ///< [rows][columns] of NormalBounds or CodeBounds

  GLINT_HD std::size_t size() const { return rowMajorIndex(0, rows, columns); }
};

/// The normals of a map, for footprints below level 0 of a pyramid: those of a NormalMap, or the same in half the bytes.
struct NearNormals {
  int width = 0;                  ///< texels; 0: no normals
  int height = 0;                 ///< texels
  NearType type = NearType::f32;  ///< of `texels` and of the nodes of `bounds`
  float step = 1;                 ///< i16: normal = step * code. A power of two, so that the product is exact
  const void* texels = nullptr;   ///< [height][width] of Vec2 or NormalCode

  /// Min-max pyramid, as that of a NormalMap; empty when not built.
  int bounds_level_count = 0;
  NearBoundsLevel bounds[NormalMap::kMaxBoundsLevels];

  NearNormals() = default;
  /// Those of a map, whose arrays must outlive it.
  GLINT_HD NearNormals(const NormalMap& map)  // NOLINT(google-explicit-constructor): every map is one
      : width(map.width), height(map.height), texels(map.normals.data()), bounds_level_count(map.bounds_level_count) {
    for (int k = 0; k < map.bounds_level_count; ++k)
      bounds[k] = {map.bounds[k].columns, map.bounds[k].rows, map.bounds[k].nodes.data()};
  }

  GLINT_HD bool coded() const { return type == NearType::i16; }
  GLINT_HD const Vec2* normals() const { return static_cast<const Vec2*>(texels); }
  GLINT_HD const NormalCode* codes() const { return static_cast<const NormalCode*>(texels); }

  GLINT_HD Vec2 decoded(NormalCode code) const {
    return {step * static_cast<float>(code.x), step * static_cast<float>(code.y)};
  }
  GLINT_HD NormalBounds decoded(const CodeBounds& b) const {
    return {step * static_cast<float>(b.low_x), step * static_cast<float>(b.low_y), step * static_cast<float>(b.high_x),
            step * static_cast<float>(b.high_y)};
  }
  /// Normal of element `index` of [height][width].
  GLINT_HD Vec2 normal(std::size_t index) const { return coded() ? decoded(codes()[index]) : normals()[index]; }
  GLINT_HD Vec2 at(int i, int j) const { return normal(rowMajorIndex(i, j, width)); }
  /// Node `index` of a level of bounds.
  GLINT_HD NormalBounds node(int level, std::size_t index) const {
    const void* nodes = bounds[level].nodes;
    return coded() ? decoded(static_cast<const CodeBounds*>(nodes)[index]) : static_cast<const NormalBounds*>(nodes)[index];
  }
};

/// Bytes of a normal, and of a node of its bounds.
GLINT_HD constexpr std::size_t normalBytes(NearType type) { return type == NearType::i16 ? sizeof(NormalCode) : sizeof(Vec2); }
GLINT_HD constexpr std::size_t boundsBytes(NearType type) {
  return type == NearType::i16 ? sizeof(CodeBounds) : sizeof(NormalBounds);
}

}  // namespace glint
