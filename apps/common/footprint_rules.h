#pragma once

#include <optional>
#include <string>

#include "glint/math/vec.h"
#include "glint/model/footprint.h"

namespace glint::apps {

/// Deviations of a footprint that can be asked for, texels. A width may be less, down to none, and counts as the narrowest.
inline constexpr double kLeastSigma = 1e-6, kMostSigma = 1e9;

/// Why a footprint cannot be asked for.
struct FootprintFault {
  std::string what;    ///< a clause that begins with the values
  std::string remedy;  ///< what to give instead
};

/// The rules that footprints of options and of rows of tables share. A footprint has a size: its larger deviation is kLeastSigma
/// to kMostSigma. Variances are those of a distribution, up to rounding. A box has an area.
/// @return the fault; none if the footprint can be asked for
std::optional<FootprintFault> footprintFault(const Footprint& footprint);

/// The same of an isotropic footprint. Footprint::isotropic would hide the sign.
std::optional<FootprintFault> sigmaFault(float sigma_texels);

/// The same of a box of half vectors that a mean is asked over: it has an area.
std::optional<FootprintFault> rangeFault(const Box2& range);

}  // namespace glint::apps
