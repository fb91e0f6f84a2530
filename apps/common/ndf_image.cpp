#include "common/ndf_image.h"

#include <tbb/parallel_for.h>

#include "glint/bake/bin_map/bin_map_image.h"

namespace glint::apps {

std::vector<float> ndfImage(const api::AnyNdf& any, const Footprint& footprint, int resolution,
                            const bake::ProgressFn& progress) {
  if (const auto* bin_map = std::get_if<BinMapNdf>(&any)) return bake::binMapImage(*bin_map, footprint, resolution, progress);
  std::vector<float> image(static_cast<std::size_t>(resolution) * resolution);
  const float pixel = 2.0f / static_cast<float>(resolution);
  bake::ProgressCounter counter(progress, static_cast<std::size_t>(resolution));
  tbb::parallel_for(0, resolution, [&](int y) {
    for (int x = 0; x < resolution; ++x) {
      const Vec2 low = {-1 + static_cast<float>(x) * pixel, -1 + static_cast<float>(y) * pixel};
      image[rowMajorIndex(x, y, resolution)] = any.mean(footprint, {low, low + Vec2{pixel, pixel}});
    }
    counter.advance();
  });
  return image;
}

}  // namespace glint::apps
