#pragma once

#include <cstdint>
#include <span>

#include "glint/model/ndf_pyramid.h"

namespace glint {

/// How the basis images of a cluster are made. In each, a block is a sum over columns k of coefficient(slice, k) * B_k(x, y).
enum class CompressionMethod : std::uint8_t {
  cp,      ///< B_r = X_r(x) Y_r(y): canonical polyadic decomposition (Deng 2022, Eq. 5)
  tucker,  ///< B_ab = U_a(x) V_b(y), k = a * rank_y + b: Tucker-2, orthonormal U and V
  pca,     ///< B_k: any 16x16 images, orthonormal
};

/// Storage of coefficients. Bases are always prefix sums of integers (or of floats with f32), so range queries are exact.
enum class CoefficientType : std::uint8_t { i8, f16, f32 };

/// One cluster: the slices (blocks of NDF images) that share an angular block and a spatial region.
struct NdfCluster {
  std::uint64_t first_basis = 0;        ///< offset into `basis`, elements
  std::uint64_t first_coefficient = 0;  ///< offset into `coefficients`, elements
  std::uint64_t first_scale = 0;        ///< offset into `scales`, elements
  std::uint16_t rank_x = 0;             ///< cp, pca: number of columns; tucker: columns of U
  std::uint16_t rank_y = 0;             ///< tucker: columns of V; cp, pca: 0
  std::uint32_t slice_count = 0;        ///< occupied slices; 0: the block is empty in the whole region
};
static_assert(sizeof(NdfCluster) == 32);

/// A compressed pyramid of NDF images (asset kind `ndf-cp`).
///
/// The map is divided in region_columns x region_rows regions. Every image belongs to the region of its centre and has a slot in
/// it. Cluster (region, block) lists the slots where the block is occupied as a bit mask; the slice of a slot is the number of set
/// bits below it, found from `mask_ranks` (running counts) and one popcount.
struct CompressedNdf {
  PyramidShape shape;
  CompressionMethod method = CompressionMethod::cp;
  CoefficientType coefficient_type = CoefficientType::i8;
  int region_columns = 1;
  int region_rows = 1;
  int words_per_cluster = 0;                          ///< 64-bit words of slot mask in each cluster
  std::uint32_t first_image[kMaxPyramidLevels] = {};  ///< index of the first image of each level

  std::span<const std::uint16_t> image_regions;  ///< [images]
  std::span<const std::uint16_t> image_slots;    ///< [images]
  std::span<const float> image_scales;           ///< [images]: factor that makes the image integrate to 1
  std::span<const float> density_scales;         ///< [images]: the same, negative pixels taken as 0; 0 if nothing is positive
  std::span<const NdfCluster> clusters;          ///< [regions][blocksPerImage]
  std::span<const std::uint64_t> masks;          ///< [regions][blocksPerImage][words_per_cluster]
  std::span<const std::uint32_t> mask_ranks;     ///< same shape as masks: set bits of the cluster before this word

  /// What sampling chooses a block of an image by: the blocks that have a slice, and at least their shares of the image.
  std::span<const std::uint64_t> block_masks;  ///< [images][maskWords]; bit b: block b has a slice
  std::span<const std::uint32_t> first_block;  ///< [images + 1]: running count of these bits
  std::span<const std::uint8_t> block_masses;  ///< [slices], by image and block: codes of block_mass.h, rounded up

  /// Prefix sums along each block axis, inclusive, columns fastest.
  /// cp: X[16][R] then Y[16][R]; tucker: U[16][rx] then V[16][ry]; pca: [16][16][K], summed over both axes.
  /// Elements are f32 if coefficient_type is f32; else i16 for cp and tucker (of 12-bit integers), i32 for pca.
  const void* basis = nullptr;
  std::uint64_t basis_count = 0;
  const void* coefficients = nullptr;  ///< [slices][columns] of each cluster
  std::uint64_t coefficient_count = 0;
  std::span<const float> scales;  ///< [columns] of each cluster: density = sum of scale * basis * coefficient
};

}  // namespace glint
