#include "glint/bake/displace/brdf_scene.h"

#include "glint/bake/common/counter_random.h"

namespace glint::bake {

BrdfScene::BrdfScene(const HeightSurface& heights, const VisibilityMasks& visibility, std::span<const Vec3> grid_directions,
                     const PatchGrid& patch_grid, const EffectiveOptions& estimate)
    : surface(heights),
      masks(visibility),
      directions(grid_directions),
      grid(patch_grid),
      options(estimate),
      tracer(surface),
      base(surface, options.base, options.texture, options.channels()) {}

std::vector<PatchFacets> BrdfScene::patches(std::size_t samples) const {
  std::vector<PatchFacets> list;
  for (int p = 0; p < grid.count(); ++p) list.emplace_back(grid, p, samples / static_cast<std::size_t>(grid.count()));
  return list;
}

void BrdfScene::facingRow(std::size_t facet, float* row) const {
  masks.expand(facet, row);
  std::fill(row + directions.count, row + directions.padded, 0.0f);
  multiplyCosines(directions, surface.normal(facet), row);
}

Vec3 BrdfScene::pointOf(std::size_t facet, std::uint64_t index) const {
  Vec2 xi = randomPair(options.seed, kPointStream, index);
  // Fold the unit square onto its lower triangle.
  if (xi.x + xi.y > 1) xi = {1 - xi.x, 1 - xi.y};
  return surface.point(facet, xi.x, xi.y);
}

}  // namespace glint::bake
