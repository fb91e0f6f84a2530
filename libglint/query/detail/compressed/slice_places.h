#pragma once

#include <cstddef>
#include <cstdint>

#include "glint/math/bits.h"
#include "glint/model/ndf_cp.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"

namespace glint {

/// A slice and its cluster.
struct SlicePlace {
  static constexpr std::size_t kNone = ~std::size_t{0};
  GLINT_HD bool found() const { return cluster != kNone; }

  std::size_t cluster = kNone;  ///< kNone: the image has no slice in the block
  std::uint64_t slice = 0;
};

/// Finds the slice of an image in a block.
/// @param block_place  place of the block (NdfCp)
inline GLINT_HD SlicePlace findSlice(const NdfCp& ndf, std::size_t image, int block_place) {
  const std::size_t at = rowMajorIndex(block_place, ndf.image_regions.data()[image], ndf.places);
  const int slot = ndf.image_slots.data()[image];
  const std::size_t word = ndf.clusters.data()[at].first_word + static_cast<std::size_t>(slot / 64);
  const std::uint64_t mask = ndf.masks.data()[word], bit = std::uint64_t{1} << (slot % 64);
  if (!(mask & bit)) return {};
  return {at, ndf.mask_ranks.data()[word] + static_cast<std::uint64_t>(setBits(mask & (bit - 1)))};
}

/// Slices of the chosen images in one block. Weights include the scales of images. A weight is 0 where the image has no slice.
struct SlicePlaces {
  std::uint32_t clusters[PyramidSlices::kMost];
  std::uint32_t slices[PyramidSlices::kMost];
  float weights[PyramidSlices::kMost];
  int count = 0;  ///< of the chosen images; 0 if no image has a slice
};

/// Finds the slices of the chosen images in a block. Has no branch on whether an image has a slice: processors cannot predict
/// it.
/// @param scales  factors of images, [images]
inline GLINT_HD SlicePlaces findSlices(const NdfCp& ndf, const PyramidSlices& chosen, int block, const float* scales) {
  SlicePlaces out;
  const unsigned block_place = ndf.block_places.data()[block];
  if (block_place == kNoBlockPlace) return out;
  out.count = chosen.count;
  const auto block_places = static_cast<unsigned>(ndf.places);
  for (int step = 0; 4 * step < chosen.count; ++step) {
    const std::uint32_t first = ndf.first_image[chosen.levels[step]];
    for (int k = 4 * step; k < 4 * step + 4; ++k) {
      const std::size_t image = first + chosen.images[k];
      const unsigned slot = ndf.image_slots.data()[image];
      out.clusters[k] = ndf.image_regions.data()[image] * block_places + block_place;
      const std::size_t word = ndf.clusters.data()[out.clusters[k]].first_word + slot / 64;
      const BitRank rank(ndf.masks.data()[word], slot % 64);
      out.slices[k] = static_cast<std::uint32_t>(ndf.mask_ranks.data()[word] + rank.below);
      out.weights[k] = keepIf(rank.kept, chosen.weights[k] * scales[image]);
    }
  }
  return out;
}

}  // namespace glint
