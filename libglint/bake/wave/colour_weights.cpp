#include "glint/bake/wave/colour_weights.h"

#include <algorithm>
#include <cmath>

namespace glint::bake {
namespace {

/// One lobe of a fit: a Gaussian with another deviation on either side of its peak.
struct Lobe {
  double height, peak_nm, below_nm, above_nm;
  double at(double nm) const {
    const double t = (nm - peak_nm) / (nm < peak_nm ? below_nm : above_nm);
    return height * std::exp(-0.5 * t * t);
  }
};

/// CIE 1931 colour matching functions (Wyman, Sloan and Shirley 2013, "Simple Analytic Approximations to the CIE XYZ Color
/// Matching Functions", multi-lobe fits).
std::array<double, 3> matching(double nm) {
  constexpr Lobe kX[] = {{1.056, 599.8, 37.9, 31.0}, {0.362, 442.0, 16.0, 26.7}, {-0.065, 501.1, 20.4, 26.2}};
  constexpr Lobe kY[] = {{0.821, 568.8, 46.9, 40.5}, {0.286, 530.9, 16.3, 31.1}};
  constexpr Lobe kZ[] = {{1.217, 437.0, 11.8, 36.0}, {0.681, 459.0, 26.0, 13.8}};
  std::array<double, 3> xyz = {};
  for (const Lobe& lobe : kX) xyz[0] += lobe.at(nm);
  for (const Lobe& lobe : kY) xyz[1] += lobe.at(nm);
  for (const Lobe& lobe : kZ) xyz[2] += lobe.at(nm);
  for (double& value : xyz) value = std::max(value, 0.0);  // the negative lobe of X reaches a little below 0
  return xyz;
}

constexpr double kFirstNm = 360, kLastNm = 830, kTableStepNm = 10;
/// CIE standard illuminant D65, relative power from kFirstNm to kLastNm.
constexpr double kD65[] = {46.6383, 52.0891, 49.9755, 54.6482, 82.7549, 91.4860, 93.4318, 86.6823, 104.865, 117.008,
                           117.812, 114.861, 115.923, 108.811, 109.354, 107.802, 104.790, 107.689, 104.405, 104.046,
                           100.000, 96.3342, 95.7880, 88.6856, 90.0062, 89.5991, 87.6987, 83.2886, 83.6992, 80.0268,
                           80.2146, 82.2778, 78.2842, 69.7213, 71.6091, 74.3490, 61.6040, 69.8856, 75.0870, 63.5927,
                           46.4182, 66.8054, 63.3828, 64.3040, 59.4519, 51.9590, 57.4406, 60.3125};

double daylight(double nm) {
  const double x = std::clamp((nm - kFirstNm) / kTableStepNm, 0.0, double{std::size(kD65) - 1});
  const auto k = std::min(static_cast<std::size_t>(x), std::size(kD65) - 2);
  const double t = x - static_cast<double>(k);
  return (1 - t) * kD65[k] + t * kD65[k + 1];
}

}  // namespace

std::vector<float> evenWavelengths(int count) {
  std::vector<float> wavelengths;
  for (int k = 0; k < count; ++k)
    wavelengths.push_back(kShortestVisibleUm + (kLongestVisibleUm - kShortestVisibleUm) * (static_cast<float>(k) + 0.5f) /
                                                   static_cast<float>(count));
  return wavelengths;
}

std::vector<std::array<float, 3>> xyzWeights(std::span<const float> wavelengths_um) {
  const std::size_t count = wavelengths_um.size();
  if (count == 1) return {{1, 1, 1}};
  std::vector<std::array<double, 3>> weights(count, {0, 0, 0});
  std::array<double, 3> sums = {};
  constexpr double kStepNm = 1;
  for (double nm = kFirstNm; nm <= kLastNm; nm += kStepNm) {
    // The two wavelengths around this one, and the share of the second.
    const auto above = std::upper_bound(wavelengths_um.begin(), wavelengths_um.end(), 1e-3 * nm) - wavelengths_um.begin();
    const auto next = std::clamp<std::ptrdiff_t>(above, 1, static_cast<std::ptrdiff_t>(count) - 1);
    const double low = wavelengths_um[next - 1], high = wavelengths_um[next];
    const double t = std::clamp((1e-3 * nm - low) / (high - low), 0.0, 1.0);
    const std::array<double, 3> here = matching(nm);
    for (int c = 0; c < 3; ++c) {
      const double power = here[c] * daylight(nm);
      weights[next - 1][c] += (1 - t) * power;
      weights[next][c] += t * power;
      sums[c] += power;
    }
  }
  std::vector<std::array<float, 3>> shares(count);
  for (std::size_t k = 0; k < count; ++k)
    for (int c = 0; c < 3; ++c) shares[k][c] = static_cast<float>(weights[k][c] / sums[c]);
  return shares;
}

std::array<Rgb, 3> rgbOfXyz() {
  // IEC 61966-2-1: linear sRGB of X, Y, Z, each column times the X, Y or Z of D65.
  constexpr float kX = 0.95047f, kZ = 1.08883f;
  return {{{3.2404542f * kX, -0.9692660f * kX, 0.0556434f * kX},
           {-1.5371385f, 1.8760108f, -0.2040259f},
           {-0.4985314f * kZ, 0.0415560f * kZ, 1.0572252f * kZ}}};
}

}  // namespace glint::bake
