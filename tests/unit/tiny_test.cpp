#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <set>
#include <vector>

#include "glint/bake/common/image_errors.h"
#include "glint/bake/common/reference_image.h"
#include "glint/bake/tiny/explicit_map.h"
#include "glint/bake/tiny/tiny_example.h"
#include "glint/model/error.h"
#include "glint/query/reference.h"
#include "glint/query/tiny_example_ndf.h"
#include "support/test_maps.h"

namespace glint::tiny_test {
namespace {

constexpr int kSize = 16;
constexpr float kSigmaR = 0.03f;
constexpr int kImage = 48;  // pixels of compared images

NormalMap mapOf(const std::vector<Vec2>& normals, int width, int height) {
  NormalMap map;
  map.width = width, map.height = height, map.normals = normals;
  return map;
}

/// A smooth, rough, periodic surface.
const std::vector<Vec2>& roughExample() {
  static const std::vector<Vec2> normals = test::roughSurface(kSize, kSize, 0.3f, 3);
  return normals;
}

bake::TinyOptions tiledOptions() {
  bake::TinyOptions options;
  options.resolution = 64;
  options.sigma_r = kSigmaR;
  return options;
}

bake::TinyOptions scatteredOptions() {
  bake::TinyOptions options = tiledOptions();
  options.mode = TinyMode::scattered;
  options.density = 1.5f;
  options.transforms.rotation_rad = {0, 6.2831853f};
  return options;
}

bake::TinyExampleData build(const bake::TinyOptions& options, const std::vector<Vec2>& normals = roughExample()) {
  return bake::buildTinyExample(mapOf(normals, kSize, kSize), options);
}

std::vector<float> imageOf(const TinyExampleNdf& model, const Footprint& p) {
  std::vector<float> image;
  const float side = 2.0f / kImage;
  for (int y = 0; y < kImage; ++y)
    for (int x = 0; x < kImage; ++x) {
      const Vec2 low = {-1 + static_cast<float>(x) * side, -1 + static_cast<float>(y) * side};
      image.push_back(model.mean(p, {low, low + Vec2{side, side}}));
    }
  return image;
}

/// Errors of a model against the surface itself, sampled several times a texel, in one footprint.
class PlaneTruth {
 public:
  static constexpr int kPerTexel = 3, kTexels = 160;

  PlaneTruth(const TinyExample& tiny) : surface_(tiny.images.shape.surface) {
    normals_ = bake::explicitNormals(tiny, {0, 0, kPerTexel * kTexels, kPerTexel * kTexels, kPerTexel});
  }

  std::vector<float> image(Vec2 texel, const Covariance& c) const {
    constexpr float kSquare = kPerTexel * kPerTexel;
    const Footprint p = Footprint::gaussian((1.0f / kTexels) * texel, {kSquare * c.xx, kSquare * c.xy, kSquare * c.yy});
    return bake::referenceImage(mapOf(normals_, kPerTexel * kTexels, kPerTexel * kTexels), kSigmaR, surface_, Boundary::wrap, p,
                                kImage);
  }
  double variation(const TinyExampleNdf& model, Vec2 texel, const Covariance& c) const {
    const Footprint p = Footprint::gaussian((1.0f / kSize) * texel, c);
    return bake::imageErrors(imageOf(model, p), image(texel, c), kImage).tv;
  }

 private:
  Surface surface_;
  std::vector<Vec2> normals_;
};

Covariance round(float sigma) { return {sigma * sigma, 0, sigma * sigma}; }

const std::vector<Matrix2>& someMatrices() {
  static const std::vector<Matrix2> list = {{1, 0, 0, 1},    {0.8f, -0.6f, 0.6f, 0.8f}, {-1, 0, 0, 1},
                                            {2, 0, 0, 0.7f}, {1.1f, 0.6f, -0.3f, 0.9f}, {0.5f, 0.2f, 0.4f, -1.5f}};
  return list;
}

/// A relief of a few waves, and its gradient.
struct Waves {
  static double height(double x, double y) { return 0.7 * std::sin(0.9 * x + 0.4 * y) + 0.4 * std::cos(0.3 * x - 1.1 * y); }
  static Vec2 normal(double x, double y) {
    const double a = 0.7 * std::cos(0.9 * x + 0.4 * y), b = -0.4 * std::sin(0.3 * x - 1.1 * y);
    return normalOf(0.9 * a + 0.3 * b, 0.4 * a - 1.1 * b);
  }
  static Vec2 normalOf(double p, double q) {
    const double scale = -1 / std::sqrt(1 + p * p + q * q);
    return {static_cast<float>(scale * p), static_cast<float>(scale * q)};
  }
};

TEST(NormalTurn, IsTheGradientOfTheMovedRelief) {
  constexpr double kStep = 1e-4;
  constexpr float kTolerance = 2e-5f;  // floats, and the difference quotient
  for (const Matrix2& m : someMatrices()) {
    for (const float heights : {0.5f, 1.0f, 2.0f}) {
      const NormalTurn turn(m, heights);
      const double det = double{m.xx} * m.yy - double{m.xy} * m.yx;
      const auto moved = [&](double u, double v) {
        return heights * Waves::height((m.yy * u - m.xy * v) / det, (m.xx * v - m.yx * u) / det);
      };
      for (const Vec2 x : {Vec2{0.3f, 0.1f}, Vec2{-2, 1.5f}, Vec2{4, -3}}) {
        const double u = double{m.xx} * x.x + double{m.xy} * x.y, v = double{m.yx} * x.x + double{m.yy} * x.y;
        const Vec2 expected = Waves::normalOf((moved(u + kStep, v) - moved(u - kStep, v)) / (2 * kStep),
                                              (moved(u, v + kStep) - moved(u, v - kStep)) / (2 * kStep));
        const Vec2 turned = turn.turned(Waves::normal(x.x, x.y));
        EXPECT_NEAR(turned.x, expected.x, kTolerance);
        EXPECT_NEAR(turned.y, expected.y, kTolerance);
      }
    }
  }
}

TEST(NormalTurn, PullsHalfVectorsBackWithTheChangeOfArea) {
  constexpr float kTolerance = 1e-4f;
  for (const Matrix2& m : someMatrices()) {
    const NormalTurn turn(m, 1.5f);
    for (const Vec2 n : {Vec2{0, 0}, Vec2{0.3f, -0.2f}, Vec2{-0.6f, 0.5f}}) {
      const Vec2 h = turn.turned(n);
      const NormalTurn::Pulled pulled = turn.pulledBack(h);
      EXPECT_NEAR(pulled.h.x, n.x, kTolerance);
      EXPECT_NEAR(pulled.h.y, n.y, kTolerance);
      EXPECT_NEAR(pulled.factor, std::fabs(turn.pullChange(h).determinant()), kTolerance * pulled.factor);
      const Matrix2 both = turn.pullChange(h) * turn.turned(n, {1, 0, 0, 1});
      EXPECT_NEAR(both.xx, 1, 1e-3f);
      EXPECT_NEAR(both.xy, 0, 1e-3f);
      EXPECT_NEAR(both.yx, 0, 1e-3f);
      EXPECT_NEAR(both.yy, 1, 1e-3f);
    }
  }
}

TEST(TinyExample, ImagesAreThoseOfTheirTiles) {
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    bake::TinyOptions options = tiledOptions();
    options.surface = surface;
    const bake::TinyExampleData data = build(options);
    const NdfPyramid images = data.view().images;
    const PyramidReader reader(images);
    const int resolution = options.resolution;
    // The surface by many points of each texel.
    constexpr int kPoints = 16;
    const std::vector<Vec2> points = bake::explicitNormals(data.view(), {0, 0, kSize * kPoints, kSize * kPoints, kPoints});
    for (const auto [level, i, j] : {std::array{0, 3, 5}, std::array{1, 2, 1}, std::array{3, 0, 0}}) {
      const float half = static_cast<float>(1 << level), side = 2 * half;
      const Vec2 centre = {(static_cast<float>(i) + 0.5f) * side / kSize, (static_cast<float>(j) + 0.5f) * side / kSize};
      const std::vector<float> truth =
          bake::referenceImage(mapOf(points, kSize * kPoints, kSize * kPoints), kSigmaR, Surface::flat, Boundary::wrap,
                               Footprint::box(centre, {kPoints * half, 0}, {0, kPoints * half}), resolution);
      PyramidSlices slices;
      slices.levels[0] = level;
      for (int k = 0; k < 4; ++k)
        slices.images[k] = static_cast<std::uint32_t>(j * images.shape.levels[level].columns + i),
        slices.weights[k] = k == 0 ? 1 : 0;
      slices.count = 4;
      std::vector<float> image;
      for (int y = 0; y < resolution; ++y)
        for (int x = 0; x < resolution; ++x) {
          const PixelPlace place = {y / kBlockSize * (resolution / kBlockSize) + x / kBlockSize, x % kBlockSize,
                                    y % kBlockSize};
          image.push_back(reader.pixelMean(slices, place));
        }
      // Halves round by 5e-4; points of a smooth surface are a deviation of the lobe apart.
      const double tolerance = surface == Surface::flat ? 1e-3 : 2e-2;
      EXPECT_LT(bake::imageErrors(image, truth, resolution).rel_l2, tolerance);
    }
  }
}

TEST(TinyExample, HasTheBytesOfThePaperInFullAndAQuarterOfThemStored) {
  constexpr double kMegabyte = 1 << 20;
  constexpr double kPaper[] = {1.31, 5.32, 21.31};  // Xing 2024, table 3: 8^2, 16^2 and 32^2
  constexpr double kRounding = 0.005;               // of these numbers
  int k = 0;
  for (const int size : {8, 16, 32}) {
    bake::TinyOptions options;
    options.precision = BlockPrecision::f32;
    options.sigma_r = 0.01f;
    const std::vector<Vec2> normals = test::roughSurface(size, size, 0.3f, 3);
    const bake::TinyExampleData full = bake::buildTinyExample(mapOf(normals, size, size), options);
    std::size_t images = 0;
    for (int l = 0; l < full.images.shape.level_count; ++l) images += full.images.shape.levels[l].imageCount();
    EXPECT_LE(static_cast<double>(images) * 128 * 128 * 4, (kPaper[k] + kRounding) * kMegabyte);
    EXPECT_LE(static_cast<double>(full.sizeBytes()), (kPaper[k] + kRounding) * kMegabyte);
    options.precision = BlockPrecision::f16;
    const bake::TinyExampleData stored = bake::buildTinyExample(mapOf(normals, size, size), options);
    EXPECT_LE(static_cast<double>(stored.sizeBytes()), 0.25 * kPaper[k] * kMegabyte);
    const TinyExample a = full.view(), b = stored.view();
    const TinyExampleNdf fine(a), coarse(b);
    const Footprint p = Footprint::isotropic({0.3f, 0.6f}, 3);
    EXPECT_LT(bake::imageErrors(imageOf(coarse, p), imageOf(fine, p), kImage).rel_l2, 0.02);
    ++k;
  }
}

TEST(TinyExampleNdf, OfTexelsIsTheReference) {
  constexpr float kTruncation = 0.01f;  // footprints end at 3.2 deviations: exp(-3.2^2 / 2) = 0.006
  const bake::TinyExampleData data = build(tiledOptions());
  const TinyExample tiny = data.view();
  const TinyExampleNdf model(tiny);
  const NormalMap map = mapOf(roughExample(), kSize, kSize);
  const Reference reference(map, kSigmaR);
  std::mt19937 random(1);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int k = 0; k < 200; ++k) {
    const Footprint p = Footprint::isotropic({3 * unit(random) - 1, unit(random)}, 0.4f + unit(random));
    const Vec2 h = {0.6f * unit(random) - 0.3f, 0.6f * unit(random) - 0.3f};
    const float peak = 1 / (2 * std::numbers::pi_v<float> * kSigmaR * kSigmaR);
    EXPECT_NEAR(model.density(p, h), reference.density(p, h), kTruncation * peak);
  }
}

TEST(TinyExampleNdf, OfTiledExamplesIsNearThePlane) {
  struct Case {
    Matrix2 matrix;
    Surface surface;
    double share;  ///< of the limits: elements of curved surfaces are Gaussians, which triangles are not
  };
  const Case cases[] = {{{1, 0, 0, 1}, Surface::flat, 1},
                        {{1.2f, 0.5f, -0.4f, 0.9f}, Surface::flat, 1},
                        {{-2.4f, 0, 0, 1.6f}, Surface::smooth, 3}};
  for (const Case& c : cases) {
    bake::TinyOptions options = tiledOptions();
    options.matrix = c.matrix;
    options.surface = c.surface;
    options.offset = {3.25f, -7};
    const bake::TinyExampleData data = build(options);
    const TinyExample tiny = data.view();
    const TinyExampleNdf model(tiny);
    const PlaneTruth truth(tiny);
    std::mt19937 random(2);
    std::uniform_real_distribution<float> unit(60, 90);
    // Tiles are flat weights: the error is largest where level 0 begins.
    for (const auto& [sigma, limit] : {std::pair{1.2f, 0.08}, {2.5f, 0.12}, {8.0f, 0.03}})
      for (int k = 0; k < 2; ++k)
        EXPECT_LT(truth.variation(model, {unit(random), unit(random)}, round(sigma)), c.share * limit) << "sigma " << sigma;
    EXPECT_LT(truth.variation(model, {70, 70}, {16, 10, 9}), c.share * 0.12);
  }
}

/// Whether all the surface in a footprint is of one example.
bool isInsideOne(const TinyExample& tiny, Vec2 texel, float radius) {
  const ScatteredPieces plane(tiny);
  std::set<float> seen;
  for (int k = -4; k <= 4; ++k)
    for (int l = -4; l <= 4; ++l) {
      const Vec2 at = texel + Vec2{radius * static_cast<float>(k) / 4, radius * static_cast<float>(l) / 4};
      const auto cell = [](float x) { return static_cast<std::int64_t>(std::floor(x / kSize)); };
      const PlanePoint point = {cell(at.x),
                                cell(at.y),
                                {at.x - static_cast<float>(cell(at.x) * kSize), at.y - static_cast<float>(cell(at.y) * kSize)}};
      const SeenPoint s = plane.seenAt(point);
      seen.insert(s.background ? 0 : s.to_example.xx);
    }
  return seen.size() == 1;
}

TEST(TinyExampleNdf, OfScatteredExamplesIsNearThePlaneInsideThemAndWhereTheyMeet) {
  for (const TinyOverlap overlap : {TinyOverlap::quarters, TinyOverlap::nearest}) {
    bake::TinyOptions options = scatteredOptions();
    options.overlap = overlap;
    const bake::TinyExampleData data = build(options);
    const TinyExample tiny = data.view();
    const TinyExampleNdf model(tiny);
    const PlaneTruth truth(tiny);
    std::mt19937 random(3);
    std::uniform_real_distribution<float> unit(30, 130);
    double inside = 0, outside = 0;
    int inside_count = 0, outside_count = 0;
    constexpr float kSigma = 1.2f;
    constexpr int kEach = 4;
    for (int k = 0; k < 4000 && (inside_count < kEach || outside_count < kEach); ++k) {
      const Vec2 at = {unit(random), unit(random)};
      const bool is_inside = isInsideOne(tiny, at, 3 * kSigma);
      int& count = is_inside ? inside_count : outside_count;
      if (count == kEach) continue;
      ++count;
      (is_inside ? inside : outside) += truth.variation(model, at, round(kSigma)) / kEach;
    }
    ASSERT_EQ(inside_count, kEach);
    ASSERT_EQ(outside_count, kEach);
    EXPECT_LT(inside, 0.1);
    EXPECT_LT(outside, 0.15);
    for (const auto& [sigma, limit] : {std::pair{3.0f, 0.3}, {6.0f, 0.25}})
      EXPECT_LT(truth.variation(model, {unit(random), unit(random)}, round(sigma)), limit) << "sigma " << sigma;
  }
}

TEST(TinyExampleNdf, OfFewExamplesIsNearThePlaneOverManyCells) {
  bake::TinyOptions options = scatteredOptions();
  options.density = 0.05f;
  const bake::TinyExampleData data = build(options);
  const TinyExample tiny = data.view();
  const TinyExampleNdf model(tiny);
  // Seventeen cells of the plane, of which the footprint reaches fourteen.
  constexpr int kTexels = 272, kPerTexel = 2;
  constexpr float kSigma = 2.2f * kSize, kSquare = kPerTexel * kPerTexel;
  ASSERT_LT(kSigma, 0.7f * model.largestSigma());  // the mean has no weight yet
  const std::vector<Vec2> normals = bake::explicitNormals(tiny, {0, 0, kPerTexel * kTexels, kPerTexel * kTexels, kPerTexel});
  const Footprint on_map = Footprint::gaussian({0.5f, 0.5f}, {kSquare * kSigma * kSigma, 0, kSquare * kSigma * kSigma});
  const std::vector<float> truth = bake::referenceImage(mapOf(normals, kPerTexel * kTexels, kPerTexel * kTexels), kSigmaR,
                                                        Surface::flat, Boundary::wrap, on_map, kImage);
  const Footprint on_plane = Footprint::isotropic({0.5f * kTexels / kSize, 0.5f * kTexels / kSize}, kSigma);
  EXPECT_LT(bake::imageErrors(imageOf(model, on_plane), truth, kImage).tv, 0.05);
}

TEST(GaussianLattice, InsideASquareVisitsItsPointsAlone) {
  const GaussianLattice lattice({400, 120, 90}, 1, 0);
  std::map<std::pair<int, int>, float> all, inside;
  lattice.forEach(7.3, -2.1, [&](int i, int j, float weight) { all[{i, j}] = weight; });
  int visits = 0;
  lattice.forEachInside(7.3, -2.1, -5, 10, [&](int i, int j, float weight) {
    inside[{i, j}] = weight;
    ++visits;
  });
  EXPECT_EQ(visits, static_cast<int>(inside.size()));
  std::size_t expected = 0;
  constexpr float kRounding = 1e-4f;  // each weight of a row is the one before times a ratio, and rows begin elsewhere
  for (const auto& [at, weight] : all) {
    if (std::min(at.first, at.second) < -5 || std::max(at.first, at.second) > 10) continue;
    ++expected;
    ASSERT_TRUE(inside.contains(at));
    EXPECT_NEAR(inside[at], weight, kRounding);
  }
  EXPECT_EQ(inside.size(), expected);
  EXPECT_GT(expected, 100u);
  // However wide the footprint: no more than the square.
  visits = 0;
  GaussianLattice({1e12, 0, 1e12}, 1, 0).forEachInside(0, 0, 0, 15, [&](int, int, float) { ++visits; });
  EXPECT_EQ(visits, 256);
}

TEST(TinyExampleNdf, OfTinyExamplesFarApartVisitsOnlyTheirTiles) {
  // Footprints of many cells of examples of a 64th of their size: a lattice without bounds would have 1e9 squares.
  bake::TinyOptions options = scatteredOptions();
  options.density = 0.01f;
  options.transforms.scale = {1.0f / 64, 1.0f / 64};
  const bake::TinyExampleData data = build(options);
  const TinyExample tiny = data.view();
  const TinyExampleNdf model(tiny);
  for (const float share : {0.1f, 0.5f, 0.99f})
    EXPECT_TRUE(std::isfinite(model.density(Footprint::isotropic({}, share * model.largestSigma()), {0.01f, 0.02f})));
}

TEST(TinyExampleNdf, OfWideFootprintsIsTheMeanOfThePlane) {
  bake::TinyOptions options = scatteredOptions();
  options.transforms.scale = {0.7f, 1.3f};
  const bake::TinyExampleData data = build(options);
  const TinyExample tiny = data.view();
  const TinyExampleNdf model(tiny);
  const Footprint below = Footprint::isotropic({4.3f, 5.1f}, 0.9999f * model.largestSigma());
  const Footprint above = Footprint::isotropic({4.3f, 5.1f}, 1.0001f * model.largestSigma());
  const std::vector<float> mean = imageOf(model, above);
  EXPECT_LT(bake::imageErrors(imageOf(model, below), mean, kImage).tv, 1e-3);  // no step
  EXPECT_EQ(mean, imageOf(model, Footprint::isotropic({-91, 8.7f}, 1e6f)));
  // The plane itself, over many cells.
  constexpr int kTexels = 512;
  const std::vector<Vec2> normals = bake::explicitNormals(tiny, {-5000, 300, kTexels, kTexels, 1});
  const NormalMap map = mapOf(normals, kTexels, kTexels);
  const std::vector<float> truth =
      bake::referenceImage(map, kSigmaR, Surface::flat, Boundary::wrap, Footprint::isotropic({0.5f, 0.5f}, 1e6f), kImage);
  EXPECT_LT(bake::imageErrors(mean, truth, kImage).tv, 0.05);  // 1024 cells of examples that differ
}

/// Models of both modes, with turns that are rigid and that are not.
const std::vector<bake::TinyExampleData>& someData() {
  static const std::vector<bake::TinyExampleData> list = [] {
    std::vector<bake::TinyExampleData> data;
    bake::TinyOptions options = tiledOptions();
    options.surface = Surface::smooth;
    options.matrix = {1.5f, 0.4f, 0, 1};
    data.push_back(build(options));
    options = scatteredOptions();
    data.push_back(build(options));
    options.transforms.stretch = {1, 1.5f};
    options.transforms.shear = {-0.2f, 0.2f};
    options.transforms.mirror = 0.5f;
    options.surface = Surface::smooth;
    options.background_sigma_r = 0.1f;
    data.push_back(build(options));
    return data;
  }();
  return list;
}

TEST(TinyExampleNdf, IntegratesToOneAndItsMeansAreThoseOfTheDensity) {
  constexpr int kPoints = 200;
  constexpr double kTolerance = 4e-3;  // lobes that leave the disk, and the lattice of points
  std::mt19937 random(4);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const bake::TinyExampleData& data : someData()) {
    const TinyExample tiny = data.view();
    const TinyExampleNdf model(tiny);
    for (const float sigma : {0.7f, 9.0f}) {
      const Footprint p = Footprint::isotropic({20 * unit(random), 20 * unit(random)}, sigma);
      double integral = 0, quarter = 0;
      for (int y = 0; y < kPoints; ++y)
        for (int x = 0; x < kPoints; ++x) {
          const Vec2 h = {(static_cast<float>(x) + 0.5f) * 2 / kPoints - 1, (static_cast<float>(y) + 0.5f) * 2 / kPoints - 1};
          const double mass = double{model.density(p, h)} * 4 / (kPoints * kPoints);
          integral += mass;
          if (h.x > 0 && h.y > 0) quarter += mass;
        }
      EXPECT_NEAR(integral, 1, kTolerance);
      EXPECT_NEAR(model.mean(p, {{0, 0}, {1, 1}}), quarter, 0.015);
      EXPECT_NEAR(4 * model.mean(p, {{-1, -1}, {1, 1}}), 1, 0.015);
    }
  }
}

TEST(TinyExampleNdf, SamplesFollowTheDensity) {
  constexpr int kSide = 128, kBins = 8;
  for (const bake::TinyExampleData& data : someData()) {
    const TinyExample tiny = data.view();
    const TinyExampleNdf model(tiny);
    for (const float sigma : {0.8f, 4.0f}) {
      const Footprint p = Footprint::isotropic({3.3f, 8.6f}, sigma);
      double counts[kBins][kBins] = {};
      for (int k = 0; k < kSide * kSide; ++k) {
        const Vec2 xi = {(static_cast<float>(k % kSide) + 0.5f) / kSide, (static_cast<float>(k / kSide) + 0.5f) / kSide};
        const HalfVectorSample s = model.sample(p, xi);
        if (!(s.pdf > 0)) continue;
        EXPECT_EQ(s.pdf, model.density(p, s.h));
        const auto bin = [](float x) { return std::clamp(static_cast<int>((x + 1) * 0.5f * kBins), 0, kBins - 1); };
        counts[bin(s.h.y)][bin(s.h.x)] += 1.0 / (kSide * kSide);
      }
      const float side = 2.0f / kBins;
      for (int y = 0; y < kBins; ++y)
        for (int x = 0; x < kBins; ++x) {
          const Vec2 low = {-1 + static_cast<float>(x) * side, -1 + static_cast<float>(y) * side};
          EXPECT_NEAR(counts[y][x], model.mean(p, {low, low + Vec2{side, side}}) * side * side, 0.015);
        }
    }
  }
}

TEST(NearExamples, OwnersFollowTheRules) {
  const bake::TinyExampleData data = build(scatteredOptions());
  const TinyExample tiny = data.view();
  const CellExamples cells(tiny);
  const NearExamples near(cells, {0, 0, {8, 8}}, kSize, 0.71f, 8, 8);
  constexpr float kHalf = kSize / 2.0f;
  int covered_twice = 0, differ = 0, points = 0;
  for (float y = 0.25f; y < 16; ++y) {
    for (float x = 0.25f; x < 16; ++x, ++points) {
      const Vec2 at = {x, y};
      std::vector<int> covering;
      Box2 box = {{-1e9f, -1e9f}, {1e9f, 1e9f}};
      for (int e = 0; e < near.count(); ++e) {
        const Vec2 local = near[e].local(at);
        if (std::max(std::fabs(local.x), std::fabs(local.y)) >= kHalf) continue;
        covering.push_back(e);
        const Vec2 low = near[e].centre - near[e].half_extent, high = near[e].centre + near[e].half_extent;
        box = {{std::max(box.low.x, low.x), std::max(box.low.y, low.y)},
               {std::min(box.high.x, high.x), std::min(box.high.y, high.y)}};
      }
      const auto nearestTo = [&](Vec2 place) {
        return *std::min_element(covering.begin(), covering.end(), [&](int a, int b) {
          const Vec2 p = near[a].centre - place, q = near[b].centre - place;
          return dot(p, p) < dot(q, q);
        });
      };
      std::uint8_t nearest = 0, quarter = 0;
      near.findOwners(&at, 1, kSize, TinyOverlap::nearest, &nearest);
      near.findOwners(&at, 1, kSize, TinyOverlap::quarters, &quarter);
      if (covering.empty()) {
        EXPECT_EQ(nearest, NearExamples::kNone);
        EXPECT_EQ(quarter, NearExamples::kNone);
        continue;
      }
      const Vec2 middle = 0.5f * (box.low + box.high);
      const Vec2 of_quarter = {0.5f * (middle.x + (x < middle.x ? box.low.x : box.high.x)),
                               0.5f * (middle.y + (y < middle.y ? box.low.y : box.high.y))};
      EXPECT_EQ(nearest, nearestTo(at));
      EXPECT_EQ(quarter, nearestTo(of_quarter));
      covered_twice += covering.size() > 1 ? 1 : 0;
      differ += nearest != quarter ? 1 : 0;
    }
  }
  EXPECT_GT(covered_twice, points / 10);
  EXPECT_GT(differ, 0);
  EXPECT_LT(differ, covered_twice / 2);
}

TEST(CellExamples, ArePoissonPointsWithoutALattice) {
  TinyExample tiny;
  tiny.mode = TinyMode::scattered;
  tiny.images.shape.width = kSize;
  tiny.density = 2;
  const CellExamples cells(tiny);
  constexpr int kCells = 64;
  double sum = 0, squares = 0;
  std::vector<Vec2> centres;  // in cells
  for (int j = 0; j < kCells; ++j)
    for (int i = 0; i < kCells; ++i) {
      const std::uint64_t key = cells.key(i, j);
      const int count = cells.count(key);
      sum += count, squares += count * count;
      for (int k = 0; k < count; ++k)
        centres.push_back(Vec2{static_cast<float>(i), static_cast<float>(j)} + (1.0f / kSize) * cells.centre(key, k));
    }
  const double mean = sum / (kCells * kCells), variance = squares / (kCells * kCells) - mean * mean;
  EXPECT_NEAR(mean, 2, 0.1);  // 4 deviations of the mean
  EXPECT_NEAR(variance, 2, 0.2);
  // Power of the centres at waves of whole numbers of periods; a lattice of cells has peaks at multiples of kCells.
  double total = 0, worst = 0;
  int waves = 0;
  for (int v = 0; v <= 2 * kCells; v += 8)
    for (int u = 8; u <= 2 * kCells; u += 8, ++waves) {
      double re = 0, im = 0;
      for (const Vec2 c : centres) {
        const double phase = 2 * std::numbers::pi * (u * double{c.x} + v * double{c.y}) / kCells;
        re += std::cos(phase), im += std::sin(phase);
      }
      const double power = (re * re + im * im) / static_cast<double>(centres.size());
      total += power;
      worst = std::max(worst, power);
    }
  EXPECT_NEAR(total / waves, 1, 0.3);     // exponentially distributed around 1: 5 deviations of the mean of 272
  EXPECT_LT(worst, std::log(waves) + 7);  // the largest of as many; passed by chance once in a thousand
}

TEST(TinyPlane, ScatteredExamplesDoNotRepeat) {
  const auto peakOf = [](const bake::TinyOptions& options) {
    const bake::TinyExampleData data = build(options);
    constexpr int kTexels = 256;
    const std::vector<Vec2> n = bake::explicitNormals(data.view(), {0, 0, kTexels, kTexels, 1});
    double same = 0, shifted = 0, mean_x = 0, mean_y = 0;
    for (const Vec2& v : n) mean_x += double{v.x} / kTexels / kTexels, mean_y += double{v.y} / kTexels / kTexels;
    const auto product = [&](std::size_t a, std::size_t b) {
      return (n[a].x - mean_x) * (n[b].x - mean_x) + (n[a].y - mean_y) * (n[b].y - mean_y);
    };
    for (int j = 0; j < kTexels; ++j)
      for (int i = 0; i + kSize < kTexels; ++i) {
        same += product(rowMajorIndex(i, j, kTexels), rowMajorIndex(i, j, kTexels));
        shifted += product(rowMajorIndex(i, j, kTexels), rowMajorIndex(i + kSize, j, kTexels));
      }
    return shifted / same;
  };
  EXPECT_NEAR(peakOf(tiledOptions()), 1, 1e-5);
  EXPECT_LT(peakOf(scatteredOptions()), 0.1);
}

TEST(TinyExampleNdf, AnswersFarOutAsNearBy) {
  for (const bake::TinyExampleData& data : someData()) {
    const TinyExample tiny = data.view();
    const TinyExampleNdf model(tiny);
    const std::int64_t far = (std::int64_t{1} << 40) / kSize;
    const Footprint p = Footprint::isotropic({0.37f, 0.81f}, 1.5f), q = Footprint::isotropic({2.37f, -0.19f}, 1.5f);
    // The same place by two origins; cells and fractions of floats are exact.
    constexpr float kRounding = 2e-3f;  // 0.37 + 2 has lost three bits
    const std::vector<float> a = imageOf(model.movedTo(far, -far), p), b = imageOf(model.movedTo(far - 2, -far + 1), q);
    EXPECT_LT(bake::imageErrors(a, b, kImage).tv, kRounding);
    // The explicit map there is the surface that is seen.
    constexpr int kTexels = 32, kPerTexel = 3, kMap = kTexels * kPerTexel;
    const std::vector<Vec2> normals = bake::explicitNormals(tiny, {far * kSize - 10, -far * kSize - 6, kMap, kMap, kPerTexel});
    const Vec2 centre = {(10 + 0.37f * kSize) / kTexels, (6 + 0.81f * kSize) / kTexels};
    const std::vector<float> truth =
        bake::referenceImage(mapOf(normals, kMap, kMap), kSigmaR, tiny.images.shape.surface, Boundary::wrap,
                             Footprint::isotropic(centre, 1.5f * kPerTexel), kImage);
    EXPECT_LT(bake::imageErrors(a, truth, kImage).tv, 0.25);  // of another place it would be 0.6 to 1
  }
}

TEST(TinyExampleNdf, AnswersEveryQuestion) {
  constexpr float kHuge = 1e30f, kNan = std::numeric_limits<float>::quiet_NaN();
  for (const bake::TinyExampleData& data : someData()) {
    const TinyExample tiny = data.view();
    const TinyExampleNdf model(tiny);
    for (const Vec2 centre : {Vec2{kNan, 0}, Vec2{kHuge, -kHuge}, Vec2{0.5f, kNan}, Vec2{-1e7f, 3}})
      for (const Covariance& c : {Covariance{kNan, 0, 1}, Covariance{0, 0, 0}, Covariance{1e30f, 0, 1e-9f},
                                  Covariance{-1, 5, 2}, Covariance{kHuge, kHuge, kHuge}, Covariance{4e4f, 3.9e4f, 4e4f}}) {
        const Footprint p = Footprint::gaussian(centre, c);
        for (const Vec2 h : {Vec2{0, 0}, Vec2{0.9f, 0.9f}, Vec2{kNan, 0}, Vec2{2, 0}}) {
          const float density = model.density(p, h);
          EXPECT_TRUE(density >= 0 && std::isfinite(density));
        }
        const float mean = model.mean(p, {{-0.1f, kNan}, {0.2f, 0.1f}});
        EXPECT_TRUE(mean >= 0 && std::isfinite(mean));
        EXPECT_TRUE(std::isfinite(model.sample(p, {kNan, 0.9f}).pdf));
      }
  }
}

TEST(TinyExample, OfOneNormalIsOneLobe) {
  const std::vector<Vec2> constant(kSize * kSize, Vec2{0.2f, -0.1f});
  const bake::TinyExampleData data = build(tiledOptions(), constant);
  const TinyExample tiny = data.view();
  const TinyExampleNdf model(tiny);
  for (const float sigma : {0.5f, 3.0f, 100.0f}) {
    const Box2 box = {{0.125f, -0.1875f}, {0.25f, 0}};
    EXPECT_NEAR(model.mean(Footprint::isotropic({0.1f, 0.7f}, sigma), box) * box.area(), lobeMass(box, constant[0], kSigmaR),
                2e-3f);
  }
}

TEST(TinyExample, IsTheSameOnAnyNumberOfThreads) {
  const auto bytesOf = [](const bake::TinyExampleData& data) {
    std::vector<std::uint16_t> all;
    for (const auto& level : data.images.levels) all.insert(all.end(), level.half_pixels.begin(), level.half_pixels.end());
    return all;
  };
  const auto many = bytesOf(build(scatteredOptions()));
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(many, bytesOf(build(scatteredOptions())));
}

TEST(TinyExample, RefusesWhatCannotBe) {
  const auto ruleOf = [](bake::TinyOptions options, int width = kSize, int height = kSize) -> std::string {
    try {
      const std::vector<Vec2> normals(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
      bake::buildTinyExample(mapOf(normals, width, height), options);
    } catch (const Error& error) {
      EXPECT_FALSE(error.remedy().empty());
      return error.rule();
    }
    return "";
  };
  EXPECT_EQ(ruleOf(tiledOptions()), "");
  EXPECT_EQ(ruleOf(tiledOptions(), 12, 12), "tiny.size");
  EXPECT_EQ(ruleOf(tiledOptions(), 16, 8), "tiny.size");
  EXPECT_EQ(ruleOf(tiledOptions(), 512, 512), "tiny.size");
  bake::TinyOptions options = tiledOptions();
  options.matrix = {1, 2, 2, 4};
  EXPECT_EQ(ruleOf(options), "tiny.transform");
  options = tiledOptions();
  options.heights = -1;
  EXPECT_EQ(ruleOf(options), "option.range");
  for (const float density : {0.0f, 1000.0f, -1.0f, std::numeric_limits<float>::quiet_NaN()}) {
    options = scatteredOptions();
    options.density = density;
    EXPECT_EQ(ruleOf(options), "option.range");
  }
  options = scatteredOptions();
  options.transforms.scale = {1, 5};
  EXPECT_EQ(ruleOf(options), "tiny.reach");
  options.transforms.scale = {1, 2.5f};
  options.density = 6;
  EXPECT_EQ(ruleOf(options), "tiny.density");
}

}  // namespace
}  // namespace glint::tiny_test
