#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "glint/model/ndf_pyramid.h"

namespace glint {

/// How the basis images of a cluster are made. In each, a block is a sum over columns k of coefficient(slice, k) * B_k(x, y).
enum class CompressionMethod : std::uint8_t {
  cp,      ///< B_k = X_k(x) Y_k(y): canonical polyadic decomposition (Deng 2022, Eq. 5)
  tucker,  ///< B_k = U_a(x) V_b(y), (a, b) from `core`: Tucker-2 with a sparse core, orthonormal U and V
  pca,     ///< B_k: any 16x16 images, orthonormal
};

/// Storage of coefficients. Bases are always prefix sums of integers, so range queries are exact.
enum class CoefficientType : std::uint8_t { i8, f16, f32 };

/// One cluster: the slices of one place in one region. A slice is the part of an image inside one angular block.
///
/// A column is one basis image and its coefficients. Columns with wide coefficients come first; the last `narrow_columns` have
/// coefficients of 4 bits. A cluster that has slices and no columns stores spots.
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
  std::uint16_t floor_unit = 0;         ///< density of a floor of 1, half precision, >= 0
};
static_assert(sizeof(NdfCluster) == 32);

/// Pixels of a cell of floors along each axis, and the cells of a block.
inline constexpr int kFloorPixels = 4;
inline constexpr int kFloorCells = (kBlockSize / kFloorPixels) * (kBlockSize / kFloorPixels);
/// Cell of a pixel of a block.
GLINT_HD constexpr int floorCell(int x, int y) { return y / kFloorPixels * (kBlockSize / kFloorPixels) + x / kFloorPixels; }

/// The blurred image of a facet in a slice: a Gaussian of variance sigma_r^2 around a point, times a weight.
struct NdfSpot {
  std::uint8_t x = 0;        ///< centre, in eighths of a pixel from 3 pixels left of the block
  std::uint8_t y = 0;        ///< centre, in eighths of a pixel from 3 pixels below the block
  std::uint16_t weight = 0;  ///< sum of the spot's pixels over the scale of the cluster
};
static_assert(sizeof(NdfSpot) == 4);

/// Positions of a spot's centre in one pixel, along an axis.
inline constexpr int kSpotSteps = 8;
/// Distance in pixels of the farthest centre outside the block.
inline constexpr int kSpotReach = 3;
/// Largest NdfSpot::x and y.
inline constexpr int kLastSpotPlace = (kBlockSize + 2 * kSpotReach) * kSpotSteps;
/// Elements of NdfCp::spot_sums: one for each distance of a pixel edge from a centre, -(16 + 3) to 16 + 3 pixels.
inline constexpr int kSpotSums = 2 * (kBlockSize + kSpotReach) * kSpotSteps + 1;

// A cluster of n slices of spots has these arrays from its first coefficient on, whose offset is a multiple of 4:
//
//   u32 before[ceil(n / 16)]  spots of the slices before slice 16 k
//   u8 counts[n]              spots of each slice
//   u8 rests[n]               even density of each slice besides its spots; codes of block_mass.h
//   u8 zeros[]                up to a multiple of 4 bytes
//   NdfSpot spots[]           spots of all slices in turn
//
// It has two scales: one for the weights, and one that turns rests into densities.

/// Slices between two entries of `before`.
inline constexpr int kSpotGroup = 16;
/// Bytes from the first coefficient of a cluster of spots to `counts`. `rests` begins n bytes after `counts`.
GLINT_HD constexpr std::uint64_t spotCountsOffset(std::uint32_t slices) {
  return std::uint64_t{4} * ((slices + kSpotGroup - 1) / kSpotGroup);
}
/// Bytes from the first coefficient of a cluster of spots to `spots`.
GLINT_HD constexpr std::uint64_t firstSpotOffset(std::uint32_t slices) {
  return spotCountsOffset(slices) + (std::uint64_t{2} * slices + 3) / 4 * 4;
}

/// Value in NdfCp::block_places for blocks that are empty in all images.
inline constexpr std::uint16_t kNoBlockPlace = 0xffff;

/// A compressed pyramid of NDF images (asset kind `ndf-cp`).
///
/// Every image belongs to a region, a group of images of nearby positions or levels, and has a slot (its number in the region).
/// Blocks that are occupied in any image are numbered: the number is the place of the block. Cluster (region, place) has a bit
/// mask of the slots whose image occupies the block. The slice of a slot is the number of set bits below the slot's bit: the
/// running count in `mask_ranks` plus one popcount.
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
  /// [images]: the factor if floors are taken off the pixels, and negative ones then count as 0; 0 if no pixel is left.
  std::span<const float> density_scales;
  std::span<const std::uint16_t> block_places;  ///< [blocksPerImage]: place of a block, or kNoBlockPlace
  std::span<const std::uint16_t> place_blocks;  ///< [places]: block of a place, rising
  std::span<const NdfCluster> clusters;         ///< [regions][places]
  std::span<const std::uint64_t> masks;         ///< of each cluster: a word for every 64 slots of its region
  std::span<const std::uint32_t> mask_ranks;    ///< same shape as masks: set bits of the cluster before this word

  // Sampling chooses a block of an image by the next three arrays: which blocks have a slice, and an upper bound of each
  // block's share of the image.
  std::span<const std::uint64_t> block_masks;  ///< [images][placeWords()]; bit k: the block of place k has a slice
  std::span<const std::uint32_t> first_block;  ///< [images + 1]: running count of these bits
  std::span<const std::uint8_t> block_masses;  ///< [slices], by image and place: codes of block_mass.h, rounded up

  /// Prefix sums along each block axis, inclusive, columns fastest.
  /// cp: X[16][K] then Y[16][K]; tucker: U[16][rank_x] then V[16][rank_y]; pca: [16][16][K], summed over both axes.
  /// Sums are of integers of at most 2^20.
  std::span<const std::int32_t> basis;
  /// Coefficients of each cluster, [slices][rowElements()]. A row has the wide columns first. With i8, bytes of two narrow
  /// columns each follow: byte j has narrow column j in its low half and narrow column j + ceil(narrow_columns / 2) in its high
  /// half. kRowPadding zeros end the array, so that rows can be read in groups of four. For clusters of spots see NdfSpot.
  const void* coefficients = nullptr;
  std::uint64_t coefficient_count = 0;
  std::span<const float> scales;       ///< [columns] of each cluster: density = sum of scale * basis * coefficient
  std::span<const std::uint8_t> core;  ///< tucker, indexed like `scales`: a + 16 b of each column
  /// [regions][places][kFloorCells]: codes of block_mass.h. A code times NdfCluster::floor_unit is the floor of a cell: what is
  /// taken off the pixels of a slice before negative pixels count as 0. Without it, small errors in the dark add up to a haze.
  std::span<const std::uint8_t> floors;
  std::span<const float> spot_sums;  ///< [kSpotSums]: integral of a spot's profile up to a pixel edge; empty without spots
  /// The normals of the map, for footprints below level 0; nothing where the asset keeps none. Only kind ndf-cp stores them.
  std::optional<NearNormals> near_normals;

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
