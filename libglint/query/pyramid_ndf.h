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

  /// Density towards h, >= 0; O(1): one pixel in each of 8 images.
  GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    if (below_.hasMap() && belowFinest(shape(), p)) return below_.density(p, h);
    return pixelDensity(selectSlices(shape(), p), pixelPlace(shape(), h));
  }

  /// Draws an image by its weight, a block by its mass (Deng 2022, section 5.2), a pixel by its value and a point evenly inside, as
  /// the density is constant there. The pdf is the density, which integrates to what the images do: 1 within 1e-3 by the format,
  /// 1e-5 as they are built. O(stored blocks of one image + 256).
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    xi = clampUnit(xi);
    if (below_.hasMap() && belowFinest(shape(), p)) return below_.sample(p, xi);
    const PyramidSlices chosen = selectSlices(shape(), p);
    const int k = chooseIndex(chosen.count, 1, [&](int i) { return chosen.slices[i].weight; }, xi.x);
    if (k < 0) return {};
    const BlockChoice block = chooseStoredBlock(chosen.slices[k], xi);
    if (block.block < 0) return {};
    const PyramidLevel& level = pyramid_.levels[chosen.slices[k].level];
    float pixels[kBlockPixels];
    loadBlock(level, level.first_block.data()[chosen.slices[k].image] + static_cast<std::uint64_t>(block.rank), pixels);
    const PixelPlace place = choosePixel(pixels, sumRows(pixels), block.block, xi);
    if (place.x < 0) return {};
    return {pointInPixel(shape(), place, xi), pixelDensity(chosen, place)};
  }

  /// Average density over a box of half vectors, 0 if it is empty. O(1) for each block that the box covers: whole blocks have
  /// their mean stored, others sum at most 256 pixels.
  GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    if (!(range.width() > 0 && range.height() > 0)) return 0;
    if (below_.hasMap() && belowFinest(shape(), p)) return below_.mean(p, range);
    const PyramidSlices chosen = selectSlices(shape(), p);
    double sum = 0;
    forEachBlock(shape(), range, [&](int block, const BlockBox& box) {
      for (int k = 0; k < chosen.count; ++k) {
        const std::int64_t stored = storedBlock(chosen.slices[k], block);
        if (stored >= 0) sum += double{chosen.slices[k].weight} * blockSum(chosen.slices[k].level, stored, box);
      }
    });
    return static_cast<float>(sum / areaInPixels(shape(), range));
  }

 private:
  GLINT_HD float pixelDensity(const PyramidSlices& chosen, const PixelPlace& place) const {
    float sum = 0;
    for (int k = 0; k < chosen.count; ++k) {
      const PyramidSlice& slice = chosen.slices[k];
      const std::int64_t block = storedBlock(slice, place.block);
      if (block >= 0) sum += slice.weight * pixel(slice.level, block, place.y * kBlockSize + place.x);
    }
    return pyramid_.value_scale * sum;
  }

  GLINT_HD BlockChoice chooseStoredBlock(const PyramidSlice& slice, Vec2& xi) const {
    const PyramidLevel& level = pyramid_.levels[slice.level];
    const std::uint64_t* first = level.first_block.data() + slice.image;
    const float* means = level.block_means.data() + first[0];
    const auto mass = [&](int begin, int end) {
      float sums[4] = {};
      int k = begin;
      for (; k + 4 <= end; k += 4)
        for (int lane = 0; lane < 4; ++lane) sums[lane] += means[k + lane];
      float sum = (sums[0] + sums[2]) + (sums[1] + sums[3]);
      for (; k < end; ++k) sum += means[k];
      return sum;
    };
    const std::uint64_t* mask = level.masks.data() + static_cast<std::size_t>(slice.image) * shape().maskWords();
    return chooseBlock(mask, shape().blocksPerAxis(), mass(0, static_cast<int>(first[1] - first[0])), mass, xi);
  }

  /// The pixels of a stored block, in any unit.
  GLINT_HD void loadBlock(const PyramidLevel& level, std::uint64_t block, float* pixels) const {
    const std::size_t first = static_cast<std::size_t>(block) * kBlockPixels;
    if (pyramid_.precision == BlockPrecision::f16) {
      const auto* stored = static_cast<const std::uint16_t*>(level.pixels) + first;
      for (int k = 0; k < kBlockPixels; k += 4) Float4::load(stored + k).store(pixels + k);
    } else {
      const auto* stored = static_cast<const float*>(level.pixels) + first;
      for (int k = 0; k < kBlockPixels; ++k) pixels[k] = stored[k];
    }
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

  GLINT_HD float pixel(int level, std::int64_t block, int k) const {
    const std::size_t at = static_cast<std::size_t>(block) * kBlockPixels + k;
    return pyramid_.precision == BlockPrecision::f16
               ? halfToFloat(static_cast<const std::uint16_t*>(pyramid_.levels[level].pixels)[at])
               : static_cast<const float*>(pyramid_.levels[level].pixels)[at];
  }

  /// Sum of the densities of the pixels in a box, in pixels.
  GLINT_HD double blockSum(int level, std::int64_t block, const BlockBox& box) const {
    const float full = kBlockSize;
    if (box.x0 <= 0 && box.y0 <= 0 && box.x1 >= full && box.y1 >= full)
      return double{kBlockPixels} * pyramid_.levels[level].block_means.data()[block];
    const auto covered = [](float low, float high, int k) {
      return std::max(0.0f, std::min(high, static_cast<float>(k + 1)) - std::max(low, static_cast<float>(k)));
    };
    double sum = 0;
    for (int y = static_cast<int>(box.y0); y < kBlockSize && static_cast<float>(y) < box.y1; ++y) {
      float row = 0;
      for (int x = static_cast<int>(box.x0); x < kBlockSize && static_cast<float>(x) < box.x1; ++x)
        row += covered(box.x0, box.x1, x) * pixel(level, block, y * kBlockSize + x);
      sum += double{row} * covered(box.y0, box.y1, y);
    }
    return pyramid_.value_scale * sum;
  }

  NdfPyramid pyramid_;
  Reference below_;
};

static_assert(NdfModel<PyramidNdf>);

}  // namespace glint
