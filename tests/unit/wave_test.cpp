#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "glint/bake/common/slopes.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/bake/synth/synth.h"
#include "glint/bake/wave/coherent_images.h"
#include "glint/bake/wave/colour_weights.h"
#include "glint/bake/wave/wave_pyramid.h"
#include "glint/model/error.h"
#include "glint/query/pyramid_ndf.h"
#include "support/wave_reference.h"

namespace glint::wave_test {
namespace {

constexpr double kPi = std::numbers::pi;

/// Heights in texels of a function in micrometres.
std::vector<float> heightsOf(int size, double texel_um, const test::HeightFunction& height) {
  std::vector<float> heights;
  for (int j = 0; j < size; ++j)
    for (int i = 0; i < size; ++i)
      heights.push_back(static_cast<float>(height((i + 0.5) * texel_um, (j + 0.5) * texel_um) / texel_um));
  return heights;
}

/// A coherent image at a place, by the transform.
struct Image {
  bake::WaveGrid grid;
  std::vector<float> pixels;

  float at(int x, int y) const { return pixels[static_cast<std::size_t>(y * grid.pixels() + x)]; }
  /// Lower border of a pixel, along either axis.
  double border(int pixel) const { return 2.0 * (pixel - grid.half_pixels) / grid.resolution; }
  double pixelSize() const { return 2.0 / grid.resolution; }
  double largest() const { return *std::max_element(pixels.begin(), pixels.end()); }
  double integral() const {
    double sum = 0;
    for (const float pixel : pixels) sum += pixel;
    return sum * pixelSize() * pixelSize();
  }
};

Image imageAt(const std::vector<float>& heights, int size, double texel_um, const bake::WaveGrid& grid, double x, double y) {
  const bake::HeightSpline spline({size, size, static_cast<float>(texel_um), heights});
  bake::PhaseRows rows(spline, texel_um, grid, x - 0.5 * grid.window_um() - grid.step_um, grid.size + 4);
  rows.compute(std::llround(y / grid.step_um) - grid.size / 2, grid.size);
  const bake::CoherentImager imager(grid);
  bake::CoherentImager::Scratch scratch(grid);
  Image image{grid, std::vector<float>(static_cast<std::size_t>(grid.pixels() * grid.pixels()))};
  imager.image(rows, x, y, scratch, image.pixels.data());
  return image;
}

/// Waves of a few directions, periodic on 128 um, with slopes up to 0.2.
double dunes(double x, double y) {
  const double k = 2 * kPi / 128;
  return 0.4 * std::sin(3 * k * x + 2 * k * y) + 0.25 * std::cos(5 * k * y - k * x) + 0.12 * std::sin(7 * k * x + 6 * k * y);
}

TEST(CoherentImage, AgreesWithTheDirectSum) {
  constexpr int kSize = 128;
  // Of the brightest pixel. The transform's sum over a pixel is fitted, and powers are floats.
  constexpr double kTolerance = 1e-3;
  const std::vector<float> heights = heightsOf(kSize, 1, dunes);
  std::mt19937 random(3);
  for (const double wavelength : {0.4, 0.6, 0.8})
    for (const double coherence : {4.0, 10.0}) {
      const bake::WaveGrid grid = bake::waveGrid(wavelength, coherence, 256, 0.3);
      const double x = 40.3, y = 77.9;
      const Image image = imageAt(heights, kSize, 1, grid, x, y);
      const test::DirectWave direct(dunes, wavelength, coherence, 0.25);
      // The brightest pixels, and some others.
      std::vector<int> order(image.pixels.size());
      for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<int>(k);
      std::sort(order.begin(), order.end(), [&](int a, int b) { return image.pixels[a] > image.pixels[b]; });
      for (int k = 0; k < 16; ++k) {
        const int pixel = k < 8 ? order[static_cast<std::size_t>(k * k)] : order[random() % 400];
        const int px = pixel % grid.pixels(), py = pixel / grid.pixels();
        const Vec2 low = {static_cast<float>(image.border(px)), static_cast<float>(image.border(py))};
        EXPECT_NEAR(image.at(px, py), direct.mean(x, y, low, image.pixelSize()), kTolerance * image.largest());
      }
    }
}

TEST(CoherentImage, OfAFlatSurfaceIsAGaussian) {
  constexpr int kSize = 64;
  constexpr double kTolerance = 1e-3;  // of the brightest pixel
  for (const double wavelength : {0.36, 0.55, 0.83})
    for (const double coherence : {5.0, 10.0, 30.0}) {
      const double sigma = wavelength / (4 * kPi * std::numbers::sqrt2 * coherence);
      const bake::WaveGrid grid = bake::waveGrid(wavelength, coherence, 256, 0.1);
      const Image image = imageAt(std::vector<float>(kSize * kSize, 3.7f), kSize, 1, grid, 20, 11);
      const auto mass = [&](int pixel) {
        const double scale = 1 / (sigma * std::numbers::sqrt2);
        return 0.5 * (std::erf(scale * image.border(pixel + 1)) - std::erf(scale * image.border(pixel))) / image.pixelSize();
      };
      for (int y = 0; y < grid.pixels(); ++y)
        for (int x = 0; x < grid.pixels(); ++x)
          ASSERT_NEAR(image.at(x, y), mass(x) * mass(y), kTolerance * image.largest()) << wavelength << " " << coherence;
    }
}

TEST(CoherentImage, OfASinusoidalGratingHasOrdersOfBesselPower) {
  constexpr int kSize = 256;
  constexpr double kPeriod = 16, kCoherence = 20, kTolerance = 1e-3;
  for (const double wavelength : {0.45, 0.65})
    for (const double amplitude : {0.05, 0.1, 0.2}) {
      const auto grating = [&](double x, double) { return amplitude * std::sin(2 * kPi * x / kPeriod); };
      const double steepest = 2 * kPi * amplitude / kPeriod;
      const bake::WaveGrid grid = bake::waveGrid(wavelength, kCoherence, 1024, steepest + 0.1);
      const Image image = imageAt(heightsOf(kSize, 1, grating), kSize, 1, grid, 101.7, 60);
      for (int order = -3; order <= 3; ++order) {
        // The light between the middles of the gaps to the next orders; Gaussians end long before.
        const double spacing = wavelength / (2 * kPeriod), low = (order - 0.5) * spacing, high = (order + 0.5) * spacing;
        double light = 0;
        for (int y = 0; y < grid.pixels(); ++y)
          for (int x = 0; x < grid.pixels(); ++x) {
            const double overlap = std::min(image.border(x + 1), high) - std::max(image.border(x), low);
            if (overlap > 0) light += image.at(x, y) * overlap * image.pixelSize();
          }
        const double bessel = std::cyl_bessel_j(std::abs(order), 4 * kPi * amplitude / wavelength);
        EXPECT_NEAR(light, bessel * bessel, kTolerance) << wavelength << " " << amplitude << " " << order;
      }
    }
}

TEST(CoherentImage, OfATiltedPlaneLiesAtMinusTheSlope) {
  constexpr int kSize = 256;
  constexpr double kWavelength = 0.5;
  constexpr double kTolerance = 5e-5;  // of a pixel of 8e-3: pixels are cut at 0
  const Vec2 slope = {0.11f, -0.07f};
  // Far from the step where the plane meets its own beginning.
  const auto plane = [&](double x, double y) { return slope.x * x + slope.y * y; };
  const bake::WaveGrid grid = bake::waveGrid(kWavelength, 8, 256, 0.2);
  const Image image = imageAt(heightsOf(kSize, 1, plane), kSize, 1, grid, 128, 128);
  double sum = 0, x_sum = 0, y_sum = 0;
  for (int y = 0; y < grid.pixels(); ++y)
    for (int x = 0; x < grid.pixels(); ++x) {
      sum += image.at(x, y);
      x_sum += image.at(x, y) * (image.border(x) + 0.5 * image.pixelSize());
      y_sum += image.at(x, y) * (image.border(y) + 0.5 * image.pixelSize());
    }
  EXPECT_NEAR(x_sum / sum, -slope.x, kTolerance);
  EXPECT_NEAR(y_sum / sum, -slope.y, kTolerance);
}

TEST(CoherentImage, KeepsTheLightAtEveryWavelength) {
  constexpr int kSize = 128;
  constexpr double kTolerance = 1e-3;
  bake::SynthOptions options = bake::defaultSynthOptions(bake::SynthKind::isotropic);
  options.width = options.height = kSize;
  options.correlation_texels = 6;
  options.alpha = 0.15f;
  const std::vector<float> heights = bake::synthHeights(options);
  for (const double wavelength : {0.36, 0.5, 0.7, 0.83}) {
    const bake::WaveGrid grid = bake::waveGrid(wavelength, 10, 256, 0.7);
    EXPECT_NEAR(imageAt(heights, kSize, 1, grid, 31, 90).integral(), 1, kTolerance) << wavelength;
  }
}

TEST(HeightSpline, MeetsHeightsAndTheSteepestSlopeOfASine) {
  constexpr int kSize = 64;
  constexpr double kPeriod = 16, kTolerance = 1e-3;  // of a cubic spline with 16 texels in a period
  const auto sine = [&](double x, double y) { return std::sin(2 * kPi * (x + 2 * y) / kPeriod); };
  const std::vector<float> heights = heightsOf(kSize, 1, sine);
  const bake::HeightSpline spline({kSize, kSize, 1, heights});
  for (const Vec2 at : {Vec2{0.5f, 0.5f}, Vec2{63.5f, 17.5f}, Vec2{63.9f, 0.1f}, Vec2{20.2f, 40.7f}})
    EXPECT_NEAR(spline.at(at.x, at.y), sine(at.x, at.y), 2 * kTolerance);
  // Slopes are looked at twice a texel, here up to 1/32 of a period from the steepest place: cos(pi / 16) = 0.98.
  constexpr double kBetweenPlaces = 0.02;
  EXPECT_NEAR(spline.steepest().slope, 4 * kPi / kPeriod, 4 * kPi / kPeriod * kBetweenPlaces);
}

TEST(ColourWeights, GiveD65ItsChromaticityAndSumToWhite) {
  // CIE 15: D65 has x = 0.3127, y = 0.3290. The fits of the matching functions err by about a hundredth.
  constexpr double kOfFits = 5e-3, kOfFloats = 1e-5;
  const std::vector<float> fine = bake::evenWavelengths(64);
  const auto weights = bake::xyzWeights(fine);
  double sums[3] = {};
  for (const auto& w : weights)
    for (int c = 0; c < 3; ++c) sums[c] += w[c];
  for (const double sum : sums) EXPECT_NEAR(sum, 1, kOfFloats);
  Rgb white;
  for (const Rgb& column : bake::rgbOfXyz()) white = white + column;
  EXPECT_NEAR(white.r, 1, 1e-4);
  EXPECT_NEAR(white.g, 1, 1e-4);
  EXPECT_NEAR(white.b, 1, 1e-4);
  // Green light of 555 nm is where Y is largest, and it is green.
  std::size_t brightest = 0;
  for (std::size_t k = 0; k < weights.size(); ++k)
    if (weights[k][1] > weights[brightest][1]) brightest = k;
  EXPECT_NEAR(fine[brightest], 0.555f, 0.015f);
  // Equal parts of the spectrum sampled coarsely have the weights of their fine samples.
  const auto coarse = bake::xyzWeights(bake::evenWavelengths(8));
  double centroid_fine = 0, centroid_coarse = 0;
  for (std::size_t k = 0; k < fine.size(); ++k) centroid_fine += weights[k][1] * fine[k];
  for (std::size_t k = 0; k < coarse.size(); ++k) centroid_coarse += coarse[k][1] * bake::evenWavelengths(8)[k];
  EXPECT_NEAR(centroid_coarse, centroid_fine, kOfFits);
}

bake::WaveOptions smallOptions() {
  bake::WaveOptions options;
  options.stride = 32;
  options.resolution = 128;
  options.coherence_um = 8;
  options.wavelengths_um = {0.45f, 0.55f, 0.65f};
  return options;
}

std::vector<float> roughHeights(int size, float alpha) {
  bake::SynthOptions options = bake::defaultSynthOptions(bake::SynthKind::isotropic);
  options.width = options.height = size;
  options.correlation_texels = 8;
  options.alpha = alpha;
  return bake::synthHeights(options);
}

/// Pixel means of an image of a level.
std::vector<float> imageOf(const NdfPyramid& pyramid, Vec2 centre, float sigma) {
  const PyramidNdf ndf(pyramid, Interpolation::footprint, Pixels::constant);
  const int size = pyramid.shape.resolution;
  std::vector<float> image;
  for (int y = 0; y < size; ++y)
    for (int x = 0; x < size; ++x)
      image.push_back(ndf.pixelMean(Footprint::isotropic(centre, sigma),
                                    {(static_cast<float>(x) + 0.5f) * 2 / static_cast<float>(size) - 1,
                                     (static_cast<float>(y) + 0.5f) * 2 / static_cast<float>(size) - 1}));
  return image;
}

double relL2(const std::vector<float>& a, const std::vector<float>& b) {
  double difference = 0, norm = 0;
  for (std::size_t k = 0; k < a.size(); ++k) difference += std::pow(double{a[k]} - b[k], 2), norm += std::pow(double{b[k]}, 2);
  return std::sqrt(difference / norm);
}

TEST(WavePyramid, TwiceTheKernelsChangeNothing) {
  constexpr double kTolerance = 1e-3;
  constexpr int kSize = 96;
  const std::vector<float> heights = roughHeights(kSize, 0.1f);
  bake::WaveOptions options = smallOptions();
  options.precision = BlockPrecision::f32;
  const bake::WavePyramidData once = bake::buildWavePyramid({kSize, kSize, 1, heights}, options);
  options.kernels = 2;
  const bake::WavePyramidData twice = bake::buildWavePyramid({kSize, kSize, 1, heights}, options);
  for (const Vec2 centre : {Vec2{0.1f, 0.1f}, Vec2{0.6f, 0.3f}})
    EXPECT_LT(relL2(imageOf(once.grey.view(), centre, 14), imageOf(twice.grey.view(), centre, 14)), kTolerance);
}

TEST(WavePyramid, AveragesCoherentImagesOverTheFootprint) {
  constexpr int kSize = 96, kPlaces = 48;
  constexpr double kTolerance = 2e-3;  // half precision, and footprints that end at 4 deviations
  const std::vector<float> heights = roughHeights(kSize, 0.06f);
  bake::WaveOptions options = smallOptions();
  options.wavelengths_um = {0.55f};
  options.overlap = 1;
  const bake::WavePyramidData pyramid = bake::buildWavePyramid({kSize, kSize, 1, heights}, options);
  // Eq. 4 on a lattice of its own, twice as dense as the builder's, at the centre of image (1, 0).
  const bake::WaveGrid grid = bake::waveGrid(0.55, 8, options.resolution, 0.5);
  const PyramidShape& shape = pyramid.grey.shape;
  const Vec2 centre = shape.centre(0, 1, 0);
  const double sigma = double{kFootprintPerStride} * shape.levels[0].stride;
  const bake::HeightSpline spline({kSize, kSize, 1, heights});
  const bake::CoherentImager imager(grid);
  bake::CoherentImager::Scratch scratch(grid);
  const auto pixels = static_cast<std::size_t>(grid.pixels());
  std::vector<double> sum(pixels * pixels);
  std::vector<float> one(sum.size());
  double total = 0;
  for (int j = 0; j < kPlaces; ++j)
    for (int i = 0; i < kPlaces; ++i) {
      const double u = 4.5 * sigma * (2 * (i + 0.5) / kPlaces - 1), v = 4.5 * sigma * (2 * (j + 0.5) / kPlaces - 1);
      const double weight = std::exp(-0.5 * (u * u + v * v) / (sigma * sigma)), x = centre.x + u, y = centre.y + v;
      bake::PhaseRows rows(spline, 1, grid, x - 0.5 * grid.window_um() - grid.step_um, grid.size + 4);
      rows.compute(std::llround(y / grid.step_um) - grid.size / 2, grid.size);
      imager.image(rows, x, y, scratch, one.data());
      for (std::size_t k = 0; k < sum.size(); ++k) sum[k] += weight * one[k];
      total += weight;
    }
  const PyramidReader reader(pyramid.grey.view());
  double difference = 0, norm = 0;
  for (int y = 0; y < grid.pixels(); ++y)
    for (int x = 0; x < grid.pixels(); ++x) {
      PyramidSlices slices;
      slices.count = 4;
      slices.levels[0] = 0;
      for (int k = 0; k < 4; ++k) slices.images[k] = 1, slices.weights[k] = k == 0 ? 1.0f : 0.0f;
      const auto psi = [&](int pixel) { return static_cast<float>(2 * (pixel - grid.half_pixels + 0.5) / options.resolution); };
      const double expected = sum[static_cast<std::size_t>(y) * pixels + static_cast<std::size_t>(x)] / total;
      const double found = reader.pixelMean(slices, pixelPlace(shape, {psi(x), psi(y)}));
      difference += (found - expected) * (found - expected), norm += expected * expected;
    }
  EXPECT_LT(std::sqrt(difference / norm), kTolerance);
}

TEST(WavePyramid, TendsToTheGeometricImagesAsTheWavelengthFalls) {
  constexpr int kSize = 96;
  const std::vector<float> heights = roughHeights(kSize, 0.08f);
  bake::WaveOptions options = smallOptions();
  options.coherence_um = 12;
  double before = 1;
  for (const float wavelength : {1.6f, 0.8f, 0.4f, 0.2f}) {
    options.wavelengths_um = {wavelength};
    const bake::WavePyramidData wave = bake::buildWavePyramid({kSize, kSize, 1, heights}, options);
    // The geometric surface blurred as little as both can resolve: facets of the same roughness at every wavelength.
    bake::PyramidOptions geometric;
    geometric.resolution = options.resolution;
    geometric.sigma_r = 0.008f;
    geometric.surface = Surface::smooth;
    const auto normals = bake::normalsFromHeights(kSize, kSize, heights);
    NormalMap map;
    map.width = map.height = kSize;
    map.normals = normals;
    const bake::NdfPyramidData facets = bake::buildPyramid(map, geometric);
    double distance = 0;
    for (const Vec2 centre : {Vec2{0.2f, 0.2f}, Vec2{0.7f, 0.4f}}) {
      const std::vector<float> a = imageOf(wave.grey.view(), centre, 20), b = imageOf(facets.view(), centre, 20);
      for (std::size_t k = 0; k < a.size(); ++k)
        distance += 0.25 * std::abs(double{a[k]} - b[k]) * 4 / (options.resolution * options.resolution);
    }
    EXPECT_LT(distance, before) << wavelength;
    RecordProperty("total_variation_" + std::to_string(static_cast<int>(1000 * wavelength)) + "nm", std::to_string(distance));
    before = distance;
  }
  EXPECT_LT(before, 0.25);
}

TEST(WavePyramid, HasTheSameBytesOnAnyNumberOfThreads) {
  constexpr int kSize = 64;
  const std::vector<float> heights = roughHeights(kSize, 0.1f);
  const bake::WavePyramidData many = bake::buildWavePyramid({kSize, kSize, 1, heights}, smallOptions());
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const bake::WavePyramidData single = bake::buildWavePyramid({kSize, kSize, 1, heights}, smallOptions());
  EXPECT_EQ(many.half_pixels, single.half_pixels);
  for (std::size_t l = 0; l < many.grey.levels.size(); ++l) {
    EXPECT_EQ(many.grey.levels[l].masks, single.grey.levels[l].masks);
    EXPECT_EQ(many.grey.levels[l].half_pixels, single.grey.levels[l].half_pixels);
  }
}

TEST(WavePyramid, OfAFlatMirrorIsWhite) {
  constexpr int kSize = 64;
  bake::WaveOptions options = smallOptions();
  options.wavelengths_um = bake::evenWavelengths(8);
  const bake::WavePyramidData flat = bake::buildWavePyramid({kSize, kSize, 1, std::vector<float>(kSize * kSize)}, options);
  const WavePyramid wave = flat.view();
  ASSERT_EQ(wave.channels, 3);
  // The integral of each channel over one image, and its colour.
  Rgb colour;
  const std::size_t blocks = wave.grey.levels[0].mask_ranks[static_cast<std::size_t>(wave.grey.shape.maskWords())];
  for (std::size_t k = 0; k < blocks * kBlockPixels * 3; ++k)
    colour = colour + (halfToFloat(flat.half_pixels[0][k]) * 4 / static_cast<float>(options.resolution * options.resolution)) *
                          wave.channel_rgb[k / kBlockSize % 3];
  constexpr float kTolerance = 2e-3f;  // halves of large numbers minus each other
  EXPECT_NEAR(colour.r, 1, kTolerance);
  EXPECT_NEAR(colour.g, 1, kTolerance);
  EXPECT_NEAR(colour.b, 1, kTolerance);
}

TEST(WavePyramid, RefusesWhatItCannotAnswer) {
  constexpr int kSize = 64;
  const std::vector<float> flat(kSize * kSize);
  const auto ruleOf = [&](float texel_um, const std::vector<float>& heights, const auto& change) -> std::string {
    bake::WaveOptions options = smallOptions();
    change(options);
    try {
      bake::buildWavePyramid({kSize, kSize, texel_um, heights}, options);
    } catch (const Error& error) {
      return error.rule() + " " + error.object();
    }
    return "";
  };
  const auto unchanged = [](bake::WaveOptions&) {};
  EXPECT_EQ(ruleOf(0, flat, unchanged), "heights.texel_size /@texel_size_um");
  EXPECT_EQ(ruleOf(1, flat, [](auto& o) { o.wavelengths_um = {0, 0.5f}; }), "option.range --wavelengths");
  EXPECT_EQ(ruleOf(1, flat, [](auto& o) { o.wavelengths_um = {0.5f, 10}; }), "option.range --wavelengths");
  EXPECT_EQ(ruleOf(1, flat, [](auto& o) { o.wavelengths_um = {0.6f, 0.5f}; }), "option.range --wavelengths");
  EXPECT_EQ(ruleOf(1, flat, [](auto& o) { o.wavelengths_um = {1.0f, 1.5f}; }), "option.range --wavelengths");
  EXPECT_EQ(ruleOf(1, flat, [](auto& o) { o.coherence_um = 0; }), "option.range --coherence-um");
  EXPECT_EQ(ruleOf(1, flat, [](auto& o) { o.coherence_um = 65; }), "option.range --coherence-um");
  std::vector<float> steep = flat;
  steep[700] = 20;
  EXPECT_EQ(ruleOf(1, steep, unchanged), "heights.steep ");
}

}  // namespace
}  // namespace glint::wave_test
