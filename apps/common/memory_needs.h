#pragma once

#include <fmt/format.h>

#include <string>

#include "common/tool.h"

namespace glint::apps {

/// Memory that the builders take at their peak, bytes for each texel of what they work on, rounded up. test_memory.py fails where a
/// builder takes more. pyramidBytes() of the builder and the tables of others are estimates of their own.
struct BytesPerTexel {
  static constexpr double kSynth = 96;            ///< normals or heights, the spectrum of noise, the encoded image
  static constexpr double kMoments = 28;          ///< six moments of all levels
  static constexpr double kTextures = 160;        ///< the same, and pictures of them
  static constexpr double kExplicit = 20;         ///< normals, and their bounds
  static constexpr double kDisplace = 128;        ///< heights, geometry, masks of visible directions
  static constexpr double kDisplaceFinely = 300;  ///< the same where cells have fewer than kFineFactor texels along a side
  static constexpr double kTiles = 24;            ///< of all Wang tiles
  static constexpr double kSeams = 160;           ///< of one Wang tile: the candidates of seams
  static constexpr double kExample = 1400;        ///< of the example at 128 pixels an image: a table for each texel
  static constexpr double kPicture = 40;          ///< densities or colours, and the encoded picture
};
inline constexpr int kFineFactor = 8;

/// Memory that is taken beside arrays in files (FiledMemory): rows that are being read, and small arrays.
inline constexpr double kLeastBytes = 16 << 20;

/// Refuses work on so many texels if it takes more than --max-memory.
/// @param what  "a bin map of"; the size is added
/// @throws Error failed
inline void requireMemoryFor(const Tool& tool, const std::string& what, int width, int height, double bytes_per_texel,
                             const std::string& remedy = "take a smaller map") {
  tool.requireMemory(bytes_per_texel * width * height, fmt::format("{} {} x {} texels", what, width, height), remedy);
}

}  // namespace glint::apps
