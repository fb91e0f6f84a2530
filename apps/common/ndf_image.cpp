#include "common/ndf_image.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "glint/bake/bin_map/bin_map_image.h"

namespace glint::apps {
namespace {

using CompressedNdf = AnisotropicNdf<CpNdf>;

/// Mean density of a square of the image. A compressed pyramid's means of ranges take off no floors, and would show a haze that its
/// densities do not have; means over its own pixels take them off. Where squares are no groups of its pixels, points
/// of each give the mean, but with texels below level 0, whose lobes may be narrower.
float squareMean(const CompressedNdf& ndf, const Footprint& footprint, Vec2 low, float side, int resolution) {
  const int own = ndf.round().shape().resolution;
  const bool groups = own % resolution == 0;
  if (!groups && ndf.round().hasNormals()) return ndf.mean(footprint, {low, low + Vec2{side, side}});
  constexpr int kPoints = 2;  // along each axis
  const int pixels = groups ? own / resolution : std::max(kPoints, kPoints * (own / resolution));
  const float step = side / static_cast<float>(pixels);
  const auto at = [&](Vec2 h) { return groups ? ndf.pixelMean(footprint, h) : ndf.density(footprint, h); };
  double sum = 0;
  for (int j = 0; j < pixels; ++j)
    for (int i = 0; i < pixels; ++i)
      sum += at(low + Vec2{(static_cast<float>(i) + 0.5f) * step, (static_cast<float>(j) + 0.5f) * step});
  return static_cast<float>(sum / (pixels * pixels));
}

}  // namespace

std::vector<float> ndfImage(const api::AnyNdf& any, const Footprint& footprint, int resolution,
                            const bake::ProgressFn& progress) {
  if (const auto* bin_map = std::get_if<BinMapNdf>(&any)) return bake::binMapImage(*bin_map, footprint, resolution, progress);
  const auto* compressed = std::get_if<CompressedNdf>(&any);
  std::vector<float> image(static_cast<std::size_t>(resolution) * resolution);
  const float pixel = 2.0f / static_cast<float>(resolution);
  bake::ProgressCounter counter(progress, static_cast<std::size_t>(resolution));
  tbb::parallel_for(0, resolution, [&](int y) {
    for (int x = 0; x < resolution; ++x) {
      const Vec2 low = {-1 + static_cast<float>(x) * pixel, -1 + static_cast<float>(y) * pixel};
      image[rowMajorIndex(x, y, resolution)] = compressed ? squareMean(*compressed, footprint, low, pixel, resolution)
                                                          : any.mean(footprint, {low, low + Vec2{pixel, pixel}});
    }
    counter.advance();
  });
  return image;
}

}  // namespace glint::apps
