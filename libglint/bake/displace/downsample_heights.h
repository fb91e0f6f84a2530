#pragma once

#include <span>
#include <vector>

#include "glint/bake/displace/cell_grid.h"
#include "glint/math/vec.h"

namespace glint::bake {

/// Weight of the Laplacian in the fit of a downsampled height field (w in Wu 2019, Eq. 10).
inline constexpr double kLaplacianWeight = 0.01;

/// Mean slopes of the surface over each cell of a coarser grid (Wu 2019, Eq. 1). Cell (I, J) covers cells (i, j) of the surface
/// with firstColumn(I) <= i < firstColumn(I + 1) and firstRow(J) <= j < firstRow(J + 1). Exact for triangles and for bilinear
/// patches: the integral of a slope over an area is the integral of the height difference between opposite sides.
/// @param heights  [grid.height][grid.width]
/// @return [grid.rows][grid.columns]
std::vector<Vec2> meanSlopes(std::span<const float> heights, const CellGrid& grid);

/// The periodic height field whose bilinear patches have slopes as close as possible to the given ones (Wu 2019, Eq. 9 and 10):
/// minimises the sum of |slope - slope*|^2 + kLaplacianWeight |Laplacian h|^2, with the Laplacian of five points. Lengths are
/// in cells of the result. Solved in the frequency domain, where the least-squares problem is diagonal.
/// @param slopes  [rows][columns], dh/dx and dh/dy of the patches
/// @param mean    mean height of the result, which slopes do not determine
/// @return [rows][columns] heights of the vertices; patch (I, J) lies between vertices (I, J) and (I + 1, J + 1)
std::vector<double> heightsFromSlopes(int columns, int rows, std::span<const Vec2> slopes, double mean);

}  // namespace glint::bake
