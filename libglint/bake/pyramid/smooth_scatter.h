#pragma once

#include <functional>

#include "glint/bake/common/progress.h"
#include "glint/bake/pyramid/block_bins.h"
#include "glint/bake/pyramid/triangle_splat.h"
#include "glint/model/ndf_pyramid.h"

namespace glint::bake {

/// Receives the bins of image (i, j) of a level, over DirectionTiles, unnormalised: divide by `sum()`. Called from several
/// threads at once.
using ImageSink = std::function<void(int level, int i, int j, const BlockBins& bins)>;

/// Direction bins under the Gaussian footprints of every level of a pyramid, for a smooth surface.
///
/// Every triangle is rasterised once, into the histograms of its cell of a lattice of an eighth of a stride. The weight of a
/// Gaussian footprint is approximated over each cell by its best linear function along either axis, so that an image is a sum
/// over the moments of ~580 cells, along rows of cells first; moments of the lattice of the next level follow from those of
/// this one exactly. Rows of cells stream through; only images whose footprint is open are held.
/// Cost: O(area of the triangles' images) + O(tiles in use) for each cell.
void scatterSmooth(const NormalMap& map, const PyramidShape& shape, const DirectionTiles& direction_tiles,
                   const ImageSink& sink, const ProgressFn& progress);

}  // namespace glint::bake
