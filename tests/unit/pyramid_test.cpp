#include "glint/bake/pyramid/pyramid.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "glint/bake/common/reference_image.h"
#include "glint/bake/pyramid/agreement.h"
#include "glint/model/error.h"
#include "glint/query/pyramid_ndf.h"
#include "glint/query/reference.h"
#include "support/test_maps.h"

namespace glint::bake::pyramid_test {
namespace {

using test::OwnedMap;

/// Cut-offs of footprints (0.22 % of the weight lies outside) are normalised away; what is left are the tails of filters and
/// pixels in half precision.
constexpr double kEnergyError = 1e-3;

PyramidOptions options(float stride, int resolution, float sigma_r, Surface surface = Surface::flat,
                       Boundary boundary = Boundary::wrap) {
  PyramidOptions o;
  o.stride = stride;
  o.resolution = resolution;
  o.sigma_r = sigma_r;
  o.surface = surface;
  o.boundary = boundary;
  return o;
}

PyramidOptions withLevels(PyramidOptions o, int levels) {
  o.levels = levels;
  return o;
}

/// The footprint that image (i, j) of a level holds.
Footprint footprintOf(const PyramidShape& shape, int level, int i, int j) {
  const Vec2 centre = shape.centre(level, i, j);
  return Footprint::isotropic({centre.x / static_cast<float>(shape.width), centre.y / static_cast<float>(shape.height)},
                              kFootprintPerStride * shape.levels[level].stride);
}

/// Calls visitor(level, i, j) for every image of a pyramid.
template <class Visitor>
void forEachImage(const PyramidShape& shape, Visitor&& visitor) {
  for (int l = 0; l < shape.level_count; ++l)
    for (int j = 0; j < shape.levels[l].rows; ++j)
      for (int i = 0; i < shape.levels[l].columns; ++i) visitor(l, i, j);
}

/// Image (i, j) of a level, decoded from its blocks.
std::vector<float> storedImage(const NdfPyramid& pyramid, int level, int i, int j) {
  const PyramidShape& shape = pyramid.shape;
  const PyramidLevel& data = pyramid.levels[level];
  const std::size_t image = static_cast<std::size_t>(j) * shape.levels[level].columns + i;
  std::vector<float> pixels(static_cast<std::size_t>(shape.resolution) * shape.resolution, 0.0f);
  std::size_t stored = data.mask_ranks[image * shape.maskWords()];
  for (int b = 0; b < shape.blocksPerImage(); ++b) {
    if (!(data.masks[image * shape.maskWords() + b / 64] >> (b % 64) & 1)) continue;
    for (int k = 0; k < kBlockPixels; ++k) {
      const std::size_t at = stored * kBlockPixels + k;
      const float value = pyramid.precision == BlockPrecision::f16
                              ? halfToFloat(static_cast<const std::uint16_t*>(data.pixels)[at])
                              : static_cast<const float*>(data.pixels)[at];
      const int x = b % shape.blocksPerAxis() * kBlockSize + k % kBlockSize,
                y = b / shape.blocksPerAxis() * kBlockSize + k / kBlockSize;
      pixels[static_cast<std::size_t>(y) * shape.resolution + x] = pyramid.value_scale * value;
    }
    ++stored;
  }
  EXPECT_EQ(stored, data.mask_ranks[(image + 1) * shape.maskWords()]);
  return pixels;
}

TEST(PyramidShape, StridesDoubleWhileTheyAreShorterThanTheMapAndThenComesItsMean) {
  PyramidOptions o = options(32, 64, 0.02f);
  o.overlap = 1;
  const PyramidShape shape = pyramidShape(350, 200, o);
  ASSERT_EQ(shape.level_count, 5);
  EXPECT_TRUE(shape.endsInMean());
  EXPECT_EQ(shape.footprintLevels(), 4);
  const PyramidGrid expected[] = {{32, 11, 7}, {64, 6, 4}, {128, 3, 2}, {256, 2, 1}, {512, 1, 1}};
  for (int l = 0; l < 5; ++l) {
    EXPECT_EQ(shape.levels[l].stride, expected[l].stride);
    EXPECT_EQ(shape.levels[l].columns, expected[l].columns);
    EXPECT_EQ(shape.levels[l].rows, expected[l].rows);
  }
  EXPECT_EQ(pyramidShape(8, 8, options(32, 64, 0.02f)).footprintLevels(), 1);
  EXPECT_EQ(pyramidShape(1 << 20, 1, options(2, 64, 0.02f)).level_count, kMaxPyramidLevels);
  EXPECT_THROW(pyramidShape(350, 200, withLevels(options(32, 64, 0.02f), 5)), Error);
}

TEST(PyramidShape, CentresOfOverlappingFootprintsAreSpreadEvenly) {
  PyramidOptions o = options(32, 64, 0.02f);
  o.overlap = 1.5f;
  const PyramidShape shape = pyramidShape(350, 200, o);
  ASSERT_EQ(shape.level_count, 5);
  const PyramidGrid expected[] = {{32, 17, 10}, {64, 9, 5}, {128, 5, 3}, {256, 12, 12}, {512, 1, 1}};
  for (int l = 0; l < 5; ++l) {
    const PyramidGrid& grid = shape.levels[l];
    EXPECT_EQ(grid.stride, expected[l].stride);
    EXPECT_EQ(grid.columns, expected[l].columns);
    EXPECT_EQ(grid.rows, expected[l].rows);
    if (l == shape.footprintLevels()) continue;
    EXPECT_LE(shape.spacing(l).x, grid.stride / o.overlap);
    EXPECT_LE(shape.spacing(l).y, grid.stride / o.overlap);
    const Vec2 first = shape.centre(l, 0, 0), last = shape.centre(l, grid.columns - 1, grid.rows - 1);
    EXPECT_NEAR(350 - last.x, first.x, 1e-3f);  // the gap across the border is that of all centres
    EXPECT_NEAR(200 - last.y, first.y, 1e-3f);
  }
}

TEST(Pyramid, RefusesOptionsOutOfRangeByName) {
  const OwnedMap owned(16, 16, test::roughSurface(16, 16, 0.1f));
  const float nan = std::numeric_limits<float>::quiet_NaN();
  for (const PyramidOptions& o : {options(1, 64, 0.02f), options(nan, 64, 0.02f), options(8, 40, 0.02f), options(8, 16, 0.02f),
                                  options(8, 2048, 0.02f), options(8, 64, 1e-4f), options(8, 64, 0.3f), options(8, 64, nan),
                                  withLevels(options(8, 64, 0.02f), -1), withLevels(options(8, 64, 0.02f), 17)}) {
    try {
      buildPyramid(owned.map(), o);
      ADD_FAILURE() << "accepted " << o.stride << ' ' << o.resolution << ' ' << o.sigma_r << ' ' << o.levels;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::usage);
      EXPECT_EQ(e.rule(), "option.range");
    }
  }
}

TEST(Pyramid, EveryImageIntegratesToOneOnSteepMaps) {
  const OwnedMap rough(75, 50, test::roughSurface(75, 50, 1.0f));
  const OwnedMap flakes(64, 48, test::synthesised(SynthKind::flakes, 64, 48, 0.5f));
  for (const OwnedMap* owned : {&rough, &flakes}) {
    for (const Surface surface : {Surface::flat, Surface::smooth}) {
      for (const BlockPrecision precision : {BlockPrecision::f16, BlockPrecision::f32}) {
        for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
          PyramidOptions o = withLevels(options(8, 64, 0.008f, surface, boundary), 3);
          o.precision = precision;
          const NdfPyramidData data = buildPyramid(owned->map(), o);
          const NdfPyramid pyramid = data.view();
          const Reference reference(owned->map(), o.sigma_r, surface, boundary);
          forEachImage(data.shape, [&](int l, int i, int j) {
            const double integral = test::momentsOf(storedImage(pyramid, l, i, j), 64).integral;
            EXPECT_LE(integral, 1 + kEnergyError);
            // Lobes of flakes that lean 85 degrees reach over the border of the square.
            if (integral < 1 - kEnergyError) {
              EXPECT_NEAR(integral, 4 * reference.mean(footprintOf(data.shape, l, i, j), {{-1, -1}, {1, 1}}), kEnergyError);
            }
            EXPECT_GT(integral, 0.99) << l << ' ' << i << ' ' << j;
          });
        }
      }
    }
  }
}

TEST(Pyramid, BlockMeansAreTheMeansOfStoredPixelsAndEmptyBlocksAreLeftOut) {
  const OwnedMap owned(96, 64, test::roughSurface(96, 64, 0.2f));
  for (const BlockPrecision precision : {BlockPrecision::f16, BlockPrecision::f32}) {
    PyramidOptions o = options(16, 128, 0.01f);
    o.precision = precision;
    const NdfPyramidData data = buildPyramid(owned.map(), o);
    const NdfPyramid pyramid = data.view();
    std::size_t blocks = 0, images = 0;
    forEachImage(data.shape, [&](int l, int i, int j) {
      const auto image = storedImage(pyramid, l, i, j);
      const std::size_t index = static_cast<std::size_t>(j) * data.shape.levels[l].columns + i;
      std::size_t stored = data.levels[l].mask_ranks[index * data.shape.maskWords()];
      blocks += data.levels[l].mask_ranks[(index + 1) * data.shape.maskWords()] - stored;
      ++images;
      for (int b = 0; b < data.shape.blocksPerImage(); ++b) {
        if (!(data.levels[l].masks[index * data.shape.maskWords() + b / 64] >> (b % 64) & 1)) continue;
        double sum = 0;
        for (int y = 0; y < kBlockSize; ++y)
          for (int x = 0; x < kBlockSize; ++x)
            sum += image[static_cast<std::size_t>(b / 8 * kBlockSize + y) * 128 + b % 8 * kBlockSize + x];
        EXPECT_NEAR(data.levels[l].block_means[stored++], sum / kBlockPixels, 1e-5 * sum / kBlockPixels);
        EXPECT_GT(sum, 0);
      }
    });
    EXPECT_LT(blocks, 0.7 * static_cast<double>(images) * data.shape.blocksPerImage());
  }
}

/// Pixel means of the Beckmann distribution.
std::vector<float> beckmannImage(double alpha, int resolution) {
  constexpr int kParts = 16;
  std::vector<float> image(static_cast<std::size_t>(resolution) * resolution);
  for (std::size_t k = 0; k < image.size(); ++k) {
    const Vec2 centre = test::pixelCentre(k, resolution);
    double sum = 0;
    for (int part = 0; part < kParts * kParts; ++part) {
      const double x = centre.x + ((part % kParts + 0.5) / kParts - 0.5) * 2 / resolution;
      const double y = centre.y + ((part / kParts + 0.5) / kParts - 0.5) * 2 / resolution;
      const double cos2 = 1 - x * x - y * y;
      if (cos2 <= 0) continue;
      sum += std::exp(-(1 - cos2) / cos2 / (alpha * alpha)) / (std::numbers::pi * alpha * alpha * cos2 * cos2);
    }
    image[k] = static_cast<float>(sum / (kParts * kParts));
  }
  return image;
}

TEST(Pyramid, TheNdfOfAGaussianSurfaceIsBeckmann) {
  // The last level sees some 30,000 independent slopes (512^2 texels of correlation length 1.5), spread over about 150 pixels:
  // half the sum of |p' - p| is about 0.4 sum sqrt(p / 30000) = 0.03. A roughness that is a tenth off is 0.08 away.
  constexpr double kSampleError = 0.04, kOtherRoughness = 0.06;
  constexpr int kResolution = 32;
  const float alpha = 0.3f, sigma_r = 0.0065f;
  const OwnedMap owned(512, 512, test::roughSurface(512, 512, alpha, 1.5f));
  const NdfPyramidData data = buildPyramid(owned.map(), withLevels(options(256, kResolution, sigma_r), 1));
  const auto image = storedImage(data.view(), 0, 0, 0);
  EXPECT_LT(test::totalVariation(image, beckmannImage(alpha, kResolution)), kSampleError);
  EXPECT_GT(test::totalVariation(image, beckmannImage(1.1 * alpha, kResolution)), kOtherRoughness);
  EXPECT_GT(test::totalVariation(image, beckmannImage(0.9 * alpha, kResolution)), kOtherRoughness);
  const auto exact =
      referenceImage(owned.map(), sigma_r, Surface::flat, Boundary::wrap, footprintOf(data.shape, 0, 0, 0), kResolution);
  EXPECT_LT(test::totalVariation(exact, beckmannImage(alpha, kResolution)), kSampleError);
}

TEST(Pyramid, AFlatMapIsOneSpotOfTheRoughnesssVariance) {
  // Filters are cut at four deviations: 1e-3 of the variance lies outside. Pixels of 1/64 have a variance of their own.
  constexpr double kVarianceError = 4e-3, kMeanError = 1e-4;
  constexpr int kResolution = 128;
  const double pixel_variance = 4.0 / kResolution / kResolution / 12;
  const Vec2 n = {0.213f, -0.121f};
  const OwnedMap owned(64, 64, std::vector<Vec2>(64 * 64, n));
  for (const float sigma_r : {0.01f, 0.03f, 0.1f}) {
    const auto check = [&](const std::vector<float>& image) {
      const test::ImageMoments m = test::momentsOf(image, kResolution);
      EXPECT_NEAR(m.integral, 1, kEnergyError);
      EXPECT_NEAR(m.mean_x, n.x, kMeanError);
      EXPECT_NEAR(m.mean_y, n.y, kMeanError);
      EXPECT_NEAR(m.variance_x - pixel_variance, sigma_r * sigma_r, kVarianceError * sigma_r * sigma_r);
      EXPECT_NEAR(m.variance_y - pixel_variance, sigma_r * sigma_r, kVarianceError * sigma_r * sigma_r);
    };
    for (const Surface surface : {Surface::flat, Surface::smooth}) {
      const NdfPyramidData data = buildPyramid(owned.map(), withLevels(options(16, kResolution, sigma_r, surface), 2));
      forEachImage(data.shape, [&](int l, int i, int j) { check(storedImage(data.view(), l, i, j)); });
      check(referenceImage(owned.map(), sigma_r, surface, Boundary::wrap, Footprint::isotropic({0.2f, 0.7f}, 3), kResolution));
    }
  }
}

TEST(Pyramid, LevelsThatAgreeAreDropped) {
  const OwnedMap constant(128, 128, std::vector<Vec2>(128 * 128, Vec2{0.1f, 0}));
  EXPECT_EQ(buildPyramid(constant.map(), options(16, 64, 0.02f)).shape.footprintLevels(), 1);
  const OwnedMap rough(128, 128, test::roughSurface(128, 128, 0.2f));
  EXPECT_EQ(buildPyramid(rough.map(), options(16, 64, 0.02f)).shape.footprintLevels(), 3);
}

TEST(Pyramid, RepeatedMapsHaveTheSameImagesInEveryTile) {
  // Texel coordinates are larger in the second tile, so weights differ in the last places. Footprints are shorter than the map:
  // where one wraps onto itself, weights below the cut of a footprint are added before they are cut (smooth surfaces, 1e-3).
  constexpr double kLastPlace = 2e-4;
  const OwnedMap one(64, 64, test::roughSurface(64, 64, 0.3f)), four(128, 128, test::repeated(one.normals(), 64, 64, 2));
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    PyramidOptions o = withLevels(options(8, 64, 0.02f, surface), 2);
    o.overlap = 1;  // strides that divide the tile: every tile has the same centres
    o.precision = BlockPrecision::f32;
    const NdfPyramidData single = buildPyramid(one.map(), o), tiled = buildPyramid(four.map(), o);
    forEachImage(tiled.shape, [&](int l, int i, int j) {
      const PyramidGrid& grid = single.shape.levels[l];
      const double difference =
          test::relL2(storedImage(tiled.view(), l, i, j), storedImage(single.view(), l, i % grid.columns, j % grid.rows));
      EXPECT_LT(difference, kLastPlace) << "surface " << int(surface) << " level " << l << " image " << i << ' ' << j;
    });
  }
}

struct CentreCase {
  int width, height, levels, resolution;
  float stride, alpha, correlation, sigma_r;
};

/// Compares two images of every level with the exact ones.
void expectExactCentres(const CentreCase& c, Surface surface) {
  // What binning, filters cut at 4 and footprints cut at 3.5 deviations cost together.
  constexpr double kImageError = 0.01;
  const OwnedMap owned(c.width, c.height, test::roughSurface(c.width, c.height, c.alpha, c.correlation));
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
    PyramidOptions o = withLevels(options(c.stride, c.resolution, c.sigma_r, surface, boundary), c.levels);
    o.overlap = boundary == Boundary::wrap ? kDefaultOverlap : 1;
    const NdfPyramidData data = buildPyramid(owned.map(), o);
    const PyramidNdf model(data.view(), Interpolation::trilinear);  // answers centres by their own image
    for (int l = 0; l < data.shape.footprintLevels(); ++l) {
      const PyramidGrid& grid = data.shape.levels[l];
      for (const auto& [i, j] : {std::pair{0, 0}, {grid.columns - 1, grid.rows / 2}}) {
        const Footprint p = footprintOf(data.shape, l, i, j);
        if (boundary == Boundary::clamp && (p.centre.x >= 1 || p.centre.y >= 1))
          continue;  // a footprint cannot be centred there
        const auto exact = referenceImage(owned.map(), c.sigma_r, surface, boundary, p, c.resolution);
        EXPECT_LE(test::relL2(test::imageOf(model, p, c.resolution), exact), kImageError)
            << c.width << 'x' << c.height << " sigma_r " << c.sigma_r << " boundary " << int(boundary) << " level " << l
            << " image " << i << ' ' << j;
      }
    }
  }
}

TEST(Pyramid, FlatImagesAreTheExactOnesAtTheirCentres) {
  for (const CentreCase& c :
       {CentreCase{350, 200, 3, 256, 32, 0.2f, 4, 0.005f}, CentreCase{140, 72, 3, 256, 16, 0.2f, 4, 0.0012f},
        CentreCase{140, 72, 3, 128, 16, 0.2f, 4, 0.02f}, CentreCase{45, 70, 4, 64, 6.5f, 0.2f, 4, 0.02f}})
    expectExactCentres(c, Surface::flat);
}

TEST(Pyramid, SmoothImagesAreTheExactOnesAtTheirCentres) {
  // Small maps for narrow lobes: the exact image takes (edge / sigma_r)^2 points in each triangle.
  for (const CentreCase& c : {CentreCase{70, 41, 3, 64, 8, 0.1f, 4, 0.02f}, CentreCase{45, 70, 3, 64, 6.5f, 0.1f, 4, 0.02f},
                              CentreCase{27, 15, 2, 256, 6, 0.1f, 8, 0.005f}, CentreCase{27, 15, 1, 256, 6, 0.05f, 8, 0.0012f}})
    expectExactCentres(c, Surface::smooth);
}

/// One image of the level above against the mean of its four children.
double parentToChildren(const NdfPyramidData& data, int level, int i, int j) {
  const auto parent = storedImage(data.view(), level + 1, i, j);
  std::vector<float> mean(parent.size(), 0.0f);
  for (int k = 0; k < 4; ++k) {
    const auto child = storedImage(data.view(), level, 2 * i + k % 2, 2 * j + k / 2);
    for (std::size_t p = 0; p < mean.size(); ++p) mean[p] += 0.25f * child[p];
  }
  return test::totalVariation(mean, parent);
}

TEST(Pyramid, ALevelAgreesWithTheMeanOfItsChildren) {
  // Four footprints around a centre weigh texels much as the larger one does, but not as widely: their variance is 0.44
  // strides^2 against 0.75. Measured on these maps: a total variation of 0.058.
  constexpr double kWeightsDiffer = 0.08;
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    const OwnedMap noise(128, 128, test::randomNormals(128, 128, 0.5f, 5)), rough(128, 128, test::roughSurface(128, 128, 0.2f));
    double worst = 0;
    for (const OwnedMap* owned : {&noise, &rough}) {
      PyramidOptions o = withLevels(options(16, 64, 0.02f, surface), 3);
      o.overlap = 1;  // every image has four children
      const NdfPyramidData data = buildPyramid(owned->map(), o);
      for (int l = 0; l < 2; ++l)
        for (int j = 0; j < data.shape.levels[l + 1].rows; ++j)
          for (int i = 0; i < data.shape.levels[l + 1].columns; ++i) worst = std::max(worst, parentToChildren(data, l, i, j));
    }
    EXPECT_LT(worst, kWeightsDiffer);
    EXPECT_GT(worst, 0.01);
  }
}

/// The smooth surface of a map at `factor` times as many texels.
std::vector<Vec2> upsampled(const NormalMap& map, int factor) {
  std::vector<Vec2> out;
  const auto wrap = [](int k, int n) { return ((k % n) + n) % n; };
  for (int j = 0; j < factor * map.height; ++j) {
    for (int i = 0; i < factor * map.width; ++i) {
      const float x = (static_cast<float>(i) + 0.5f) / static_cast<float>(factor) - 0.5f,
                  y = (static_cast<float>(j) + 0.5f) / static_cast<float>(factor) - 0.5f;
      const int cx = static_cast<int>(std::floor(x)), cy = static_cast<int>(std::floor(y));
      const float s = x - static_cast<float>(cx), t = y - static_cast<float>(cy);
      const auto at = [&](int dx, int dy) { return map.at(wrap(cx + dx, map.width), wrap(cy + dy, map.height)); };
      const Vec2 n = at(0, 0), far = at(1, 1);
      out.push_back(s >= t ? n + s * (at(1, 0) - n) + t * (far - at(1, 0)) : n + t * (at(0, 1) - n) + s * (far - at(0, 1)));
    }
  }
  return out;
}

TEST(Pyramid, FlatImagesOfFinerMapsConvergeToTheSmoothOne) {
  constexpr int kResolution = 64;
  constexpr double kBuildersError = 0.005;  // two builders, each within half the 1 % of its images
  const OwnedMap coarse(48, 48, test::roughSurface(48, 48, 0.2f));
  const auto smooth =
      referenceImage(coarse.map(), 0.02f, Surface::smooth, Boundary::wrap, Footprint::isotropic({0.4f, 0.6f}, 5), kResolution);
  const NdfPyramidData smooth_pyramid =
      buildPyramid(coarse.map(), withLevels(options(12, kResolution, 0.02f, Surface::smooth), 1));
  double previous = 1, previous_pyramid = 1;
  for (const int factor : {1, 2, 4, 8}) {
    const OwnedMap fine(48 * factor, 48 * factor, upsampled(coarse.map(), factor));
    const auto flat = referenceImage(fine.map(), 0.02f, Surface::flat, Boundary::wrap,
                                     Footprint::isotropic({0.4f, 0.6f}, 5.0f * static_cast<float>(factor)), kResolution);
    const double error = test::relL2(flat, smooth);
    EXPECT_LT(error, 0.5 * previous) << factor;
    const NdfPyramidData flat_pyramid =
        buildPyramid(fine.map(), withLevels(options(12.0f * static_cast<float>(factor), kResolution, 0.02f), 1));
    const double pyramid_error =
        test::relL2(storedImage(flat_pyramid.view(), 0, 1, 2), storedImage(smooth_pyramid.view(), 0, 1, 2));
    EXPECT_LT(pyramid_error, std::max(0.6 * previous_pyramid, kBuildersError)) << factor;  // down to the builders' own error
    previous = error;
    previous_pyramid = pyramid_error;
  }
  EXPECT_LT(previous, 0.02);
}

TEST(Pyramid, DoesNotDependOnTheNumberOfThreads) {
  const OwnedMap owned(80, 56, test::roughSurface(80, 56, 0.2f));
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    for (const BlockPrecision precision : {BlockPrecision::f16, BlockPrecision::f32}) {
      PyramidOptions o = withLevels(options(8, 64, 0.01f, surface), 4);
      o.precision = precision;
      const auto build = [&](std::size_t threads) {
        const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
        return buildPyramid(owned.map(), o);
      };
      const NdfPyramidData one = build(1);
      for (int repeat = 0; repeat < 3; ++repeat) {
        const NdfPyramidData two = build(2);
        for (int l = 0; l < one.shape.level_count; ++l) {
          EXPECT_EQ(one.levels[l].masks, two.levels[l].masks);
          EXPECT_EQ(one.levels[l].mask_ranks, two.levels[l].mask_ranks);
          EXPECT_EQ(one.levels[l].half_pixels, two.levels[l].half_pixels);
          const auto same = [](const std::vector<float>& a, const std::vector<float>& b) {
            return std::ranges::equal(std::as_bytes(std::span(a)), std::as_bytes(std::span(b)));
          };
          EXPECT_TRUE(same(one.levels[l].block_means, two.levels[l].block_means));
          EXPECT_TRUE(same(one.levels[l].float_pixels, two.levels[l].float_pixels));
        }
      }
    }
  }
}

TEST(Pyramid, SmallestMapsAndFootprintsLargerThanTheMapWork) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {9, 1}, {3, 2}}) {
    const OwnedMap owned(width, height, std::vector<Vec2>(static_cast<std::size_t>(width) * height, Vec2{0.1f, 0.2f}));
    for (const Surface surface : {Surface::flat, Surface::smooth}) {
      for (const float stride : {2.0f, 64.0f}) {
        const NdfPyramidData data = buildPyramid(owned.map(), options(stride, 64, 0.05f, surface));
        forEachImage(data.shape, [&](int l, int i, int j) {
          const test::ImageMoments m = test::momentsOf(storedImage(data.view(), l, i, j), 64);
          ASSERT_NEAR(m.integral, 1, kEnergyError) << width << 'x' << height << " stride " << stride << " surface "
                                                   << int(surface) << " level " << l << " image " << i << ' ' << j;
          EXPECT_NEAR(m.mean_x, 0.1, 1e-3);
          EXPECT_NEAR(m.mean_y, 0.2, 1e-3);
        });
      }
    }
  }
}

}  // namespace
}  // namespace glint::bake::pyramid_test
