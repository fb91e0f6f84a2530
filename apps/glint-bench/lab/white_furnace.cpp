#include "glint-bench/lab/white_furnace.h"

#include <cmath>
#include <numbers>

#include "glint/bake/displace/effective_brdf.h"

namespace glint::apps {
namespace {

/// Light that a white surface sends to a view under an even sky, minus 1.
double furnaceError(const DisplacedBrdf& brdf, Vec3 wo, DisplacedVariant variant) {
  const Displacement& asset = brdf.asset();
  const DisplacementLevel& level = asset.levels[0];
  const std::vector<Vec3> directions = bake::angularDirections(asset.angular);
  double light = 0, flat = 0;
  for (int j = 0; j < level.rows; ++j) {
    for (int i = 0; i < level.columns; ++i) {
      // A point of each of the two triangles of a cell.
      for (const float inside : {0.3f, 0.7f}) {
        const Vec2 uv = {(static_cast<float>(i) + inside) / static_cast<float>(level.columns),
                         (static_cast<float>(j) + inside) / static_cast<float>(level.rows)};
        const Vec3 n = brdf.normal(0, uv);
        for (const Vec3 wi : directions) {
          const double cosines = double{dot(n, wi)} * dot(n, wo) / n.z;
          light += cosines * brdf.evaluate(0, uv, wi, wo, variant).g;
          flat += std::numbers::inv_pi * wi.z * wo.z;
        }
      }
    }
  }
  return light / flat - 1;
}

}  // namespace

double meanFurnaceError(const DisplacedBrdf& brdf, DisplacedVariant variant) {
  double sum = 0;
  int views = 0;
  for (const double degrees : {10.0, 25.0, 40.0, 55.0, 70.0}) {
    for (const double azimuth : {0.2, 1.1, 2.9, 4.4}) {
      const double theta = std::numbers::pi * degrees / 180;
      const Vec3 wo = {static_cast<float>(std::sin(theta) * std::cos(azimuth)),
                       static_cast<float>(std::sin(theta) * std::sin(azimuth)), static_cast<float>(std::cos(theta))};
      sum += std::abs(furnaceError(brdf, wo, variant));
      ++views;
    }
  }
  return sum / views;
}

void fadeRelief(std::vector<float>& heights, int width) {
  for (std::size_t k = 0; k < heights.size(); ++k) {
    const auto u = static_cast<float>(k % static_cast<std::size_t>(width)) / static_cast<float>(width);
    heights[k] *= 0.5f - 0.5f * std::cos(2 * std::numbers::pi_v<float> * u);
  }
}

}  // namespace glint::apps
