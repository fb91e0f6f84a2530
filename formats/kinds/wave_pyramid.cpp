#include <cmath>

#include "glint/formats/kinds/description.h"
#include "glint/formats/kinds/pyramid_fields.h"
#include "glint/formats/kinds/tally.h"
#include "glint/formats/kinds/wave_fields.h"

namespace glint::formats {
namespace {

/// Both sides are rounded to half precision: 2^-11 relative each, 2^-25 near zero.
constexpr double kGreyTolerance = 2e-3, kGreyFloor = 0x1p-23;

std::string pixelsObject(int l) { return "/" + levelPath("level_{l}/channel_pixels", l); }

/// Checks the channels of one level, and that the pixels of `grey` are their means.
void checkLevel(const WavePyramid& wave, int l, Findings& findings) {
  const PyramidLevel& level = wave.grey.levels[l];
  const auto channels = static_cast<std::size_t>(wave.channels);
  Tally bad_pixels, bad_means;  // by block
  for (std::size_t k = 0; k < level.block_means.size() * kBlockPixels; ++k) {
    double sum = 0;
    bool bad = false;
    for (std::size_t c = 0; c < channels; ++c) {
      const float value =
          storedPixel(wave.pixels[l], wave.grey.precision, (k / kBlockSize * channels + c) * kBlockSize + k % kBlockSize);
      bad |= !(std::isfinite(value) && value >= 0);
      sum += value;
    }
    const double mean = sum / wave.channels, grey = storedPixel(level.pixels, wave.grey.precision, k);
    if (bad) bad_pixels.add(k / kBlockPixels);
    if (!bad && !(std::abs(mean - grey) <= kGreyTolerance * mean + kGreyFloor)) bad_means.add(k / kBlockPixels);
  }
  const auto image = [&](std::size_t block) { return imageOf(wave.grey, l, block); };
  report(bad_pixels, "wave.pixels", pixelsObject(l), {"pixel is", "pixels are"}, "negative or not finite", findings, image);
  report(bad_means, "wave.grey", pixelsObject(l), {"pixel has", "pixels have"}, "another mean than the pixel of `pixels`",
         findings, image);
}

}  // namespace

template <>
struct KindDescription<WavePyramid> {
  static constexpr std::string_view kTitle = "Pyramid of NDF images under wave optics";

  static std::vector<Rule> indexRules() {
    return {errorRule("wave.channels", "channels are 3 with xyz and the wavelengths with spectral, at most 64"),
            errorRule("wave.wavelengths", "wavelengths rise and are 0.01 to 10 um"),
            errorRule("wave.colours", "channel_rgb are within 100, and sum to white within 1e-3")};
  }
  static std::vector<Rule> valueRules() {
    return {errorRule("wave.pixels", "pixels of channels are finite and not negative"),
            errorRule("wave.grey", "pixels are the means of the pixels of the channels")};
  }

  static void describe(Fields auto& fields, auto& wave) {
    describePyramidAttributes(fields, wave.grey);
    describeChannels(fields, wave);
    describePyramidLevels(fields, wave.grey, [&](int l, std::uint64_t blocks) {
      fields.data("level_{l}/channel_pixels", wave.pixels[l], blocks * kBlockPixels * static_cast<std::uint64_t>(wave.channels),
                  {{"precision=f16", ElementType::f16}, {"precision=f32", ElementType::f32}},
                  {"stored_blocks", "16", "channels", "16"}, "1",
                  "mean density, divided by value_scale: of each row of each stored block, in each channel, of each pixel");
    });
  }

  static void checkIndex(const WavePyramid& wave, Findings& findings) {
    checkPyramidIndex(wave.grey, findings);
    checkChannels(wave.meaning, wave.channels, wave.wavelengths_um, wave.channel_rgb, findings);
  }

  static void checkValues(const WavePyramid& wave, Findings& findings) {
    checkPyramidValues(wave.grey, findings, true);
    for (int l = 0; l < wave.grey.shape.level_count; ++l) checkLevel(wave, l, findings);
  }
};

template const Kind& kindOf<WavePyramid>();

}  // namespace glint::formats
