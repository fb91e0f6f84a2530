#pragma once

#include <algorithm>
#include <cstddef>
#include <span>

#include "glint/math/vec.h"
#include "glint/model/map_slopes.h"
#include "glint/model/normal_map.h"

namespace glint {

/// Mean and covariance of the slopes under each texel of one level. Texels are of equal size and cover the map.
struct SlopeMomentsLevel {
  int columns = 0;
  int rows = 0;
  std::span<const MapSlopes> texels;  ///< [rows][columns], bottom row first
};

/// Moments of the slopes of a normal map at all sizes of footprints, as the levels of a texture (asset kind `slope-moments`).
/// LEAN mapping (Olano and Baker 2010) and LEADR mapping (Dupuy et al. 2013) filter the same moments.
///
/// Level l of a full chain has chainSize(width, l) x chainSize(height, l) texels, as graphics hardware has it. The chain ends
/// with one texel, which holds the moments of the whole map. An asset may leave out its finest levels.
struct SlopeMoments {
  static constexpr int kMaxLevels = 21;

  int width = 0;   ///< of the normal map, texels
  int height = 0;  ///< of the normal map, texels
  Boundary boundary = Boundary::wrap;
  int finest_level = 0;  ///< level of the full chain that is levels[0]
  int level_count = 0;   ///< 1..kMaxLevels
  MapSlopes slopes;      ///< of the normal map's texels
  SlopeMomentsLevel levels[kMaxLevels];

  /// Texels of level l of a full chain along an axis of `texels` texels.
  static GLINT_HD constexpr int chainSize(int texels, int l) { return std::max(1, texels >> l); }
  /// Levels of a full chain.
  static GLINT_HD constexpr int chainLength(int width, int height) {
    int count = 1;
    while (std::max(width, height) >> count > 0) ++count;
    return count;
  }
};

}  // namespace glint
