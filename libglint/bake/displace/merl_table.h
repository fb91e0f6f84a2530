#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "glint/model/error.h"

namespace glint::bake {

/// An isotropic BRDF in the form of the MERL database (Matusik et al. 2003): one value for each bin of half angle, difference
/// angle and azimuth of the difference, in red, green and blue.
///
/// Bin k of n half angles ends at (pi / 2) ((k + 1) / n)^2, bins of difference angles divide pi / 2 evenly, and those of the
/// azimuth divide pi: exchanging the directions adds pi to it.
struct MerlTable {
  int half_bins = 0;
  int difference_bins = 0;
  int azimuth_bins = 0;
  std::vector<float> values;   ///< [3][half_bins][difference_bins][azimuth_bins], 1 / sr, >= 0
  std::uint64_t negative = 0;  ///< values that were below 0, which marks bins without a measurement; they are 0 now

  /// The values at these angles, linear between the middles of bins.
  /// @param theta_half, theta_difference  0 to pi / 2; others count as the nearest
  /// @param phi_difference                any; has a period of pi
  std::array<float, 3> at(double theta_half, double theta_difference, double phi_difference) const;
};

/// Sizes along an axis that a table may have. MERL's are 90, 90 and 180.
inline constexpr int kLeastMerlBins = 2, kMostMerlBins = 1024;

/// Checks the size of a file in MERL's form, before it is read.
/// @param head        the first bytes of the file, 12 if it has as many: three 32-bit integers, in the order of MerlTable's values
/// @param file_bytes  its size
/// @throws Error invalid_input, rule merl.size: too few or too many bytes for the numbers of bins, or numbers of bins outside
///         kLeastMerlBins to kMostMerlBins
void checkMerlSize(std::span<const std::byte> head, std::uint64_t file_bytes);

/// Reads a file in MERL's form: three 32-bit integers, then doubles: a plane for each of red, green and blue, which 1 / 1500,
/// 1.15 / 1500 and 1.66 / 1500 turn into 1 / sr. All little-endian.
/// @throws Error invalid_input: as checkMerlSize; merl.values: values that are not
///         finite or above 1e6 / sr (names the first of them), or no value above 0
/// @note memory: half the bytes again
MerlTable readMerl(std::span<const std::byte> bytes);

}  // namespace glint::bake
