#pragma once

#include <vector>

namespace glint::bake {

/// Errors of an NDF image against the truth.
struct ImageErrors {
  double rel_l2 = 0;  ///< |D' - D| / |D|, over pixels
  double tv = 0;      ///< total variation: half the integral of |D' - D|
  double energy = 0;  ///< integral of D', minus 1
};

/// @param image, truth  [resolution][resolution] pixel means over [-1, 1]^2
ImageErrors imageErrors(const std::vector<float>& image, const std::vector<float>& truth, int resolution);

}  // namespace glint::bake
