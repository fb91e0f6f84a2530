#pragma once

#include "glint/bake/common/progress.h"
#include "glint/bake/displace/brdf_scene.h"

namespace glint::bake {

/// Estimates the effective BRDFs of a surface with a diffuse base. Each sampled facet is where one walk starts, and the walk
/// serves all pairs of directions at once.
EffectiveBrdf estimateDiffuse(const BrdfScene& scene, const ProgressFn& progress);

}  // namespace glint::bake
