#pragma once

#include <bit>

#include "glint/model/compressed_ndf.h"
#include "glint/query/cluster_basis.h"
#include "glint/query/pyramid_slices.h"
#include "glint/query/reference.h"

namespace glint {

/// The NDF from a compressed pyramid: tensor rank (CP), Tucker-2 or PCA (Deng 2022, sections 4.2 to 4.4).
///
/// Chooses images as PyramidNdf does. Pixels are sums of products of few factors, and so are sums over boxes of pixels, from
/// prefix sums (Eq. 6 and 7). Images are scaled to integrate to 1. What the approximation takes below zero is answered as 0, by
/// `density` and `mean` alike; `signedDensity` and `signedMean` give it as it is, and of those the mean is the exact average.
/// The density is constant over a pixel. Thread-safe, allocates nothing; the arrays must outlive it.
class CpNdf {
 public:
  GLINT_HD explicit CpNdf(const CompressedNdf& ndf) : ndf_(ndf) {}
  GLINT_HD CpNdf(const CompressedNdf& ndf, const NormalMap& normals)
      : ndf_(ndf),
        below_(Reference(normals, ndf.shape.sigma_r, ndf.shape.surface, ndf.shape.boundary, Reference::Search::pruned)) {}

  const PyramidShape& shape() const { return ndf_.shape; }

  /// Density towards h, >= 0; O(columns) in each of 8 images.
  GLINT_HD float density(const Footprint& p, Vec2 h) const { return std::max(0.0f, signedDensity(p, h)); }

  /// Average density over a box of half vectors, >= 0, 0 if the box is empty; O(columns) for each block that the box covers.
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
  /// Weighted sum over slices of one block. The coefficients of slices of the same cluster, as neighbours mostly are, are blended
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
      const std::size_t image = ndf_.first_image[slice.level] + slice.image;
      const std::size_t at = static_cast<std::size_t>(ndf_.image_regions.data()[image]) * shape().blocksPerImage() + block;
      const int slot = ndf_.image_slots.data()[image];
      const std::size_t word = at * ndf_.words_per_cluster + slot / 64;
      const std::uint64_t mask = ndf_.masks.data()[word], bit = std::uint64_t{1} << (slot % 64);
      if (!(mask & bit)) continue;
      const NdfCluster& cluster = ndf_.clusters.data()[at];
      const int columns = columnCount(ndf_, cluster);
      if (at != current) {
        finishCluster();
        current = at;
        std::fill(blend, blend + columns, 0.0f);
      }
      const std::uint64_t row = ndf_.mask_ranks.data()[word] + static_cast<std::uint64_t>(std::popcount(mask & (bit - 1)));
      addCoefficients(ndf_, cluster.first_coefficient + row * columns, slice.weight * ndf_.image_scales.data()[image], columns,
                      blend);
    }
    finishCluster();
    return sum;
  }

  CompressedNdf ndf_;
  Reference below_;
};

static_assert(NdfModel<CpNdf>);

}  // namespace glint
