#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/model/sh.h"

namespace glint::bake {

struct ShLobesOptions {
  float sigma_r = 0.005f;  ///< intrinsic roughness, disk units, in (0, 1]
  int order = 60;          ///< highest band, 0 .. kMaxShOrder
  ShGrid grid{65, 128};    ///< directions of the table; 0 x 0: no table
  ShPrecision precision = ShPrecision::f16;
  std::uint64_t max_bytes = std::uint64_t{4} << 30;  ///< largest table that is allowed
};

/// A ShLobes that owns its arrays.
struct ShLobesData {
  ShLobes lobes;
  std::vector<float> zonal;
  std::vector<std::uint16_t> halves;
  std::vector<float> floats;

  /// Spans over the arrays; valid while this object lives and is not changed.
  ShLobes view() const;
};

/// Computes the zonal coefficients f_l, l = 0 .. order, of the roughness lobe g along +z:
///   f_l = 2 pi sqrt((2l + 1) / (4 pi)) integral of g(a) P_l(cos a) sin a da,
/// by Gauss-Legendre quadrature to about 1e-13 of f_0. ShLobes defines g.
/// @throws Error usage if sigma_r or the order is out of range
std::vector<double> zonalLobe(double sigma_r, int order);

/// Builds the table of the lobe, turned towards every direction of a grid (Gamboa 2018, Eq. 10 and 12; section 6.2).
/// O(directions * order^2). The result does not depend on the number of threads.
/// @throws Error usage if an option is out of range; failed if the table is larger than max_bytes
ShLobesData buildShLobes(const ShLobesOptions& options, const ProgressFn& progress = {});

/// Throws Error usage unless a grid of directions is 0 x 0, or has 2 to 4096 rows and 3 to 8192 columns.
void requireUsableGrid(const ShGrid& grid);
/// Throws Error failed if a table would be larger than the limit. The error names the size, and the largest order that fits.
/// @param bytes_per_coefficient  bytes of one coefficient in all directions together
void requireTableFits(int order, double bytes_per_coefficient, std::uint64_t max_bytes);

}  // namespace glint::bake
