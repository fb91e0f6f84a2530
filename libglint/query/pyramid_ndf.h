#pragma once

#include "glint/model/ndf_pyramid.h"
#include "glint/query/bits.h"
#include "glint/query/float4.h"
#include "glint/query/half.h"
#include "glint/query/pyramid_slices.h"
#include "glint/query/reference.h"
#include "glint/query/sampling.h"

namespace glint {

/// The NDF from a pyramid of images: exact (pixel means) at the centres of its levels, trilinear between them.
///
/// Footprints are answered as isotropic Gaussians of the same mean square size. With the normals at hand, those below level 0 are
/// answered by Reference; without, and above the last level, the nearest level answers.
/// The density is constant over a pixel. Thread-safe, allocates nothing; the arrays must outlive it.
class PyramidNdf {
 public:
  GLINT_HD explicit PyramidNdf(const NdfPyramid& pyramid) : pyramid_(pyramid) {}
  GLINT_HD PyramidNdf(const NdfPyramid& pyramid, const NormalMap& normals)
      : pyramid_(pyramid),
        below_(Reference(normals, pyramid.shape.sigma_r, pyramid.shape.surface, pyramid.shape.boundary,
                         Reference::Search::pruned)) {}

  GLINT_HD const NdfPyramid& pyramid() const { return pyramid_; }
  /// Whether footprints below level 0 are answered from the texels.
  GLINT_HD bool hasNormals() const { return below_.hasMap(); }
  GLINT_HD const PyramidShape& shape() const { return pyramid_.shape; }
  /// Whether this footprint is answered from the texels.
  GLINT_HD bool fromTexels(const Footprint& p) const { return hasNormals() && belowFinest(shape(), p); }

  /// Density towards h, >= 0; O(1): one pixel in each of 8 images.
  GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    if (fromTexels(p)) return below_.density(p, h);
    return pixelDensity(selectSlices(shape(), p), pixelPlace(shape(), h));
  }

  /// Draws an image by its weight, a block by its mass (Deng 2022, section 5.2), a pixel by its value and a point evenly inside, as
  /// the density is constant there. The pdf is the density, which integrates to what the images do: 1 within 1e-3 by the format,
  /// 1e-5 as they are built. O(stored blocks of one image + 256).
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    if (fromTexels(p)) return below_.sample(p, clampUnit(xi));
    Draw draw = chooseImage(selectSlices(shape(), p), xi);
    findBlocks(draw);
    prefetchIndex(draw.slices);
    chooseBlock(draw);
    choosePixel(draw, [](const auto* pixels) { return sumRows(pixels); });
    if (draw.place.x < 0) return {};
    return {pointInPixel(shape(), draw.place, draw.xi), pixelDensity(draw.slices, draw.place)};
  }

  /// Where a place is in the level of every slice.
  struct Places {
    const void* pixels[PyramidSlices::kMost];
    float weights[PyramidSlices::kMost];  ///< 0 where nothing is stored: then the pixel is something else, which can be read
    int count = 0;
  };

  /// A sample from an image on its way: chooseImage, findBlocks, chooseBlock and choosePixel make it, in this order. Each
  /// reads what the one before has asked the memory for, so the cache misses of many samples can be under way together.
  struct Draw {
    PyramidSlices slices;
    Vec2 xi;
    PyramidSlice chosen = {0, 0, 0};  ///< weight 0: nothing can be drawn
    std::uint64_t first_block = 0;    ///< of the chosen image
    int block_count = 0;
    std::uint64_t stored = 0;        ///< the chosen block
    PixelPlace place = {0, -1, -1};  ///< x = -1: nothing can be drawn
  };

  GLINT_HD Draw chooseImage(const PyramidSlices& chosen, Vec2 xi) const {
    Draw draw;
    draw.slices = chosen;
    draw.xi = clampUnit(xi);
    const int k = chooseIndex(
        draw.slices.count, 1, [&](int i) { return draw.slices.slices[i].weight; }, draw.xi.x);
    if (k < 0) return draw;
    draw.chosen = draw.slices.slices[k];
    prefetch(maskOf(draw.chosen));
    prefetch(levelOf(draw.chosen).first_block.data() + draw.chosen.image);
    return draw;
  }

  GLINT_HD void findBlocks(Draw& draw) const {
    constexpr int kLine = 16;
    const PyramidLevel& level = levelOf(draw.chosen);
    const std::uint64_t* first = level.first_block.data() + draw.chosen.image;
    draw.first_block = first[0];
    draw.block_count = static_cast<int>(first[1] - first[0]);
    for (int k = 0; k < draw.block_count; k += kLine) prefetch(level.block_means.data() + first[0] + k);
  }

  GLINT_HD void chooseBlock(Draw& draw) const {
    if (!(draw.chosen.weight > 0)) return;
    const PyramidLevel& level = levelOf(draw.chosen);
    constexpr int kMostBlocks = 64 * kMostMaskWords;
    const float* means = level.block_means.data() + draw.first_block;
    const int count = draw.block_count;
    const int rank = chooseOfMany<kMostBlocks>(
        count,
        [&](int first) {
          if (first + 16 <= count) return Float16::load(means + first);
          float rest[16] = {};
          for (int k = first; k < count; ++k) rest[k - first] = means[k];
          return Float16::load(rest);
        },
        draw.xi.y);
    if (rank < 0) return;
    draw.place.block = placeOfRank(maskOf(draw.chosen), rank);
    draw.stored = draw.first_block + static_cast<std::uint64_t>(rank);
    prefetchPixels(level, draw.stored, 0, kBlockSize);
  }

  /// @param sum_rows  sum_rows(pixels): sums of the rows of a block of floats or half-precision numbers
  template <class SumRows>
  GLINT_HD void choosePixel(Draw& draw, SumRows&& sum_rows) const {
    if (!(draw.chosen.weight > 0 && draw.place.block >= 0)) return;
    const PyramidLevel& level = levelOf(draw.chosen);
    const auto choose = [&](const auto* pixels) {
      const auto* block = pixels + draw.stored * kBlockPixels;
      const int y = chooseOf16(sum_rows(block), draw.xi.y);
      if (y >= 0) draw.place = {draw.place.block, chooseOf16(rowOf(block, y), draw.xi.x), y};
    };
    pyramid_.precision == BlockPrecision::f16 ? choose(static_cast<const std::uint16_t*>(level.pixels))
                                              : choose(static_cast<const float*>(level.pixels));
  }

  /// How much of each row and column of a block a box covers.
  class BlockCover {
   public:
    GLINT_HD explicit BlockCover(const BlockBox& box) {
      constexpr float kFull = kBlockSize;
      whole_ = box.x0 <= 0 && box.y0 <= 0 && box.x1 >= kFull && box.y1 >= kFull;
      for (int k = 0; k < kBlockSize; ++k) {
        columns[k] = covered(box.x0, box.x1, k);
        rows[k] = covered(box.y0, box.y1, k);
      }
      first_row = static_cast<int>(box.y0);
      end_row = std::min(static_cast<int>(std::ceil(box.y1)), kBlockSize);
      first_column = static_cast<int>(box.x0) / 4 * 4;
      end_column = std::min(static_cast<int>(std::ceil(box.x1)), kBlockSize);
    }
    int first_row, end_row, first_column, end_column;  ///< the first column is a multiple of 4
    float columns[kBlockSize], rows[kBlockSize];       ///< covered parts, 0 to 1
    GLINT_HD bool isWhole() const { return whole_; }

    /// Sum of the covered pixels.
    template <class Pixel>
    GLINT_HD float sum(const Pixel* pixels) const {
      Float4 sum = Float4::zero();
      for (int y = first_row; y < end_row; ++y) {
        Float4 row = Float4::zero();
        for (int x = first_column; x < end_column; x += 4)
          row = row + Float4::load(columns + x) * loadPixels(pixels + y * kBlockSize + x);
        sum = sum + Float4::all(rows[y]) * row;
      }
      return sum.sum();
    }

   private:
    static GLINT_HD float covered(float low, float high, int k) {
      return std::max(0.0f, std::min(high, static_cast<float>(k + 1)) - std::max(low, static_cast<float>(k)));
    }
    bool whole_;
  };

  /// Average density over a box of half vectors, 0 if it is empty. O(1) for each block that the box covers: whole blocks have
  /// their mean stored, others sum at most 256 pixels.
  GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    if (fromTexels(p)) return below_.mean(p, range);
    return mean(selectSlices(shape(), p), range, [](const auto* pixels, const BlockCover& cover) { return cover.sum(pixels); });
  }

  /// The same from chosen images.
  /// @param covered_sum  covered_sum(pixels, cover): BlockCover::sum of floats or half-precision numbers
  template <class Sum>
  GLINT_HD float mean(const PyramidSlices& chosen, const Box2& range, Sum&& covered_sum) const {
    if (!(range.width() > 0 && range.height() > 0)) return 0;
    double sum = 0;
    forEachBlock(shape(), range, [&](int block, const BlockBox& box) {
      const BlockCover cover(box);
      for (int k = 0; k < chosen.count; ++k) {
        const std::int64_t stored = storedBlock(chosen.slices[k], block);
        if (stored >= 0)
          sum += double{chosen.slices[k].weight} * blockSum(levelOf(chosen.slices[k]), stored, cover, covered_sum);
      }
    });
    return static_cast<float>(sum / areaInPixels(shape(), range));
  }

  /// Asks the memory for where chosen images say which blocks they store.
  GLINT_HD void prefetchIndex(const PyramidSlices& chosen) const {
    for (int k = 0; k < chosen.count; ++k) {
      prefetch(maskOf(chosen.slices[k]));
      prefetch(levelOf(chosen.slices[k]).first_block.data() + chosen.slices[k].image);
    }
  }

  /// Asks the memory for what a mean from chosen images reads. Reads their index.
  GLINT_HD void prefetchMean(const PyramidSlices& chosen, const Box2& range) const {
    forEachBlock(shape(), range, [&](int block, const BlockBox& box) {
      const BlockCover cover(box);
      for (int k = 0; k < chosen.count; ++k) {
        const std::int64_t stored = storedBlock(chosen.slices[k], block);
        if (stored < 0) continue;
        const PyramidLevel& level = levelOf(chosen.slices[k]);
        if (cover.isWhole())
          prefetch(level.block_means.data() + stored);
        else
          prefetchPixels(level, static_cast<std::uint64_t>(stored), cover.first_row, cover.end_row);
      }
    });
  }

 private:
  GLINT_HD const PyramidLevel& levelOf(const PyramidSlice& slice) const { return pyramid_.levels[slice.level]; }
  GLINT_HD const std::uint64_t* maskOf(const PyramidSlice& slice) const {
    return levelOf(slice).masks.data() + static_cast<std::size_t>(slice.image) * shape().maskWords();
  }
  GLINT_HD float pixelDensity(const PyramidSlices& chosen, const PixelPlace& place) const {
    return addPixels(findPixels(chosen, place));
  }

  /// Finds a pixel in every slice and asks the memory for all. Nothing branches on what is stored, since that cannot be predicted, so
  /// the cache misses of all slices are under way together.
  GLINT_HD Places findPixels(const PyramidSlices& chosen, const PixelPlace& place) const {
    Places places;
    if (shape().maskWords() == 4)  // images of 256^2, as most are
      findPixels<4>(chosen, place, 4, places);
    else
      findPixels<kMostMaskWords>(chosen, place, shape().maskWords(), places);
    return places;
  }

  template <int kWords>
  GLINT_HD void findPixels(const PyramidSlices& chosen, const PixelPlace& place, int given_words, Places& places) const {
    const int words = kWords < kMostMaskWords ? kWords : given_words, word = place.block / 64, bit = place.block % 64;
    std::uint64_t before[kWords];  // the blocks before this one
    for (int w = 0; w < words; ++w) before[w] = w < word ? ~std::uint64_t{0} : w == word ? (std::uint64_t{1} << bit) - 1 : 0;
    const int shift = pyramid_.precision == BlockPrecision::f16 ? 1 : 2;
    const auto pixel = static_cast<std::uint64_t>(place.y * kBlockSize + place.x);
    places.count = chosen.count;
    for (int k = 0; k < chosen.count; ++k) {
      const PyramidLevel& level = levelOf(chosen.slices[k]);
      const std::uint64_t* mask = level.masks.data() + static_cast<std::size_t>(chosen.slices[k].image) * words;
      std::uint64_t rank = level.first_block.data()[chosen.slices[k].image];
      for (int w = 0; w < words; ++w) rank += static_cast<std::uint64_t>(setBits(mask[w] & before[w]));
      const std::uint64_t stored = mask[word] >> bit & 1, offset = (rank * kBlockPixels + pixel) << shift & (0 - stored);
      // Where nothing is stored the first pixel of the level is read; a level may have none.
      const void* pixels = level.block_means.empty() ? level.masks.data() : level.pixels;
      places.pixels[k] = static_cast<const char*>(pixels) + offset;
      places.weights[k] = static_cast<float>(static_cast<int>(stored)) * chosen.slices[k].weight;
      prefetch(places.pixels[k]);
    }
  }

  GLINT_HD float addPixels(const Places& places) const {
    float sum = 0;
    for (int k = 0; k < places.count; k += 4) {
      const float* w = places.weights + k;
      sum += (fourPixels(places.pixels + k, w) * Float4::of(w[0], w[1], w[2], w[3])).sum();
    }
    return pyramid_.value_scale * sum;
  }

  GLINT_HD Float4 fourPixels(const void* const* at, const float* weights) const {
    if (pyramid_.precision == BlockPrecision::f16) {
      const auto half = [&](int k) { return *static_cast<const std::uint16_t*>(at[k]); };
      return Float4::ofPositive(half(0), half(1), half(2), half(3));
    }
    // Values of a file are not checked: a slice that does not count must not bring an infinity.
    const auto value = [&](int k) { return weights[k] > 0 ? *static_cast<const float*>(at[k]) : 0.0f; };
    return Float4::of(value(0), value(1), value(2), value(3));
  }

  /// Index of a block of an image among the stored blocks of its level, or -1.
  GLINT_HD std::int64_t storedBlock(const PyramidSlice& slice, int block) const {
    const PyramidLevel& level = pyramid_.levels[slice.level];
    const int words = shape().maskWords();
    const std::uint64_t* mask = level.masks.data() + static_cast<std::size_t>(slice.image) * words;
    const int word = block / 64;
    const std::uint64_t bit = std::uint64_t{1} << (block % 64);
    if (!(mask[word] & bit)) return -1;
    int rank = setBits(mask[word] & (bit - 1));
    for (int w = 0; w < word; ++w) rank += setBits(mask[w]);
    return static_cast<std::int64_t>(level.first_block.data()[slice.image]) + rank;
  }

  /// Sum of the densities of the covered pixels of a block, in pixels.
  template <class Sum>
  GLINT_HD float blockSum(const PyramidLevel& level, std::int64_t block, const BlockCover& cover, Sum&& covered_sum) const {
    if (cover.isWhole()) return kBlockPixels * level.block_means.data()[block];
    const std::size_t first = static_cast<std::size_t>(block) * kBlockPixels;
    return pyramid_.value_scale * (pyramid_.precision == BlockPrecision::f16
                                       ? covered_sum(static_cast<const std::uint16_t*>(level.pixels) + first, cover)
                                       : covered_sum(static_cast<const float*>(level.pixels) + first, cover));
  }

  /// Asks the memory for rows of a block's pixels.
  GLINT_HD void prefetchPixels(const PyramidLevel& level, std::uint64_t block, int first_row, int end_row) const {
    constexpr int kCacheLine = 64;
    const int row_bytes = kBlockSize * (pyramid_.precision == BlockPrecision::f16 ? 2 : 4);
    const char* pixels = static_cast<const char*>(level.pixels) + block * static_cast<std::uint64_t>(kBlockSize * row_bytes);
    for (int k = first_row * row_bytes / kCacheLine * kCacheLine; k < end_row * row_bytes; k += kCacheLine)
      prefetch(pixels + k);
  }

  NdfPyramid pyramid_;
  Reference below_;
};

static_assert(NdfModel<PyramidNdf>);

}  // namespace glint
