#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/bake/compressed/compress.h"

namespace glint::bake {

/// Floats from one slice of a panel to the next. With a power of two, the same pixel of all slices would compete for a few
/// lines of the cache.
inline constexpr int kSliceStride = kBlockPixels + 16;
/// Slices of a panel, which kernels work on at once: 278 kB, which fit the second-level cache.
inline constexpr int kPanelSlices = 256;

/// Tells which slices of a pyramid each cluster has, in the order of ndf_cp.h.
///
/// load() multiplies each pixel by a factor: callers scale densities by what an error there counts, and divide by the peak of the
/// cluster, so that floats neither overflow nor underflow.
class SliceIndex {
 public:
  static constexpr std::uint32_t kMostImages = 65536;  ///< of a region: slots are numbers of 16 bits

  /// @param regions       regions along each axis, 1..255
  /// @param level_groups  groups of levels with regions of their own, >= 1: each of the finest levels is a group, and the last
  ///                      group has all coarser levels
  /// @throw Error usage if a region has more than kMostImages images, invalid_input if the arrays of the pyramid do not fit its shape
  /// @param image_masses  [images]: what the pixels of each image are multiplied by; empty: 1. Must outlive the index
  SliceIndex(const NdfPyramid& pyramid, int regions, int level_groups, std::span<const float> image_masses = {});

  /// @return number of groups of levels. All groups have the same number of clusters, and clusters are in the order of groups
  int levelGroupCount() const { return level_groups_; }
  int regionCount() const { return static_cast<int>(region_slots_.size()); }
  /// @return number of images of a region
  std::uint32_t slotCount(int region) const { return region_slots_[region]; }
  /// @return slot of an image in its region
  std::uint16_t slot(std::uint32_t image) const { return slots_[image]; }
  /// @return pixels of an image in an area of 1 of the disk
  double pixelsPerArea() const { return 0.25 * pyramid_.shape.resolution * pyramid_.shape.resolution; }
  /// @return deviation of the lobe of a facet, in pixels
  float sigmaPixels() const { return pyramid_.shape.sigma_r * 0.5f * static_cast<float>(pyramid_.shape.resolution); }

  std::size_t clusterCount() const { return first_slices_.size() - 1; }
  std::size_t imageCount() const { return slots_.size(); }
  float imageMass(std::size_t image) const { return image_masses_.empty() ? 1.0f : image_masses_[image]; }
  /// @return number of slices of a cluster
  int sliceCount(std::size_t cluster) const { return static_cast<int>(first_slices_[cluster + 1] - first_slices_[cluster]); }
  std::uint64_t totalSlices() const { return first_slices_.back(); }
  /// @return image that has a slice; images are numbered over all levels
  std::uint32_t image(std::uint64_t slice) const { return images_[slice]; }
  /// @return image that has slice number `slice` of a cluster
  std::uint32_t sliceImage(std::size_t cluster, int slice) const {
    return images_[first_slices_[cluster] + static_cast<std::uint64_t>(slice)];
  }
  /// @return level of that image
  int sliceLevel(std::size_t cluster, int slice) const { return level(sliceImage(cluster, slice)); }

  int levelCount() const { return pyramid_.shape.level_count; }
  /// @return level of an image; images are numbered over all levels
  int level(std::uint32_t image) const;
  /// @return number of images of a level
  std::uint32_t levelImages(int level) const { return first_image_[level + 1] - first_image_[level]; }
  /// @return number of angular blocks of an image
  int blockCount() const { return pyramid_.shape.blocksPerImage(); }
  /// @return density of one stored unit
  float unit() const { return pyramid_.value_scale; }
  /// @return pixels of an image along each axis
  int resolution() const { return pyramid_.shape.resolution; }

  /// Converts slices first..first+count-1 of a cluster to floats, times the masses of their images.
  /// @param factors  [256]: what each pixel is multiplied by; null: 1
  /// @param out      [count][kSliceStride]; the padding is not written
  void load(std::size_t cluster, int first, int count, const float* factors, float* out) const;

  /// Fills the shape, regions and slots of `data`.
  void describe(NdfCpData& data) const;

 private:
  void assignImages();
  void assignSlices();

  const NdfPyramid& pyramid_;
  int regions_;
  int level_groups_;
  std::span<const float> image_masses_;
  std::vector<std::uint32_t> region_slots_;   // [regions]: number of images
  std::vector<std::uint32_t> first_image_;    // [levels + 1]
  std::vector<std::uint16_t> image_regions_;  // [images]
  std::vector<std::uint16_t> slots_;          // [images]
  std::vector<std::uint64_t> first_slices_;   // [clusters + 1]
  std::vector<std::uint32_t> images_;         // [slices]
  std::vector<std::uint64_t> blocks_;         // [slices]: number of the block in its level
};

}  // namespace glint::bake
