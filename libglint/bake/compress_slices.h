#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/bake/compress.h"

namespace glint::bake {

/// Floats between the slices of a panel. Not a power of two: columns of slices would share a few cache sets.
inline constexpr int kSliceStride = kBlockPixels + 16;
/// Slices that kernels work on at once (278 kB: the second-level cache).
inline constexpr int kPanelSlices = 256;

/// The clusters of a pyramid: which slices each holds, in the order of compressed_ndf.h.
///
/// Densities are divided by the largest magnitude of the cluster, so that kernels in float neither overflow nor underflow.
class SliceIndex {
 public:
  /// @param regions  per axis, 1..255
  /// @throw Error usage if a region has more than 65536 images, invalid_input if the arrays of the pyramid do not fit its shape
  SliceIndex(const NdfPyramid& pyramid, int regions);

  std::size_t clusterCount() const { return first_slices_.size() - 1; }
  std::size_t imageCount() const { return slots_.size(); }
  /// @return slices of one cluster
  int sliceCount(std::size_t cluster) const { return static_cast<int>(first_slices_[cluster + 1] - first_slices_[cluster]); }
  std::uint64_t totalSlices() const { return first_slices_.back(); }
  std::uint64_t firstSlice(std::size_t cluster) const { return first_slices_[cluster]; }
  /// @return image of a slice, numbered over all levels
  std::uint32_t image(std::uint64_t slice) const { return images_[slice]; }

  /// Converts slices first..first+count-1 of a cluster, multiplied by `factor`.
  /// @param out  [count][kSliceStride]; the padding is not written
  void load(std::size_t cluster, int first, int count, float factor, float* out) const;

  /// Fills the shape, regions, slots, masks and mask ranks of `data`.
  void describe(CompressedNdfData& data) const;

 private:
  void assignImages();
  void assignSlices();
  const std::byte* block(std::uint64_t slice) const;

  const NdfPyramid& pyramid_;
  int regions_;
  int words_per_cluster_ = 0;
  std::vector<std::uint32_t> first_image_;    // [levels + 1]
  std::vector<std::uint16_t> image_regions_;  // [images]
  std::vector<std::uint16_t> slots_;          // [images]
  std::vector<std::uint64_t> first_slices_;   // [clusters + 1]
  std::vector<std::uint32_t> images_;         // [slices]
  std::vector<std::uint64_t> blocks_;         // [slices]: number of the block in its level
};

}  // namespace glint::bake
