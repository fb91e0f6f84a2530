#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "glint/math/vec.h"
#include "glint/model/map_slopes.h"

namespace glint {

/// Interpolation of normals between texel centres.
enum class Surface : std::uint8_t {
  flat,    ///< each texel is a facet: a point of the disk
  smooth,  ///< linear over the two triangles of every cell of four texel centres
};

/// Continuation of a map beyond its border.
enum class Boundary : std::uint8_t { wrap, clamp };

/// Smallest box of the disk that holds the normals of a block of texels. Stored as four floats in this order.
struct NormalBounds {
  float low_x;
  float low_y;
  float high_x;
  float high_y;
};
static_assert(sizeof(NormalBounds) == 16);

/// One level of the min-max pyramid of a normal map.
///
/// With b = 2^(k+1) texels, node (i, j) of `bounds[k]` bounds the texels [i b, (i+1) b] x [j b, (j+1) b], both ends included
/// (wrapped). The extra row and column are there so that the node also bounds the triangles of a smooth surface that start in
/// it. columns = ceil(width / b), rows = ceil(height / b).
struct NormalBoundsLevel {
  int columns = 0;
  int rows = 0;
  std::span<const NormalBounds> nodes;  ///< [rows][columns]
};

/// A map of normals, each given by its projection (nx, ny) on the unit disk; nz = sqrt(1 - nx^2 - ny^2) > 0.
///
/// Bottom row first: element [j][i] is centred at u = (i + 0.5) / width, v = (j + 0.5) / height.
struct NormalMap {
  static constexpr int kMaxBoundsLevels = 20;

  int width = 0;                    ///< texels
  int height = 0;                   ///< texels
  float texel_size_um = 0;          ///< 0 when unknown
  std::span<const Vec2> normals;    ///< [height][width]
  std::optional<MapSlopes> slopes;  ///< of the texels; nothing when not computed

  /// Min-max pyramid from the finest level (2x2 texels) to the coarsest (one node); empty when not built.
  int bounds_level_count = 0;
  NormalBoundsLevel bounds[kMaxBoundsLevels];

  GLINT_HD const Vec2& at(int i, int j) const { return normals.data()[rowMajorIndex(i, j, width)]; }
};

/// A height field, same order as NormalMap. Heights are in texels (height / texel size).
struct HeightMap {
  int width = 0;
  int height = 0;
  float texel_size_um = 0;         ///< 0 when unknown
  std::span<const float> heights;  ///< [height][width], texels
};

}  // namespace glint
