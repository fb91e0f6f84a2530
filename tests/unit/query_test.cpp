#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <tuple>

#include "glint/bake/compressed/compress.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/manifold_ndf.h"
#include "glint/query/pyramid_ndf.h"
#include "glint/query/reference.h"
#include "support/test_maps.h"
#include "unit/compress_reference.h"

namespace glint::query_test {
namespace {

using bake::NdfCpData;
using bake::NdfPyramidData;
using test::OwnedMap;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kResolution = 64;

/// Sums of up to 64^2 float terms, relative to the sum of their magnitudes.
constexpr double kSumError = 1e-5;

const OwnedMap& map() {
  static const OwnedMap owned(100, 72, test::roughSurface(100, 72, 0.3f));
  return owned;
}

/// Strides 16, 32 and 64 divide neither side.
const NdfPyramidData& pyramid(Boundary boundary = Boundary::wrap, BlockPrecision precision = BlockPrecision::f16) {
  static std::map<std::pair<Boundary, BlockPrecision>, NdfPyramidData> built;
  const auto key = std::pair{boundary, precision};
  if (!built.contains(key)) {
    bake::PyramidOptions o;
    o.stride = 16;
    o.resolution = kResolution;
    o.sigma_r = 0.02f;
    o.boundary = boundary;
    o.levels = 3;
    o.precision = precision;
    built[key] = bake::buildPyramid(map().map(), o);
  }
  return built[key];
}

const NdfCpData& compressed(CompressionMethod method, CoefficientType type) {
  static std::map<std::pair<CompressionMethod, CoefficientType>, NdfCpData> built;
  const auto key = std::pair{method, type};
  if (!built.contains(key)) {
    bake::CompressionOptions o;
    o.method = method;
    o.coefficient_type = type;
    o.rank = 6;  // coarse enough to have values below zero
    o.regions = 2;
    built[key] = bake::compressPyramid(pyramid().view(), o);
  }
  return built[key];
}

/// With a tolerance: columns of 4 bits.
const NdfCpData& compressedToTolerance(CompressionMethod method) {
  static std::map<CompressionMethod, NdfCpData> built;
  if (!built.contains(method)) {
    bake::CompressionOptions o;
    o.method = method;
    o.tolerance = 0.2;
    o.metric = bake::ErrorMetric::l2;
    built[method] = bake::compressPyramid(pyramid().view(), o);
    int narrow = 0;
    for (const NdfCluster& cluster : built[method].clusters) narrow += cluster.narrow_columns;
    EXPECT_GT(narrow, 0);
  }
  return built[method];
}

/// A pyramid of few facets, stored as spots.
const NdfCpData& ndfCpSpots() {
  static const NdfCpData data = [] {
    const OwnedMap flakes(100, 72, test::synthesised(bake::SynthKind::flakes, 100, 72, 0.3f));
    bake::PyramidOptions p;
    p.stride = 16;
    p.resolution = kResolution;
    p.sigma_r = 0.02f;
    p.levels = 3;
    bake::CompressionOptions o;
    o.tolerance = 0.3;
    o.metric = bake::ErrorMetric::l2;
    bake::CompressionReport report;
    auto made = bake::compressPyramid(bake::buildPyramid(flakes.map(), p).view(), o, &report);
    EXPECT_GT(report.spot_slices, 0u);
    return made;
  }();
  return data;
}

/// Calls visitor(CpNdf, data) for every method, coefficient type, and form of slices.
template <class Visitor>
void forEachCompression(Visitor&& visitor) {
  for (const auto method : {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca}) {
    for (const auto type : {CoefficientType::i8, CoefficientType::f16, CoefficientType::f32}) {
      SCOPED_TRACE("method " + std::to_string(int(method)) + " type " + std::to_string(int(type)));
      visitor(CpNdf(compressed(method, type).view()), compressed(method, type));
    }
  }
  for (const auto method : {CompressionMethod::tucker, CompressionMethod::pca}) {
    SCOPED_TRACE("tolerance, method " + std::to_string(int(method)));
    visitor(CpNdf(compressedToTolerance(method).view()), compressedToTolerance(method));
  }
  SCOPED_TRACE("spots");
  visitor(CpNdf(ndfCpSpots().view()), ndfCpSpots());
}

class RandomQueries {
 public:
  explicit RandomQueries(unsigned seed) : random_(seed) {}
  float unit() { return std::uniform_real_distribution<float>(0, 1)(random_); }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(random_); }
  Footprint footprint(float low = 5, float high = 60) {
    return Footprint::isotropic({unit(), unit()}, low * std::pow(high / low, unit()));
  }
  /// Whole pixels [x0, x1) x [y0, y1) of an image, at random.
  std::array<int, 4> pixels() {
    const int x = below(kResolution), y = below(kResolution);
    return {x, y, x + 1 + below(kResolution - x), y + 1 + below(kResolution - y)};
  }

 private:
  std::mt19937 random_;
};

float toHalfVector(int pixel) { return -1 + static_cast<float>(pixel) * 2 / kResolution; }

/// Mean over whole pixels, from point queries, and the mean of their magnitudes.
template <class Density>
std::pair<double, double> meanOfPoints(const std::array<int, 4>& p, const Density& density) {
  double sum = 0, magnitude = 0;
  for (int y = p[1]; y < p[3]; ++y) {
    for (int x = p[0]; x < p[2]; ++x) {
      const double d = density(Vec2{toHalfVector(x) + 1.0f / kResolution, toHalfVector(y) + 1.0f / kResolution});
      sum += d;
      magnitude += std::abs(d);
    }
  }
  const double count = (p[2] - p[0]) * (p[3] - p[1]);
  return {sum / count, magnitude / count};
}

Box2 boxOf(const std::array<int, 4>& p) {
  return {{toHalfVector(p[0]), toHalfVector(p[1])}, {toHalfVector(p[2]), toHalfVector(p[3])}};
}

TEST(PyramidNdf, MeanOverPixelsIsTheMeanOfPointQueries) {
  RandomQueries random(1);
  for (const BlockPrecision precision : {BlockPrecision::f16, BlockPrecision::f32}) {
    const PyramidNdf model(pyramid(Boundary::wrap, precision).view());
    for (int k = 0; k < 200; ++k) {
      const Footprint p = random.footprint();
      const auto pixels = random.pixels();
      const auto [mean, magnitude] = meanOfPoints(pixels, [&](Vec2 h) { return model.pixelMean(p, h); });
      EXPECT_NEAR(model.mean(p, boxOf(pixels)), mean, kSumError * magnitude);
    }
  }
}

TEST(PyramidNdf, PartsOfConstantPixelsCountByTheirArea) {
  const PyramidNdf model(pyramid().view(), Interpolation::footprint, Pixels::constant);
  RandomQueries random(2);
  for (int k = 0; k < 100; ++k) {
    const Footprint p = random.footprint();
    // A box of 2x2 pixels around a pixel corner, moved by (a, b) of a pixel.
    const int x = 1 + random.below(kResolution - 3), y = 1 + random.below(kResolution - 3);
    const double a = random.below(64) / 64.0, b = random.below(64) / 64.0;
    double expected = 0;
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 3; ++i) {
        const double wx = i == 0 ? 1 - a : i == 1 ? 1 : a, wy = j == 0 ? 1 - b : j == 1 ? 1 : b;
        expected += wx * wy *
                    model.pixelMean(p, {toHalfVector(x + i) + 1.0f / kResolution, toHalfVector(y + j) + 1.0f / kResolution}) /
                    4;
      }
    const Vec2 low = {toHalfVector(x) + static_cast<float>(a) * 2 / kResolution,
                      toHalfVector(y) + static_cast<float>(b) * 2 / kResolution};
    EXPECT_NEAR(model.mean(p, {low, low + Vec2{4.0f / kResolution, 4.0f / kResolution}}), expected, kSumError * (expected + 1));
  }
}

TEST(CpNdf, SignedMeanOverPixelsIsTheMeanOfSignedPointQueries) {
  forEachCompression([](const CpNdf& model, const NdfCpData&) {
    RandomQueries random(3);
    int negative = 0;
    for (int k = 0; k < 60; ++k) {
      const Footprint p = random.footprint();
      const auto pixels = random.pixels();
      const auto [mean, magnitude] = meanOfPoints(pixels, [&](Vec2 h) {
        const double d = model.signedDensity(p, h);
        negative += d < 0;
        return d;
      });
      // Columns of a few times the size of the result cancel.
      EXPECT_NEAR(model.signedMean(p, boxOf(pixels)), mean, kSumError * (10 * magnitude + 1));
      EXPECT_EQ(model.mean(p, boxOf(pixels)), std::max(0.0f, model.signedMean(p, boxOf(pixels))));
    }
    EXPECT_GT(negative, 0);  // otherwise nothing was said about signs
  });
}

/// Positive pixels around a pixel of an image.
PixelWindow windowOf(const std::vector<double>& image, int x, int y) {
  PixelWindow window;
  for (int j = 0; j < PixelWindow::kSize; ++j)
    for (int i = 0; i < PixelWindow::kSize; ++i) {
      const int column = x + i - 1, row = y + j - 1;
      if (column < 0 || column >= kResolution || row < 0 || row >= kResolution) continue;
      window.pixels[j][i] = static_cast<float>(image[static_cast<std::size_t>(row * kResolution + column)]);
    }
  return window;
}

TEST(CpNdf, EqualsASlowDecoderAtItsCentres) {
  constexpr double kFactorError = 1e-5;  // of the largest value: products of floats
  forEachCompression([](const CpNdf&, const NdfCpData& data) {
    const NdfCp view = data.view();
    const CpNdf model(view, Interpolation::trilinear), constant(view, Interpolation::trilinear, Pixels::constant);
    for (int l = 0; l < view.shape.level_count; ++l) {
      const PyramidGrid& grid = view.shape.levels[l];
      const float sigma = l < view.shape.footprintLevels() ? kFootprintPerStride * grid.stride : 1e6f;  // the mean of the map
      for (const auto& [i, j] : {std::pair{0, 0}, {grid.columns / 2, grid.rows - 1}}) {
        const Vec2 centre = view.shape.centre(l, i, j);
        const Footprint p = Footprint::isotropic({centre.x / 100, centre.y / 72}, sigma);
        const auto expected = test::decodeImage(view, view.first_image[l] + static_cast<std::uint32_t>(j * grid.columns + i));
        const double largest = *std::max_element(expected.begin(), expected.end());
        ASSERT_GT(largest, 1);
        const auto shown = test::decodeDensities(view, view.first_image[l] + static_cast<std::uint32_t>(j * grid.columns + i));
        for (std::size_t k = 0; k < expected.size(); ++k) {
          const Vec2 h = test::pixelCentre(k, kResolution);
          ASSERT_NEAR(model.signedDensity(p, h), expected[k], 10 * kFactorError * largest)
              << l << ' ' << i << ' ' << j << " pixel " << k;
          ASSERT_NEAR(model.pixelMean(p, h), shown[k], 10 * kFactorError * largest);
          ASSERT_NEAR(constant.density(p, h), shown[k], 10 * kFactorError * largest);
        }
        RandomQueries random(6);
        for (int k = 0; k < 200; ++k) {
          const int x = random.below(kResolution), y = random.below(kResolution);
          const Vec2 t = {random.unit(), random.unit()},
                     h = {toHalfVector(x) + t.x * 2 / kResolution, toHalfVector(y) + t.y * 2 / kResolution};
          const PixelSpline spline(windowOf(shown, x, y));
          ASSERT_NEAR(model.density(p, h), spline.density(t), 1e-4 * largest) << x << ' ' << y;
        }
      }
    }
  });
}

TEST(CpNdf, AFullRankBasisReproducesThePyramid) {
  // 64 columns of a block's 256 pixels hold almost all of it; quantised bases have 20 bits.
  constexpr double kBasisError = 0.02;
  bake::CompressionOptions o;
  o.method = CompressionMethod::pca;
  o.coefficient_type = CoefficientType::f32;
  o.rank = 64;
  const NdfCpData data = bake::compressPyramid(pyramid().view(), o);
  const PyramidNdf exact(pyramid().view());
  const CpNdf model(data.view());
  RandomQueries random(4);
  for (int k = 0; k < 10; ++k) {
    const Footprint p = random.footprint(7, 30);
    EXPECT_LT(test::relL2(test::imageOf(model, p, kResolution), test::imageOf(exact, p, kResolution)), kBasisError);
  }
}

/// Checks that hold for every model of a pyramid.
template <class Model>
void expectEnergyOfOne(const Model& model, double tolerance) {
  RandomQueries random(5);
  for (int k = 0; k < 40; ++k) {
    const Footprint p = random.footprint(1, 500);
    EXPECT_NEAR(model(p, Box2{{-1, -1}, {1, 1}}), 0.25, 0.25 * tolerance);
    EXPECT_NEAR(model(p, Box2{{-1, -1}, {3, 1}}), 0.125, 0.125 * tolerance);  // 0 outside the square
  }
}

TEST(PyramidNdf, MeanOverTheWholeSquareIsAQuarter) {
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp})
    expectEnergyOfOne(
        [model = PyramidNdf(pyramid(boundary).view())](const Footprint& p, const Box2& b) { return model.mean(p, b); }, 1e-3);
}

TEST(CpNdf, MeanOverTheWholeSquareIsAQuarter) {
  forEachCompression([](const CpNdf& model, const NdfCpData&) {
    expectEnergyOfOne([&](const Footprint& p, const Box2& b) { return model.signedMean(p, b); }, 1e-4);
  });
}

constexpr Interpolation kInterpolations[] = {Interpolation::footprint, Interpolation::trilinear};

/// Weight of every image, as a sparse vector.
std::map<std::pair<int, std::uint32_t>, double> weightsOf(const PyramidShape& shape, const SliceChooser& chooser,
                                                          const Footprint& p) {
  std::map<std::pair<int, std::uint32_t>, double> weights;
  const PyramidSlices chosen = chooser.choose(p);
  EXPECT_LE(chosen.count, PyramidSlices::kMost);
  for (int k = 0; k < chosen.count; ++k) {
    const PyramidSlice s = chosen[k];
    EXPECT_GE(s.weight, 0);
    EXPECT_LT(s.level, shape.level_count);
    EXPECT_LT(s.image, shape.levels[s.level].imageCount());
    weights[{s.level, s.image}] += s.weight;
  }
  return weights;
}

double distance(const std::map<std::pair<int, std::uint32_t>, double>& a, std::map<std::pair<int, std::uint32_t>, double> b) {
  for (const auto& [image, w] : a) b[image] -= w;
  double sum = 0;
  for (const auto& [image, w] : b) sum += std::abs(w);
  return sum;
}

TEST(PyramidSlices, WeightsAreNotNegativeAndSumToOne) {
  RandomQueries random(6);
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
    for (const Interpolation interpolation : kInterpolations) {
      const PyramidShape& shape = pyramid(boundary).shape;
      const SliceChooser chooser(shape, interpolation);
      for (int k = 0; k < 5000; ++k) {
        double sum = 0;
        for (const auto& [image, w] : weightsOf(shape, chooser, random.footprint(0.1f, 1e4f))) sum += w;
        ASSERT_NEAR(sum, 1, 5e-6);
      }
    }
  }
}

TEST(PyramidSlices, WeightsAreContinuousInPosition) {
  // Bilinear weights change by 2 a gap and axis, and kernels of four centres by less than 4. The shortest gap is 10 texels.
  constexpr double kStep = 0.02, kMostPerStep = 4 * kStep / 10;  // texels
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
    for (const Interpolation interpolation : kInterpolations) {
      const PyramidShape& shape = pyramid(boundary).shape;
      const SliceChooser chooser(shape, interpolation);
      for (const float sigma : {3.0f, 6.93f, 9.0f, 13.86f, 15.0f, 20.0f, 27.7f, 100.0f}) {
        for (const bool along_v : {false, true}) {
          const int steps = static_cast<int>((along_v ? shape.height : shape.width) / kStep);
          const auto at = [&](int k) {
            const auto u = static_cast<float>(static_cast<double>(k % steps) / steps);
            return weightsOf(shape, chooser, Footprint::isotropic(along_v ? Vec2{0.37f, u} : Vec2{u, 0.37f}, sigma));
          };
          auto previous = at(0);
          for (int k = 1; k <= (boundary == Boundary::wrap ? steps : steps - 1); ++k) {  // with wrap, round to where it started
            auto next = at(k);
            ASSERT_LT(distance(previous, next), kMostPerStep) << "sigma " << sigma << " step " << k;
            previous = std::move(next);
          }
        }
      }
    }
  }
}

TEST(PyramidSlices, WeightsAreContinuousInSize) {
  // Trilinear weights are linear in octaves: 2 for each. The fade between levels of footprints takes log2(1.23) octaves: 2 / 0.3
  // for each. Above the last level the share falls at most as exp(-x) over that at the level, with x = 2 pi^2 sigma^2 / width^2:
  // at most 4 ln(2) x <= 16 for each where the level ends at 0.57 of the map. Grids of the last level hand over within a fortieth of
  // an octave, between images that are nearly alike: Interpolation.IsContinuousInSize tests answers.
  constexpr float kStep = 0.01f;  // octaves
  constexpr double kMostTrilinear = 0.045, kMostOfFootprints = 0.16, kMostOfLast = 0.8;
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
    for (const Interpolation interpolation : kInterpolations) {
      const PyramidShape& shape = pyramid(boundary).shape;
      const SliceChooser chooser(shape, interpolation);
      auto previous = weightsOf(shape, chooser, Footprint::isotropic({0.61f, 0.83f}, 2));
      for (float octave = 1; octave < 9; octave += kStep) {
        auto next = weightsOf(shape, chooser, Footprint::isotropic({0.61f, 0.83f}, std::exp2(octave)));
        const bool last = boundary == Boundary::wrap &&
                          std::exp2(octave) > kFootprintPerStride * shape.levels[shape.footprintLevels() - 1].stride;
        ASSERT_LT(distance(previous, next), interpolation == Interpolation::trilinear ? kMostTrilinear
                                            : last                                    ? kMostOfLast
                                                                                      : kMostOfFootprints)
            << octave;
        previous = std::move(next);
      }
    }
  }
}

TEST(PyramidSlices, CentresGetTheirOwnImageOfTrilinearInterpolation) {
  constexpr double kCentreError = 1e-4;  // a centre as uv is rounded: 1e-5 of the gap between centres
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
    const PyramidShape& shape = pyramid(boundary).shape;
    const SliceChooser chooser(shape, Interpolation::trilinear);
    for (int l = 0; l < shape.footprintLevels(); ++l) {
      const PyramidGrid& grid = shape.levels[l];
      for (int j = 0; j < grid.rows; ++j) {
        for (int i = 0; i < grid.columns; ++i) {
          const Vec2 centre = shape.centre(l, i, j), uv = {centre.x / 100, centre.y / 72};
          auto weights = weightsOf(shape, chooser, Footprint::isotropic(uv, kFootprintPerStride * grid.stride));
          EXPECT_NEAR((weights[{l, static_cast<std::uint32_t>(j * grid.columns + i)}]), 1, kCentreError)
              << l << ' ' << i << ' ' << j;
        }
      }
    }
  }
}

/// Checks that hold for every model of a pyramid, in the way that a user sees them.
template <class Model>
void expectLevelsAreExtended(const Model& model, const Model& with_normals, const Boundary boundary) {
  RandomQueries random(7);
  const ManifoldNdf exact(map().map(), 0.02f, Surface::flat, boundary);
  constexpr double kFade = 2e-4;  // of 1 / (1 + x), x at most 1e4, on a map that ends
  const float finest = finestSigma(model.shape()), coarsest = 4 * finest;
  int positive = 0;
  for (int k = 0; k < 200; ++k) {
    const Vec2 uv = {random.unit(), random.unit()};
    const Vec2 h = {random.unit() - 0.5f, random.unit() - 0.5f};
    const Box2 range = {h, h + Vec2{0.1f, 0.2f}};
    for (const float sigma : {0.0f, 0.3f, 0.99f * finest}) {
      const Footprint p = Footprint::isotropic(uv, sigma), level0 = Footprint::isotropic(uv, finest);
      EXPECT_EQ(with_normals.density(p, h), exact.density(p, h));
      EXPECT_EQ(with_normals.mean(p, range), exact.mean(p, range));
      EXPECT_NEAR(model.density(p, h), model.density(level0, h), 1e-4 * (1 + model.density(level0, h)));
      EXPECT_NEAR(model.mean(p, range), model.mean(level0, range), 1e-4);
      positive += exact.density(p, h) > 0.1f;
    }
    const float mean = model.density(Footprint::isotropic({0.5f, 0.5f}, 1e10f), h);
    for (const float sigma : {1.01f * coarsest, 1e3f, 1e10f, 1e30f}) {
      const Footprint p = Footprint::isotropic(uv, sigma);
      EXPECT_EQ(with_normals.density(p, h), model.density(p, h));
      if (sigma > 1e4f) {
        EXPECT_NEAR(model.density(p, h), mean, kFade * (1 + mean));
      }
    }
  }
  EXPECT_GT(positive, 20);
}

TEST(PyramidNdf, BelowTheFinestLevelTheTexelsAnswerAndFarAboveTheLastTheMean) {
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp})
    expectLevelsAreExtended(PyramidNdf(pyramid(boundary).view()), PyramidNdf(pyramid(boundary).view(), map().map()), boundary);
}

TEST(CpNdf, BelowTheFinestLevelTheTexelsAnswerAndFarAboveTheLastTheMean) {
  const NdfCp view = compressed(CompressionMethod::tucker, CoefficientType::f16).view();
  expectLevelsAreExtended(CpNdf(view), CpNdf(view, map().map()), Boundary::wrap);
}

template <class Model>
void expectDegenerateQueriesAreAnswered(const Model& model) {
  const Vec2 uv = {0.3f, 0.7f};
  const Footprint p = Footprint::isotropic(uv, 10);
  const Box2 whole = {{-1, -1}, {1, 1}};
  for (const Vec2 h : {Vec2{1.001f, 0}, Vec2{0, -1.001f}, Vec2{kNan, 0}, Vec2{0, kNan}, Vec2{kInfinity, 0}})
    EXPECT_EQ(model.density(p, h), 0);
  for (const Vec2 h : {Vec2{1, 1}, Vec2{-1, -1}, Vec2{1, -1}})
    EXPECT_GE(model.density(p, h), 0);  // corners are read inside the image
  for (const Box2 range : {Box2{{0, 0}, {0, 1}}, Box2{{0.5f, 0}, {-0.5f, 1}}, Box2{{kNan, 0}, {1, 1}}, Box2{{0, 0}, {1, kNan}},
                           Box2{{2, 2}, {3, 3}}, Box2{{-kInfinity, -kInfinity}, {kInfinity, kInfinity}}})
    EXPECT_EQ(model.mean(p, range), 0) << range.low.x << ' ' << range.high.x;

  // Too narrow or not finite: the narrowest footprint.
  const float narrowest = model.density(Footprint::isotropic(uv, kMinSigmaTexels), {0, 0});
  EXPECT_TRUE(std::isfinite(narrowest));
  for (const Footprint& q :
       {Footprint::isotropic(uv, 0), Footprint::isotropic(uv, kNan), Footprint::gaussian(uv, {-4, 0, -4}),
        Footprint::gaussian(uv, {kInfinity, 0, 1}), Footprint::box(uv, {0, 0}, {0, 0}), Footprint::box(uv, {kNan, 0}, {0, 1})})
    EXPECT_EQ(model.density(q, {0, 0}), narrowest);
  // A centre that is not finite counts as 0.
  EXPECT_EQ(model.density(Footprint::isotropic({kNan, -kInfinity}, 10), {0, 0}),
            model.density(Footprint::isotropic({0, 0}, 10), {0, 0}));
  // Far larger than the map: its mean.
  const float mean = model.density(Footprint::isotropic(uv, 1e4f), {0.1f, 0});
  EXPECT_GT(mean, 0);
  for (const Footprint& q :
       {Footprint::isotropic(uv, 1e18f), Footprint::box(uv, {1e9f, 0}, {0, 1e9f}), Footprint::box(uv, {1e18f, 0}, {0, 1e18f})})
    EXPECT_EQ(model.density(q, {0.1f, 0}), mean);
  for (const float thickness : {0.0f, 1e-6f, 1e-3f, 0.1f})
    EXPECT_NEAR(model.mean(Footprint::box(uv, {9, 3}, {-thickness, thickness}), whole), 0.25, 0.01);
}

TEST(PyramidNdf, DegenerateQueriesHaveDocumentedAnswers) {
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
    expectDegenerateQueriesAreAnswered(PyramidNdf(pyramid(boundary).view()));
    expectDegenerateQueriesAreAnswered(PyramidNdf(pyramid(boundary).view(), map().map()));
  }
}

TEST(CpNdf, DegenerateQueriesHaveDocumentedAnswers) {
  forEachCompression([](const CpNdf& model, const NdfCpData& data) {
    expectDegenerateQueriesAreAnswered(model);
    expectDegenerateQueriesAreAnswered(CpNdf(data.view(), map().map()));
  });
}

TEST(PyramidNdf, TexturePlaneIsPeriodic) {
  const PyramidNdf model(pyramid().view());
  RandomQueries random(8);
  for (int k = 0; k < 100; ++k) {
    const Vec2 uv = {static_cast<float>(random.below(64)) / 64, static_cast<float>(random.below(64)) / 64};  // exact far away
    const float sigma = 5 + 50 * random.unit();
    const Vec2 h = {random.unit() - 0.5f, random.unit() - 0.5f};
    for (const Vec2 far : {Vec2{1, -1}, Vec2{-7, 3}, Vec2{4096, -100000}})
      EXPECT_EQ(model.density(Footprint::isotropic(uv + far, sigma), h), model.density(Footprint::isotropic(uv, sigma), h));
  }
}

TEST(PyramidNdf, BoxesAndAnisotropicFootprintsAreAnsweredByTheirMeanSquareSize) {
  const PyramidNdf model(pyramid().view());
  const Vec2 uv = {0.4f, 0.2f}, h = {0.1f, 0.05f};
  const float expected = model.density(Footprint::isotropic(uv, std::sqrt(0.5f * (100 + 400))), h);
  EXPECT_NEAR(model.density(Footprint::gaussian(uv, {100, 50, 400}), h), expected, 1e-5 * expected);
  const float a = std::sqrt(300.0f), b = std::sqrt(1200.0f);  // half axes: three times the variance
  EXPECT_NEAR(model.density(Footprint::box(uv, {a, 0}, {0, b}), h), expected, 1e-4 * expected);
}

TEST(PyramidNdf, BoxesInTheOuterHalfTexelOfAClampedSmoothSurfaceAreAnsweredFromItsBorder) {
  bake::PyramidOptions o;
  o.stride = 16;
  o.resolution = kResolution;
  o.sigma_r = 0.05f;
  o.surface = Surface::smooth;
  o.boundary = Boundary::clamp;
  const NdfPyramidData data = bake::buildPyramid(map().map(), o);
  const PyramidNdf pyramid(data.view(), map().map());
  const Reference reference(map().map(), o.sigma_r, Surface::smooth, Boundary::clamp);
  const Vec2 h = map().map().at(0, 40) + Vec2{0.01f, 0.02f};
  const Footprint outside = Footprint::box({0.2f / 100, 40.5f / 72}, {0.1f, 0}, {0, 0.1f});
  const Footprint border = Footprint::box({0.5f / 100, 40.5f / 72}, {0.1f, 0}, {0, 0.1f});
  EXPECT_GT(pyramid.density(outside, h), 1);
  EXPECT_NEAR(pyramid.density(outside, h), reference.density(border, h), 1e-4 * reference.density(border, h));
  EXPECT_NEAR(pyramid.mean(outside, {{-1, -1}, {1, 1}}), 0.25, 1e-4);
  EXPECT_GT(pyramid.sample(outside, {0.2f, 0.6f}).pdf, 0);
}

}  // namespace
}  // namespace glint::query_test
