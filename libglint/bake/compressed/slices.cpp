#include "glint/bake/compressed/slices.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <string>

#include "glint/bake/common/stored_block.h"
#include "glint/bake/compressed/kernels.h"
#include "glint/model/error.h"

namespace glint::bake {
namespace {

/// Region, along one axis, that has the centre of column i of a level (ndf_cp.h).
/// @param spacing  distance between neighbouring centres, texels
int regionOf(int i, float spacing, int size, int regions) {
  return std::min(regions - 1, static_cast<int>(std::floor((2.0 * i + 1) * spacing * regions / (2.0 * size))));
}

[[noreturn]] void rejectLevel(int level, const std::string& what) {
  throw Error(ErrorCode::invalid_input, "pyramid.layout", "", "level " + std::to_string(level), what,
              "build the pyramid again with glint-pyramid");
}

/// Checks that the arrays of a level have the sizes that its shape and masks ask for.
void checkLevel(const NdfPyramid& pyramid, int level) {
  const PyramidShape& shape = pyramid.shape;
  const PyramidLevel& data = pyramid.levels[level];
  const std::size_t images = shape.levels[level].imageCount();
  const std::size_t words = shape.maskWords();
  if (!(shape.levels[level].stride > 0)) rejectLevel(level, "the stride is not positive");
  if (data.masks.size() != images * words) rejectLevel(level, "the masks do not fit the number of images");
  if (data.mask_ranks.size() != images * words + 1)
    rejectLevel(level, "the running count of blocks does not fit the number of images");
  const int spare_bits = static_cast<int>(words) * 64 - shape.blocksPerImage();
  for (std::size_t i = 0; i < images; ++i) {
    for (std::size_t w = i * words; w < (i + 1) * words; ++w) {
      if (data.mask_ranks[w + 1] - data.mask_ranks[w] != static_cast<std::uint32_t>(std::popcount(data.masks[w])))
        rejectLevel(level, "the running count of blocks contradicts the masks (first at image " + std::to_string(i) + ")");
    }
    if (spare_bits > 0 && data.masks[i * words + words - 1] >> (64 - spare_bits))
      rejectLevel(level, "a mask has bits beyond the last block (first at image " + std::to_string(i) + ")");
  }
  if (data.mask_ranks[0] != 0) rejectLevel(level, "the running count of blocks does not start at 0");
  if (data.mask_ranks.back() > 0 && data.pixels == nullptr) rejectLevel(level, "the pixels are missing");
}

void checkShape(const PyramidShape& shape) {
  const bool valid = shape.width > 0 && shape.height > 0 && shape.resolution > 0 && shape.resolution % kBlockSize == 0 &&
                     shape.level_count > 0 && shape.level_count <= kMaxPyramidLevels;
  if (!valid)
    throw Error(ErrorCode::invalid_input, "pyramid.shape", "", "", "the shape of the pyramid is not valid",
                "build the pyramid again with glint-pyramid");
}

}  // namespace

SliceIndex::SliceIndex(const NdfPyramid& pyramid, int regions, int level_groups, std::span<const float> image_masses)
    : pyramid_(pyramid),
      regions_(regions),
      level_groups_(std::min(level_groups, pyramid.shape.level_count)),
      image_masses_(image_masses) {
  checkShape(pyramid.shape);
  for (int l = 0; l < pyramid.shape.level_count; ++l) checkLevel(pyramid, l);
  assignImages();
  if (!image_masses_.empty() && image_masses_.size() != imageCount())
    throw Error(
        ErrorCode::usage, "compress.masses", "", "",
        "there are " + std::to_string(image_masses_.size()) + " masses for " + std::to_string(imageCount()) + " images");
  assignSlices();
}

/// Gives every image its region, and a slot in the region.
void SliceIndex::assignImages() {
  const PyramidShape& shape = pyramid_.shape;
  first_image_.push_back(0);
  region_slots_.assign(static_cast<std::size_t>(regions_) * regions_ * level_groups_, 0);
  for (int l = 0; l < shape.level_count; ++l) {
    const PyramidGrid& grid = shape.levels[l];
    const Vec2 spacing = shape.spacing(l);
    for (int j = 0; j < grid.rows; ++j) {
      for (int i = 0; i < grid.columns; ++i) {
        const int row = regionOf(j, spacing.y, shape.height, regions_), column = regionOf(i, spacing.x, shape.width, regions_);
        const int region = (std::min(l, level_groups_ - 1) * regions_ + row) * regions_ + column;
        image_regions_.push_back(static_cast<std::uint16_t>(region));
        slots_.push_back(static_cast<std::uint16_t>(region_slots_[region]++));
      }
    }
    first_image_.push_back(static_cast<std::uint32_t>(slots_.size()));
  }
  const std::uint32_t most = *std::max_element(region_slots_.begin(), region_slots_.end());
  if (most > kMostImages)
    throw Error(ErrorCode::usage, "compress.regions", "", "",
                "a region holds " + std::to_string(most) + " images, and " + std::to_string(kMostImages) + " is the limit",
                "ask for more regions");
}

/// Sorts the blocks of all images by cluster.
void SliceIndex::assignSlices() {
  const PyramidShape& shape = pyramid_.shape;
  const std::size_t blocks = shape.blocksPerImage();
  const std::size_t words = shape.maskWords();
  // Calls visit(cluster, image, number of the block in its level) for every stored block, images in the order of their slots.
  const auto forEachBlock = [&](auto visit) {
    for (int l = 0; l < shape.level_count; ++l) {
      const PyramidLevel& level = pyramid_.levels[l];
      std::uint64_t block = 0;
      for (std::size_t i = 0; i < shape.levels[l].imageCount(); ++i) {
        const std::uint32_t image = first_image_[l] + static_cast<std::uint32_t>(i);
        for (std::size_t w = 0; w < words; ++w)
          for (std::uint64_t bits = level.masks[i * words + w]; bits != 0; bits &= bits - 1)
            visit(image_regions_[image] * blocks + w * 64 + std::countr_zero(bits), image, block++);
      }
    }
  };
  first_slices_.assign(region_slots_.size() * blocks + 1, 0);
  forEachBlock([&](std::size_t cluster, std::uint32_t, std::uint64_t) { ++first_slices_[cluster + 1]; });
  for (std::size_t c = 1; c < first_slices_.size(); ++c) first_slices_[c] += first_slices_[c - 1];
  images_.resize(first_slices_.back());
  blocks_.resize(first_slices_.back());
  std::vector<std::uint64_t> next(first_slices_.begin(), first_slices_.end() - 1);
  forEachBlock([&](std::size_t cluster, std::uint32_t image, std::uint64_t block) {
    images_[next[cluster]] = image;
    blocks_[next[cluster]++] = block;
  });
}

int SliceIndex::level(std::uint32_t image) const {
  return static_cast<int>(std::upper_bound(first_image_.begin(), first_image_.end(), image) - first_image_.begin()) - 1;
}

void SliceIndex::load(std::size_t cluster, int first, int count, const float* factors, float* out) const {
  for (int s = 0; s < count; ++s, out += kSliceStride) {
    const std::uint64_t slice = first_slices_[cluster] + first + s;
    loadStoredBlock(pyramid_, pyramid_.levels[level(images_[slice])], blocks_[slice], out);
    if (factors != nullptr)
      for (int p = 0; p < kBlockPixels; ++p) out[p] *= factors[p];
    if (const float mass = imageMass(images_[slice]); mass != 1)
      for (int p = 0; p < kBlockPixels; ++p) out[p] *= mass;
  }
}

void SliceIndex::describe(NdfCpData& data) const {
  NdfCp& header = data.header;
  header.shape = pyramid_.shape;
  header.regions = regionCount();
  std::copy(first_image_.begin(), first_image_.end() - 1, header.first_image);
  data.image_regions = image_regions_;
  data.image_slots = slots_;
}

}  // namespace glint::bake
