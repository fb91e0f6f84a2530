#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/bake/common/seen_error.h"
#include "glint/model/ndf_cp.h"
#include "glint/model/ndf_pyramid.h"

namespace glint::bake {

/// The error that compressPyramid() makes small.
enum class ErrorMetric : std::uint8_t {
  seen,  ///< the seen error (SeenError) of each level
  l2,    ///< the relative error of all images together, ||D' - D|| / ||D||. Peaks hide all other densities
};

/// How compressPyramid() compresses.
struct CompressionOptions {
  /// Without a value: tucker; where a tolerance cannot be met with tucker, as on small maps of few sharp facets, pca.
  std::optional<CompressionMethod> method;

  /// Columns of every cluster, 1..256. A cluster that is exact with fewer columns has fewer. Not used with a tolerance.
  int rank = 16;

  /// If > 0: chooses the columns of every cluster, and with i8 the bits of their coefficients (8 or 4; cp: 8), so that the error
  /// of the metric is at most this in few bytes. Below 1.
  ///
  /// With ErrorMetric::seen, the seen error of every level is at most this. With tucker and pca, sizes are chosen so that no
  /// angular block errs by more than twice this, over its lit cells; blocks that cannot meet it, or do not after a few searches,
  /// err by more. Floors (NdfCp::floors) take off the light that errors of columns add to the dark. The bias is reported, and not
  /// bounded.
  /// With ErrorMetric::l2 the error of all images together is at most this; with tucker, the errors of level 0, of level 1, and
  /// of all coarser levels together each are. One bound for all levels would leave the error to levels in which a byte removes
  /// least of it, such as the coarse levels of flakes.
  double tolerance = 0;

  ErrorMetric metric = ErrorMetric::seen;

  /// Stores the slices of a cluster as spots where spots take fewer bytes. Needs a tolerance, tucker or pca, and i8.
  bool spots = true;

  /// Without a value: i8; where a tolerance cannot be met with i8, f16; where it cannot be met with f16, f32.
  std::optional<CoefficientType> coefficient_type;

  /// Regions along each axis of the map, 1..255. 0: the default of the method, 8 for cp (Deng 2022, section 4.2) and 1
  /// otherwise, or more where a region would hold more than 65536 images. With tucker, level 0 and level 1 have regions of
  /// their own, and all coarser levels share theirs. With a
  /// tolerance for the seen error, level 2 has regions of its own, too, whatever the method.
  int regions = 0;

  /// [images]: what each image counts in answers, > 0; empty: 1 each. Errors are those of masses times images. Images integrate to 1
  /// all the same.
  std::span<const float> image_masses;

  double min_improvement = 1e-4;  ///< cp: the search ends when a sweep improves the relative error of a cluster by less, >= 0
  int max_iterations = 500;       ///< cp: most sweeps, >= 1
};

/// Size and error of one level of the pyramid, or of all levels.
struct CompressionLevelReport {
  std::uint64_t slices = 0;  ///< blocks that the pyramid stores
  double rel_l2 = 0;  ///< ||D' - D|| / ||D|| over the pixels of these slices, D' as a reader decodes it; 0 for an empty level
  /// Seen error of the densities, over all images of the level and the cells that they light; of all levels: the largest. Errors
  /// of cells that only the decoded images light count in `seen.seen` and not in the others.
  SeenSummary seen;
};

/// Errors and bytes that compressPyramid() reached. Bytes are sizes of arrays, without the overhead of a file.
struct CompressionReport {
  CompressionMethod method = CompressionMethod::tucker;
  CoefficientType coefficient_type = CoefficientType::i8;
  std::vector<CompressionLevelReport> levels;
  CompressionLevelReport total;
  std::uint64_t basis_bytes = 0;
  std::uint64_t coefficient_bytes = 0;  ///< coefficients, scales of columns, and spots
  std::uint64_t index_bytes = 0;        ///< clusters, masks, core; regions, slots, scales and block masses of images
  std::uint64_t total_bytes = 0;
  double ratio_to_dense = 0;   ///< bytes of f32 images with their empty blocks, over total_bytes
  double ratio_to_stored = 0;  ///< bytes of the pyramid as a file stores it, over total_bytes
  std::vector<std::uint64_t>
      rank_histogram;             ///< [columns]: clusters with slices that have so many columns (clusters of spots: 0 columns)
  std::uint64_t spot_slices = 0;  ///< slices that are stored as spots
  std::uint64_t spots = 0;
  std::uint64_t unscaled_images =
      0;  ///< images that decode to half their mass or less, and so are not scaled to integrate to 1
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
  std::vector<std::int32_t> basis;
  std::vector<std::byte> coefficients;  ///< of the element type of NdfCp::coefficients
  std::vector<float> scales;
  std::vector<std::uint8_t> core;
  std::vector<float> spot_sums;
  std::vector<std::uint8_t> floors;

  /// @return spans over the arrays; valid while this object lives and is not changed
  NdfCp view() const;
};

/// @return bytes of one element of NdfCp::coefficients
int coefficientElementBytes(CoefficientType type);

/// Compresses the images of a pyramid (Deng 2022, section 4.2).
///
/// A cluster has the slices of all images in one spatial region, inside one angular block: a 16x16xL tensor. Each tensor is
/// decomposed (`cp`: alternating least squares, Eq. 5; `tucker`, `pca`: eigenvectors). Its basis is quantised, its coefficients
/// are solved for the quantised basis and quantised, and each image is scaled to integrate to 1.
/// @param pyramid   f16 or f32; densities must be finite
/// @param report    filled when not null
/// @param progress  units of work, several per cluster; may be empty
/// @throw Error usage for options out of range; invalid_input for a pyramid that breaks a rule of ndf_pyramid.h; failed for a
///        tolerance that this method and coefficient type cannot reach (the error names the smallest that they can)
/// @note Parallel over clusters; the result does not depend on the number of threads. Memory, besides the result: the bases of
///       all clusters in float, and one cluster of the pyramid for each thread.
NdfCpData compressPyramid(const NdfPyramid& pyramid, const CompressionOptions& options, CompressionReport* report = nullptr,
                          const ProgressFn& progress = {});

}  // namespace glint::bake
