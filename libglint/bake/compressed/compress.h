#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/model/ndf_cp.h"
#include "glint/model/ndf_pyramid.h"

namespace glint::bake {

/// What compressPyramid() makes.
struct CompressionOptions {
  CompressionMethod method = CompressionMethod::tucker;

  /// Columns of every cluster, 1..256 (fewer where a cluster has no more to give). Not used when a tolerance is given.
  int rank = 16;

  /// If > 0: choose the columns of every cluster, and with i8 the bits of their coefficients (8 or 4; cp: 8), so that the
  /// relative error of all images together, ||D' - D|| / ||D||, is at most this and the bytes are as few as possible. With
  /// tucker also that of level 0, of level 1, and of the coarser ones together: else all of it would be left to where a byte
  /// takes off least, the coarser levels of flakes. Below 1.
  double tolerance = 0;

  /// With a tolerance, tucker and pca, i8: store slices as spots where they cost less.
  bool spots = true;

  CoefficientType coefficient_type = CoefficientType::i8;

  /// Regions along each axis of the map, 1..255. 0: the default of the method, 8 for cp (Deng 2022, section 4.2) and 1
  /// otherwise. With tucker, the first two levels have regions of their own, as the others have together.
  int regions = 0;

  double min_improvement = 1e-4;  ///< cp: stop when a sweep improves the relative error of a cluster by less, >= 0
  int max_iterations = 500;       ///< cp: sweeps at most, >= 1
};

/// One level of the pyramid, or all of them.
struct CompressionLevelReport {
  std::uint64_t slices = 0;  ///< stored blocks
  double rel_l2 = 0;  ///< ||D' - D|| / ||D|| over the pixels of these slices, D' as a reader decodes it; 0 for an empty level
};

/// What compressPyramid() achieved. Bytes are those of the arrays, without the overhead of a file.
struct CompressionReport {
  std::vector<CompressionLevelReport> levels;
  CompressionLevelReport total;
  std::uint64_t basis_bytes = 0;
  std::uint64_t coefficient_bytes = 0;  ///< with the scale of every column, and spots
  std::uint64_t index_bytes = 0;        ///< clusters, masks, core; regions, slots, scales and block masses of images
  std::uint64_t total_bytes = 0;
  double ratio_to_dense = 0;                  ///< bytes of the uncompressed f32 images, empty blocks included, over total_bytes
  double ratio_to_stored = 0;                 ///< bytes of the pyramid as it is stored, over total_bytes
  std::vector<std::uint64_t> rank_histogram;  ///< [columns]: occupied clusters that have so many columns (spots: 0)
  std::uint64_t spot_slices = 0;              ///< slices that are stored as spots
  std::uint64_t spots = 0;
  std::uint64_t unscaled_images = 0;  ///< images that decode to half their energy or less, so that they cannot be normalised
};

/// A compressed pyramid and the arrays that it points to.
class NdfCpData {
 public:
  NdfCp header;  ///< sizes and parameters; its spans and pointers are not set (see view())
  std::vector<std::uint16_t> image_regions;
  std::vector<std::uint16_t> image_slots;
  std::vector<float> image_scales;
  std::vector<float> density_scales;
  std::vector<std::uint16_t> block_places;
  std::vector<std::uint16_t> place_blocks;
  std::vector<std::uint64_t> block_masks;
  std::vector<std::uint32_t> first_block;
  std::vector<std::uint8_t> block_masses;
  std::vector<NdfCluster> clusters;
  std::vector<std::uint64_t> masks;
  std::vector<std::uint32_t> mask_ranks;
  std::vector<std::byte> basis;         ///< of the element type of NdfCp::basis
  std::vector<std::byte> coefficients;  ///< of the element type of NdfCp::coefficients
  std::vector<float> scales;
  std::vector<std::uint8_t> core;
  std::vector<float> spot_sums;

  /// @return what a model queries; valid while this object lives and is not changed
  NdfCp view() const;
};

/// @return bytes of one element of NdfCp::basis
int basisElementBytes(CompressionMethod method, CoefficientType type);

/// @return bytes of one element of NdfCp::coefficients
int coefficientElementBytes(CoefficientType type);

/// Compresses the images of a pyramid (Deng 2022, section 4.2).
///
/// The blocks of all images that share an angular block and a spatial region are the slices of a 16x16xL tensor. Each tensor is
/// decomposed (`cp`: alternating least squares, Eq. 5; `tucker`, `pca`: eigenvectors), the bases are quantised, the
/// coefficients are solved again for the quantised bases and quantised, and each image is scaled to integrate to 1.
/// @param pyramid   f16 or f32; densities must be finite
/// @param report    filled when not null
/// @param progress  units of work, several per cluster; may be empty
/// @throw Error usage for options out of range; invalid_input for a pyramid that is not what ndf_pyramid.h says; failed for a
///        tolerance that this method and coefficient type cannot reach, naming the best that they do
/// @note Parallel over clusters; the result does not depend on the number of threads. Besides the result it holds the bases of
///       all clusters in float, and the pyramid is converted cluster by cluster.
NdfCpData compressPyramid(const NdfPyramid& pyramid, const CompressionOptions& options, CompressionReport* report = nullptr,
                          const ProgressFn& progress = {});

}  // namespace glint::bake
