#include "glint/bake/moments/lobe_errors.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "glint/bake/common/image_errors.h"
#include "glint/bake/common/reference_image.h"
#include "glint/bake/common/seen_error.h"
#include "glint/query/detail/moments/slope_lobe.h"

namespace glint::bake {
namespace {

constexpr int kResolution = 128;

/// The area of a texel of a level, as a footprint.
Footprint areaOf(const SlopeMoments& moments, const SlopeMomentsLevel& level, std::size_t texel) {
  const auto column = static_cast<float>(texel % static_cast<std::size_t>(level.columns));
  const auto row = static_cast<float>(texel / static_cast<std::size_t>(level.columns));
  const auto columns = static_cast<float>(level.columns), rows = static_cast<float>(level.rows);
  const Vec2 centre = {(column + 0.5f) / columns, (row + 0.5f) / rows};
  return Footprint::box(centre, {0.5f * static_cast<float>(moments.width) / columns, 0},
                        {0, 0.5f * static_cast<float>(moments.height) / rows});
}

/// Mean densities of a lobe over the pixels of an image, of four points each: no lobe is narrower than a pixel.
std::vector<float> imageOf(const SlopeLobe& lobe) {
  constexpr float kPixel = 2.0f / kResolution, kNear = 0.25f * kPixel, kFar = 0.75f * kPixel;
  std::vector<float> image(kResolution * kResolution);
  tbb::parallel_for(0, kResolution, [&](int j) {
    for (int i = 0; i < kResolution; ++i) {
      const Vec2 low = {kPixel * static_cast<float>(i) - 1, kPixel * static_cast<float>(j) - 1};
      image[rowMajorIndex(i, j, kResolution)] =
          0.25f * (lobe.density(low + Vec2{kNear, kNear}) + lobe.density(low + Vec2{kFar, kNear}) +
                   lobe.density(low + Vec2{kNear, kFar}) + lobe.density(low + Vec2{kFar, kFar}));
    }
  });
  return image;
}

}  // namespace

std::vector<LobeError> lobeErrors(const NormalMap& map, const SlopeMoments& moments, float sigma_r,
                                  const ProgressFn& progress) {
  const float sigma = std::max(sigma_r, kFinestLobe);
  std::vector<LobeError> errors;
  ProgressCounter counter(progress, static_cast<std::size_t>(moments.level_count));
  for (int l = 0; l < moments.level_count; ++l) {
    const SlopeMomentsLevel& level = moments.levels[l];
    const std::size_t count = std::min<std::size_t>(level.texels.size(), kLobeErrorTexels);
    SeenError seen(kResolution);
    double variation = 0;
    for (std::size_t k = 0; k < count; ++k) {
      // The golden ratio of the texels, so that neighbouring ones are in different rows and columns.
      const std::size_t texel =
          count == level.texels.size()
              ? k
              : static_cast<std::size_t>(std::fmod((static_cast<double>(k) + 0.5) * 0.61803398874989485, 1.0) *
                                         static_cast<double>(level.texels.size()));
      const std::vector<float> truth =
          referenceImage(map, sigma, Surface::flat, moments.boundary, areaOf(moments, level, texel), kResolution);
      const std::vector<float> image = imageOf(SlopeLobe(level.texels[texel], sigma));
      seen.add(image.data(), truth.data());
      variation += imageErrors(image, truth, kResolution).tv;
    }
    errors.push_back({variation / static_cast<double>(count), seen.summary().seen});
    counter.advance();
  }
  return errors;
}

}  // namespace glint::bake
