#pragma once

#include <array>
#include <span>
#include <vector>

#include "glint/math/rgb.h"

namespace glint::bake {

/// The visible range, um.
inline constexpr float kShortestVisibleUm = 0.36f, kLongestVisibleUm = 0.83f;

/// Wavelengths in the middle of `count` equal parts of the visible range, um, rising.
std::vector<float> evenWavelengths(int count);

/// How much each of a few wavelengths counts in CIE X, Y and Z under D65.
///
/// A spectrum is read as linear between its wavelengths and constant beyond them, times D65 and the CIE 1931 functions (fits of
/// Wyman, Sloan and Shirley 2013). The weights of X sum to 1, so those of Y and of Z: a flat mirror, which reflects all
/// wavelengths alike, has X = Y = Z = 1.
/// @param wavelengths_um  rising, at least one in the visible range where there is more than one
/// @return [wavelengths]: weights in X, Y and Z. One wavelength: 1 each
std::vector<std::array<float, 3>> xyzWeights(std::span<const float> wavelengths_um);

/// Linear sRGB of X, Y and Z, each 1 for white: the columns, which sum to (1, 1, 1).
std::array<Rgb, 3> rgbOfXyz();

}  // namespace glint::bake
