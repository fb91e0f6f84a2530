#include "glint/bake/displace/effective_brdf.h"

#include "glint/bake/displace/brdf_scene.h"
#include "glint/bake/displace/diffuse_estimator.h"
#include "glint/bake/displace/glossy_estimator.h"
#include "glint/math/concentric_map.h"

namespace glint::bake {

std::vector<Vec3> angularDirections(int angular) {
  std::vector<Vec3> directions;
  for (int d = 0; d < angular * angular; ++d) directions.push_back(gridDirection(d, angular));
  return directions;
}

double PatchGrid::share(int patch) const {
  const int c = patch % columns, r = patch / columns;
  return static_cast<double>(firstColumn(c + 1) - firstColumn(c)) * (firstRow(r + 1) - firstRow(r)) /
         (static_cast<double>(width()) * height());
}

std::vector<double> EffectiveBrdf::mean(const PatchGrid& grid, std::size_t channel) const {
  std::vector<double> mean(directions * directions);
  for (int p = 0; p < grid.count(); ++p) {
    const double share = grid.share(p);
    const std::span<const float> of_patch = patch(static_cast<std::size_t>(p), channel);
    for (std::size_t k = 0; k < mean.size(); ++k) mean[k] += share * of_patch[k];
  }
  return mean;
}

EffectiveBrdf effectiveBrdf(const HeightSurface& surface, const VisibilityMasks& masks, std::span<const Vec3> directions,
                            const PatchGrid& grid, const EffectiveOptions& options, const ProgressFn& progress) {
  const BrdfScene scene(surface, masks, directions, grid, options);
  return options.base.kind == BaseBrdf::Kind::diffuse ? estimateDiffuse(scene, progress) : estimateGlossy(scene, progress);
}

}  // namespace glint::bake
