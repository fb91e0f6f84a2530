#pragma once

#include <cstdint>
#include <span>

#include "glint/math/rgb.h"
#include "glint/model/ndf_pyramid.h"

namespace glint {

/// Most channels of a wave pyramid, and most wavelengths that it is made of.
inline constexpr int kMostWaveChannels = 64;

/// What the channels of a wave pyramid are.
enum class WaveChannels : std::uint8_t {
  xyz,       ///< three: CIE 1931 X, Y, Z under D65, each divided by that of a flat mirror
  spectral,  ///< one for each wavelength
};

/// NDF images of a height field under wave optics, at every footprint size (Deng 2022, Eq. 3 and 4).
///
/// Images are indexed by psi = ((wi + wo) / 2)_xy and not by the half vector; psi = (wi.h) h_xy. Each channel of an image of a flat
/// surface integrates to 1 over psi. Channels are stored, and not red, green and blue, because these are negative where a colour
/// is outside their gamut.
struct WavePyramid {
  /// The mean of the channels. sigma_r of its shape is the deviation of the spot of a flat surface, at the mean wavelength.
  NdfPyramid grey;
  WaveChannels meaning = WaveChannels::xyz;
  int channels = 3;                            ///< 3 with xyz, else the number of wavelengths; at most kMostWaveChannels
  float texel_size_um = 0;                     ///< of the height field, > 0
  float coherence_um = 0;                      ///< sigma_c: deviation of the coherence area
  std::span<const float> wavelengths_um;       ///< rising
  std::span<const Rgb> channel_rgb;            ///< [channels]: linear sRGB of a density of 1 in one channel; they sum to white
  const void* pixels[kMaxPyramidLevels] = {};  ///< [blocks][16 rows][channels][16] of each level, of the blocks of `grey`
};

}  // namespace glint
