#pragma once

#include "glint/model/ndf_cp.h"
#include "glint/model/wave_pyramid.h"

namespace glint {

/// A compressed WavePyramid (asset kind `wave-cp`): the images of all channels, with bases that the channels share.
///
/// `images` has `channels` times the images of a level: image (i, j) of channel c is in column i and row c rows + j of the level,
/// rows being those of `shape`. Each image of a channel integrates to 1 over psi.
struct WaveCp {
  PyramidShape shape;  ///< of one channel
  WaveChannels meaning = WaveChannels::xyz;
  int channels = 3;                       ///< as WavePyramid::channels
  float texel_size_um = 0;                ///< of the height field, > 0
  float coherence_um = 0;                 ///< sigma_c: deviation of the coherence area
  std::span<const float> wavelengths_um;  ///< rising
  std::span<const Rgb> channel_rgb;       ///< [channels]: linear sRGB of a density of 1 in one channel; they sum to white
  NdfCp images;                           ///< its shape is channelShape(shape, channels)
};

/// The shape of the images of all channels: the rows of the channels lie above each other.
constexpr PyramidShape channelShape(const PyramidShape& shape, int channels) {
  PyramidShape all = shape;
  for (int l = 0; l < shape.level_count; ++l) all.levels[l].rows *= channels;
  return all;
}

}  // namespace glint
