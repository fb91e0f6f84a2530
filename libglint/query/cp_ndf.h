#pragma once

#include "glint/model/compressed_ndf.h"
#include "glint/query/bits.h"
#include "glint/query/block_mass.h"
#include "glint/query/cluster_slices.h"
#include "glint/query/pyramid_slices.h"
#include "glint/query/reference.h"
#include "glint/query/sampling.h"
#include "glint/query/spots.h"

namespace glint {

/// The NDF from a compressed pyramid: tensor rank (CP), Tucker-2 or PCA (Deng 2022, sections 4.2 to 4.4).
///
/// Chooses images as PyramidNdf does. Pixels are sums of products of few factors, and so are sums over boxes of pixels, from
/// prefix sums (Eq. 6 and 7). Where few facets make up the slices, they are sums of few spots and an even rest instead.
///
/// The density of an image is what the approximation leaves above zero, scaled to integrate to 1, and constant over a pixel. The
/// mean is a difference of prefix sums, so it counts what lies below zero, is scaled to integrate to 1 with that, and only the
/// result is clamped: it is the exact average of `signedDensity`, and of `density` where nothing is negative.
/// Thread-safe, allocates nothing; the arrays must outlive it.
class CpNdf {
  static constexpr int kMaxBlocksPerAxis = 64;  // of 1024 pixels, the largest image

 public:
  GLINT_HD explicit CpNdf(const CompressedNdf& ndf) : ndf_(ndf), chooser_(ndf.shape) {}
  GLINT_HD CpNdf(const CompressedNdf& ndf, const NormalMap& normals)
      : ndf_(ndf),
        chooser_(ndf.shape),
        below_(Reference(normals, ndf.shape.sigma_r, ndf.shape.surface, ndf.shape.boundary, Reference::Search::pruned)) {}

  GLINT_HD const CompressedNdf& compressed() const { return ndf_; }
  /// Whether footprints below level 0 are answered from the texels.
  GLINT_HD bool hasNormals() const { return below_.hasMap(); }
  GLINT_HD const PyramidShape& shape() const { return ndf_.shape; }
  GLINT_HD const SliceChooser& chooser() const { return chooser_; }

  /// Density towards h, >= 0; O(columns) in each of 8 images.
  GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    if (below_.hasMap() && belowFinest(shape(), p)) return below_.density(p, h);
    const PyramidSlices chosen = chooser_.choose(p);
    const PixelPlace place = pixelPlace(shape(), h);
    return withReader(ndf_, [&](const auto& reader) { return pixelDensity(reader, chosen, place); });
  }

  /// Draws an image by its weight, a block by its mass (Deng 2022, section 5.2), a pixel by its value and a point evenly inside, as
  /// the density is constant there: exactly in proportion to the density, which is the pdf.
  ///
  /// Stored masses are rounded up by at most a sixteenth; a block is kept with the ratio of the mass that its pixels have to the
  /// stored one, else another is drawn from the digits of `xi` that are left (one in forty on average). O(columns * 256).
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const;

  /// Average over a box of half vectors, >= 0, 0 if the box is empty; O(columns) for each block that the box covers.
  GLINT_HD float mean(const Footprint& p, const Box2& range) const { return std::max(0.0f, signedMean(p, range)); }

  GLINT_HD float signedDensity(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    if (below_.hasMap() && belowFinest(shape(), p)) return below_.density(p, h);
    const PyramidSlices chosen = chooser_.choose(p);
    const PixelPlace place = pixelPlace(shape(), h);
    return withReader(ndf_, [&](const auto& reader) {
      return sumSlices(chosen, place.block, ndf_.image_scales.data(), PixelOf<decltype(reader)>{reader, place}, Signed{});
    });
  }

  GLINT_HD float signedMean(const Footprint& p, const Box2& range) const {
    if (!(range.width() > 0 && range.height() > 0)) return 0;
    if (below_.hasMap() && belowFinest(shape(), p)) return below_.mean(p, range);
    const PyramidSlices chosen = chooser_.choose(p);
    return withReader(ndf_, [&](const auto& reader) {
      double sum = 0;
      forEachBlock(shape(), range, [&](int block, const BlockBox& box) {
        sum += sumSlices(chosen, block, ndf_.image_scales.data(), BoxOf<decltype(reader)>{reader, box}, Signed{});
      });
      return static_cast<float>(sum / areaInPixels(shape(), range));
    });
  }

 private:
  static constexpr std::size_t kNone = ~std::size_t{0};

  /// A slice of a cluster. cluster: kNone when the image has nothing in the block.
  struct SlicePlace {
    std::size_t cluster = kNone;
    std::uint64_t slice = 0;
  };

  GLINT_HD std::size_t imageOf(const PyramidSlice& slice) const {
    return std::size_t{ndf_.first_image[slice.level]} + slice.image;
  }

  /// @param block_place  as in CompressedNdf
  GLINT_HD SlicePlace findSlice(std::size_t image, int block_place) const {
    const std::size_t at =
        static_cast<std::size_t>(ndf_.image_regions.data()[image]) * static_cast<std::size_t>(ndf_.places) + block_place;
    const int slot = ndf_.image_slots.data()[image];
    const std::size_t word = ndf_.clusters.data()[at].first_word + static_cast<std::size_t>(slot / 64);
    const std::uint64_t mask = ndf_.masks.data()[word], bit = std::uint64_t{1} << (slot % 64);
    if (!(mask & bit)) return {};
    return {at, ndf_.mask_ranks.data()[word] + static_cast<std::uint64_t>(setBits(mask & (bit - 1)))};
  }

  /// Negative values of a slice: kept, or taken as 0.
  struct Signed {
    GLINT_HD float operator()(float value) const { return value; }
    GLINT_HD Float4 operator()(Float4 values) const { return values; }
  };
  struct Positive {
    GLINT_HD float operator()(float value) const { return std::max(0.0f, value); }
    GLINT_HD Float4 operator()(Float4 values) const { return values.positive(); }
  };

  /// What is asked of a block: one pixel, or the sum over a box of pixels.
  template <class Reader>
  struct PixelOf {
    Reader reader;
    PixelPlace place;
    GLINT_HD void project(const NdfCluster& cluster, const ColumnLayout& layout, float* projection) const {
      reader.pixel(cluster, layout, place.x, place.y, projection);
    }
    GLINT_HD void prefetch(const NdfCluster& cluster, std::uint64_t slice) const {
      reader.prefetchAlone(cluster, slice, place.x, place.y);
    }
    GLINT_HD bool alone(const NdfCluster& cluster) const { return reader.asksAlone(cluster); }
    GLINT_HD float valueAlone(const NdfCluster& cluster, std::uint64_t slice) const {
      return reader.valueAlone(cluster, reader.row(cluster, slice), place.x, place.y);
    }
    GLINT_HD float spots(const SpotProfile& profile, const SpotList& list) const {
      return spotsAt(profile, list, place.x, place.y);
    }
  };
  template <class Reader>
  struct BoxOf {
    Reader reader;
    BlockBox box;
    GLINT_HD void project(const NdfCluster& cluster, const ColumnLayout& layout, float* projection) const {
      reader.box(cluster, layout, box, projection);
    }
    GLINT_HD void prefetch(const NdfCluster&, std::uint64_t) const {}
    GLINT_HD bool alone(const NdfCluster&) const { return false; }
    GLINT_HD float valueAlone(const NdfCluster&, std::uint64_t) const { return 0; }
    GLINT_HD float spots(const SpotProfile& profile, const SpotList& list) const { return spotsIn(profile, list, box); }
  };

  /// Where the slices of the chosen images are. Weights include the scales of images, and are 0 where an image has no slice, or
  /// where no more images are chosen.
  struct SlicePlaces {
    std::uint32_t clusters[PyramidSlices::kMost];
    std::uint32_t slices[PyramidSlices::kMost];
    float weights[PyramidSlices::kMost] = {};
  };

  /// Nothing branches on what is stored: that cannot be predicted.
  GLINT_HD SlicePlaces findSlices(const PyramidSlices& chosen, unsigned block_place, const float* scales) const {
    SlicePlaces out;
    const auto block_places = static_cast<unsigned>(ndf_.places);
    for (int step = 0; 4 * step < chosen.count; ++step) {
      const std::uint32_t first = ndf_.first_image[chosen.levels[step]];
      for (int k = 4 * step; k < 4 * step + 4; ++k) {
        const std::size_t image = first + chosen.images[k];
        const unsigned slot = ndf_.image_slots.data()[image];
        out.clusters[k] = ndf_.image_regions.data()[image] * block_places + block_place;
        const std::size_t word = ndf_.clusters.data()[out.clusters[k]].first_word + slot / 64;
        const BitRank rank(ndf_.masks.data()[word], slot % 64);
        out.slices[k] = static_cast<std::uint32_t>(ndf_.mask_ranks.data()[word] + rank.below);
        out.weights[k] = keepIf(rank.kept, chosen.weights[k] * scales[image]);
      }
    }
    return out;
  }

  /// Weighted sum over the chosen images. Slices of the same cluster, as those of neighbours mostly are, share its projection.
  /// @param scales  of images
  /// @param ask     PixelOf or BoxOf
  /// @param part    Signed or Positive
  template <class Ask, class Part>
  GLINT_HD float sumSlices(const PyramidSlices& chosen, int block, const float* scales, const Ask& ask, Part part) const {
    const unsigned block_place = ndf_.block_places.data()[block];
    if (block_place == kNoBlockPlace) return 0;
    const SlicePlaces places = findSlices(chosen, block_place, scales);
    if (ndf_.method == CompressionMethod::cp) {
      for (int k = 0; k < chosen.count; ++k)
        if (places.weights[k] > 0) ask.prefetch(ndf_.clusters.data()[places.clusters[k]], places.slices[k]);
    }
    unsigned left = lanesAbove0(Float4::load(places.weights)) | lanesAbove0(Float4::load(places.weights + 4)) << 4;
    float sum = 0;
    while (left != 0) {
      const int lowest = lowestBit(left);
      const std::uint32_t at = places.clusters[lowest];
      const NdfCluster& cluster = ndf_.clusters.data()[at];
      if (ask.alone(cluster)) {
        left &= left - 1;
        sum += places.weights[lowest] * part(ask.valueAlone(cluster, places.slices[lowest]));
        continue;
      }
      const auto shares = [&](int step) { return whereEqual(places.clusters + step, at, Float4::load(places.weights + step)); };
      const unsigned here = lanesAbove0(shares(0)) | lanesAbove0(shares(4)) << 4;
      left &= ~here;
      if (cluster.columns == 0) {
        sum += addSpots(cluster, places, here, ask, part);
        continue;
      }
      const ColumnLayout layout(cluster);
      float projection[ColumnLayout::kMost];
      ask.project(cluster, layout, projection);
      const auto rows = ask.reader.rows(cluster, layout);
      for (int step = 0; step < PyramidSlices::kMost; step += 4) {
        const unsigned lanes = here >> step & 15;
        if (lanes == 0) continue;
        const int first = step + lowestBit(lanes);
        if ((lanes & (lanes - 1)) == 0) {
          sum += places.weights[first] * part(ask.reader.dot(projection, layout, rows(places.slices[first])));
          continue;
        }
        // Lanes of other clusters repeat one of this, and weigh nothing.
        const auto lane = [&](int k) { return rows(places.slices[lanes >> k & 1 ? step + k : first]); };
        sum += (shares(step) * part(ask.reader.dots(projection, layout, {lane(0), lane(1), lane(2), lane(3)}))).sum();
      }
    }
    return sum;
  }

  static GLINT_HD unsigned lanesAbove0(Float4 weights) { return ~weights.notAbove(0) & 15u; }

  /// Weighted sum over the slices `here` of a cluster of spots.
  template <class Ask, class Part>
  GLINT_HD float addSpots(const NdfCluster& cluster, const SlicePlaces& places, unsigned here, const Ask& ask,
                          Part part) const {
    const SpotProfile profile(ndf_);
    float sum = 0;
    for (; here != 0; here &= here - 1) {
      const int k = lowestBit(here);
      sum += places.weights[k] * part(ask.spots(profile, spotsOf(ndf_, cluster, places.slices[k])));
    }
    return sum;
  }

  template <class Reader>
  GLINT_HD float pixelDensity(const Reader& reader, const PyramidSlices& chosen, const PixelPlace& place) const {
    return sumSlices(chosen, place.block, ndf_.density_scales.data(), PixelOf<const Reader&>{reader, place}, Positive{});
  }

  /// All pixels of a slice, [16][16], >= 0.
  template <class Reader>
  GLINT_HD void decodeBlock(const Reader& reader, const SlicePlace& at, float* pixels) const {
    const NdfCluster& cluster = ndf_.clusters.data()[at.cluster];
    if (cluster.columns == 0)
      spotsOfBlock(SpotProfile(ndf_), spotsOf(ndf_, cluster, at.slice), pixels);
    else
      reader.block(cluster, reader.row(cluster, at.slice), pixels);
  }

  /// Chooses a block with a slice in proportion to its stored mass: its row with xi.y, its column with xi.x.
  /// @param codes  masses of the blocks of the image
  /// @return block -1 if the image has none
  GLINT_HD BlockChoice chooseStored(std::size_t image, const std::uint8_t* codes, int count, Vec2& xi) const {
    const int blocks = shape().blocksPerAxis();
    const std::uint64_t* mask = ndf_.block_masks.data() + image * static_cast<std::size_t>(ndf_.placeWords());
    const auto mass = [&](int begin, int end) {
      std::uint32_t units = 0;
      for (int k = begin; k < end; ++k) units += blockMassUnits(codes[k]);
      return static_cast<float>(units);
    };
    int begins[kMaxBlocksPerAxis + 1], rows = 0, n = 0, row = -1;
    for (int w = 0; w < ndf_.placeWords(); ++w) {
      for (std::uint64_t bits = mask[w]; bits != 0; bits &= bits - 1, ++n) {
        const int block_row = ndf_.place_blocks.data()[64 * w + lowestBit(bits)] / blocks;
        if (block_row != row) begins[rows++] = n;
        row = block_row;
      }
    }
    begins[rows] = count;
    const int r = chooseIndex(
        rows, mass(0, count), [&](int k) { return mass(begins[k], begins[k + 1]); }, xi.y);
    if (r < 0) return {};
    const int begin = begins[r], end = begins[r + 1];
    const int k = chooseIndex(
        end - begin, mass(begin, end), [&](int j) { return mass(begin + j, begin + j + 1); }, xi.x);
    const int rank = begin + std::max(k, 0);
    return {ndf_.place_blocks.data()[placeOfRank(mask, rank)], rank};
  }

  /// Number of the set bit that has `rank` set bits below it.
  static GLINT_HD int placeOfRank(const std::uint64_t* mask, int rank) {
    int w = 0;
    for (int bits = setBits(mask[0]); bits <= rank; bits = setBits(mask[++w])) rank -= bits;
    std::uint64_t word = mask[w];
    for (; rank > 0; --rank) word &= word - 1;
    return 64 * w + lowestBit(word);
  }

  /// A pixel of an image, in proportion to the image's density. x = -1 if there is none.
  template <class Reader>
  GLINT_HD PixelPlace choosePlace(const Reader& reader, std::size_t image, Vec2& xi) const {
    constexpr int kTries = 4;  // the last is kept: one in a million
    const std::uint32_t* first = ndf_.first_block.data() + image;
    const std::uint8_t* codes = ndf_.block_masses.data() + first[0];
    const float to_units = 0x1p18f * 4 * ndf_.density_scales.data()[image] /
                           (static_cast<float>(shape().resolution) * static_cast<float>(shape().resolution));
    for (int tries = 1;; ++tries) {
      const BlockChoice choice = chooseStored(image, codes, static_cast<int>(first[1] - first[0]), xi);
      const SlicePlace at = choice.block < 0 ? SlicePlace{} : findSlice(image, ndf_.block_places.data()[choice.block]);
      if (at.cluster == kNone) return {0, -1, -1};
      float pixels[kBlockPixels];
      decodeBlock(reader, at, pixels);
      const BlockSums sums = sumRows(pixels);
      const float kept = std::min(1.0f, sums.total * to_units / static_cast<float>(blockMassUnits(codes[choice.rank])));
      if (xi.y < kept || tries == kTries) {
        xi.y = clampUnit(xi.y / kept);
        return choosePixel(pixels, sums, choice.block, xi);
      }
      xi.y = clampUnit((xi.y - kept) / (1 - kept));
    }
  }

  CompressedNdf ndf_;
  SliceChooser chooser_;
  Reference below_;
};

// Behind the class: clang instantiates the templates that it calls only once it has read them.
inline GLINT_HD HalfVectorSample CpNdf::sample(const Footprint& p, Vec2 xi) const {
  xi = clampUnit(xi);
  if (below_.hasMap() && belowFinest(shape(), p)) return below_.sample(p, xi);
  const PyramidSlices chosen = chooser_.choose(p);
  float weights[PyramidSlices::kMost];
  float total = 0;  // images of which nothing was kept have no density
  for (int k = 0; k < chosen.count; ++k) {
    weights[k] = ndf_.density_scales.data()[imageOf(chosen[k])] > 0 ? chosen.weights[k] : 0.0f;
    total += weights[k];
  }
  const int k = chooseIndex(
      chosen.count, total, [&](int i) { return weights[i]; }, xi.x);
  if (k < 0) return {};
  return withReader(ndf_, [&](const auto& reader) -> HalfVectorSample {
    const PixelPlace place = choosePlace(reader, imageOf(chosen[k]), xi);
    if (place.x < 0) return {};
    return {pointInPixel(shape(), place, xi), pixelDensity(reader, chosen, place) / total};
  });
}

static_assert(NdfModel<CpNdf>);

}  // namespace glint
