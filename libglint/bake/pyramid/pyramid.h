#pragma once

#include <cstdint>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/model/ndf_pyramid_shard.h"

namespace glint::bake {

/// sqrt(2): twice the images of an overlap of 1.
inline constexpr float kDefaultOverlap = 1.41421356f;

/// Pixels of an NDF image along each axis.
inline constexpr int kLeastResolution = 32, kMostResolution = 1024;

struct PyramidOptions {
  float stride = 32;  ///< of level 0, texels; >= 2. Footprints have a deviation of kFootprintPerStride strides
  /// Footprints in a stride along each axis, 1 to kMostOverlap. The default is the knee of error against bytes; 1 is the grid
  /// of Deng 2022.
  float overlap = kDefaultOverlap;
  int resolution = 256;    ///< pixels of an NDF image along each axis: a multiple of 16 in [kLeastResolution, kMostResolution]
  float sigma_r = 0.005f;  ///< intrinsic roughness, disk units: at least 0.1 pixel of an NDF image, at most 0.25
  Surface surface = Surface::flat;
  Boundary boundary = Boundary::wrap;
  /// Number of levels with footprints, besides the level that is the mean of the map. 0: levels are added until two
  /// neighbouring levels agree (see kAgreement) or the stride reaches the size of the map.
  int levels = 0;
  BlockPrecision precision = BlockPrecision::f16;
};

/// The smallest resolution, within the limits, at which sigma_r has 1.5 pixels: densities within a pixel then err by 4 %
/// (PixelSpline).
/// @param sigma_r  intrinsic roughness, disk units, > 0
int resolutionFor(float sigma_r);

/// A block that has less than this share of the mass of its image is not stored.
inline constexpr float kBlockMassThreshold = 1e-6f;

/// An NdfPyramid that owns its arrays.
class NdfPyramidData {
 public:
  struct Level {
    std::vector<std::uint64_t> masks;
    std::vector<std::uint32_t> mask_ranks;
    std::vector<float> block_means;
    std::vector<std::uint16_t> half_pixels;  ///< used with BlockPrecision::f16
    std::vector<float> float_pixels;         ///< used with BlockPrecision::f32
  };

  PyramidShape shape;
  BlockPrecision precision = BlockPrecision::f16;
  float value_scale = 1;
  std::vector<Level> levels;

  /// Spans over the arrays; valid while this object lives and is not changed.
  NdfPyramid view() const;
};

/// The shape of the pyramid for a map of this size. Level l has stride `stride 2^l`, for all strides shorter than the longer
/// side of the map; the last level is the mean of the map.
PyramidShape pyramidShape(int width, int height, const PyramidOptions& options);

/// @throws Error (usage) for options out of range
void checkPyramidOptions(const PyramidOptions& options);

/// The memory that buildPyramid or buildPyramidShard takes at its peak, bytes: images before and after they are packed. Where
/// every block of every image would fit into `most_bytes`, it is the bytes of all blocks; otherwise blocks are counted on a few
/// images of each level.
/// @throws Error usage for options out of range
double pyramidBytes(const NormalMap& map, const PyramidOptions& options, double most_bytes, PyramidRegion region = {});

/// Builds the NDF images of every level (Deng 2022, section 4.1).
///
/// Facets are scattered: each texel of a footprint adds its weight to bins of directions. Then one separable filter for each
/// image turns bins into pixel means of the blurred density. Gaussian footprints end at kPyramidReach deviations.
/// @throws Error (usage) for options out of range
NdfPyramidData buildPyramid(const NormalMap& map, const PyramidOptions& options, const ProgressFn& progress = {});

/// An NdfPyramidShard that owns its arrays.
struct NdfPyramidShardData {
  NdfPyramidData images;  ///< of the shape of the whole pyramid; arrays hold the rows of the region
  PyramidRegion region;
  LevelChoice level_choice = LevelChoice::given;

  NdfPyramidShard view() const;
};

/// Builds the images of one region. The images are the same as those of buildPyramid, bit by bit: joinedShape and joinedRanks
/// (join.h) say how shards are joined. Reads the texels of rowsReached() only, and with a map that does not say its slopes, all
/// others once.
NdfPyramidShardData buildPyramidShard(const NormalMap& map, const PyramidOptions& options, PyramidRegion region,
                                      const ProgressFn& progress = {});

/// The rows of texels that the footprints of a region reach. Of smooth surfaces a few more.
/// @return [height]: 1 where a row is reached
std::vector<std::uint8_t> rowsReached(const PyramidShape& shape, PyramidRegion region);

}  // namespace glint::bake
