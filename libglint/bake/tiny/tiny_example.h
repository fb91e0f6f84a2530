#pragma once

#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/model/tiny_example.h"
#include "glint/query/detail/tiny/normal_turn.h"

namespace glint::bake {

struct TinyOptions {
  TinyMode mode = TinyMode::tiled;
  int resolution = 128;    ///< pixels of an NDF image along each axis: a multiple of 16 in [kLeastResolution, kMostResolution]
  float sigma_r = 0.005f;  ///< intrinsic roughness, disk units: at least 0.1 pixel of an NDF image, at most 0.25
  Surface surface = Surface::flat;
  BlockPrecision precision = BlockPrecision::f16;

  // Tiled.
  Matrix2 matrix;     ///< from the example to the plane; not singular
  Vec2 offset;        ///< texels of the plane
  float heights = 1;  ///< factor of the heights of the relief, > 0

  // Scattered.
  TinyTransforms transforms;
  float density = 1;  ///< examples in a cell on average, up to TinyExample::kMostDensity
  TinyOverlap overlap = TinyOverlap::quarters;
  float background_sigma_r = 0;  ///< roughness between examples; 0: sigma_r
  int seed = 1;
};

/// A TinyExample that owns its arrays.
class TinyExampleData {
 public:
  TinyExample shape;  ///< parameters; its spans are empty
  NdfPyramidData images;
  std::vector<Vec2> normals;
  float covered = 1;  ///< share of the plane that examples cover

  /// Spans over the arrays; valid while this object lives and is not changed.
  TinyExample view() const;
  std::size_t sizeBytes() const;
};

/// Computes the NDF images of the tiles of an example at every level (Xing 2024, section 5.2 and Eq. 2), and of a plane of
/// scattered examples the mean over points of the plane.
///
/// Each image is the exact mean over its tile: of the texels, or on a smooth surface of points that are less than a deviation of a
/// lobe apart. Normals turn as NormalTurn says. Same bytes on any number of threads.
/// @param example  n x n texels, n a power of two from TinyExample::kLeastSize to kMostSize
/// @throws Error (usage) for options out of range or transforms that do not fit together; (invalid_input) for an example of another
///         size
TinyExampleData buildTinyExample(const NormalMap& example, const TinyOptions& options, const ProgressFn& progress = {});

}  // namespace glint::bake
