#pragma once

#include <cstdint>
#include <span>

#include "glint/model/ndf_pyramid.h"

namespace glint {

/// How the basis images of a cluster are made. In each, a block is a sum over columns k of coefficient(slice, k) * B_k(x, y).
enum class CompressionMethod : std::uint8_t {
  cp,      ///< B_k = X_k(x) Y_k(y): canonical polyadic decomposition (Deng 2022, Eq. 5)
  tucker,  ///< B_k = U_a(x) V_b(y), (a, b) from `core`: Tucker-2 with a sparse core, orthonormal U and V
  pca,     ///< B_k: any 16x16 images, orthonormal
};

/// Storage of coefficients. Bases are always prefix sums of integers (or of floats with f32), so range queries are exact.
enum class CoefficientType : std::uint8_t { i8, f16, f32 };

/// One cluster: the slices (blocks of NDF images) that share an angular block and a region.
///
/// Columns are stored widest first: the last `narrow_columns` have coefficients of 4 bits. A cluster with slices and without
/// columns is one of spots.
struct NdfCluster {
  std::uint64_t first_coefficient = 0;  ///< offset into `coefficients`, elements
  std::uint32_t first_basis = 0;        ///< offset into `basis`, elements
  std::uint32_t first_scale = 0;        ///< offset into `scales` and `core`, elements
  std::uint32_t first_word = 0;         ///< offset into `masks` and `mask_ranks`, elements
  std::uint32_t slice_count = 0;        ///< occupied slices; 0: the block is empty in the whole region
  std::uint16_t columns = 0;            ///< 0: a cluster of spots
  std::uint16_t narrow_columns = 0;     ///< i8: columns of 4 bits
  std::uint8_t rank_x = 0;              ///< tucker: columns of U
  std::uint8_t rank_y = 0;              ///< tucker: columns of V
  std::uint16_t reserved = 0;
};
static_assert(sizeof(NdfCluster) == 32);

/// A facet's image in a slice: a Gaussian of variance sigma_r^2 around a point, and how much of it there is.
struct NdfSpot {
  std::uint8_t x = 0;        ///< centre, eighths of a pixel right of 3 pixels left of the block
  std::uint8_t y = 0;        ///< the same upwards
  std::uint16_t weight = 0;  ///< times the scale of the cluster: sum of its pixels
};
static_assert(sizeof(NdfSpot) == 4);

/// Steps of a spot's place in a pixel.
inline constexpr int kSpotSteps = 8;
/// Pixels between a block and the farthest centre of a spot in it.
inline constexpr int kSpotReach = 3;
/// Largest place of a spot along an axis.
inline constexpr int kLastSpotPlace = (kBlockSize + 2 * kSpotReach) * kSpotSteps;
/// Elements of NdfCp::spot_sums: distances of an edge of pixels from a centre, -(16 + 3) to 16 + 3 pixels.
inline constexpr int kSpotSums = 2 * (kBlockSize + kSpotReach) * kSpotSteps + 1;

// A cluster of n slices of spots has, from its first coefficient on (a multiple of 4):
//
//   u32 before[ceil(n / 16)]  spots of the slices before slice 16 k
//   u8 counts[n]              spots of each slice
//   u8 rests[n]               codes of block_mass.h: what is left of each slice, even over the block
//   u8 zeros[]                up to a multiple of 4 bytes
//   NdfSpot spots[]           of all slices in turn
//
// and two scales: of the weights, and of the rests (then a density).

/// Slices between two entries of `before`.
inline constexpr int kSpotGroup = 16;
/// Bytes from the first coefficient of a cluster of spots to `counts` and to `spots`; `rests` is n bytes after `counts`.
GLINT_HD constexpr std::uint64_t spotCountsOffset(std::uint32_t slices) {
  return std::uint64_t{4} * ((slices + kSpotGroup - 1) / kSpotGroup);
}
GLINT_HD constexpr std::uint64_t firstSpotOffset(std::uint32_t slices) {
  return spotCountsOffset(slices) + (std::uint64_t{2} * slices + 3) / 4 * 4;
}

/// Of a block without slices in any image.
inline constexpr std::uint16_t kNoBlockPlace = 0xffff;

/// A compressed pyramid of NDF images (asset kind `ndf-cp`).
///
/// Every image belongs to a region and has a slot in it; a region holds images of like places or levels. Blocks that occur in
/// any
/// image are numbered: that is their place. Cluster (region, place) lists the slots where the block is occupied as a bit mask;
/// the slice of a slot is the number of set bits below it, found from `mask_ranks` (running counts) and one popcount.
struct NdfCp {
  PyramidShape shape;
  CompressionMethod method = CompressionMethod::cp;
  CoefficientType coefficient_type = CoefficientType::i8;
  int regions = 1;
  int places = 0;                                     ///< blocks that occur
  std::uint32_t first_image[kMaxPyramidLevels] = {};  ///< index of the first image of each level

  std::span<const std::uint16_t> image_regions;  ///< [images]
  std::span<const std::uint16_t> image_slots;    ///< [images]
  std::span<const float> image_scales;           ///< [images]: factor that makes the image integrate to 1
  std::span<const float> density_scales;         ///< [images]: the same, negative pixels taken as 0; 0 if nothing is positive
  std::span<const std::uint16_t> block_places;   ///< [blocksPerImage]: place of a block, or kNoBlockPlace
  std::span<const std::uint16_t> place_blocks;   ///< [places]: block of a place, rising
  std::span<const NdfCluster> clusters;          ///< [regions][places]
  std::span<const std::uint64_t> masks;          ///< of each cluster: a word for every 64 slots of its region
  std::span<const std::uint32_t> mask_ranks;     ///< same shape as masks: set bits of the cluster before this word

  /// What sampling chooses a block of an image by: the blocks that have a slice, and at least their shares of the image.
  std::span<const std::uint64_t> block_masks;  ///< [images][placeWords()]; bit k: the block of place k has a slice
  std::span<const std::uint32_t> first_block;  ///< [images + 1]: running count of these bits
  std::span<const std::uint8_t> block_masses;  ///< [slices], by image and place: codes of block_mass.h, rounded up

  /// Prefix sums along each block axis, inclusive, columns fastest.
  /// cp: X[16][K] then Y[16][K]; tucker: U[16][rank_x] then V[16][rank_y]; pca: [16][16][K], summed over both axes.
  /// Elements are f32 if coefficient_type is f32; else i16 for cp and tucker (of 12-bit integers), i32 for pca.
  const void* basis = nullptr;
  std::uint64_t basis_count = 0;
  /// Of each cluster [slices][rowElements()]. i8: wide columns, then narrow ones: byte j holds column j of them in its low
  /// half and
  /// column j + ceil(narrow / 2) in its high half. Ends with kRowPadding zeros, so that rows can be read in groups of four.
  /// A cluster of spots is laid out as above.
  const void* coefficients = nullptr;
  std::uint64_t coefficient_count = 0;
  std::span<const float> scales;  ///< [columns] of each cluster: density = sum of scale * basis * coefficient; two for spots
  std::span<const std::uint8_t> core;  ///< tucker: as `scales`: a + 16 b of each column
  std::span<const float> spot_sums;  ///< [kSpotSums]: integral of a spot's profile up to an edge of pixels; none without spots

  GLINT_HD constexpr int placeWords() const { return (places + 63) / 64; }
};

/// Elements after the last row of NdfCp::coefficients.
inline constexpr int kRowPadding = 16;

/// Elements of a row of coefficients.
GLINT_HD constexpr int rowElements(const NdfCluster& cluster) {
  return cluster.columns - cluster.narrow_columns + (cluster.narrow_columns + 1) / 2;
}

/// Elements of the basis of a cluster.
GLINT_HD constexpr int basisElements(CompressionMethod method, const NdfCluster& cluster) {
  switch (method) {
    case CompressionMethod::cp:
      return 2 * kBlockSize * cluster.columns;
    case CompressionMethod::tucker:
      return cluster.columns > 0 ? kBlockSize * (cluster.rank_x + cluster.rank_y) : 0;
    default:
      return kBlockPixels * cluster.columns;
  }
}

}  // namespace glint
