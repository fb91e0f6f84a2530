#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "glint/bake/common/progress.h"
#include "glint/bake/sh/environment.h"
#include "glint/model/sh.h"

namespace glint::bake {

/// Largest order of a light table. Time grows with order^3 for each direction: higher orders take hours and gigabytes.
inline constexpr int kMaxShLightOrder = 300;

struct ShLightOptions {
  int order = 60;  ///< highest band, 0 .. kMaxShLightOrder
  /// Outgoing directions of the table. 17 x 32 take 12 MB at order 60 in half precision; ShLightQuery says why so few suffice.
  ShGrid grid{17, 32};
  /// Highest band of the environment; 0: lightBandLimit(order). The upper half of its bands fade out smoothly (lightTaper).
  int band_limit = 0;
  ShPrecision precision = ShPrecision::f16;
  std::uint64_t max_bytes = std::uint64_t{4} << 30;  ///< largest table that is allowed, with what it is made with
};

/// A ShLight that owns its arrays.
struct ShLightData {
  ShLight light;
  std::vector<float> scales;
  std::vector<float> band_norms;
  std::vector<std::uint16_t> halves;
  std::vector<float> floats;

  /// Spans over the arrays; valid while this object lives and is not changed.
  ShLight view() const;
};

/// Highest band of the environment that a table of an order needs.
///
/// The mirrored direction turns twice as fast as the half vector, so bands up to `order` suffice at normal incidence. No limit
/// suffices around the direction opposite to the outgoing direction: a whole ring of half vectors mirrors to it, and light
/// there turns as fast as half vectors turn about the rim. With this limit, the light of a single direction is right to 1e-6 of
/// its norm up to 120 degrees from the outgoing direction, and to 1e-3 up to 150 degrees (orders 20 to 60). With twice the
/// limit it is right to 1e-6 up to 140 degrees (order 30). Facets that mirror by more degrees have wo . h below 0.35.
constexpr int lightBandLimit(int order) { return std::max(3 * order + 24, std::min(6 * order + 24, 204)); }

/// Weight of band l of an environment: 1 up to half of the band limit, then falling smoothly to 0.
double lightTaper(int l, int band_limit);

/// Matrix T(l', l) of one m that maps coefficients of light, as a function of its direction, to coefficients of light as a
/// function of the half vector, for an outgoing direction of +z:
///   T(l', l) = 2 pi integral over t = cos(theta_h) in [0, 1] of P_l'^m(t) P_l^m(2 t^2 - 1) 4 t dt,
/// since the mirrored direction has the azimuth of the half vector and twice its polar angle, and 4 (wo . h) dh = dwi. The
/// quadrature is exact.
/// @return [order - m + 1][band_limit - m + 1], row by row
std::vector<double> halfVectorTransfer(int m, int order, int band_limit);

/// Builds the table of light coefficients for every outgoing direction of a grid (Gamboa 2018, section 6.4). The harmonics of
/// the environment are turned to each outgoing direction and mapped to half vectors, both by exact matrices.
/// O(directions * order * band_limit^2). The result does not depend on the number of threads.
/// @throws Error usage if an option is out of range; failed if the table and what it is made with are larger than max_bytes;
///         invalid_input if requireUsable throws
ShLightData buildShLight(const Environment& environment, const ShLightOptions& options, const ProgressFn& progress = {});

}  // namespace glint::bake
