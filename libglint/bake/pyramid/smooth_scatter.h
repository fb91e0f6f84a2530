#pragma once

#include <functional>

#include "glint/bake/common/progress.h"
#include "glint/bake/pyramid/block_bins.h"
#include "glint/bake/pyramid/triangle_splat.h"
#include "glint/model/ndf_pyramid_shard.h"

namespace glint::bake {

/// Receives the bins of image (i, j) of a level, over DirectionTiles. The bins are not normalised: divide by their `sum()`.
/// Several threads call it at once.
using ImageSink = std::function<void(int level, int i, int j, const BlockBins& bins)>;

/// Computes the bins of directions under the Gaussian footprints of every level of a pyramid, for a smooth surface.
///
/// The map is cut by a lattice of cells, an eighth of a stride wide. Every triangle is rasterised once, into the histograms of
/// its cell (see kMoments). Over each cell, the weight of a Gaussian footprint is replaced by its best linear function along
/// either axis. So an image is a weighted sum over the moments of about 580 cells: along each row of cells first, then over
/// rows. The lattice of the next level has cells of twice the width, and their moments follow exactly from the moments of their
/// parts.
///
/// Rows of cells are made one after the other. In memory are only images whose footprint has begun and not ended.
/// Only the images of a region are made, and only cells that they need.
/// Cost: O(area of the triangles on the disk) + O(tiles in use) for each cell.
void scatterSmooth(const NormalMap& map, const PyramidShape& shape, PyramidRegion region, const DirectionTiles& direction_tiles,
                   const ImageSink& sink, const ProgressFn& progress);

}  // namespace glint::bake
