#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

#include "glint/math/vec.h"
#include "glint/model/ndf_pyramid.h"

namespace glint {

/// How copies of an example cover a plane.
enum class TinyMode : std::uint8_t {
  tiled,      ///< side by side, all with one transform
  scattered,  ///< at random places, each with a transform of its own
};

/// Which of several scattered examples is seen at a point that they cover.
enum class TinyOverlap : std::uint8_t {
  /// The common part of their bounding boxes is divided into four quarters. In a quarter the example is seen whose centre is
  /// nearest to the middle of the quarter (Xing 2024, section 6.3 and Fig. 3).
  quarters,
  nearest,  ///< the example whose centre is nearest to the point
};

/// The numbers from which each scattered example draws its own, evenly.
struct TinyRange {
  float low = 0;
  float high = 0;
};

/// Transforms of scattered examples. The matrix of an example is
/// rotation * (1 shear; 0 1) * (scale stretch, 0; 0, scale / stretch) * mirror, with mirror x -> -x.
struct TinyTransforms {
  TinyRange scale = {1, 1};
  TinyRange stretch = {1, 1};
  TinyRange shear;
  TinyRange rotation_rad;
  TinyRange heights = {1, 1};  ///< factor of the heights of the relief; normals turn with it
  float mirror = 0;            ///< share of the examples that are mirrored, 0 to 1

  /// Largest distance between the centre of an example and its corners, in cells.
  GLINT_HD float reach() const {
    constexpr float kHalfDiagonal = 0.70710678f;
    const float thinnest = std::max(std::max(stretch.high, 1 / stretch.low), 1.0f);
    const float slanted = std::max(std::fabs(shear.low), std::fabs(shear.high));
    return kHalfDiagonal * scale.high * thinnest * (1 + slanted);
  }
};

/// A plane without end that is covered by copies of one small normal map, the example (asset kind `tiny-example`, Xing 2024).
///
/// The example has n x n texels, n a power of two. Level l of `images` has the NDF of each of its tiles of 2^(l+1) x 2^(l+1)
/// texels, up to one tile for the whole example (Eq. 2). Below level 0 the elements themselves answer (Eq. 1).
/// Cell (i, j) of the plane is the square of n x n texels whose lower left corner is at (i n, j n).
struct TinyExample {
  static constexpr int kLeastSize = 2, kMostSize = 256;
  /// Largest number of examples in a cell, on average.
  static constexpr float kLeastDensity = 0.01f, kMostDensity = 8;
  /// Largest number in a matrix of a tiled plane, and smallest determinant.
  static constexpr float kMostMatrix = 64, kLeastDeterminant = 1e-6f;
  /// Largest distance between the centre of an example and its corners, in cells.
  static constexpr float kMostReach = 2;
  /// Footprints up to at least this deviation, in cells, are answered from the examples that they cover. More examples, or larger
  /// ones, than that allows would cost too much.
  static constexpr float kLeastSigmaInCells = 0.1f;
  /// Examples near a footprint that a query expects at most, and the deviations up to which it looks for them.
  static constexpr float kMostExpected = 64, kFootprintReach = 3.2f;
  /// Deviation, in cells, of footprints near which kMostExpected examples are.
  static GLINT_HD float sigmaInCells(float density, float reach) {
    return (std::sqrt(kMostExpected / density) - 2 * reach) / (2 * kFootprintReach);
  }

  TinyMode mode = TinyMode::tiled;
  TinyOverlap overlap = TinyOverlap::quarters;  ///< of scattered examples
  /// Tiled: point x of the example is seen at matrix x + offset of the plane. Rows of the matrix are {xx, xy} and {yx, yy}. The
  /// normals are those of the plane: they are turned already.
  float matrix[4] = {1, 0, 0, 1};
  Vec2 offset;                   ///< tiled, texels of the plane
  TinyTransforms transforms;     ///< scattered
  float density = 1;             ///< scattered: examples in a cell on average
  float background_sigma_r = 0;  ///< scattered: roughness of the surface between examples, whose normal is the plane's
  int seed = 1;                  ///< scattered

  /// Width, height: n. Strides are 2^(l+1). Scattered: one more level, whose only image is the mean of the plane.
  NdfPyramid images;
  std::span<const Vec2> normals;  ///< [n][n], bottom row first

  GLINT_HD int size() const { return images.shape.width; }
  /// Levels of images of the example's tiles.
  GLINT_HD int exampleLevels() const { return images.shape.level_count - (mode == TinyMode::scattered ? 1 : 0); }
  /// The level whose only image is the mean of the plane.
  GLINT_HD int meanLevel() const { return images.shape.level_count - 1; }
};

}  // namespace glint
