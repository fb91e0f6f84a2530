#include "glint/bake/compressed/compress.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "glint/bake/common/seen_error.h"
#include "glint/model/error.h"
#include "unit/compress_fixture.h"
#include "unit/compress_reference.h"

namespace glint::bake::compress_test {
namespace {

using test::TestPyramid;

constexpr CompressionMethod kMethods[] = {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca};
constexpr CoefficientType kTypes[] = {CoefficientType::i8, CoefficientType::f16, CoefficientType::f32};

// Decoding in double against sums in float over 256 pixels.
constexpr double kFloatError = 1e-5;

const TestPyramid& noise() {
  static const TestPyramid pyramid = test::makePyramid(test::isotropicNoise(128, 0.2f, 1), test::makeShape(128, 64, 16, 3));
  return pyramid;
}

const TestPyramid& flakes() {
  static const TestPyramid pyramid = test::makePyramid(test::flakes(128, 5, 24, 2), test::makeShape(128, 64, 16, 3));
  return pyramid;
}

CompressionOptions options(CompressionMethod method, CoefficientType type = CoefficientType::i8, int rank = 16,
                           int regions = 2) {
  CompressionOptions o;
  o.method = method;
  o.coefficient_type = type;
  o.rank = rank;
  o.regions = regions;
  o.metric = ErrorMetric::l2;
  return o;
}

struct Measured {
  std::vector<double> levels;
  double total = 0;
  double worst_integral = 0;  // |integral - 1| of any image
};

/// Error and energy of the decoded data, by the slow decoder.
Measured measure(const NdfPyramid& pyramid, const NdfCp& compressed) {
  Measured result;
  double errors = 0, energies = 0;
  for (int l = 0; l < pyramid.shape.level_count; ++l) {
    double error = 0, energy = 0;
    for (std::size_t i = 0; i < pyramid.shape.levels[l].imageCount(); ++i) {
      const auto expected = test::storedImage(pyramid, l, i);
      const auto decoded = test::decodeImage(compressed, compressed.first_image[l] + static_cast<std::uint32_t>(i));
      double integral = 0;
      for (std::size_t p = 0; p < decoded.size(); ++p) {
        error += (decoded[p] - expected[p]) * (decoded[p] - expected[p]);
        energy += expected[p] * expected[p];
        integral += decoded[p] * 4 / static_cast<double>(decoded.size());
      }
      result.worst_integral = std::max(result.worst_integral, std::abs(integral - 1));
    }
    result.levels.push_back(energy > 0 ? std::sqrt(error / energy) : 0);
    errors += error;
    energies += energy;
  }
  result.total = energies > 0 ? std::sqrt(errors / energies) : 0;
  return result;
}

/// One level of one image per given block, in a single angular block (resolution 16).
TestPyramid singleBlocks(const std::vector<std::vector<float>>& images) {
  TestPyramid p;
  p.shape = test::makeShape(static_cast<int>(images.size()) * 16, 16, 16, 1);
  p.shape.height = 16;
  p.shape.levels[0].rows = 1;
  for (const auto& image : images) p.addImage(0, image);
  return p;
}

TEST(Compress, ReportsTheErrorOfTheDecodedData) {
  for (const auto method : kMethods) {
    for (const auto type : kTypes) {
      CompressionReport report;
      const NdfPyramid pyramid = flakes().view();
      const auto data = compressPyramid(pyramid, options(method, type), &report);
      const Measured measured = measure(pyramid, data.view());
      EXPECT_NEAR(report.total.rel_l2, measured.total, kFloatError + 1e-4 * measured.total);
      for (std::size_t l = 0; l < report.levels.size(); ++l)
        EXPECT_NEAR(report.levels[l].rel_l2, measured.levels[l], kFloatError + 1e-4 * measured.levels[l]);
      EXPECT_GT(measured.total, 0);
      EXPECT_LT(measured.total, 0.5);
    }
  }
}

TEST(Compress, MakesEveryImageIntegrateToOne) {
  for (const auto method : kMethods) {
    CompressionReport report;
    const auto data = compressPyramid(noise().view(), options(method), &report);
    EXPECT_EQ(report.unscaled_images, 0u);
    EXPECT_LT(measure(noise().view(), data.view()).worst_integral, kFloatError);
  }
}

TEST(Compress, ReportsTheBytesThatItStores) {
  for (const auto method : kMethods) {
    CompressionReport report;
    const auto data = compressPyramid(noise().view(), options(method), &report);
    EXPECT_EQ(report.basis_bytes, 4 * data.basis.size());
    EXPECT_EQ(report.coefficient_bytes, data.coefficients.size() + 4 * data.scales.size() + 4 * data.spot_sums.size());
    EXPECT_EQ(report.total_bytes, report.basis_bytes + report.coefficient_bytes + 2 * data.image_regions.size() +
                                      2 * data.image_slots.size() + 4 * data.image_scales.size() + 32 * data.clusters.size() +
                                      8 * data.masks.size() + 4 * data.mask_ranks.size() + 4 * data.density_scales.size() +
                                      8 * data.block_masks.size() + 4 * data.first_block.size() + data.block_masses.size() +
                                      2 * data.block_places.size() + 2 * data.place_blocks.size() + data.core.size() +
                                      data.floors.size());
    std::uint64_t slices = 0, clusters = 0;
    for (const NdfCluster& c : data.clusters) slices += c.slice_count;
    for (const std::uint64_t count : report.rank_histogram) clusters += count;
    EXPECT_EQ(report.total.slices, slices);
    EXPECT_EQ(clusters, static_cast<std::uint64_t>(std::count_if(data.clusters.begin(), data.clusters.end(),
                                                                 [](const NdfCluster& c) { return c.slice_count > 0; })));
  }
}

TEST(Compress, GivesTheSameBytesForAnyNumberOfThreads) {
  for (const auto method : kMethods) {
    for (const double tolerance : {0.0, 0.2}) {
      auto o = options(method, CoefficientType::i8, 8);
      o.tolerance = tolerance;
      const auto compress = [&](std::size_t threads) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        return compressPyramid(noise().view(), o);
      };
      const auto one = compress(1);
      const auto many = compress(4);
      EXPECT_EQ(one.basis, many.basis);
      EXPECT_EQ(one.coefficients, many.coefficients);
      EXPECT_EQ(one.scales, many.scales);
      EXPECT_EQ(one.image_scales, many.image_scales);
    }
  }
}

TEST(Compress, MeetsAToleranceAndIsNotFarBelowIt) {
  for (const auto method : kMethods) {
    for (const double tolerance : {0.3, 0.15}) {
      auto o = options(method);
      o.tolerance = tolerance;
      const auto data = compressPyramid(noise().view(), o);
      const double error = measure(noise().view(), data.view()).total;
      EXPECT_LE(error, tolerance * (1 + kFloatError));
      EXPECT_GE(error, tolerance * 0.98) << "method " << static_cast<int>(method);
    }
  }
}

/// Seen error of each level of decoded data, by the slow decoder.
std::vector<SeenSummary> seenErrors(const NdfPyramid& pyramid, const NdfCp& compressed) {
  std::vector<SeenSummary> result;
  for (int l = 0; l < pyramid.shape.level_count; ++l) {
    SeenError error(pyramid.shape.resolution);
    for (std::size_t i = 0; i < pyramid.shape.levels[l].imageCount(); ++i) {
      const auto expected = test::storedImage(pyramid, l, i);
      const auto decoded = test::decodeDensities(compressed, compressed.first_image[l] + static_cast<std::uint32_t>(i));
      const std::vector<float> truth(expected.begin(), expected.end()), shown(decoded.begin(), decoded.end());
      error.add(shown.data(), truth.data());
    }
    result.push_back(error.summary());
  }
  return result;
}

TEST(Compress, MeetsAToleranceOfTheSeenErrorInEveryLevel) {
  constexpr double kTightness = 0.9;  // of the level that is nearest to the tolerance
  PyramidShape shape = test::makeShape(128, 64, 16, 3);
  shape.sigma_r = 0.03f;  // about a pixel
  const TestPyramid noise = test::makePyramid(test::isotropicNoise(128, 0.2f, 1), shape),
                    flakes = test::makePyramid(test::flakes(128, 5, 24, 2), shape);
  for (const auto method : kMethods) {
    for (const TestPyramid* pyramid : {&noise, &flakes}) {
      auto o = options(method);
      o.coefficient_type.reset();
      o.metric = ErrorMetric::seen;
      // The rank of cp ends at 64; and blocks of a few facets reach from 10,000 to nothing within a pixel.
      o.tolerance = method == CompressionMethod::cp ? 0.4 : pyramid == &noise ? 0.1 : 0.3;
      CompressionReport report;
      const auto data = compressPyramid(pyramid->view(), o, &report);
      const std::vector<SeenSummary> seen = seenErrors(pyramid->view(), data.view());
      double most = 0;
      for (std::size_t l = 0; l < seen.size(); ++l) {
        EXPECT_LE(seen[l].seen, o.tolerance * 1.01) << "level " << l;
        // The report counts errors of cells that are not lit, too.
        EXPECT_GE(report.levels[l].seen.seen, seen[l].seen - 0.01 * o.tolerance);
        EXPECT_LE(report.levels[l].seen.seen, seen[l].seen + 0.1 * o.tolerance);
        // The report leaves out cells that only the decoded images light.
        EXPECT_LE(report.levels[l].seen.worst, 1.02 * seen[l].worst + 1e-3);
        EXPECT_LE(report.levels[l].seen.bias, 1.02 * seen[l].bias + 1e-3);
        if (pyramid == &noise) {
          EXPECT_NEAR(report.levels[l].seen.bias, seen[l].bias, 0.02 * seen[l].bias + 1e-3);
        }
        most = std::max(most, seen[l].seen);
      }
      // On a map of few flakes the bounds of blocks ask for more than the tolerance does.
      if (pyramid == &noise) {
        EXPECT_GE(most, kTightness * o.tolerance);
      }
    }
  }
}

TEST(Compress, KeepsDimLightThatARelativeErrorLoses) {
  // A bright peak beside dim lobes, which differ from place to place.
  PyramidShape shape = test::makeShape(128, 64, 16, 1);
  shape.sigma_r = 0.02f;
  TestPyramid pyramid;
  pyramid.shape = shape;
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-0.4f, 0.4f);
  for (int image = 0; image < 64; ++image) {
    std::vector<float> pixels(64 * 64, 0.0f);
    test::addLobe(pixels, 64, {0, 0}, 0.02f, 0.98f);
    for (int k = 0; k < 4; ++k) test::addLobe(pixels, 64, {place(random), place(random)}, 0.06f, 0.005f);
    pyramid.addImage(0, pixels);
  }
  auto o = options(CompressionMethod::tucker, CoefficientType::i8, 16, 1);
  o.tolerance = 0.1;
  const auto by_l2 = seenErrors(pyramid.view(), compressPyramid(pyramid.view(), o).view());
  o.metric = ErrorMetric::seen;
  const auto by_seen = seenErrors(pyramid.view(), compressPyramid(pyramid.view(), o).view());
  EXPECT_GT(by_l2[0].seen, 0.8);
  EXPECT_LE(by_seen[0].seen, 0.101);
}

/// Light of a level at places that are nearly dark, over its light at all places; 0: no haze. Towards each half vector, a place
/// is dark where it has less than a hundredth of the root mean square of all places.
double haze(const NdfPyramid& pyramid, const NdfCp& compressed) {
  const std::size_t images = pyramid.shape.levels[0].imageCount();
  std::vector<std::vector<double>> truths, shown;
  for (std::size_t i = 0; i < images; ++i) {
    truths.push_back(test::storedImage(pyramid, 0, i));
    shown.push_back(test::decodeDensities(compressed, static_cast<std::uint32_t>(i)));
  }
  double in_dark = 0, all = 0;
  for (std::size_t p = 0; p < truths[0].size(); ++p) {
    double square = 0;
    for (const auto& truth : truths) square += truth[p] * truth[p] / static_cast<double>(images);
    for (std::size_t i = 0; i < images; ++i) {
      all += truths[i][p];
      if (truths[i][p] < 0.01 * std::sqrt(square)) in_dark += shown[i][p];
    }
  }
  return in_dark / all;
}

TEST(Compress, LeavesTheDarkBetweenFarFacetsDark) {
  // Flakes of a few texels each.
  constexpr double kMost = 0.75;  // of the haze that would be without floors
  PyramidShape shape = test::makeShape(256, 128, 16, 1);
  shape.sigma_r = 0.02f;  // 1.3 pixels
  const TestPyramid pyramid = test::makePyramid(test::flakes(256, 6, 2000, 2), shape);
  for (const auto method : {CompressionMethod::tucker, CompressionMethod::pca}) {
    for (const bool spots : {false, true}) {
      auto o = options(method);
      o.metric = ErrorMetric::seen;
      o.tolerance = 0.2;
      o.coefficient_type.reset();
      o.spots = spots;
      const auto data = compressPyramid(pyramid.view(), o);
      NdfCpData without = data;
      for (NdfCluster& cluster : without.clusters) cluster.floor_unit = 0;
      const double haze_with = haze(pyramid.view(), data.view()), haze_without = haze(pyramid.view(), without.view());
      std::printf("method %d, spots %d: %.4f of the light in the dark, %.4f without floors\n", static_cast<int>(method), spots,
                  haze_with, haze_without);
      EXPECT_LT(haze_with, kMost * haze_without);
    }
  }
}

/// Root mean square of the steps of an error between neighbouring pixels of a row, relative to the light of their half vectors:
/// across the border of two blocks, and inside of blocks.
struct ErrorSteps {
  double at_borders, inside;
};
ErrorSteps errorSteps(const NdfPyramid& pyramid, const NdfCp& compressed) {
  const int n = pyramid.shape.resolution;
  const auto images = pyramid.shape.levels[0].imageCount();
  std::vector<double> light(static_cast<std::size_t>(n) * n);
  std::vector<std::vector<double>> errors;
  for (std::size_t i = 0; i < images; ++i) {
    const auto truth = test::storedImage(pyramid, 0, i);
    auto error = test::decodeDensities(compressed, static_cast<std::uint32_t>(i));
    for (std::size_t p = 0; p < truth.size(); ++p) {
      error[p] -= truth[p];
      light[p] += truth[p] * truth[p] / static_cast<double>(images);
    }
    errors.push_back(std::move(error));
  }
  double sums[2] = {}, counts[2] = {};
  for (int y = 0; y < n; ++y) {
    for (int x = 0; x + 1 < n; ++x) {
      const auto p = static_cast<std::size_t>(y * n + x);
      const double scale = std::sqrt(0.5 * (light[p] + light[p + 1]));
      if (scale < kDarkestSeen) continue;
      const int inside = (x + 1) % kBlockSize != 0;
      for (const auto& error : errors) sums[inside] += std::pow((error[p + 1] - error[p]) / scale, 2);
      counts[inside] += static_cast<double>(images);
    }
  }
  return {std::sqrt(sums[0] / counts[0]), std::sqrt(sums[1] / counts[1])};
}

TEST(Compress, FloorsLowerTheBias) {
  // Cells of half vectors are two pixels wide here, and floors are for four: some bias is left.
  constexpr double kMost = 0.6;  // of the bias without floors
  PyramidShape shape = test::makeShape(256, 128, 16, 1);
  shape.sigma_r = 0.02f;
  const TestPyramid pyramid = test::makePyramid(test::isotropicNoise(256, 0.2f, 1), shape);
  for (const auto method : {CompressionMethod::tucker, CompressionMethod::pca}) {
    auto o = options(method, CoefficientType::i8, 16, 1);
    o.metric = ErrorMetric::seen;
    o.tolerance = 0.2;
    NdfCpData data = compressPyramid(pyramid.view(), o);
    const double with = seenErrors(pyramid.view(), data.view())[0].bias;
    for (NdfCluster& cluster : data.clusters) cluster.floor_unit = 0;
    const double without = seenErrors(pyramid.view(), data.view())[0].bias;
    std::printf("method %d: bias %.3f, %.3f without floors\n", static_cast<int>(method), with, without);
    EXPECT_LT(with, kMost * without);
  }
}

/// Largest seen error of an angular block of level 0, over its lit cells, by the slow decoder.
double worstBlock(const NdfPyramid& pyramid, const NdfCp& compressed) {
  SeenError error(pyramid.shape.resolution);
  for (std::size_t i = 0; i < pyramid.shape.levels[0].imageCount(); ++i) {
    const auto expected = test::storedImage(pyramid, 0, i);
    const auto decoded = test::decodeDensities(compressed, compressed.first_image[0] + static_cast<std::uint32_t>(i));
    const std::vector<float> truth(expected.begin(), expected.end()), shown(decoded.begin(), decoded.end());
    error.add(shown.data(), truth.data());
  }
  const std::vector<double> errors = error.errors();
  const int cells = static_cast<int>(std::lround(std::sqrt(static_cast<double>(errors.size())))),
            side = cells / pyramid.shape.blocksPerAxis();
  double worst = 0;
  for (int block = 0; block < pyramid.shape.blocksPerImage(); ++block) {
    double sum = 0, lit = 0;
    for (int k = 0; k < side * side; ++k) {
      const int x = block % pyramid.shape.blocksPerAxis() * side + k % side,
                y = block / pyramid.shape.blocksPerAxis() * side + k / side;
      const double e = errors[static_cast<std::size_t>(y * cells + x)];
      sum += e * e, lit += e > 0;
    }
    worst = std::max(worst, lit > 0 ? std::sqrt(sum / lit) : 0.0);
  }
  return worst;
}

TEST(Compress, BoundsTheErrorOfEveryBlock) {
  // Cells that only the decoded images light count here, and not in the bound.
  constexpr double kMost = 2.2;  // times the tolerance
  PyramidShape shape = test::makeShape(256, 128, 16, 1);
  shape.sigma_r = 0.02f;  // 1.3 pixels
  const TestPyramid flakes = test::makePyramid(test::flakes(256, 6, 2000, 2), shape),
                    noise = test::makePyramid(test::isotropicNoise(256, 0.2f, 1), shape);
  for (const TestPyramid* pyramid : {&flakes, &noise}) {
    for (const auto method : {CompressionMethod::tucker, CompressionMethod::pca}) {
      auto o = options(method, CoefficientType::i8, 16, 1);
      o.metric = ErrorMetric::seen;
      o.tolerance = 0.2;
      const double worst = worstBlock(pyramid->view(), compressPyramid(pyramid->view(), o).view());
      std::printf("method %d: worst block %.3f\n", static_cast<int>(method), worst);
      EXPECT_LT(worst, kMost * o.tolerance);
    }
  }
}

TEST(Compress, ErrsAcrossBordersOfBlocksAsIndependentErrorsDo) {
  // Blocks are compressed apart, so errors on both sides of a border are independent, and steps there are sqrt(2) times the
  // error. Inside of blocks errors of neighbours resemble each other, and steps are smaller.
  constexpr double kAboveMean = 1.2;   // error at borders over that of all pixels: bases fit a block worst at its edges
  constexpr double kOverInside = 1.9;  // the largest that was measured is 1.83, of pca
  PyramidShape shape = test::makeShape(128, 64, 16, 1);
  shape.sigma_r = 0.03f;
  const TestPyramid pyramid = test::makePyramid(test::isotropicNoise(128, 0.2f, 1), shape);
  for (const auto method : kMethods) {
    auto o = options(method);
    o.metric = ErrorMetric::seen;
    o.tolerance = method == CompressionMethod::cp ? 0.4 : 0.1;
    o.coefficient_type.reset();
    const auto data = compressPyramid(pyramid.view(), o);
    const ErrorSteps steps = errorSteps(pyramid.view(), data.view());
    std::printf("method %d: steps of the error %.3f at borders, %.3f inside of blocks\n", static_cast<int>(method),
                steps.at_borders, steps.inside);
    EXPECT_LT(steps.at_borders, kAboveMean * std::sqrt(2.0) * o.tolerance);
    EXPECT_LT(steps.at_borders, kOverInside * steps.inside);
  }
}

TEST(Compress, TakesMoreBitsWhereAToleranceNeedsThem) {
  CompressionOptions o;
  o.metric = ErrorMetric::l2;
  o.tolerance = 3e-4;
  CompressionReport report;
  compressPyramid(noise().view(), o, &report);
  EXPECT_NE(report.coefficient_type, CoefficientType::i8);
  EXPECT_LE(report.total.rel_l2, o.tolerance);
  o.tolerance = 0.1;
  compressPyramid(noise().view(), o, &report);
  EXPECT_EQ(report.coefficient_type, CoefficientType::i8);
}

TEST(Compress, StoresTheErrorOfFixedRanksInAThirdOfTheBytes) {
  auto fixed = options(CompressionMethod::cp, CoefficientType::i8, 16, 8);
  CompressionReport cp;
  compressPyramid(noise().view(), fixed, &cp);
  auto chosen = options(CompressionMethod::tucker, CoefficientType::i8, 16, 0);
  chosen.tolerance = cp.total.rel_l2;
  CompressionReport tucker;
  compressPyramid(noise().view(), chosen, &tucker);
  EXPECT_LE(tucker.total.rel_l2, cp.total.rel_l2);
  EXPECT_LE(3 * tucker.total_bytes, cp.total_bytes);
}

TEST(Compress, StoresFlakesAsSpotsInHalfTheBytesOfColumns) {
  // Flakes of a few texels each: every slice holds few directions, which differ from place to place.
  const TestPyramid pyramid = test::makePyramid(test::flakes(256, 6, 4000, 2), [] {
    PyramidShape shape = test::makeShape(256, 64, 16, 2);
    shape.sigma_r = 0.02f;  // 0.64 pixel
    return shape;
  }());
  CompressionReport spots, columns;
  auto o = options(CompressionMethod::tucker, CoefficientType::i8, 16, 1);
  o.tolerance = 0.25;
  const auto data = compressPyramid(pyramid.view(), o, &spots);
  EXPECT_GT(spots.spot_slices, spots.total.slices / 3);
  const Measured measured = measure(pyramid.view(), data.view());
  EXPECT_NEAR(measured.total, spots.total.rel_l2, 1e-3 * measured.total);
  EXPECT_LT(measured.worst_integral, 1e-3);
  o.spots = false;
  compressPyramid(pyramid.view(), o, &columns);
  EXPECT_EQ(columns.spot_slices, 0u);
  EXPECT_LT(2 * spots.total_bytes, columns.total_bytes);
}

TEST(Compress, SpotsHaveTheLightOfTheirBlocks) {
  // Many small flakes: the spots that a tolerance leaves out hold light, which no direction may lose.
  constexpr double kMost = 0.02;  // density_scales, and images whose light is scaled otherwise
  PyramidShape shape = test::makeShape(256, 64, 16, 1);
  shape.sigma_r = 0.02f;
  const TestPyramid pyramid = test::makePyramid(test::flakes(256, 6, 4000, 2), shape);
  auto o = options(CompressionMethod::tucker, CoefficientType::i8, 16, 1);
  o.metric = ErrorMetric::seen;
  o.tolerance = 0.4;
  const auto data = compressPyramid(pyramid.view(), o);
  const int per_row = shape.resolution / kBlockSize;
  std::vector<double> truths(data.view().block_places.size()), shown(truths.size());
  const NdfPyramid stored = pyramid.view();
  for (std::size_t i = 0; i < stored.shape.levels[0].imageCount(); ++i) {
    const auto truth = test::storedImage(stored, 0, i);
    const auto image = test::decodeDensities(data.view(), static_cast<std::uint32_t>(i));
    for (std::size_t p = 0; p < truth.size(); ++p) {
      const auto x = static_cast<int>(p) % shape.resolution, y = static_cast<int>(p) / shape.resolution;
      const auto block = static_cast<std::size_t>(y / kBlockSize * per_row + x / kBlockSize);
      truths[block] += truth[p];
      shown[block] += image[p];
    }
  }
  int blocks = 0;
  for (std::size_t place = 0; place < data.place_blocks.size(); ++place) {
    const std::size_t block = data.place_blocks[place];
    if (data.clusters[place].columns > 0 || !(shown[block] > 0)) continue;
    EXPECT_NEAR(shown[block] / truths[block], 1, kMost) << block;
    ++blocks;
  }
  EXPECT_GE(blocks, 2);
}

TEST(Compress, SpendsFewerBytesOnALargerTolerance) {
  std::uint64_t previous = std::numeric_limits<std::uint64_t>::max();
  for (const double tolerance : {0.05, 0.1, 0.2, 0.4, 0.8}) {
    auto o = options(CompressionMethod::tucker);
    o.tolerance = tolerance;
    CompressionReport report;
    compressPyramid(flakes().view(), o, &report);
    EXPECT_LT(report.total_bytes, previous);
    previous = report.total_bytes;
  }
}

TEST(Compress, EmptiesClustersThatAToleranceLeavesWithoutColumns) {
  auto o = options(CompressionMethod::pca);
  o.tolerance = 0.8;
  o.spots = false;
  CompressionReport report;
  const auto data = compressPyramid(flakes().view(), o, &report);
  ASSERT_FALSE(report.rank_histogram.empty());
  ASSERT_GT(report.rank_histogram[0], 0u) << "the tolerance is too small for this test to see anything";
  for (const NdfCluster& cluster : data.clusters) EXPECT_EQ(cluster.slice_count > 0, cluster.columns > 0);
  EXPECT_NEAR(measure(flakes().view(), data.view()).total, report.total.rel_l2, kFloatError + 1e-4 * report.total.rel_l2);
}

TEST(Compress, NamesTheBestErrorWhereAToleranceCannotBeReached) {
  for (const ErrorMetric metric : {ErrorMetric::l2, ErrorMetric::seen}) {
    auto o = options(CompressionMethod::tucker);
    o.metric = metric;
    o.tolerance = 1e-6;
    try {
      compressPyramid(noise().view(), o);
      FAIL() << "a tolerance below the rounding of 8 bits was met";
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::failed);
      const std::string remedy = error.remedy(), words = "at least ";
      ASSERT_NE(remedy.find(words), std::string::npos) << error.what();
      o.tolerance = std::stod(remedy.substr(remedy.find(words) + words.size()));
    }
    EXPECT_LT(o.tolerance, 0.5);
    EXPECT_NO_THROW(compressPyramid(noise().view(), o)) << "the remedy does not work";
  }
}

TEST(Compress, KeepsFullRankUpToTheRoundingOfTheType) {
  const double limits[] = {0.02, 0.002, 1e-4};
  for (std::size_t t = 0; t < std::size(kTypes); ++t) {
    for (const auto method : {CompressionMethod::tucker, CompressionMethod::pca}) {
      CompressionReport report;
      compressPyramid(noise().view(), options(method, kTypes[t], 256), &report);
      EXPECT_LT(report.total.rel_l2, limits[t]);
    }
  }
}

TEST(Compress, LeavesTheTailOfTheSingularValuesWithPca) {
  // Rank k leaves what the singular values from k on hold: the reference has those of the same blocks, in double.
  const TestPyramid& p = noise();
  constexpr int kRank = 6;
  double tail = 0, energy = 0;
  for (int b = 0; b < p.shape.blocksPerImage(); ++b) {
    std::vector<double> slices;
    for (int l = 0; l < p.shape.level_count; ++l) {
      for (std::size_t i = 0; i < p.shape.levels[l].imageCount(); ++i) {
        const auto image = test::storedImage(p.view(), l, i);
        for (int q = 0; q < kBlockPixels; ++q) slices.push_back(image[(b / 4 * 16 + q / 16) * 64 + b % 4 * 16 + q % 16]);
      }
    }
    const std::vector<double> values = test::squaredSingularValues(slices, kBlockPixels);
    energy += std::accumulate(values.begin(), values.end(), 0.0);
    tail += std::accumulate(values.begin() + kRank, values.end(), 0.0);
  }
  CompressionReport report;
  compressPyramid(p.view(), options(CompressionMethod::pca, CoefficientType::f32, kRank, 1), &report);
  // The images are scaled to integrate to 1 afterwards, which moves the error off its minimum.
  EXPECT_NEAR(report.total.rel_l2 / std::sqrt(tail / energy), 1, 0.01);
}

TEST(Compress, ExactlyKeepsAnImageThatNeverChanges) {
  std::vector<float> image(256);
  for (int p = 0; p < 256; ++p) image[p] = static_cast<float>(1 + p % 16) * static_cast<float>(1 + p / 16) / 4624 * 16;
  for (const int count : {1, 2, 40}) {
    const TestPyramid pyramid = singleBlocks(std::vector<std::vector<float>>(count, image));
    for (const auto method : kMethods) {
      CompressionReport report;
      const auto data = compressPyramid(pyramid.view(), options(method, CoefficientType::i8, 16, 1), &report);
      EXPECT_EQ(data.clusters[0].columns, 1);
      EXPECT_LT(report.total.rel_l2, 1e-3);
    }
  }
}

TEST(Compress, TakesSinglePixelsAndUniformImages) {
  std::vector<float> pixel(256, 0.0f);
  pixel[37] = 64;
  const TestPyramid p = singleBlocks({pixel, std::vector<float>(256, 0.25f)});
  for (const auto method : kMethods) {
    for (const auto type : kTypes) {
      CompressionReport report;
      const auto data = compressPyramid(p.view(), options(method, type, 16, 1), &report);
      EXPECT_LT(report.total.rel_l2, 1e-2);
      for (const float scale : data.image_scales) EXPECT_NEAR(scale, 1, 0.02);
    }
  }
}

TEST(Compress, StaysFiniteOverAHugeDynamicRange) {
  std::vector<std::vector<float>> images;
  for (int i = 0; i < 24; ++i) {
    std::vector<float> image(256);
    for (int p = 0; p < 256; ++p) image[p] = std::exp2(static_cast<float>((i * 37 + p * 11) % 220 - 110));
    images.push_back(image);
  }
  images.push_back(std::vector<float>(256, std::numeric_limits<float>::denorm_min()));
  images.push_back(std::vector<float>(256, 0.0f));
  const TestPyramid pyramid = singleBlocks(images);
  for (const auto method : kMethods) {
    for (const auto type : kTypes) {
      CompressionReport report;
      const auto data = compressPyramid(pyramid.view(), options(method, type, 32, 1), &report);
      EXPECT_TRUE(std::isfinite(report.total.rel_l2));
      for (const float scale : data.scales) EXPECT_TRUE(std::isfinite(scale));
      for (const float scale : data.image_scales) EXPECT_TRUE(std::isfinite(scale));
    }
  }
}

TEST(Compress, TakesAPyramidOfZeros) {
  const TestPyramid pyramid = singleBlocks({std::vector<float>(256, 0.0f), std::vector<float>(256, 0.0f)});
  for (const auto method : kMethods) {
    for (const double tolerance : {0.0, 0.1}) {
      auto o = options(method, CoefficientType::i8, 16, 1);
      o.tolerance = tolerance;
      CompressionReport report;
      const auto data = compressPyramid(pyramid.view(), o, &report);
      EXPECT_TRUE(data.clusters.empty());
      EXPECT_EQ(data.header.places, 0);
      EXPECT_EQ(report.unscaled_images, 2u);
      EXPECT_EQ(report.total.rel_l2, 0);
    }
  }
}

TEST(Compress, PutsImagesInTheRegionOfTheirLevelAndCentre) {
  const auto data = compressPyramid(noise().view(), options(CompressionMethod::tucker, CoefficientType::i8, 4, 3));
  const NdfCp c = data.view();
  std::vector<int> next(27, 0);
  for (int l = 0; l < c.shape.level_count; ++l) {
    const PyramidGrid& grid = c.shape.levels[l];
    for (int j = 0; j < grid.rows; ++j) {
      for (int i = 0; i < grid.columns; ++i) {
        const std::uint32_t image = c.first_image[l] + j * grid.columns + i;
        const auto region = [](float centre) { return std::min(2, static_cast<int>(centre * 3 / 128)); };
        const Vec2 centre = c.shape.centre(l, i, j);
        EXPECT_EQ(c.image_regions[image], (l * 3 + region(centre.y)) * 3 + region(centre.x));
        EXPECT_EQ(c.image_slots[image], next[c.image_regions[image]]++);
      }
    }
  }
}

TEST(Compress, StoresIntegersUpTo2To20) {
  constexpr double kPeak = 1 << 20;

  for (const auto method : kMethods) {
    const auto data = compressPyramid(noise().view(), options(method));
    const NdfCp c = data.view();
    int checked = 0;
    for (const NdfCluster& cluster : c.clusters) {
      const int columns = method == CompressionMethod::tucker ? 0 : cluster.columns;
      for (int k = 0; k < columns; ++k, ++checked) {
        double largest = 0;
        for (int y = 0; y < kBlockSize; ++y)
          for (int x = 0; x < kBlockSize; ++x) largest = std::max(largest, std::abs(test::basisValue(c, cluster, k, x, y)));
        EXPECT_EQ(largest, method == CompressionMethod::cp ? kPeak * kPeak : kPeak);
      }
    }
    EXPECT_EQ(checked > 0, method != CompressionMethod::tucker);
  }
}

TEST(Compress, ReportsProgressToTheEnd) {
  // The last tolerance is met with coefficients of more bits, in another attempt.
  for (const double tolerance : {0.0, 0.1, 3e-4}) {
    auto o = options(CompressionMethod::pca);
    o.coefficient_type.reset();
    o.tolerance = tolerance;
    std::size_t last = 0, whole = 0;
    bool falling = false;
    compressPyramid(noise().view(), o, nullptr, [&](std::size_t done, std::size_t total) {
      falling |= done < last;
      last = done;
      whole = total;
    });
    EXPECT_FALSE(falling);
    EXPECT_GT(whole, 0u);
    EXPECT_EQ(last, whole);
  }
}

TEST(Compress, RefusesOptionsOutOfRange) {
  const auto refuses = [](auto change) {
    CompressionOptions o;
    change(o);
    try {
      compressPyramid(noise().view(), o);
    } catch (const Error& error) {
      return error.code() == ErrorCode::usage;
    }
    return false;
  };
  EXPECT_TRUE(refuses([](auto& o) { o.rank = 0; }));
  EXPECT_TRUE(refuses([](auto& o) { o.rank = 257; }));
  EXPECT_TRUE(refuses([](auto& o) { o.tolerance = -0.1; }));
  EXPECT_TRUE(refuses([](auto& o) { o.tolerance = 1; }));
  EXPECT_TRUE(refuses([](auto& o) { o.tolerance = std::nan(""); }));
  EXPECT_TRUE(refuses([](auto& o) { o.regions = 256; }));
  EXPECT_TRUE(refuses([](auto& o) { o.max_iterations = 0; }));
  EXPECT_FALSE(refuses([](auto&) {}));
}

TEST(Compress, RefusesPyramidsThatContradictThemselves) {
  const auto refuses = [](auto change) {
    TestPyramid broken = noise();
    change(broken);
    try {
      compressPyramid(broken.view(), options(CompressionMethod::tucker));
    } catch (const Error& error) {
      return error.code() == ErrorCode::invalid_input;
    }
    return false;
  };
  EXPECT_TRUE(refuses([](auto& p) { p.masks[1].pop_back(); }));
  EXPECT_TRUE(refuses([](auto& p) { p.mask_ranks[0].pop_back(); }));
  EXPECT_TRUE(refuses([](auto& p) { p.masks[0][3] ^= 1; }));
  EXPECT_TRUE(refuses([](auto& p) { p.pixels[0][77] = std::nanf(""); }));
  EXPECT_TRUE(refuses([](auto& p) { p.pixels[0][77] = std::numeric_limits<float>::infinity(); }));
  EXPECT_TRUE(refuses([](auto& p) { p.shape.resolution = 60; }));
  EXPECT_FALSE(refuses([](auto&) {}));
}

}  // namespace
}  // namespace glint::bake::compress_test
