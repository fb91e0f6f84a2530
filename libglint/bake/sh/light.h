#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/bake/sh/environment.h"
#include "glint/model/sh.h"

namespace glint::bake {

/// Building light tables of higher orders takes hours (it grows like order^3 for each direction) and gigabytes.
inline constexpr int kMaxShLightOrder = 300;

struct ShLightOptions {
  int order = 60;  ///< highest band, 0 .. kMaxShLightOrder
  /// Outgoing directions. 12 MB at order 60 in half precision; see ShLightQuery for why so few are enough.
  ShGrid grid{17, 32};
  /// Highest band of the environment itself; 0: lightBandLimit(order). Its upper half is faded out smoothly.
  int band_limit = 0;
  ShPrecision precision = ShPrecision::f16;
  std::uint64_t max_bytes = std::uint64_t{4} << 30;  ///< larger tables are refused
};

/// The memory behind ShLight.
struct ShLightData {
  ShLight light;
  std::vector<float> scales;
  std::vector<float> band_norms;
  std::vector<std::uint16_t> halves;
  std::vector<float> floats;

  /// Points into this object.
  ShLight view() const;
};

/// Band of the environment up to which a table of an order can tell it apart. A half vector turns half as fast as the direction
/// that it mirrors to, so `order` bands would do at normal incidence; around the direction opposite to the outgoing one, where
/// whole rings of half vectors see one spot, no limit is enough: there the light of a direction turns as fast as half vectors
/// turn about the rim. With this limit the light of a single direction is right to 1e-6 of its norm up to 120 degrees from the
/// outgoing direction, and to 1e-3 up to 150 degrees (orders 20 to 60); with twice the limit to 1e-6 up to 140 (order 30).
/// Facets that reflect by more have wo . h below 0.35.
constexpr int lightBandLimit(int order) { return std::max(3 * order + 24, std::min(6 * order + 24, 204)); }

/// Weight of band l of an environment: 1 up to half of the band limit, then smoothly to 0.
double lightTaper(int l, int band_limit);

/// Coefficients, for half vectors around +z, of light around +z: T(l', l) of one m with
///   T = 2 pi integral over t = cos(theta_h) in [0, 1] of P_l'^m(t) P_l^m(2 t^2 - 1) 4 t dt,
/// since the mirror direction has the same azimuth and twice the polar angle, and 4 (wo . h) dh = dwi. Exact quadrature.
/// @return [order - m + 1][band_limit - m + 1], row by row
std::vector<double> halfVectorTransfer(int m, int order, int band_limit);

/// Light coefficients of every outgoing direction of a grid (Gamboa 2018, section 6.4): the environment's harmonics are turned
/// to the outgoing direction and mapped to half vectors, both by exact matrices.
/// Cost about directions * order * band_limit^2; the same for any number of threads.
/// @throws Error usage if an option is out of range or the table is larger than max_bytes; invalid_input as requireUsable
ShLightData buildShLight(const Environment& environment, const ShLightOptions& options, const ProgressFn& progress = {});

}  // namespace glint::bake
