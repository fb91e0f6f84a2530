#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "glint/math/bits.h"
#include "glint/math/float4.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/detail/pyramid/avx2_blocks.h"
#include "glint/query/detail/pyramid/block_cover.h"
#include "glint/query/detail/pyramid/block_rows.h"
#include "glint/query/detail/pyramid/pixel_spline.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"

namespace glint {

/// Reads the images that answer a footprint. Long answers are split into steps, and each step prefetches what the next step
/// reads. A batch does one step for many queries before the next step, so that their cache misses overlap.
class PyramidReader {
 public:
  GLINT_HD explicit PyramidReader(const NdfPyramid& pyramid)
      : pyramid_(pyramid), mask_words_(static_cast<std::size_t>(pyramid.shape.maskWords())) {}

  GLINT_HD const NdfPyramid& pyramid() const { return pyramid_; }
  GLINT_HD const PyramidShape& shape() const { return pyramid_.shape; }

  /// Mean density of a pixel, >= 0; O(1).
  GLINT_HD float pixelMean(const PyramidSlices& chosen, const PixelPlace& place) const {
    return addPixels(findPixels(chosen, place));
  }

  /// Positions of one pixel in the arrays of the levels, for all slices.
  struct FoundPixels {
    const void* pixels[PyramidSlices::kMost];
    float weights[PyramidSlices::kMost];  ///< 0 where the block is not stored: the position is then some other pixel
    int count = 0;
  };

  /// Prefetches what findPixels reads.
  GLINT_HD void prefetchBlock(const PyramidSlices& chosen, int block) const {
    const std::size_t word = static_cast<unsigned>(block) / 64;
    for (int k = 0; k < chosen.count; ++k) {
      prefetch(maskOf(chosen[k]) + word);
      prefetch(ranksOf(chosen[k]) + word);
    }
  }

  /// Finds a pixel in every slice and prefetches it. Has no branch on whether blocks are stored, which processors cannot
  /// predict: so the cache misses of all slices overlap.
  GLINT_HD FoundPixels findPixels(const PyramidSlices& chosen, const PixelPlace& place) const {
    return pyramid_.precision == BlockPrecision::f16 ? findPixelsOf<std::uint16_t>(chosen, place)
                                                     : findPixelsOf<float>(chosen, place);
  }

  /// Mean density of the pixels that were found, >= 0.
  GLINT_HD float addPixels(const FoundPixels& pixels) const {
    return pyramid_.precision == BlockPrecision::f16 ? addPixelsOf<std::uint16_t>(pixels) : addPixelsOf<float>(pixels);
  }

  /// The stored blocks of the chosen images that have one number.
  struct StoredBlocks {
    int count;
    float weights[PyramidSlices::kMost];
    const void* pixels[PyramidSlices::kMost];
    const float* means[PyramidSlices::kMost];
  };

  /// Mean densities of a pixel and of its neighbours, >= 0; O(1).
  GLINT_HD PixelWindow window(const PyramidSlices& chosen, const PixelPlace& place) const {
    PixelWindow window;
    forEachBlockOfWindow(shape(), place, [&](int block, int x, int y) {
      StoredBlocks found;
      findStored(chosen, block, found);
      const int first = std::max(y, 0), end = std::min(y + PixelWindow::kSize, int{kBlockSize});
      for (int k = 0; k < found.count; ++k) prefetchRows(found.pixels[k], first, end);
      addBlock(found, x, y, window);
    });
    window *= pyramid_.value_scale;
    return window;
  }

  /// A sample that is being drawn: chooseImage, findBlocks, chooseBlock and choosePixel fill it in this order. Each step reads
  /// what the previous step prefetched, so that the cache misses of many samples can overlap.
  struct Draw {
    PyramidSlices slices;
    Vec2 xi;
    PyramidSlice chosen = {0, 0, 0};  ///< weight 0: nothing can be drawn
    std::uint64_t first_block = 0;    ///< number of the chosen image's first stored block
    int block_count = 0;
    std::uint64_t stored = 0;        ///< the chosen block
    PixelPlace place = {0, -1, -1};  ///< x = -1: nothing can be drawn
  };

  /// Chooses an image in proportion to its weight, with xi.x.
  GLINT_HD Draw chooseImage(const PyramidSlices& chosen, Vec2 xi) const {
    Draw draw;
    draw.slices = chosen;
    draw.xi = clampUnit(xi);
    const int k = chooseIndex(
        draw.slices.count, 1, [&](int i) { return draw.slices.weights[i]; }, draw.xi.x);
    if (k < 0) return draw;
    draw.chosen = draw.slices[k];
    prefetch(maskOf(draw.chosen));
    prefetch(ranksOf(draw.chosen));
    return draw;
  }

  /// Finds the stored blocks of the image and prefetches their means.
  GLINT_HD void findBlocks(Draw& draw) const {
    constexpr int kLine = 16;
    const PyramidLevel& level = levelOf(draw.chosen);
    const std::uint32_t *ranks = ranksOf(draw.chosen), end = ranks[mask_words_];
    draw.first_block = ranks[0];
    draw.block_count = static_cast<int>(end - ranks[0]);
    for (int k = 0; k < draw.block_count; k += kLine) prefetch(level.block_means.data() + draw.first_block + k);
  }

  /// Chooses a block in proportion to its mean, with xi.y.
  GLINT_HD void chooseBlock(Draw& draw) const {
    if (!(draw.chosen.weight > 0)) return;
    const PyramidLevel& level = levelOf(draw.chosen);
    constexpr int kMostBlocks = 64 * kMostMaskWords;
    const BlockMeans means{level.block_means.data() + draw.first_block, draw.block_count};
    const int rank = chooseOfMany<kMostBlocks>(means, draw.xi.y);
    if (rank < 0) return;
    draw.place.block = placeOfRank(maskOf(draw.chosen), rank);
    draw.stored = draw.first_block + static_cast<std::uint64_t>(rank);
    prefetchRows(static_cast<const char*>(level.pixels) + draw.stored * blockBytes(), 0, kBlockSize);
  }

  /// Chooses a pixel in proportion to its value: the row with xi.y, the column with xi.x.
  GLINT_HD void choosePixel(Draw& draw) const {
    if (!(draw.chosen.weight > 0 && draw.place.block >= 0)) return;
    const PyramidLevel& level = levelOf(draw.chosen);
    const auto choose = [&](const auto* pixels) {
      const auto* block = pixels + draw.stored * kBlockPixels;
      const int y = chooseOf16(rowSums(block), draw.xi.y);
      if (y >= 0) draw.place = {draw.place.block, chooseOf16(rowOf(block, y), draw.xi.x), y};
    };
    pyramid_.precision == BlockPrecision::f16 ? choose(static_cast<const std::uint16_t*>(level.pixels))
                                              : choose(static_cast<const float*>(level.pixels));
  }

  /// A mean that has been begun: its blocks are prefetched and not read yet.
  struct PendingMean {
    static constexpr int kMost = 4;
    double sum;  ///< integral so far: densities times numbers of pixels
    int count;
    BlockCover covers[kMost];
    StoredBlocks blocks[kMost];
  };

  /// Begins a mean from chosen images: finds the stored blocks in the range and prefetches them. In ranges of more than
  /// PendingMean::kMost blocks, blocks are summed already here to make room.
  /// @param pixels  how the density runs in pixels that edges of the range cut
  GLINT_HD void beginMean(const PyramidSlices& chosen, const Box2& range, Pixels pixels, PendingMean& pending) const {
    pending.sum = 0;
    pending.count = 0;
    if (!(range.width() > 0 && range.height() > 0)) return;
    forEachBlock(shape(), range, pixels, [&](int block, const BlockBox& box) {
      if (pending.count == PendingMean::kMost) addPending(pending);
      BlockCover& cover = pending.covers[pending.count];
      StoredBlocks& stored = pending.blocks[pending.count++];
      cover.set(box);
      findStored(chosen, block, stored);
      for (int k = 0; k < stored.count; ++k)
        cover.isWhole() ? prefetch(stored.means[k]) : prefetchRows(stored.pixels[k], cover.first_row, cover.end_row);
    });
  }

  /// Completes a mean that was begun with the same range; 0 if the range is empty.
  GLINT_HD float finishMean(const Box2& range, PendingMean& pending) const {
    addPending(pending);
    const float area = areaInPixels(shape(), range);
    return area > 0 ? finitePositive(static_cast<float>(pending.sum / double{area})) : 0.0f;
  }

  /// Prefetches the masks of stored blocks of the chosen images.
  GLINT_HD void prefetchIndex(const PyramidSlices& chosen) const {
    for (int k = 0; k < chosen.count; ++k) {
      prefetch(maskOf(chosen[k]));
      prefetch(ranksOf(chosen[k]));
    }
  }

 private:
  GLINT_HD const PyramidLevel& levelOf(const PyramidSlice& slice) const { return pyramid_.levels[slice.level]; }
  GLINT_HD const std::uint64_t* maskOf(const PyramidSlice& slice) const {
    return levelOf(slice).masks.data() + std::size_t{slice.image} * mask_words_;
  }
  GLINT_HD const std::uint32_t* ranksOf(const PyramidSlice& slice) const {
    return levelOf(slice).mask_ranks.data() + std::size_t{slice.image} * mask_words_;
  }

  /// Means of the blocks of an image, for chooseOfMany.
  struct BlockMeans {
    const float* means;
    int stored;
    GLINT_HD int count() const { return stored; }
    GLINT_HD Float16 group(int g) const {
      const int first = 16 * g;
      if (first + 16 <= stored) return Float16::load(means + first);
      float rest[16] = {};
      for (int k = first; k < stored; ++k) rest[k - first] = means[k];
      return Float16::load(rest);
    }
    GLINT_HD void sumGroups(float* sums) const {
      for (int g = 0; 16 * g < stored; ++g) sums[g] = group(g).sum();
    }
  };

  template <class Pixel>
  GLINT_HD FoundPixels findPixelsOf(const PyramidSlices& chosen, const PixelPlace& place) const {
    constexpr std::uint64_t kBlockBytes = kBlockPixels * sizeof(Pixel);
    const unsigned word = static_cast<unsigned>(place.block) / 64, bit = static_cast<unsigned>(place.block) % 64;
    FoundPixels places;
    places.count = chosen.count;
    for (int step = 0; 4 * step < chosen.count; ++step) {
      const PyramidLevel& level = pyramid_.levels[chosen.levels[step]];
      // Where the block is not stored, a pixel of the level's first block is read instead; a level may have no block at all.
      const void* pixels = level.masks.data();
      if (!level.block_means.empty()) pixels = static_cast<const Pixel*>(level.pixels) + (place.y * kBlockSize + place.x);
      for (int k = 4 * step; k < 4 * step + 4; ++k) {
        const std::size_t at = std::size_t{chosen.images[k]} * mask_words_ + word;
        const BitRank rank(level.masks.data()[at], bit);
        const std::uint64_t stored = level.mask_ranks.data()[at] + rank.below;
        places.pixels[k] = static_cast<const char*>(pixels) + (stored * kBlockBytes & rank.kept);
        places.weights[k] = keepIf(rank.kept, chosen.weights[k]);
        prefetch(places.pixels[k]);
      }
    }
    return places;
  }

  template <class Pixel>
  GLINT_HD float addPixelsOf(const FoundPixels& pixels) const {
    Float4 sum = Float4::zero();
    for (int k = 0; k < pixels.count; k += 4) sum = sum + fourPixels<Pixel>(pixels, k);
    return finitePositive(pyramid_.value_scale * sum.sum());
  }

  /// Adds the part of a window that lies in a block.
  /// @param x, y  column and row of the window's first pixel in the block, -2 to 15
  GLINT_HD void addBlock(const StoredBlocks& blocks, int x, int y, PixelWindow& window) const {
    pyramid_.precision == BlockPrecision::f16 ? addBlockOf<std::uint16_t>(blocks, x, y, window)
                                              : addBlockOf<float>(blocks, x, y, window);
  }

  template <class Pixel>
  GLINT_HD void addBlockOf(const StoredBlocks& blocks, int x, int y, PixelWindow& window) const {
    constexpr int kSize = PixelWindow::kSize, kLanes = 4;
    const int first = std::clamp(x, 0, kBlockSize - kLanes);  // of the columns that are read
    const int low = std::max(y, 0), high = std::min(y + kSize, int{kBlockSize});
    Float4 sums[kSize] = {Float4::zero(), Float4::zero(), Float4::zero()};
    for (int k = 0; k < blocks.count; ++k) {
      const Pixel* pixels = static_cast<const Pixel*>(blocks.pixels[k]) + first;
      const Float4 weight = Float4::all(blocks.weights[k]);
      for (int row = low; row < high; ++row) sums[row - y] = sums[row - y] + weight * loadPixels(pixels + row * kBlockSize);
    }
    for (int row = low; row < high; ++row) {
      float lanes[kLanes];
      sums[row - y].store(lanes);
      for (int column = std::max(x, 0); column < std::min(x + kSize, int{kBlockSize}); ++column)
        window.pixels[row - y][column - x] += lanes[column - first];
    }
  }

  /// Weighted pixels of the four slices from k on.
  template <class Pixel>
  static GLINT_HD Float4 fourPixels(const FoundPixels& found, int k) {
    const auto pixel = [&](int j) { return *static_cast<const Pixel*>(found.pixels[k + j]); };
    const Float4 weights = Float4::load(found.weights + k);
    if constexpr (std::is_same_v<Pixel, float>) {
      // Numbers of a file are not checked: 0 times an infinity from a slice of weight 0 would be NaN.
      return whereLess(Float4::zero(), weights, weights * Float4::of(pixel(0), pixel(1), pixel(2), pixel(3)));
    } else {
      return weights * Float4::ofPositive(pixel(0), pixel(1), pixel(2), pixel(3));
    }
  }

  /// Finds a block in every slice. Like findPixelsOf, has no branch on whether blocks are stored.
  GLINT_HD void findStored(const PyramidSlices& chosen, int block, StoredBlocks& out) const {
    const unsigned word = static_cast<unsigned>(block) / 64, bit = static_cast<unsigned>(block) % 64;
    int count = 0;
    for (int k = 0; k < chosen.count; ++k) {
      const PyramidLevel& level = pyramid_.levels[chosen.level(k)];
      const std::size_t at = std::size_t{chosen.images[k]} * mask_words_ + word;
      const BitRank rank(level.masks.data()[at], bit);
      const std::uint64_t stored = level.mask_ranks.data()[at] + rank.below;
      out.weights[count] = chosen.weights[k];
      out.pixels[count] = static_cast<const char*>(level.pixels) + stored * blockBytes();
      out.means[count] = level.block_means.data() + stored;
      // Drops blocks of weight 0: they would cost as much as others, and 0 times an unchecked number of a file may be NaN.
      count += static_cast<int>(rank.kept & 1) & static_cast<int>(chosen.weights[k] > 0);
    }
    out.count = count;
  }

  GLINT_HD void addPending(PendingMean& pending) const {
    for (int k = 0; k < pending.count; ++k) pending.sum += double{blockSum(pending.covers[k], pending.blocks[k])};
    pending.count = 0;
  }

  /// Weighted sum of the densities of the covered pixels, in pixels.
  GLINT_HD float blockSum(const BlockCover& cover, const StoredBlocks& blocks) const {
    if (cover.isWhole()) {
      float means = 0;
      for (int k = 0; k < blocks.count; ++k) means += blocks.weights[k] * *blocks.means[k];
      return kBlockPixels * means;
    }
    const auto covered = [&]<class Pixel>(const Pixel*) {
      const Pixel* pixels[PyramidSlices::kMost];
      for (int k = 0; k < blocks.count; ++k) pixels[k] = static_cast<const Pixel*>(blocks.pixels[k]);
      return cover.sum(pixels, blocks.weights, blocks.count);
    };
    return pyramid_.value_scale * (pyramid_.precision == BlockPrecision::f16
                                       ? covered(static_cast<const std::uint16_t*>(nullptr))
                                       : covered(static_cast<const float*>(nullptr)));
  }

  /// The sum of each row of a block.
  template <class Pixel>
  static GLINT_HD Float16 rowSums(const Pixel* block) {
#ifdef GLINT_AVX2
    if constexpr (std::is_same_v<Pixel, std::uint16_t>)
      if (hasAvx2()) return sumRowsAvx2(block);
#endif
    return sumRows(block);
  }

  GLINT_HD std::size_t blockBytes() const {
    return kBlockPixels * (pyramid_.precision == BlockPrecision::f16 ? sizeof(std::uint16_t) : sizeof(float));
  }

  /// Asks the memory for rows of a block's pixels.
  GLINT_HD void prefetchRows(const void* pixels, int first_row, int end_row) const {
    constexpr int kCacheLine = 64;
    const int row_bytes = static_cast<int>(blockBytes()) / kBlockSize;
    for (int k = first_row * row_bytes / kCacheLine * kCacheLine; k < end_row * row_bytes; k += kCacheLine)
      prefetch(static_cast<const char*>(pixels) + k);
  }

  NdfPyramid pyramid_;
  std::size_t mask_words_;
};

}  // namespace glint
