#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "glint/bake/common/seen_error.h"
#include "glint/bake/synth/synth.h"
#include "glint/bake/wave/compress_wave.h"
#include "glint/bake/wave/wave_pyramid.h"
#include "glint/query/anisotropic_ndf.h"
#include "glint/query/wave_cp_ndf.h"
#include "glint/query/wave_ndf.h"

namespace glint::wave_cp_test {
namespace {

constexpr int kSize = 96, kResolution = 64;
constexpr double kTolerance = 0.1;

/// A small rough surface, its images under wave optics, and the same compressed.
struct Surface {
  explicit Surface(bool spectral) {
    bake::SynthOptions synth = bake::defaultSynthOptions(bake::SynthKind::isotropic);
    synth.width = synth.height = kSize;
    synth.correlation_texels = 8;
    synth.alpha = 0.1f;
    bake::WaveOptions options;
    options.stride = 16;
    options.resolution = kResolution;
    options.coherence_um = 4;
    options.wavelengths_um = {0.42f, 0.48f, 0.55f, 0.62f, 0.7f};
    options.spectral = spectral;
    pyramid = bake::buildWavePyramid({kSize, kSize, 1, bake::synthHeights(synth)}, options);
    bake::CompressionOptions compression;
    compression.tolerance = kTolerance;
    compressed = bake::compressWavePyramid(pyramid.view(), compression, &report);
  }

  bake::WavePyramidData pyramid;
  bake::WaveCpData compressed;
  bake::CompressionReport report;
};

const Surface& surface(bool spectral = false) {
  static const Surface colours(false), wavelengths(true);
  return spectral ? wavelengths : colours;
}

/// The images of a model of constant pixels: grey, and then each channel.
template <class Model>
std::vector<std::vector<float>> imagesOf(const Model& model, const Footprint& p) {
  const int channels = model.channels();
  std::vector<std::vector<float>> images(static_cast<std::size_t>(channels) + 1);
  std::vector<float> spectrum(static_cast<std::size_t>(channels));
  for (int y = 0; y < kResolution; ++y)
    for (int x = 0; x < kResolution; ++x) {
      const Vec2 psi = {(static_cast<float>(x) + 0.5f) * 2 / kResolution - 1,
                        (static_cast<float>(y) + 0.5f) * 2 / kResolution - 1};
      images[0].push_back(model.density(p, psi));
      model.densitySpectrum(p, psi, spectrum.data());
      for (int c = 0; c < channels; ++c)
        images[static_cast<std::size_t>(c) + 1].push_back(spectrum[static_cast<std::size_t>(c)]);
    }
  return images;
}

double integralOf(const std::vector<float>& image) {
  double sum = 0;
  for (const float density : image) sum += double{density};
  return sum * 4 / (kResolution * kResolution);
}

std::vector<Footprint> someFootprints(int count, float smallest, float largest) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<Footprint> footprints;
  for (int k = 0; k < count; ++k) {
    const Vec2 centre = {unit(random), unit(random)};
    footprints.push_back(Footprint::isotropic(centre, smallest + (largest - smallest) * unit(random)));
  }
  return footprints;
}

TEST(WaveCp, IsSeenAsThePyramidInAllChannels) {
  // Between centres and levels errors of several images average, so that answers err by less than the images do.
  constexpr double kGrey = 1.0 * kTolerance, kChannel = 1.5 * kTolerance, kLight = 0.02;
  for (const bool spectral : {false, true}) {
    const WavePyramid wave = surface(spectral).pyramid.view();
    const WaveNdf truth(wave, Interpolation::footprint, Pixels::constant);
    const WaveCpNdf model(surface(spectral).compressed.view(), Interpolation::footprint, Pixels::constant);
    const auto channels = static_cast<std::size_t>(wave.channels);
    bake::SeenError all(kResolution);
    std::vector<bake::SeenError> each(channels + 1, bake::SeenError(kResolution));
    for (const Footprint& p : someFootprints(6, 7, 30)) {
      const auto expected = imagesOf(truth, p), found = imagesOf(model, p);
      for (std::size_t c = 0; c <= channels; ++c) {
        each[c].add(found[c].data(), expected[c].data());
        if (c > 0) all.add(found[c].data(), expected[c].data());
        EXPECT_NEAR(integralOf(found[c]), integralOf(expected[c]), kLight) << "channel " << c;
      }
    }
    EXPECT_LT(all.summary().seen, kTolerance);
    EXPECT_GT(all.summary().seen, 0.01 * kTolerance);  // something is lost
    EXPECT_LT(each[0].summary().seen, kGrey);
    for (std::size_t c = 1; c <= channels; ++c) EXPECT_LT(each[c].summary().seen, kChannel) << "channel " << c;
  }
}

TEST(WaveCp, ReportsTheSeenErrorOfAllChannelsWithinTheTolerance) {
  const Surface& s = surface();
  EXPECT_LE(s.report.total.seen.seen, kTolerance);
  EXPECT_EQ(s.report.levels.size(), static_cast<std::size_t>(s.pyramid.grey.shape.level_count));
  EXPECT_GT(s.report.ratio_to_stored, 2);
  EXPECT_EQ(s.report.unscaled_images, 0u);
  // The errors of level 0 at the centres of its images, where the model reads one image.
  const WaveNdf truth(s.pyramid.view(), Interpolation::trilinear, Pixels::constant);
  const WaveCpNdf model(s.compressed.view(), Interpolation::trilinear, Pixels::constant);
  const PyramidShape& shape = truth.shape();
  bake::SeenError error(kResolution);
  for (int j = 0; j < shape.levels[0].rows; ++j)
    for (int i = 0; i < shape.levels[0].columns; ++i) {
      const Vec2 texels = shape.centre(0, i, j);
      const Footprint p = Footprint::isotropic({texels.x / kSize, texels.y / kSize}, finestSigma(shape));
      const auto expected = imagesOf(truth, p), found = imagesOf(model, p);
      for (std::size_t c = 1; c < found.size(); ++c) error.add(found[c].data(), expected[c].data());
    }
  constexpr double kRounding = 0.02;  // positions between centres are floats
  EXPECT_NEAR(error.summary().seen, s.report.levels[0].seen.seen, kRounding * s.report.levels[0].seen.seen);
}

TEST(WaveCp, GreyIsTheMeanOfTheChannels) {
  const WaveCpNdf round(surface().compressed.view(), Interpolation::footprint, Pixels::constant);
  const AnisotropicNdf<WaveCpNdf> model(round);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> component(-0.25f, 0.25f);
  float spectrum[3];
  for (Footprint p : someFootprints(40, 7, 30)) {
    p.covariance.xx *= 3, p.covariance.xy = 0.4f * p.covariance.yy;
    const Vec2 psi = {component(random), component(random)};
    model.densitySpectrum(p, psi, spectrum);
    const float grey = model.density(p, psi);
    EXPECT_NEAR(grey, (spectrum[0] + spectrum[1] + spectrum[2]) / 3, 1e-5f * grey);
    EXPECT_NEAR(model.pixelMean(p, psi), grey, 1e-5f * grey);
    Rgb expected;
    for (std::size_t c = 0; c < 3; ++c) expected = expected + spectrum[c] * round.waveCp().channel_rgb[c];
    const Rgb rgb = model.densityRgb(p, psi);
    EXPECT_NEAR(rgb.r, expected.r, 1e-5f * (grey + 1));
    EXPECT_NEAR(rgb.b, expected.b, 1e-5f * (grey + 1));
  }
  EXPECT_EQ(model.density({}, {1.01f, 0}), 0);
  EXPECT_EQ(model.densityRgb({}, {NAN, 0}), Rgb{});
  EXPECT_EQ(model.sample(Footprint::isotropic({NAN, 0}, 9), {NAN, 2}).pdf > 0, true);
}

/// The means of boxes are those of the images, and all of the square is the light.
TEST(WaveCp, MeansAreThoseOfTheImages) {
  const WaveCpNdf model(surface().compressed.view());
  for (const Footprint& p : someFootprints(5, 7, 30)) {
    EXPECT_NEAR(4 * model.mean(p, {{-1, -1}, {1, 1}}), 1, 2e-3f);
    const WaveNdf truth(surface().pyramid.view());
    const Box2 box = {{-0.1f, -0.05f}, {0.15f, 0.2f}};
    EXPECT_NEAR(model.mean(p, box), truth.mean(p, box), 0.1f * truth.mean(p, box));
  }
  EXPECT_EQ(model.mean({}, {{0.1f, 0}, {0.1f, 1}}), 0);
}

TEST(WaveCp, SamplesFollowTheDensity) {
  constexpr int kSamples = 15000, kCells = 16, kPixels = kResolution / kCells;
  for (const Pixels pixels : {Pixels::smooth, Pixels::constant}) {
    const WaveCpNdf model(surface().compressed.view(), Interpolation::footprint, pixels);
    const Footprint p = Footprint::isotropic({0.3f, 0.7f}, 10);
    std::vector<double> expected(kCells * kCells), counts(kCells * kCells);
    for (int y = 0; y < kResolution; ++y)
      for (int x = 0; x < kResolution; ++x) {
        const Vec2 psi = {(static_cast<float>(x) + 0.5f) * 2 / kResolution - 1,
                          (static_cast<float>(y) + 0.5f) * 2 / kResolution - 1};
        expected[static_cast<std::size_t>(y / kPixels * kCells + x / kPixels)] +=
            double{model.pixelMean(p, psi)} * 4 / (kResolution * kResolution) * kSamples;
      }
    std::mt19937 random(8);
    std::uniform_real_distribution<float> unit(0, 1);
    for (int k = 0; k < kSamples; ++k) {
      const HalfVectorSample drawn = model.sample(p, {unit(random), unit(random)});
      ASSERT_GT(drawn.pdf, 0);
      ASSERT_NEAR(drawn.pdf, model.density(p, drawn.h), 1e-4f * drawn.pdf);
      const auto cell = [](float x) { return std::clamp(static_cast<int>((x + 1) * 0.5f * kCells), 0, kCells - 1); };
      counts[static_cast<std::size_t>(cell(drawn.h.y) * kCells + cell(drawn.h.x))] += 1;
    }
    double chi_squared = 0;
    int cells = 0;
    for (std::size_t k = 0; k < counts.size(); ++k) {
      if (expected[k] < 20) continue;  // too few for a normal deviation
      chi_squared += (counts[k] - expected[k]) * (counts[k] - expected[k]) / expected[k];
      ++cells;
    }
    ASSERT_GT(cells, 5);
    EXPECT_LT(chi_squared, cells + 5 * std::sqrt(2.0 * cells));  // five deviations
  }
}

TEST(WaveCp, SharesOfColumnsDoNotChangeAnswers) {
  // Channels that are asked together share the values of columns. Three times the same channel has the bits of the channel.
  const WaveCp wave = surface().compressed.view();
  const WaveCpNdf model(wave);
  float spectrum[3];
  for (const Footprint& p : someFootprints(5, 7, 30))
    for (const Vec2 psi : {Vec2{0.01f, 0.02f}, Vec2{-0.03f, 0.004f}}) {
      model.densitySpectrum(p, psi, spectrum);
      for (int c = 0; c < 3; ++c) {
        WaveCp one = wave;  // three times the same channel
        one.images.first_image[0] = 0;
        std::vector<std::uint16_t> regions, slots;
        std::vector<float> scales, density_scales;
        for (int l = 0; l < wave.shape.level_count; ++l) {
          const std::size_t images = wave.shape.levels[l].imageCount();
          for (int copy = 0; copy < 3; ++copy)
            for (std::size_t k = 0; k < images; ++k) {
              const std::size_t from = wave.images.first_image[l] + static_cast<std::size_t>(c) * images + k;
              regions.push_back(wave.images.image_regions[from]);
              slots.push_back(wave.images.image_slots[from]);
              scales.push_back(wave.images.image_scales[from]);
              density_scales.push_back(wave.images.density_scales[from]);
            }
        }
        one.images.image_regions = regions, one.images.image_slots = slots;
        one.images.image_scales = scales, one.images.density_scales = density_scales;
        float same[3];
        WaveCpNdf(one).densitySpectrum(p, psi, same);
        EXPECT_EQ(same[0], spectrum[c]);
        EXPECT_EQ(same[2], spectrum[c]);
        EXPECT_NEAR(WaveCpNdf(one).density(p, psi), spectrum[c], 1e-5f * spectrum[c]);
      }
    }
}

TEST(WaveCp, HasTheSameBytesOnAnyNumberOfThreads) {
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  bake::CompressionOptions options;
  options.tolerance = kTolerance;
  const bake::WaveCpData single = bake::compressWavePyramid(surface().pyramid.view(), options);
  EXPECT_EQ(single.images.coefficients, surface().compressed.images.coefficients);
  EXPECT_EQ(single.images.basis, surface().compressed.images.basis);
}

}  // namespace
}  // namespace glint::wave_cp_test
