#pragma once

#include <functional>

#include "glint/bake/block_bins.h"
#include "glint/bake/progress.h"
#include "glint/model/ndf_pyramid.h"

namespace glint::bake {

/// Receives the bins of image (i, j) of a level, unnormalised: divide by `mass()`. Called from several threads at once.
using ImageSink = std::function<void(int level, int i, int j, const BlockBins& bins)>;

/// Direction bins under the Gaussian footprints of every level of a pyramid, for a smooth surface.
///
/// Every triangle is rasterised once. Its weight in a Gaussian footprint is interpolated linearly between the nodes of a lattice
/// of an eighth of a stride (with the Gaussian narrowed by the q^2/6 that interpolation adds: the weights are good to 0.4 %), so a
/// footprint is a sum over ~460 nodes, and the lattice of the next level follows from this one by halving. Rows of nodes stream
/// through; only images whose footprint is open are held.
/// Cost: O(area of the triangles' images) + O(460 nodes) per image.
void scatterSmooth(const NormalMap& map, const PyramidShape& shape, int subdivision, const ImageSink& sink,
                   const ProgressFn& progress);

}  // namespace glint::bake
