#pragma once

#include <optional>
#include <string>

#include "glint/math/vec.h"
#include "glint/model/footprint.h"

namespace glint::apps {

/// Range of the larger deviation of a footprint, texels. The smaller one may be less, down to 0, and counts as the narrowest.
inline constexpr double kLeastSigma = 1e-6, kMostSigma = 1e9;

/// Why a footprint cannot be asked for.
struct FootprintFault {
  std::string what;    ///< a clause that begins with the values
  std::string remedy;  ///< what to give instead
};

/// Checks a footprint of an option or of a row of a table. Its larger deviation is kLeastSigma to kMostSigma. A covariance is
/// positive semidefinite, up to rounding. A box has an area.
/// @return the fault; none if the footprint can be asked for
std::optional<FootprintFault> footprintFault(const Footprint& footprint);

/// Checks the deviation of an isotropic footprint. Footprint::isotropic squares it, and so would hide its sign.
std::optional<FootprintFault> sigmaFault(float sigma_texels);

/// Checks a box of half vectors that a mean is taken over: it has an area.
std::optional<FootprintFault> rangeFault(const Box2& range);

/// Largest half width of the box of half vectors that a pixel sees.
inline constexpr double kMostSpread = 0.5;
/// Checks half widths of a box of half vectors: each is 0 to kMostSpread.
std::optional<FootprintFault> spreadFault(Vec2 spread);

}  // namespace glint::apps
