#pragma once

#include <algorithm>

#include "glint/model/wave_pyramid.h"
#include "glint/query/detail/wave/channel_window.h"
#include "glint/query/pyramid_ndf.h"

namespace glint {

/// The distribution of psi = ((wi + wo) / 2)_xy of a height field under wave optics, from a pyramid of images (Deng 2022, Eq. 3, 4).
///
/// As a model of the NDF it answers the mean of its channels, from which psi is drawn: half vectors of the questions are points psi.
/// `densityRgb` and `densitySpectrum` answer the channels. For wi and wo near the normal psi is the half vector. WaveBrdf asks with
/// the right psi for all directions. Footprints are answered as by PyramidNdf; below level 0 always by level 0, since a texel
/// without its neighbours has no diffraction.
/// Thread-safe, allocates nothing; the arrays must outlive it.
class WaveNdf {
 public:
  GLINT_HD explicit WaveNdf(const WavePyramid& wave, Interpolation interpolation = Interpolation::footprint,
                            Pixels pixels = Pixels::smooth)
      : wave_(wave), grey_(wave.grey, interpolation, pixels) {}

  GLINT_HD const WavePyramid& wavePyramid() const { return wave_; }
  GLINT_HD const PyramidNdf& grey() const { return grey_; }
  GLINT_HD const PyramidShape& shape() const { return wave_.grey.shape; }
  GLINT_HD int channels() const { return wave_.channels; }
  /// False: footprints below level 0 are answered from level 0.
  GLINT_HD bool hasNormals() const { return false; }
  GLINT_HD float smallestSigma() const { return grey_.smallestSigma(); }

  /// Mean of the channels towards psi, >= 0; as PyramidNdf::density.
  GLINT_HD float density(const Footprint& p, Vec2 psi) const { return grey_.density(p, psi); }
  /// Mean of the channels over the pixel of the images that holds psi.
  GLINT_HD float pixelMean(const Footprint& p, Vec2 psi) const { return grey_.pixelMean(p, psi); }
  /// Mean of the channels over a box.
  GLINT_HD float mean(const Footprint& p, const Box2& range) const { return grey_.mean(p, range); }
  /// Draws psi in proportion to the mean of the channels; the pdf is `density`.
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const { return grey_.sample(p, xi); }

  /// Density of each channel towards psi, >= 0. O(channels).
  /// @param out  [channels()]
  GLINT_HD void densitySpectrum(const Footprint& p, Vec2 psi, float* out) const {
    forEachChannel(p, psi, [&](int c, float density) { out[c] = density; });
  }

  /// Density in linear sRGB under D65, in which a flat mirror is white (1, 1, 1). Channels may be below 0: colours of few
  /// wavelengths lie outside the gamut.
  GLINT_HD Rgb densityRgb(const Footprint& p, Vec2 psi) const {
    Rgb sum;
    forEachChannel(p, psi, [&](int c, float density) { sum = sum + density * wave_.channel_rgb.data()[c]; });
    return sum;
  }

  /// Calls visitor(c, density) for each channel, in order. O(channels).
  template <class Visitor>
  GLINT_HD void forEachChannel(const Footprint& p, Vec2 psi, Visitor&& visitor) const {
    constexpr int kMost = ChannelReader::kMost;
    if (!insideSquare(psi)) {
      for (int c = 0; c < wave_.channels; ++c) visitor(c, 0.0f);
      return;
    }
    const PyramidSlices chosen = grey_.chooser().choose(p);
    const PixelPlace place = pixelPlace(shape(), psi);
    const ChannelReader reader(wave_, chosen);
    for (int first = 0; first < wave_.channels; first += kMost) {
      const int count = std::min(wave_.channels - first, int{kMost});
      PixelWindow windows[kMost];
      reader.read(place, first, count, windows);
      for (int c = 0; c < count; ++c)
        visitor(first + c, grey_.pixels() == Pixels::constant ? finitePositive(windows[c].centre())
                                                              : splineDensity(shape(), windows[c], psi));
    }
  }

 private:
  WavePyramid wave_;
  PyramidNdf grey_;
};

static_assert(NdfModel<WaveNdf>);

}  // namespace glint
