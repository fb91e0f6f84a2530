#pragma once

#include <vector>

#include "glint/query/reference.h"

namespace glint::bake {

/// The exact NDF image of a footprint: `Reference::mean` over every pixel, computed by scattering.
///
/// Each texel (or, on a smooth surface, each point of a quadrature over its triangles no coarser than the lobe) adds the mass
/// of its lobe to the pixels around it, in double precision. O(texels) instead of O(texels * pixels).
/// @return [resolution][resolution] pixel means of the density over [-1, 1]^2, bottom row first
std::vector<float> referenceImage(const NormalMap& map, float sigma_r, Surface surface, Boundary boundary,
                                  const Footprint& footprint, int resolution);

}  // namespace glint::bake
