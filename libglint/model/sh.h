#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "glint/math/device.h"

namespace glint {

/// Highest order of spherical harmonics that an asset may have.
inline constexpr int kMaxShOrder = 1000;

/// Coefficients of bands 0 .. order.
GLINT_HD constexpr std::size_t shCount(int order) {
  return (static_cast<std::size_t>(order) + 1) * (static_cast<std::size_t>(order) + 1);
}
/// Index of the coefficient of y_l^m. Bands follow one another; a band has the cosines m = 0 .. l, then the sines m = -1 .. -l.
GLINT_HD constexpr std::size_t shIndex(int l, int m) {
  return static_cast<std::size_t>(l) * static_cast<std::size_t>(l) + static_cast<std::size_t>(m >= 0 ? m : l - m);
}

/// Directions of the whole sphere: row j at the polar angle pi j / (rows - 1), both poles included, column k at the azimuth
/// 2 pi k / columns.
struct ShGrid {
  int rows = 0;
  int columns = 0;

  GLINT_HD constexpr std::size_t directionCount() const {
    return static_cast<std::size_t>(rows) * static_cast<std::size_t>(columns);
  }
};

enum class ShPrecision : std::uint8_t { f16, f32 };

/// The roughness lobe of a facet as spherical harmonics, along +z and turned towards the directions of a grid (asset kind
/// `sh-lobes`; Gamboa 2018, Eq. 10 and 12).
///
/// At the angle a from the facet's normal the lobe is exp(-sin^2(a) / (2 sigma_r^2)) / (2 pi sigma_r^2), and 0 from 90 degrees
/// on: for a facet of an untilted normal, the Gaussian of deviation sigma_r on the unit disk.
struct ShLobes {
  int order = 0;      ///< highest band
  float sigma_r = 0;  ///< intrinsic roughness, disk units
  ShGrid grid;        ///< 0 x 0: no table; lobes are turned when they are asked
  ShPrecision precision = ShPrecision::f16;
  std::span<const float> zonal;        ///< [order + 1]: f_l of the lobe along +z
  const void* coefficients = nullptr;  ///< [rows][columns][shCount(order)] of f16 or f32
};

/// Distant light for half vectors: for every outgoing direction of a grid, the spherical harmonics of
/// L(r(wo, h)) 4 (wo . h), with r the mirror direction of wo at h (asset kind `sh-light`; Gamboa 2018, section 6.4).
///
/// Coefficients of an outgoing direction are in its own frame: z along wo, x towards growing polar angle, y towards growing
/// azimuth.
struct ShLight {
  int order = 0;  ///< highest band
  ShGrid grid;    ///< outgoing directions
  ShPrecision precision = ShPrecision::f16;
  std::span<const float> scales;       ///< [rows][columns]: coefficient = scale * stored number
  std::span<const float> band_norms;   ///< [rows][columns][order + 1]: norm of each band's coefficients, the largest of R, G, B
  const void* coefficients = nullptr;  ///< [rows][columns][3][shCount(order)] of f16 or f32; R, G, B
};

}  // namespace glint
