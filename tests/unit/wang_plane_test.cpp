#include "glint/query/wang_plane.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "glint/bake/common/counter_random.h"
#include "glint/bake/compressed/compress.h"
#include "glint/bake/wang/tile_pyramid.h"
#include "glint/bake/wang/wang_tiles.h"
#include "glint/model/error.h"
#include "glint/query/reference.h"
#include "glint/query/wang_reference.h"
#include "support/test_maps.h"

namespace glint::wang_plane_test {
namespace {

constexpr int kSize = 64, kResolution = 64;
constexpr float kSigmaR = 0.05f, kStride = 8;

bake::PyramidOptions optionsOf(float overlap) {
  bake::PyramidOptions options;
  options.stride = kStride, options.overlap = overlap;
  options.resolution = kResolution, options.sigma_r = kSigmaR;
  options.precision = BlockPrecision::f32;
  options.boundary = Boundary::clamp;
  return options;
}

/// Tiles of a rough map, and their images.
struct Plane {
  explicit Plane(WangScheme scheme = WangScheme::corner, float overlap = bake::kDefaultOverlap)
      : normals(test::roughSurface(320, 256, 0.35f, 5)) {
    NormalMap map;
    map.width = 320, map.height = 256, map.normals = normals;
    bake::WangOptions options;
    options.scheme = scheme, options.size = kSize;
    tiles = bake::buildWangTiles(map, options);
    pyramid = bake::buildWangPyramid(tiles.view(), optionsOf(overlap));
  }
  WangPlane<PyramidTiles> model() const { return WangPlane<PyramidTiles>(pyramid.view()); }

  std::vector<Vec2> normals;
  bake::WangTilesData tiles;
  bake::WangPyramidData pyramid;
};
const Plane& plane() {
  static const Plane the_plane;
  return the_plane;
}

/// A point of the plane, in texels, and a footprint there.
struct Asked {
  std::string name;
  double x, y;
  Footprint shape;
};
std::vector<Asked> footprints() {
  const auto round = [](float sigma) { return Footprint::isotropic({}, sigma); };
  return {
      {"inside", 3.5 * kSize + 0.3, 1.4 * kSize, round(4)},
      {"over an edge", 2.0 * kSize + 0.6, 1.5 * kSize, round(5)},
      {"beside an edge", 1.5 * kSize, -1.0 * kSize - 9, round(6)},
      {"over a corner", -3.0 * kSize + 1.1, 2.0 * kSize - 0.4, round(4)},
      {"over a corner, wider", 5.0 * kSize - 3, 7.0 * kSize + 5, round(11)},
      {"a quarter of a tile", 0.2 * kSize, 0.7 * kSize, round(14)},
      {"far out", 0x1p46 + 2.25, -0x1p45 - 3.5, round(5)},
  };
}

template <class Model>
Model at(const Model& model, const Asked& asked, Footprint& p) {
  const WangPlace place = model.layout().placeOf(asked.x, asked.y);
  p = asked.shape;
  p.centre = model.layout().positionIn(place);
  return model.movedTo(place.cell_x, place.cell_y);
}

/// The part of the plane around a point as a map, with the corner of a cell as its corner.
struct Explicit {
  static constexpr int kTiles = 8;
  static constexpr int kWidth = kTiles * kSize;

  Explicit(const WangTiles& tiles, const Asked& asked) {
    const auto first = [](double texel) { return (std::floor(texel / kSize) - kTiles / 2) * kSize; };
    const double x = first(asked.x), y = first(asked.y);
    normals = bake::explicitPlane(tiles, static_cast<std::int64_t>(x), static_cast<std::int64_t>(y), kWidth, kWidth);
    map.width = map.height = kWidth, map.normals = normals;
    footprint = asked.shape;
    footprint.centre = {static_cast<float>((asked.x - x) / kWidth), static_cast<float>((asked.y - y) / kWidth)};
  }
  std::vector<Vec2> normals;
  NormalMap map;
  Footprint footprint;
};

/// Means over the cells of a grid of half vectors.
constexpr int kCells = 16;
template <class Model>
std::vector<double> imageOf(const Model& model, const Footprint& p) {
  std::vector<double> image;
  for (int y = 0; y < kCells; ++y)
    for (int x = 0; x < kCells; ++x) {
      const auto edge = [](int k) { return -1 + 2 * static_cast<float>(k) / kCells; };
      image.push_back(double{model.mean(p, {{edge(x), edge(y)}, {edge(x + 1), edge(y + 1)}})});
    }
  return image;
}
double difference(const std::vector<double>& a, const std::vector<double>& b) {
  double error = 0, size = 0;
  for (std::size_t k = 0; k < a.size(); ++k) error += (a[k] - b[k]) * (a[k] - b[k]), size += b[k] * b[k];
  return std::sqrt(error / size);
}

TEST(WangPlane, EqualsThePyramidOfTheExplicitPlane) {
  // With an overlap of 1 the centres of the map are those of the tiles. What is left is the end of footprints: a square of 3.2
  // deviations, or a circle of 3.5.
  constexpr double kEnds = 0.004;
  for (const WangScheme scheme : {WangScheme::edge, WangScheme::corner}) {
    const Plane tiled(scheme, 1);
    for (const Asked& asked : footprints()) {
      const Explicit part(tiled.tiles.view(), asked);
      const bake::NdfPyramidData pyramid = bake::buildPyramid(part.map, optionsOf(1));
      Footprint p;
      const auto model = at(tiled.model(), asked, p);
      EXPECT_LT(difference(imageOf(model, p), imageOf(PyramidNdf(pyramid.view()), part.footprint)), kEnds) << asked.name;
    }
  }
}

TEST(WangPlane, ErrsAsMuchAsAPyramidOfTheExplicitPlane) {
  // Centres differ, so that either is the nearer one at some places; on average the errors are alike.
  constexpr double kMore = 1.1, kMost = 0.08;
  double tiled = 0, mapped = 0;
  for (const Asked& asked : footprints()) {
    const Explicit part(plane().tiles.view(), asked);
    const bake::NdfPyramidData pyramid = bake::buildPyramid(part.map, optionsOf(bake::kDefaultOverlap));
    const auto truth = imageOf(Reference(part.map, kSigmaR, Surface::flat, Boundary::clamp), part.footprint);
    Footprint p;
    const auto model = at(plane().model(), asked, p);
    const double error = difference(imageOf(model, p), truth);
    EXPECT_LT(error, kMost) << asked.name;
    tiled += error;
    mapped += difference(imageOf(PyramidNdf(pyramid.view()), part.footprint), truth);
  }
  EXPECT_LT(tiled, kMore * mapped);
  EXPECT_GT(tiled, 0);
}

TEST(WangPlane, StretchedFootprintsAreThoseOfTheExplicitPlane) {
  constexpr double kEnds = 0.006;  // as above
  const Plane tiled(WangScheme::corner, 1);
  for (const double turn : {0.0, 0.7, 2.1}) {
    const auto c = static_cast<float>(std::cos(turn)), s = static_cast<float>(std::sin(turn));
    constexpr float kLong = 400, kShort = 16;
    const Asked asked = {
        "stretched", 2.1 * kSize, 4.95 * kSize,
        Footprint::gaussian({}, {kLong * c * c + kShort * s * s, (kLong - kShort) * c * s, kLong * s * s + kShort * c * c})};
    const Explicit part(tiled.tiles.view(), asked);
    const bake::NdfPyramidData pyramid = bake::buildPyramid(part.map, optionsOf(1));
    const AnisotropicNdf<PyramidNdf> mapped(PyramidNdf(pyramid.view()), Explicit::kWidth, Explicit::kWidth,
                                            finestSigma(pyramid.shape));
    Footprint p;
    const auto model = at(tiled.model(), asked, p);
    EXPECT_LT(difference(imageOf(model, p), imageOf(mapped, part.footprint)), kEnds) << turn;
  }
}

TEST(WangPlane, IntegratesToOneEverywhere) {
  constexpr double kRounding = 2e-5;
  for (const Asked& asked : footprints()) {
    Footprint p;
    const auto model = at(plane().model(), asked, p);
    EXPECT_NEAR(4 * model.mean(p, {{-1, -1}, {1, 1}}), 1, kRounding) << asked.name;
  }
}

TEST(WangPlane, HasNoStepAtBordersOfTiles) {
  // A thousandth of a texel on either side of a border.
  constexpr float kStep = 1e-3f / kSize;
  constexpr double kMost = 1e-3;
  for (const Vec2 border : {Vec2{2, 0.3f}, Vec2{0.6f, -1}, Vec2{3, 5}})
    for (const float sigma : {4.0f, 9.0f}) {
      const auto before = imageOf(plane().model(), Footprint::isotropic(border - Vec2{kStep, kStep}, sigma));
      const auto after = imageOf(plane().model(), Footprint::isotropic(border + Vec2{kStep, kStep}, sigma));
      EXPECT_LT(difference(before, after), kMost) << border.x << " " << border.y << " " << sigma;
    }
}

TEST(WangPlane, ManyTilesTendToTheirMean) {
  const WangReference tiles(plane().tiles.view(), kSigmaR);
  const auto mean = imageOf(tiles, Footprint::isotropic({}, 100 * kSize));
  double before = 1e9;
  for (const float tiles_wide : {0.5f, 1.0f, 10.0f}) {
    const Footprint p = Footprint::isotropic({0.3f, 0.8f}, tiles_wide * kSize);
    const auto answer = imageOf(plane().model(), p);
    // The texels differ from the mean less and less, and the answer is nearer to the texels than the mean of all tiles is.
    const double left = difference(answer, mean), error = difference(answer, imageOf(tiles, p));
    EXPECT_LT(left, before) << tiles_wide;
    constexpr double kRounding = 1e-3;
    EXPECT_LT(error, std::max(difference(mean, imageOf(tiles, p)), kRounding)) << tiles_wide;
    before = left;
  }
  EXPECT_LT(before, 5e-3);  // a hundredth of the variance of level 3 is left
}

/// Draws many half vectors, and compares their numbers in cells with the masses of the density.
template <class Model>
double chiSquaredPerCell(const Model& model, const Footprint& p) {
  constexpr int kSamples = 60000, kGrid = 16, kPixels = kResolution / kGrid;
  std::vector<double> counts(kGrid * kGrid, 0.0);
  double worst = 0;
  for (int k = 0; k < kSamples; ++k) {
    const HalfVectorSample drawn = model.sample(p, bake::randomPair(3, 0, static_cast<std::uint64_t>(k)));
    if (!(drawn.pdf > 0)) continue;
    const double density = double{model.density(p, drawn.h)};
    worst = std::max(worst, std::fabs(double{drawn.pdf} - density) / density);
    const auto cell = [](float h) { return std::clamp(static_cast<int>((h + 1) * kGrid / 2), 0, kGrid - 1); };
    ++counts[static_cast<std::size_t>(cell(drawn.h.y) * kGrid + cell(drawn.h.x))];
  }
  EXPECT_LT(worst, 1e-5);  // the pdf is the density; sums of the same numbers in the same order
  double sum = 0;
  int cells = 0;
  for (int y = 0; y < kGrid; ++y)
    for (int x = 0; x < kGrid; ++x) {
      // The mass of the density, whose negative pixels count as 0.
      double mass = 0;
      for (int j = 0; j < kPixels; ++j)
        for (int i = 0; i < kPixels; ++i) {
          const auto middle = [](int cell, int pixel) {
            return -1 + 2 * (static_cast<float>(cell * kPixels + pixel) + 0.5f) / kResolution;
          };
          mass += double{model.pixelMean(p, {middle(x, i), middle(y, j)})} * 4 / (kResolution * kResolution);
        }
      const double expected = kSamples * mass;
      constexpr double kFewest = 20;  // samples of a cell that chi-squared needs
      if (expected < kFewest) continue;
      const double off = counts[static_cast<std::size_t>(y * kGrid + x)] - expected;
      sum += off * off / expected, ++cells;
    }
  EXPECT_GT(cells, 10);
  return sum / cells;
}

/// Of random samples in 60 cells the mean is 1 +- .18.
constexpr double kMostChi = 1.6;

TEST(WangPlane, SamplesInProportionToTheDensity) {
  std::vector<Asked> all = footprints();
  all.push_back({"stretched", 2.02 * kSize, 4.95 * kSize, Footprint::gaussian({}, {300, 120, 90})});
  for (const Asked& asked : all) {
    Footprint p;
    const auto model = at(plane().model(), asked, p);
    EXPECT_LT(chiSquaredPerCell(model, p), kMostChi) << asked.name;
  }
}

TEST(WangPlane, CompressedImagesAnswerAlike) {
  bake::CompressionOptions options;
  options.tolerance = 0.05, options.metric = bake::ErrorMetric::l2;
  const std::vector<float> masses = bake::imageMasses(plane().pyramid.view());
  options.image_masses = masses;
  const auto data = bake::compressPyramid(plane().pyramid.images.view(), options);
  const WangCp asset = {plane().pyramid.plane.view(), data.view()};
  const WangPlane<CompressedTiles> compressed(asset);
  constexpr double kTolerance = 0.08;  // of single footprints; 0.05 is that of all images together
  for (const Asked& asked : footprints()) {
    Footprint p;
    const auto exact = at(plane().model(), asked, p);
    const auto model = at(compressed, asked, p);
    EXPECT_LT(difference(imageOf(model, p), imageOf(exact, p)), kTolerance) << asked.name;
    EXPECT_LT(chiSquaredPerCell(model, p), kMostChi) << asked.name;
  }
}

TEST(WangPlane, ConstantPixelsAreMeansOfPixels) {
  const WangPlane<PyramidTiles> constant(plane().pyramid.view(), Pixels::constant);
  for (const Asked& asked : footprints()) {
    Footprint p;
    const auto model = at(constant, asked, p);
    const float pixel = 2.0f / kResolution;
    const Box2 box = {{3 * pixel, -2 * pixel}, {4 * pixel, -pixel}};
    constexpr float kRounding = 1e-5f;
    EXPECT_NEAR(model.density(p, 0.5f * (box.low + box.high)), model.mean(p, box), kRounding * (1 + model.mean(p, box)));
  }
}

TEST(WangPlane, AnswersAnyQuestion) {
  const auto model = plane().model().movedTo(INT64_MIN, INT64_MAX);
  const float inf = INFINITY, nan = NAN;
  for (const Vec2 centre : {Vec2{nan, 0}, Vec2{inf, -inf}, Vec2{1e30f, 3}, Vec2{-0.0f, 1}})
    for (const float sigma : {0.0f, 1e-20f, 7.0f, 1e20f, nan, inf}) {
      const Footprint p = Footprint::isotropic(centre, sigma);
      const float density = model.density(p, {0.1f, 0});
      EXPECT_TRUE(std::isfinite(density) && density >= 0);
      EXPECT_TRUE(std::isfinite(model.sample(p, {nan, 2}).pdf));
      EXPECT_NEAR(4 * model.mean(p, {{-1, -1}, {1, 1}}), 1, 1e-4);
    }
  EXPECT_EQ(model.density(Footprint::isotropic({}, 5), {2, 0}), 0);
  EXPECT_EQ(model.mean(Footprint::isotropic({}, 5), {{0, 0}, {0, 1}}), 0);
}

TEST(WangPyramid, MassesOfACentreSumToOne) {
  const WangImages images = plane().pyramid.plane.view();
  for (int l = 0; l + 1 < plane().pyramid.images.shape.level_count; ++l) {
    const WangGrid& grid = images.grids[l];
    ASSERT_EQ(grid.masses.size(), static_cast<std::size_t>(grid.side()));
    EXPECT_GE(grid.margin, 1);
    for (int k = 0; k < grid.columns; ++k) {
      double sum = 0;
      for (int place = k; place < grid.side(); place += grid.columns)
        sum += double{grid.masses[static_cast<std::size_t>(place)]};
      EXPECT_NEAR(sum, 1, 1e-6) << l << " " << k;
    }
  }
}

TEST(WangPyramid, RefusesSmoothSurfaces) {
  bake::PyramidOptions options = optionsOf(1);
  options.surface = Surface::smooth;
  try {
    bake::buildWangPyramid(plane().tiles.view(), options);
    FAIL() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::unsupported);
  }
}

}  // namespace
}  // namespace glint::wang_plane_test
