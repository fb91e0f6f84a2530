#pragma once

#include <algorithm>
#include <cmath>

#include "glint/model/wave_cp.h"
#include "glint/query/cp_ndf.h"

namespace glint {

/// The distribution of psi of a height field under wave optics, from compressed images (Deng 2022, sections 4.2 to 4.4 and 5.6).
///
/// Answers what WaveNdf answers, of images as CpNdf has them: a channel is decompressed as an NDF is, so no channel is negative. The
/// grey density is the mean of the channels. It costs as much as the colour, since no sum of channels is stored.
/// Thread-safe, allocates nothing; the arrays must outlive it.
class WaveCpNdf {
 public:
  GLINT_HD explicit WaveCpNdf(const WaveCp& wave, Interpolation interpolation = Interpolation::footprint,
                              Pixels pixels = Pixels::smooth)
      : wave_(wave), images_(wave.images, interpolation, pixels), chooser_(wave.shape, interpolation) {}

  GLINT_HD const WaveCp& waveCp() const { return wave_; }
  /// Of one channel.
  GLINT_HD const PyramidShape& shape() const { return wave_.shape; }
  GLINT_HD int channels() const { return wave_.channels; }
  /// False: footprints below level 0 are answered from level 0.
  GLINT_HD bool hasNormals() const { return false; }
  GLINT_HD float smallestSigma() const { return std::sqrt(smallestSeenVariance(shape())); }

  /// Mean of the channels towards psi, >= 0; O(channels columns) in each image.
  GLINT_HD float density(const Footprint& p, Vec2 psi) const {
    if (!insideSquare(psi)) return 0;
    const PyramidSlices chosen = chooser_.choose(p);
    const PixelPlace place = pixelPlace(shape(), psi);
    if (images_.pixels() == Pixels::constant) return greyMean(chosen, place);
    return splineDensity(shape(), greyWindow(chosen, place), psi);
  }
  /// Mean of the channels over the pixel of the images that holds psi.
  GLINT_HD float pixelMean(const Footprint& p, Vec2 psi) const {
    return insideSquare(psi) ? greyMean(chooser_.choose(p), pixelPlace(shape(), psi)) : 0.0f;
  }
  /// Mean of the channels over a box, >= 0; as CpNdf::mean.
  GLINT_HD float mean(const Footprint& p, const Box2& range) const {
    if (!(range.width() > 0 && range.height() > 0)) return 0;
    const PyramidSlices chosen = chooser_.choose(p);
    double sum = 0;
    for (int c = 0; c < channels(); ++c) sum += double{images_.signedImageMean(imagesOf(c, chosen), range, images_.pixels())};
    return finitePositive(static_cast<float>(sum / channels()));
  }

  /// Draws a channel by the light that it has, and from it as CpNdf does. The pdf is `density`.
  GLINT_HD HalfVectorSample sample(const Footprint& p, Vec2 xi) const;

  /// Density of each channel towards psi, >= 0.
  /// @param out  [channels()]
  GLINT_HD void densitySpectrum(const Footprint& p, Vec2 psi, float* out) const {
    forEachChannel(p, psi, [&](int c, float density) { out[c] = density; });
  }
  /// Density in linear sRGB under D65; as WaveNdf::densityRgb.
  GLINT_HD Rgb densityRgb(const Footprint& p, Vec2 psi) const {
    Rgb sum;
    forEachChannel(p, psi, [&](int c, float density) { sum = sum + density * wave_.channel_rgb.data()[c]; });
    return sum;
  }
  /// Calls visitor(c, density) for each channel, in order; O(channels columns) in each image.
  template <class Visitor>
  GLINT_HD void forEachChannel(const Footprint& p, Vec2 psi, Visitor&& visitor) const {
    if (!insideSquare(psi)) {
      for (int c = 0; c < channels(); ++c) visitor(c, 0.0f);
      return;
    }
    const PyramidSlices chosen = chooser_.choose(p);
    const PixelPlace place = pixelPlace(shape(), psi);
    if (images_.pixels() == Pixels::constant) {
      for (int c = 0; c < channels(); ++c) visitor(c, images_.imageMean(imagesOf(c, chosen), place));
      return;
    }
    for (int first = 0; first < channels(); first += kMost) {
      const int count = std::min(channels() - first, int{kMost});
      WindowRows windows[kMost];
      addWindows(chosen, place, first, count, windows);
      for (int c = 0; c < count; ++c) visitor(first + c, splineDensity(shape(), windows[c].pixels(), psi));
    }
  }

 private:
  /// Channels that are asked at once.
  static constexpr int kMost = CpNdf::kMostWindows;

  /// The images of a channel in the place of those of channel 0.
  GLINT_HD PyramidSlices imagesOf(int channel, const PyramidSlices& chosen) const {
    PyramidSlices out = chosen;
    for (int k = 0; k < chosen.count; ++k)
      out.images[k] +=
          static_cast<std::uint32_t>(channel) * static_cast<std::uint32_t>(shape().levels[chosen.level(k)].imageCount());
    return out;
  }

  /// Adds the pixels around a place in some channels.
  GLINT_HD void addWindows(const PyramidSlices& chosen, const PixelPlace& place, int first, int count,
                           WindowRows (&windows)[kMost]) const {
    const NdfCp& ndf = images_.ndfCp();
    withReader(ndf, [&](const auto& reader) {
      forEachBlockOfWindow(shape(), place, [&](int block, int x, int y) {
        SlicePlaces places[kMost];
        for (int c = 0; c < count; ++c) {
          places[c] = findSlices(ndf, imagesOf(first + c, chosen), block, ndf.density_scales.data());
          images_.prefetchRows(reader, places[c]);
        }
        images_.addWindows(reader, places, count, x, y, windows);
      });
    });
  }

  /// Means over the channels of the pixels around a place.
  GLINT_HD PixelWindow greyWindow(const PyramidSlices& chosen, const PixelPlace& place) const {
    WindowRows sum;
    for (int first = 0; first < channels(); first += kMost) {
      const int count = std::min(channels() - first, int{kMost});
      WindowRows windows[kMost];
      addWindows(chosen, place, first, count, windows);
      for (int c = 0; c < count; ++c)
        for (int y = 0; y < PixelWindow::kSize; ++y) sum.rows[y] = sum.rows[y] + windows[c].rows[y];
    }
    PixelWindow grey = sum.pixels();
    grey *= 1 / static_cast<float>(channels());
    return grey;
  }
  /// Mean over the channels of a pixel.
  GLINT_HD float greyMean(const PyramidSlices& chosen, const PixelPlace& place) const {
    float sum = 0;
    for (int c = 0; c < channels(); ++c) sum += images_.imageMean(imagesOf(c, chosen), place);
    return finitePositive(sum / static_cast<float>(channels()));
  }
  /// Light of the chosen images of a channel: the weights of those that have any density.
  GLINT_HD float lightOf(int channel, const PyramidSlices& chosen) const {
    const PyramidSlices images = imagesOf(channel, chosen);
    float sum = 0;
    for (int k = 0; k < images.count; ++k)
      if (images_.ndfCp().density_scales.data()[images_.imageOf(images[k])] > 0) sum += images.weights[k];
    return sum;
  }

  WaveCp wave_;
  CpNdf images_;  // its own choice of images is not asked: it has the rows of all channels
  SliceChooser chooser_;
};

inline GLINT_HD HalfVectorSample WaveCpNdf::sample(const Footprint& p, Vec2 xi) const {
  const PyramidSlices chosen = chooser_.choose(p);
  float total = 0;
  for (int c = 0; c < channels(); ++c) total += lightOf(c, chosen);
  Vec2 left = clampUnit(xi);
  const int channel = chooseIndex(
      channels(), total, [&](int c) { return lightOf(c, chosen); }, left.x);
  if (channel < 0) return {};
  CpNdf::Draw draw = images_.chooseImage(imagesOf(channel, chosen), left);
  images_.chooseBlock(draw);
  images_.findBlockSlice(draw);
  if (!draw.possible) return {};
  withReader(images_.ndfCp(), [&](const auto& reader) { images_.choosePixel(reader, draw); });
  if (draw.place.x < 0) return {};
  const float per_light = static_cast<float>(channels()) / total;
  if (images_.pixels() == Pixels::constant)
    return drawnAt(pointInPixel(shape(), draw.place, draw.xi), finitePositive(greyMean(chosen, draw.place) * per_light));
  PixelWindow pixels = greyWindow(chosen, draw.place);
  pixels *= per_light;
  return splineSample(shape(), draw.place, pixels, draw.xi);
}

static_assert(NdfModel<WaveCpNdf>);

}  // namespace glint
