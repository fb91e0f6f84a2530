#pragma once

namespace glint::bake {

/// The stride between the images of level 0 that answers footprints from this size on, whole texels, at least 2.
/// @param smallest_texels  deviation of the smallest footprint
/// @note without the map, smaller footprints are seen as wide as those of level 0: PyramidNdf::smallestSigma says from which size on
int strideFor(double smallest_texels);

/// The number of levels of footprints up to this size, at least 1, as many as PyramidShape holds at most.
/// @param largest_texels  deviation of the largest footprint
/// @param stride          of level 0, texels
/// @note between the last level and the mean of the map, larger footprints are answered by both
int levelsFor(double largest_texels, double stride);

}  // namespace glint::bake
