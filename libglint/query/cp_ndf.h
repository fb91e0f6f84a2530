#pragma once

#include "glint/model/compressed_ndf.h"
#include "glint/query/bits.h"
#include "glint/query/block_mass.h"
#include "glint/query/cluster_basis.h"
#include "glint/query/cluster_slices.h"
#include "glint/query/pyramid_slices.h"
#include "glint/query/reference.h"
#include "glint/query/sampling.h"

namespace glint {

/// The NDF from a compressed pyramid: tensor rank (CP), Tucker-2 or PCA (Deng 2022, sections 4.2 to 4.4).
///
/// Chooses images as PyramidNdf does. Pixels are sums of products of few factors, and so are sums over boxes of pixels, from
/// prefix sums (Eq. 6 and 7).
///
/// The density of an image is what the approximation leaves above zero, scaled to integrate to 1, and constant over a pixel. The
/// mean is a difference of prefix sums, so it counts what lies below zero, is scaled to integrate to 1 with that, and only the
/// result is clamped: it is the exact average of `signedDensity`, and of `density` where nothing is negative.
/// Thread-safe, allocates nothing; the arrays must outlive it.
class CpNdf {
 public:
  GLINT_HD explicit CpNdf(const CompressedNdf& ndf) : ndf_(ndf) {}
  GLINT_HD CpNdf(const CompressedNdf& ndf, const NormalMap& normals)
      : ndf_(ndf),
        below_(Reference(normals, ndf.shape.sigma_r, ndf.shape.surface, ndf.shape.boundary, Reference::Search::pruned)) {}

  GLINT_HD const CompressedNdf& compressed() const { return ndf_; }
  /// Whether footprints below level 0 are answered from the texels.
  GLINT_HD bool hasNormals() const { return below_.hasMap(); }
  GLINT_HD const PyramidShape& shape() const { return ndf_.shape; }

  /// Density towards h, >= 0; O(columns) in each of 8 images.
  GLINT_HD float density(const Footprint& p, Vec2 h) const {
    if (!insideSquare(h)) return 0;
    if (below_.hasMap() && belowFinest(shape(), p)) return below_.density(p, h);
    const PyramidSlices chosen = selectSlices(shape(), p);
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
    const PyramidSlices chosen = selectSlices(shape(), p);
    const PixelPlace place = pixelPlace(shape(), h);
    return blockValue(chosen, place.block, [&](const auto& projector, const NdfCluster& cluster, float* projection) {
      return projector.pixel(cluster, place.x, place.y, projection);
    });
  }

  GLINT_HD float signedMean(const Footprint& p, const Box2& range) const {
    if (!(range.width() > 0 && range.height() > 0)) return 0;
    if (below_.hasMap() && belowFinest(shape(), p)) return below_.mean(p, range);
    const PyramidSlices chosen = selectSlices(shape(), p);
    double sum = 0;
    forEachBlock(shape(), range, [&](int block, const BlockBox& box) {
      sum += blockValue(chosen, block, [&](const auto& projector, const NdfCluster& cluster, float* projection) {
        return projector.box(cluster, box, projection);
      });
    });
    return static_cast<float>(sum / areaInPixels(shape(), range));
  }

 private:
  /// A slice of a cluster. cluster: ~0 when the image has nothing in the block.
  struct SlicePlace {
    std::size_t cluster = ~std::size_t{0};
    std::uint64_t slice = 0;
  };

  GLINT_HD std::size_t imageOf(const PyramidSlice& slice) const {
    return std::size_t{ndf_.first_image[slice.level]} + slice.image;
  }

  GLINT_HD SlicePlace findSlice(std::size_t image, int block) const {
    const std::size_t at = static_cast<std::size_t>(ndf_.image_regions.data()[image]) * shape().blocksPerImage() + block;
    const int slot = ndf_.image_slots.data()[image];
    const std::size_t word = at * ndf_.words_per_cluster + slot / 64;
    const std::uint64_t mask = ndf_.masks.data()[word], bit = std::uint64_t{1} << (slot % 64);
    if (!(mask & bit)) return {};
    return {at, ndf_.mask_ranks.data()[word] + static_cast<std::uint64_t>(setBits(mask & (bit - 1)))};
  }

  /// Weighted sum over the chosen images. Slices of the same cluster, as those of neighbours mostly are, share its projection.
  template <class Reader>
  GLINT_HD float pixelDensity(const Reader& reader, const PyramidSlices& chosen, const PixelPlace& place) const {
    SlicePlace places[PyramidSlices::kMost];
    float weights[PyramidSlices::kMost];
    for (int k = 0; k < chosen.count; ++k) {
      const std::size_t image = imageOf(chosen.slices[k]);
      places[k] = findSlice(image, place.block);
      weights[k] = chosen.slices[k].weight * ndf_.density_scales.data()[image];
    }
    constexpr std::size_t kNone = ~std::size_t{0};
    float projection[kMaxColumns];
    float sum = 0;
    for (int first = 0; first < chosen.count; ++first) {
      const std::size_t at = places[first].cluster;
      if (at == kNone) continue;
      const NdfCluster& cluster = ndf_.clusters.data()[at];
      const int columns = columnCount(ndf_, cluster);
      reader.pixel(cluster, place.x, place.y, projection);
      const Float4 last = reader.lastColumns(projection, columns);
      for (int k = first; k < chosen.count; ++k) {
        if (places[k].cluster != at) continue;
        sum +=
            weights[k] * std::max(0.0f, reader.dot(projection, last, reader.row(cluster, places[k].slice, columns), columns));
        places[k].cluster = kNone;
      }
    }
    return sum;
  }

  /// A pixel of an image, in proportion to the image's density. x = -1 if there is none.
  template <class Reader>
  GLINT_HD PixelPlace choosePlace(const Reader& reader, std::size_t image, Vec2& xi) const {
    constexpr int kTries = 4;  // the last is kept: one in a million
    const std::uint32_t* first = ndf_.first_block.data() + image;
    const std::uint8_t* codes = ndf_.block_masses.data() + first[0];
    const auto mass = [&](int begin, int end) {
      std::uint32_t units = 0;
      for (int k = begin; k < end; ++k) units += blockMassUnits(codes[k]);
      return static_cast<float>(units);
    };
    const float total = mass(0, static_cast<int>(first[1] - first[0]));
    const std::uint64_t* mask = ndf_.block_masks.data() + image * shape().maskWords();
    const float to_units = 0x1p18f * 4 * ndf_.density_scales.data()[image] /
                           (static_cast<float>(shape().resolution) * static_cast<float>(shape().resolution));
    for (int tries = 1;; ++tries) {
      const BlockChoice choice = chooseBlock(mask, shape().blocksPerAxis(), total, mass, xi);
      const SlicePlace at = choice.block < 0 ? SlicePlace{} : findSlice(image, choice.block);
      if (at.cluster == ~std::size_t{0}) return {0, -1, -1};
      const NdfCluster& cluster = ndf_.clusters.data()[at.cluster];
      const int columns = columnCount(ndf_, cluster);
      float pixels[kBlockPixels];
      reader.block(cluster, reader.row(cluster, at.slice, columns), columns, pixels);
      const BlockSums sums = sumRows(pixels);
      const float kept = std::min(1.0f, sums.total * to_units / static_cast<float>(blockMassUnits(codes[choice.rank])));
      if (xi.y < kept || tries == kTries) {
        xi.y = clampUnit(xi.y / kept);
        return choosePixel(pixels, sums, choice.block, xi);
      }
      xi.y = clampUnit((xi.y - kept) / (1 - kept));
    }
  }

  /// Signed: weighted sum over slices of one block. The coefficients of slices of the same cluster, as neighbours mostly are, are blended
  /// first and meet the cluster's projection once.
  template <class Project>
  GLINT_HD float blockValue(const PyramidSlices& chosen, int block, Project&& project) const {
    constexpr std::size_t kNone = ~std::size_t{0};
    float blend[kMaxColumns];
    std::size_t current = kNone;
    float sum = 0;
    const auto finishCluster = [&] {
      if (current == kNone) return;
      const NdfCluster& cluster = ndf_.clusters.data()[current];
      float projection[kMaxColumns];
      const int columns = withProjector(ndf_, [&](const auto& projector) { return project(projector, cluster, projection); });
      sum += dotProduct(projection, blend, columns);
    };
    for (int k = 0; k < chosen.count; ++k) {
      const PyramidSlice& slice = chosen.slices[k];
      const std::size_t image = imageOf(slice);
      const auto [at, row] = findSlice(image, block);
      if (at == kNone) continue;
      const NdfCluster& cluster = ndf_.clusters.data()[at];
      const int columns = columnCount(ndf_, cluster);
      if (at != current) {
        finishCluster();
        current = at;
        std::fill(blend, blend + columns, 0.0f);
      }
      addCoefficients(ndf_, cluster.first_coefficient + row * columns, slice.weight * ndf_.image_scales.data()[image], columns,
                      blend);
    }
    finishCluster();
    return sum;
  }

  CompressedNdf ndf_;
  Reference below_;
};

// Behind the class: clang instantiates the templates that it calls only once it has read them.
inline GLINT_HD HalfVectorSample CpNdf::sample(const Footprint& p, Vec2 xi) const {
  xi = clampUnit(xi);
  if (below_.hasMap() && belowFinest(shape(), p)) return below_.sample(p, xi);
  const PyramidSlices chosen = selectSlices(shape(), p);
  float weights[PyramidSlices::kMost];
  float total = 0;  // images of which nothing was kept have no density
  for (int k = 0; k < chosen.count; ++k) {
    weights[k] = ndf_.density_scales.data()[imageOf(chosen.slices[k])] > 0 ? chosen.slices[k].weight : 0.0f;
    total += weights[k];
  }
  const int k = chooseIndex(chosen.count, total, [&](int i) { return weights[i]; }, xi.x);
  if (k < 0) return {};
  return withReader(ndf_, [&](const auto& reader) -> HalfVectorSample {
    const PixelPlace place = choosePlace(reader, imageOf(chosen.slices[k]), xi);
    if (place.x < 0) return {};
    return {pointInPixel(shape(), place, xi), pixelDensity(reader, chosen, place) / total};
  });
}

static_assert(NdfModel<CpNdf>);

}  // namespace glint
