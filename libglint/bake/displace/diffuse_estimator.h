#pragma once

#include "glint/bake/common/progress.h"
#include "glint/bake/displace/brdf_scene.h"

namespace glint::bake {

/// Estimates the effective BRDFs of a surface with a diffuse base. One walk starts from each sampled facet. A diffuse facet
/// sends the same light to all directions, so that one walk serves all pairs of directions.
EffectiveBrdf estimateDiffuse(const BrdfScene& scene, const ProgressFn& progress);

}  // namespace glint::bake
