#pragma once

// Private to formats/: what kinds of images under wave optics share.

#include "glint/formats/kinds/shared_fields.h"
#include "glint/model/wave_cp.h"

namespace glint::formats {

/// Attributes and arrays of channels.
void describeChannels(Fields auto& fields, auto& wave) {
  fields.choice("channel_meaning", wave.meaning, "xyz|spectral", "what the channels are");
  fields.integer("channels", wave.channels, {1, kMostWaveChannels}, "1", "number of channels");
  fields.real("texel_size_um", wave.texel_size_um, kPositive, "um", "width of a texel of the height field");
  fields.real("coherence_um", wave.coherence_um, kPositive, "um", "deviation of the coherence area");
  fields.array("wavelengths_um", wave.wavelengths_um, {"wavelength_count"}, "um", "wavelengths, rising");
  fields.array("channel_rgb", wave.channel_rgb, {"channels", "3"}, "1",
               "linear red, green and blue (sRGB, D65) of a density of 1 in each channel");
}

/// Rules wave.channels, wave.wavelengths and wave.colours.
void checkChannels(WaveChannels meaning, int channels, std::span<const float> wavelengths_um, std::span<const Rgb> channel_rgb,
                   Findings& findings);

}  // namespace glint::formats
