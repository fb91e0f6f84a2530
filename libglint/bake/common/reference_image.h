#pragma once

#include <vector>

#include "glint/query/reference.h"

namespace glint::bake {

/// Computes the exact NDF image of a footprint, `Reference::mean` over every pixel, by scattering.
///
/// Each texel adds the mass of its lobe to the pixels around its normal, in double precision. On a smooth surface, each point
/// of a quadrature over the triangles does, with points closer to each other than a lobe is wide. O(texels) instead of
/// O(texels * pixels).
/// @return [resolution][resolution] pixel means of the density over [-1, 1]^2, bottom row first
std::vector<float> referenceImage(const NormalMap& map, float sigma_r, Surface surface, Boundary boundary,
                                  const Footprint& footprint, int resolution);

}  // namespace glint::bake
