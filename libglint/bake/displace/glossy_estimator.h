#pragma once

#include "glint/bake/common/progress.h"
#include "glint/bake/displace/brdf_scene.h"

namespace glint::bake {

/// Estimates the effective BRDFs of a surface with a GGX base, or with a base that is a table. Single reflections are sums over facets. Interreflections come
/// from random walks: walks start from each view, and collect light from all directions at every facet that they visit.
EffectiveBrdf estimateGlossy(const BrdfScene& scene, const ProgressFn& progress);

}  // namespace glint::bake
