#pragma once

// Private to libglint/api.

#include <cstdint>

#include "glint/api/batch.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"

namespace glint::api {

/// Queries that a batch works on at once: enough to keep many cache misses in flight, few enough to stay in the nearest cache.
inline constexpr int kChunk = 32;

/// The images that answer a chunk of queries, as SliceChooser chooses them, and the pixels that are read. Lane k is a query;
/// lanes beyond the last query repeat it.
struct SliceChunk {
  /// Slice j of a query: corner j % 4 (x in bit 0, y in bit 1) of level first + j / 4.
  alignas(64) float weights[8][kChunk];  ///< 0: the slice does not count, but its image can be read
  alignas(64) std::uint32_t images[8][kChunk];
  alignas(64) std::int32_t levels[2][kChunk];
  alignas(64) std::int32_t blocks[kChunk];
  alignas(64) std::int32_t pixels[kChunk];  ///< y * kBlockSize + x in the block
  alignas(64) std::int32_t inside[kChunk];  ///< 1: the half vector is in the square, else the density is 0
  alignas(64) std::int32_t below[kChunk];   ///< 1: the footprint is below level 0

  /// The images of one query.
  PyramidSlices slices(int lane) const {
    PyramidSlices out;
    for (int step = 0; step < 2; ++step) out.levels[step] = levels[step][lane];
    for (int j = 0; j < PyramidSlices::kMost; ++j) {
      out.images[j] = images[j][lane];
      out.weights[j] = weights[j][lane];
    }
    out.count = PyramidSlices::kMost;
    return out;
  }
};

/// Fills a chunk with queries [first, first + count), count <= kChunk.
/// @param chooser  of this shape
void selectChunk(const PyramidShape& shape, const SliceChooser& chooser, const FootprintArrays& footprints,
                 const HalfVectorArrays& halves, std::size_t first, int count, SliceChunk& chunk);

}  // namespace glint::api
