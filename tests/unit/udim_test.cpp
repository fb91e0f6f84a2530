// UDIM sets against one large map: answers near borders of tiles, where a tile is missing, and far away.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "glint.h"
#include "glint/api/any_ndf.h"
#include "glint/api/batch.h"
#include "glint/api/pack.h"
#include "glint/api/plane_position.h"
#include "glint/bake/compressed/compress.h"
#include "glint/bake/ingest/normal_bounds.h"
#include "glint/bake/ingest/tile_margins.h"
#include "glint/bake/moments/slope_moments.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/formats/asset_writer.h"
#include "glint/formats/validate.h"
#include "glint/query/reference.h"
#include "support/temp_folder.h"

namespace glint::udim_test {
namespace {

constexpr int kWidth = 112, kHeight = 88, kMargin = 64;  // of a tile
constexpr float kSigmaR = 0.05f;
/// A tile answers alone where less than a thousandth of the footprint lies beyond its margins.
constexpr double kCutTail = 2e-3;

/// Normals of 2 x 2 tiles as one map. The mean normal follows the place, so that a footprint in the wrong place is seen.
std::vector<Vec2> largeMap() {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(-1, 1);
  std::vector<Vec2> normals;
  for (int j = 0; j < 2 * kHeight; ++j)
    for (int i = 0; i < 2 * kWidth; ++i) {
      const float u = static_cast<float>(i) / (2 * kWidth), v = static_cast<float>(j) / (2 * kHeight);
      normals.push_back({0.25f * unit(random) + 0.5f * u - 0.25f, 0.25f * unit(random) + 0.5f * v - 0.25f});
    }
  return normals;
}

/// A set of tiles that are cut from the large map, and the large map as the truth.
class Tiles {
 public:
  explicit Tiles(std::vector<int> numbers = {1001, 1002, 1011, 1012}, int margin = kMargin)
      : numbers_(std::move(numbers)), margin_(margin), large_(largeMap()) {
    for (const Vec2 n : large_)
      for (const Vec2 h : halfVectors()) {
        const float x = (h.x - n.x) / kSigmaR, y = (h.y - n.y) / kSigmaR;
        lobes_.push_back(std::exp(-0.5f * (x * x + y * y)) / (2 * std::numbers::pi_v<float> * kSigmaR * kSigmaR));
      }
  }

  bool has(int column, int row) const {
    return std::find(numbers_.begin(), numbers_.end(), 1001 + column + 10 * row) != numbers_.end() && column >= 0;
  }

  /// Writes every tile with `write`, which is given the path, the map with margins, and its place.
  using Write = std::function<void(const std::filesystem::path&, const NormalMap&, const formats::UdimPlace&)>;
  std::filesystem::path write(const std::string& name, const Write& write_tile) const {
    const std::filesystem::path pattern = folder_ / (name + ".<UDIM>.glint");
    for (const int number : numbers_) {
      const int column = (number - 1001) % 10, row = (number - 1001) / 10;
      formats::UdimPlace place{number, {}};
      if (has(column - 1, row)) place.margins[0] = margin_;
      if (has(column, row - 1)) place.margins[1] = margin_;
      if (has(column + 1, row)) place.margins[2] = margin_;
      if (has(column, row + 1)) place.margins[3] = margin_;
      bake::TileNeighbourhood<Vec2> around;
      std::array<std::vector<Vec2>, 9> texels;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          if (!has(column + dx, row + dy)) continue;
          auto& cut = texels[static_cast<std::size_t>(3 * dy + 3 + dx + 1)];
          cut = tile(column + dx, row + dy);
          around.at(dx, dy) = {cut, kWidth, kHeight};
        }
      const std::vector<Vec2> all = bake::withMargins(around, place.margins);
      NormalMap map;
      map.width = kWidth + place.margins[0] + place.margins[2], map.height = kHeight + place.margins[1] + place.margins[3];
      map.normals = all;
      const auto bounds = bake::buildNormalBounds(map.width, map.height, map.normals);
      bake::attachBounds(map, bounds);
      write_tile(formats::udimFile(pattern, number), map, place);
    }
    return pattern;
  }

  std::filesystem::path writeNormals() const {
    return write("map", [](const auto& path, const NormalMap& map, const formats::UdimPlace& place) {
      formats::writeAsset(path, map, {}, {.overwrite = true, .udim = place});
    });
  }
  std::filesystem::path writePyramids() const {
    return write("pyramid", [](const auto& path, const NormalMap& map, const formats::UdimPlace& place) {
      formats::writeAsset(path, bake::buildPyramid(map, pyramidOptions()).view(), {}, {.overwrite = true, .udim = place});
    });
  }
  std::filesystem::path writeCompressed() const {
    return write("cp", [](const auto& path, const NormalMap& map, const formats::UdimPlace& place) {
      const bake::NdfPyramidData pyramid = bake::buildPyramid(map, pyramidOptions());
      bake::CompressionOptions options;
      options.tolerance = 0.05;
      formats::writeAsset(path, bake::compressPyramid(pyramid.view(), options).view(), {}, {.overwrite = true, .udim = place});
    });
  }
  std::filesystem::path writeMoments() const {
    return write("moments", [](const auto& path, const NormalMap& map, const formats::UdimPlace& place) {
      bake::SlopeMomentsOptions options;
      options.boundary = Boundary::clamp;
      formats::writeAsset(path, bake::buildSlopeMoments(map, options).view(), {}, {.overwrite = true, .udim = place});
    });
  }

  static bake::PyramidOptions pyramidOptions() {
    bake::PyramidOptions options;
    options.stride = 8;
    options.resolution = 64;
    options.sigma_r = kSigmaR;
    options.boundary = Boundary::clamp;
    return options;
  }

  /// The truth, by the definition: facets of the tiles that exist, weighed by the Gaussian.
  std::vector<double> densities(double u, double v, double sigma) const {
    const std::size_t count = halfVectors().size();
    std::vector<double> sums(count);
    double total = 0;
    for (int j = 0; j < 2 * kHeight; ++j) {
      const double dy = (j + 0.5 - v * kHeight) / sigma;
      if (std::fabs(dy) > 5) continue;
      for (int i = 0; i < 2 * kWidth; ++i) {
        const double dx = (i + 0.5 - u * kWidth) / sigma;
        if (std::fabs(dx) > 5 || !has(i / kWidth, j / kHeight)) continue;
        const double weight = std::exp(-0.5 * (dx * dx + dy * dy));
        const float* lobes = &lobes_[(static_cast<std::size_t>(j) * 2 * kWidth + i) * count];
        total += weight;
        for (std::size_t k = 0; k < count; ++k) sums[k] += weight * double{lobes[k]};
      }
    }
    for (double& sum : sums) sum /= total;
    return sums;
  }

  static std::vector<Vec2> halfVectors() {
    std::vector<Vec2> halves;
    for (float y = -0.4f; y < 0.41f; y += 0.2f)
      for (float x = -0.4f; x < 0.41f; x += 0.2f) halves.push_back({x, y});
    return halves;
  }

  const std::vector<Vec2>& large() const { return large_; }
  std::filesystem::path file(const std::string& name) const { return folder_ / name; }

 private:
  std::vector<Vec2> tile(int column, int row) const {
    std::vector<Vec2> texels;
    for (int j = 0; j < kHeight; ++j)
      for (int i = 0; i < kWidth; ++i)
        texels.push_back(large_[static_cast<std::size_t>(row * kHeight + j) * 2 * kWidth + column * kWidth + i]);
    return texels;
  }

  test::TempFolder folder_;
  std::vector<int> numbers_;
  int margin_;
  std::vector<Vec2> large_;
  std::vector<float> lobes_;  // [texels][half vectors]: what a facet adds to a density
};

/// Squares of errors and of the truth, summed over places.
struct Sums {
  double error = 0, truth = 0;
  double relative() const { return std::sqrt(error / truth); }
};

void addErrors(const Tiles& tiles, const api::AnyNdf& model, double u, double v, float sigma, Sums& sums) {
  const std::vector<double> truth = tiles.densities(u, v, sigma);
  const std::vector<Vec2> halves = Tiles::halfVectors();
  const Footprint p = Footprint::isotropic(wrappedUv(u, v), sigma);
  for (std::size_t k = 0; k < halves.size(); ++k) {
    const double error = api::densityAt(model, u, v, p, halves[k]) - truth[k];
    sums.error += error * error, sums.truth += truth[k] * truth[k];
  }
}

/// Relative error at random places inside tiles, and on and near the borders between them.
struct PlaceErrors {
  double inside, borders;
};
PlaceErrors placeErrors(const Tiles& tiles, const api::AnyNdf& model, float sigma) {
  constexpr int kPlaces = 24;
  std::mt19937 random(9);
  std::uniform_real_distribution<double> unit(0, 1);
  Sums inside, borders;
  for (int k = 0; k < kPlaces; ++k) {
    const int column = k % 2, row = k / 2 % 2;
    addErrors(tiles, model, column + 0.45 + 0.1 * unit(random), row + 0.45 + 0.1 * unit(random), sigma, inside);
    const double near = k % 4 == 0 ? 0 : 2 * sigma * (unit(random) - 0.5) / kWidth, along = 0.2 + 1.6 * unit(random);
    if (k % 3 == 0)
      addErrors(tiles, model, 1 + near, 1 + 0.2 * (unit(random) - 0.5), sigma, borders);  // where four tiles meet
    else if (k % 3 == 1)
      addErrors(tiles, model, 1 + near, along, sigma, borders);
    else
      addErrors(tiles, model, along, 1 + near, sigma, borders);
  }
  return {inside.relative(), borders.relative()};
}

TEST(Udim, TheTruthOfTheseTestsIsReferenceOnTheLargeMap) {
  const Tiles tiles;
  NormalMap map;
  map.width = 2 * kWidth, map.height = 2 * kHeight, map.normals = tiles.large();
  const Reference reference(map, kSigmaR, Surface::flat, Boundary::clamp);
  const std::vector<Vec2> halves = Tiles::halfVectors();
  for (const double u : {0.02, 0.97, 1.0, 1.6}) {
    const std::vector<double> truth = tiles.densities(u, 1.01, 7);
    const Footprint p = Footprint::isotropic({static_cast<float>(u / 2), 0.505f}, 7);
    for (std::size_t k = 0; k < halves.size(); ++k)
      EXPECT_NEAR(reference.density(p, halves[k]), truth[k], 1e-3 * (1 + truth[k]));
  }
}

TEST(Udim, TexelsOfASetAnswerAsTheLargeMap) {
  const Tiles tiles;
  api::NdfOptions options;
  options.sigma_r = kSigmaR;
  const auto opened = api::OpenedNdf::open(tiles.writeNormals(), options);
  EXPECT_EQ(opened.info().width, kWidth);
  EXPECT_EQ(opened.info().height, kHeight);
  for (const float sigma : {0.7f, 5.0f, 19.0f}) {
    const PlaceErrors errors = placeErrors(tiles, opened.model(), sigma);
    EXPECT_LT(errors.inside, kCutTail) << sigma;
    EXPECT_LT(errors.borders, kCutTail) << sigma;
  }
}

/// Errors at borders may exceed those inside by this much: 24 places each are a sample.
constexpr double kSample = 1.25;

TEST(Udim, PyramidsErrAcrossBordersNoMoreThanInsideTiles) {
  const Tiles tiles;
  const auto opened = api::OpenedNdf::open(tiles.writePyramids());
  for (const float sigma : {4.0f, 8.0f, 16.0f}) {
    const PlaceErrors errors = placeErrors(tiles, opened.model(), sigma);
    std::printf("sigma %g: inside %.4f borders %.4f\n", sigma, errors.inside, errors.borders);
    EXPECT_LT(errors.borders, kSample * errors.inside + kCutTail) << sigma << " inside " << errors.inside;
    EXPECT_LT(errors.inside, 0.1) << sigma;
  }
}

TEST(Udim, CompressedPyramidsErrAcrossBordersNoMoreThanInsideTiles) {
  const Tiles tiles;
  const auto opened = api::OpenedNdf::open(tiles.writeCompressed());
  for (const float sigma : {4.0f, 16.0f}) {
    const PlaceErrors errors = placeErrors(tiles, opened.model(), sigma);
    EXPECT_LT(errors.borders, kSample * errors.inside + kCutTail) << sigma << " inside " << errors.inside;
    EXPECT_LT(errors.inside, 0.15) << sigma;
  }
}

TEST(Udim, PyramidsWithNormalsAnswerSmallFootprintsAcrossBorders) {
  const Tiles tiles;
  api::NdfOptions options;
  options.normals = tiles.writeNormals();
  const auto opened = api::OpenedNdf::open(tiles.writePyramids(), options);
  EXPECT_TRUE(opened.hasNormals());
  const PlaceErrors errors = placeErrors(tiles, opened.model(), 1.5f);
  EXPECT_LT(errors.inside, 0.01);
  EXPECT_LT(errors.borders, 0.01);
}

/// Margins so narrow that footprints reach beyond them before the set ends.
constexpr int kNarrowMargin = 16;

/// Other tiles answer for what lies beyond the margins from their nearest places, which misplaces a part of the footprint.
TEST(Udim, FootprintsBeyondTheMarginsStayNearTheLargeMap) {
  const Tiles tiles({1001, 1002, 1011, 1012}, kNarrowMargin);
  const auto pyramids = api::OpenedNdf::open(tiles.writePyramids());
  constexpr double kMisplaced = 0.1;
  for (const float sigma : {5.0f, 8.0f, 16.0f, 30.0f, 60.0f, 120.0f}) {
    const PlaceErrors errors = placeErrors(tiles, pyramids.model(), sigma);
    std::printf("sigma %g: inside %.4f borders %.4f\n", sigma, errors.inside, errors.borders);
    EXPECT_LT(errors.borders, kMisplaced) << sigma;
  }
}

TEST(Udim, TheFarFieldIsTheMeanOfTheTiles) {
  for (const std::vector<int>& numbers : {std::vector<int>{1001, 1002, 1011, 1012}, std::vector<int>{1001, 1002, 1011}}) {
    const Tiles tiles(numbers, kHeight / 16);
    const auto opened = api::OpenedNdf::open(tiles.writePyramids());
    constexpr double kMarginsCountTwice = 0.05;  // the mean of a tile's map holds its margins
    Sums sums;
    addErrors(tiles, opened.model(), 0.7, 0.4, 1e5f, sums);
    std::printf("far field: %.4f\n", sums.relative());
    EXPECT_LT(sums.relative(), kMarginsCountTwice);
  }
}

TEST(Udim, TheFarFieldIsTheSameFromEveryTile) {
  const Tiles tiles({1001, 1002, 1011, 1012}, kNarrowMargin);
  const auto opened = api::OpenedNdf::open(tiles.writePyramids());
  constexpr double kSame = 0.02;  // margins of the own tile keep a part of what lies beyond it
  const Footprint p = Footprint::isotropic({}, 1e5f);
  for (const Vec2 h : {Vec2{0, 0}, Vec2{0.1f, -0.1f}, Vec2{-0.2f, 0.05f}}) {
    const float here = api::densityAt(opened.model(), 0.2, 0.3, p, h);
    ASSERT_GT(here, 0);
    for (const auto& [u, v] : {std::pair{1.5, 0.5}, {0.1, 1.9}, {1.99, 1.01}})
      EXPECT_NEAR(api::densityAt(opened.model(), u, v, p, h), here, kSame * here) << u << " " << v;
  }
}

TEST(Udim, WeightsOfAMissingTileCountForNothing) {
  const Tiles tiles({1001, 1002, 1011});  // 1012 is missing: the set has a re-entrant corner at uv (1, 1)
  api::NdfOptions options;
  options.sigma_r = kSigmaR;
  const auto opened = api::OpenedNdf::open(tiles.writeNormals(), options);
  Sums borders, corner;
  constexpr float kSigma = 8;
  for (int k = 0; k < 24; ++k) {
    const double t = 0.1 + 0.028 * k;                                          // at most .77: beyond the reach of the corner
    addErrors(tiles, opened.model(), 1.3 + 0.02 * k, 0.999, kSigma, borders);  // below the missing tile
    addErrors(tiles, opened.model(), 0.999, 1.3 + 0.02 * k, kSigma, borders);  // left of it
    addErrors(tiles, opened.model(), 1, t, kSigma, borders);
    addErrors(tiles, opened.model(), 0.99 + 0.02 * (k % 2), 0.97 + 0.001 * k, kSigma, corner);
  }
  EXPECT_LT(borders.relative(), kCutTail);
  // Within the reach of the corner, texels stand in for those that do not exist.
  std::printf("borders %.5f corner %.4f\n", borders.relative(), corner.relative());
  EXPECT_LT(corner.relative(), 0.2);
}

TEST(Udim, DensitiesAreZeroWhereTheSetHasNoTile) {
  const Tiles tiles({1001, 1002, 1011});
  const auto opened = api::OpenedNdf::open(tiles.writePyramids());
  const auto& set = std::get<api::UdimNdf>(opened.model());
  for (const auto& [u, v] : {std::pair{1.5, 1.5}, {-0.5, 0.5}, {0.5, -1.0}, {2.5, 0.5}, {10.5, 0.5}, {0.5, 1e9}}) {
    const Footprint p = Footprint::isotropic(wrappedUv(u, v), 8);
    EXPECT_EQ(api::densityAt(opened.model(), u, v, p, {}), 0) << u << " " << v;
    EXPECT_EQ(api::meanAt(opened.model(), u, v, p, {{-1, -1}, {1, 1}}), 0);
    EXPECT_EQ(api::sampleAt(opened.model(), u, v, p, {0.5f, 0.5f}).pdf, 0);
  }
  EXPECT_EQ(set.tiles().at(1, 1), nullptr);
  EXPECT_NE(set.tiles().at(0, 1), nullptr);
}

TEST(Udim, MeansAndSamplesAgreeWithDensities) {
  const Tiles tiles;
  const auto opened = api::OpenedNdf::open(tiles.writePyramids());
  for (const float sigma : {8.0f, 60.0f}) {
    const Footprint p = Footprint::isotropic({0.98f, 0.9f}, sigma);
    EXPECT_NEAR(opened.model().mean(p, {{-1, -1}, {1, 1}}), 0.25f, 1e-3f);
    double mean = 0;
    constexpr int kSamples = 1000;
    std::mt19937 random(3);
    std::uniform_real_distribution<float> unit(0, 1);
    for (int k = 0; k < kSamples; ++k) {
      const HalfVectorSample drawn = opened.model().sample(p, {unit(random), unit(random)});
      ASSERT_GT(drawn.pdf, 0);
      EXPECT_NEAR(drawn.pdf, opened.model().density(p, drawn.h), 0.02f * drawn.pdf + 1e-3f);
      mean += (drawn.h.x < 0 ? 1.0 : 0.0) / kSamples;
    }
    constexpr double kNoise = 0.065;  // four deviations of a share of 1000 samples
    EXPECT_NEAR(mean, 2 * opened.model().mean(p, {{-1, -1}, {0, 1}}), kNoise);
  }
}

TEST(Udim, TilesMayHaveSeveralResolutions) {
  const Tiles tiles({1001, 1002});
  // Tile 1002 again, with four texels for each.
  const auto pattern = tiles.write("mixed", [](const auto& path, const NormalMap& map, const formats::UdimPlace& place) {
    if (place.tile == 1001) return formats::writeAsset(path, map, {}, {.overwrite = true, .udim = place});
    formats::UdimPlace fine = place;
    for (int& margin : fine.margins) margin *= 2;
    NormalMap doubled;
    doubled.width = 2 * map.width, doubled.height = 2 * map.height;
    std::vector<Vec2> normals;
    for (int j = 0; j < doubled.height; ++j)
      for (int i = 0; i < doubled.width; ++i) normals.push_back(map.at(i / 2, j / 2));
    doubled.normals = normals;
    formats::writeAsset(path, doubled, {}, {.overwrite = true, .udim = fine});
  });
  api::NdfOptions options;
  options.sigma_r = kSigmaR;
  const auto opened = api::OpenedNdf::open(pattern, options);
  EXPECT_EQ(opened.info().width, 2 * kWidth);  // footprints are in texels of the finest tile
  const std::vector<Vec2> halves = Tiles::halfVectors();
  Sums sums;
  for (const double u : {0.5, 0.99, 1.0, 1.01, 1.5}) {
    const std::vector<double> truth = tiles.densities(u, 0.5, 6);
    const Footprint p = Footprint::isotropic(wrappedUv(u, 0.5), 12);
    for (std::size_t k = 0; k < halves.size(); ++k) {
      const double error = api::densityAt(opened.model(), u, 0.5, p, halves[k]) - truth[k];
      sums.error += error * error, sums.truth += truth[k] * truth[k];
    }
  }
  EXPECT_LT(sums.relative(), 0.01);  // a texel of a sixth of the deviation is not a point
}

TEST(Udim, MomentsOfASetAnswerAsThoseOfTheLargeMap) {
  const Tiles tiles;
  NormalMap map;
  map.width = 2 * kWidth, map.height = 2 * kHeight, map.normals = tiles.large();
  bake::SlopeMomentsOptions values;
  values.boundary = Boundary::clamp;
  formats::writeAsset(tiles.file("large.glint"), bake::buildSlopeMoments(map, values).view(), {});
  api::NdfOptions options;
  options.sigma_r = kSigmaR;
  const auto large = api::OpenedNdf::open(tiles.file("large.glint"), options);
  const auto opened = api::OpenedNdf::open(tiles.writeMoments(), options);
  constexpr float kSigma = 8;
  Sums sums;
  for (const auto& [u, v] : {std::pair{0.5, 0.5}, {0.99, 0.4}, {1.0, 1.0}, {1.01, 1.5}, {1.6, 1.02}, {0.03, 1.2}})
    for (const Vec2 h : Tiles::halfVectors()) {
      const double truth = large.model().density(Footprint::isotropic(wrappedUv(u / 2, v / 2), kSigma), h);
      const double error = api::densityAt(opened.model(), u, v, Footprint::isotropic(wrappedUv(u, v), kSigma), h) - truth;
      sums.error += error * error, sums.truth += truth * truth;
    }
  constexpr double kOtherTexels = 0.1;  // texels of the levels lie elsewhere
  std::printf("moments: %.4f\n", sums.relative());
  EXPECT_LT(sums.relative(), kOtherTexels);
  EXPECT_GT(opened.slopes().covariance.xx, 0);
}

TEST(Udim, CAndBatchesAnswerAsCpp) {
  const Tiles tiles({1001, 1002, 1011});
  const std::string pattern = tiles.writePyramids().string();
  const auto opened = api::OpenedNdf::open(pattern);
  glint_ndf* ndf = nullptr;
  ASSERT_EQ(glint_ndf_open(pattern.c_str(), nullptr, &ndf), GLINT_OK) << glint_error_message();
  glint_ndf_info info = {};
  info.struct_size = sizeof info;
  ASSERT_EQ(glint_ndf_get_info(ndf, &info), GLINT_OK);
  EXPECT_EQ(info.width, kWidth);
  EXPECT_EQ(info.boundary, GLINT_BOUNDARY_CLAMP);
  EXPECT_EQ(info.file_bytes, opened.fileBytes());
  const std::vector<double> us = {0.2, 1.3, 0.99, 1.001, 1.5}, vs = {0.7, 0.4, 1.02, 0.99, 1.5};
  std::vector<float> answers(us.size());
  glint_footprints footprints = {};
  const float sigma = 8, hx = 0.1f, hy = -0.05f;
  footprints.precise_u = {us.data(), sizeof(double)}, footprints.precise_v = {vs.data(), sizeof(double)};
  footprints.sigma = {&sigma, 0};
  ASSERT_EQ(glint_density_batch(ndf, us.size(), &footprints, {&hx, 0}, {&hy, 0}, answers.data()), GLINT_OK);
  for (std::size_t k = 0; k < us.size(); ++k) {
    const glint_footprint p = glint_footprint_isotropic(us[k], vs[k], sigma);
    float density = -1;
    ASSERT_EQ(glint_density(ndf, &p, hx, hy, &density), GLINT_OK);
    EXPECT_EQ(density,
              api::densityAt(opened.model(), us[k], vs[k], Footprint::isotropic(wrappedUv(us[k], vs[k]), sigma), {hx, hy}));
    EXPECT_EQ(density, answers[k]);
    EXPECT_EQ(density == 0, k == 4);
  }
  glint_ndf_close(ndf);
}

TEST(Udim, AFileOfOneTileIsASetOfThisTile) {
  const Tiles tiles;
  const auto pattern = tiles.writePyramids();
  const auto set = api::OpenedNdf::open(pattern), tile = api::OpenedNdf::open(formats::udimFile(pattern, 1012));
  const Footprint p = Footprint::isotropic({1.4f, 1.6f}, 8);
  EXPECT_GT(tile.model().density(p, {0.1f, 0.1f}), 0);
  EXPECT_EQ(tile.model().density(p, {0.1f, 0.1f}), set.model().density(p, {0.1f, 0.1f}));
  EXPECT_EQ(tile.model().density(Footprint::isotropic({0.4f, 0.6f}, 8), {}), 0);
}

TEST(Udim, ErrorsNameTheFileAndTheRemedy) {
  const Tiles tiles;
  const auto pattern = tiles.writePyramids();
  const auto ruleOf = [](const std::filesystem::path& path, const api::NdfOptions& options = {}) {
    try {
      const auto opened = api::OpenedNdf::open(path, options);
      static_cast<void>(api::pack(opened));
      return std::string();
    } catch (const Error& error) {
      EXPECT_FALSE(error.remedy().empty());
      return error.rule();
    }
  };
  EXPECT_EQ(ruleOf(tiles.file("none.<UDIM>.glint")), "udim.files");
  EXPECT_EQ(ruleOf(tiles.file("a.<UDIM>.<UDIM>.glint")), "udim.pattern");
  EXPECT_EQ(ruleOf(tiles.file("<UDIM>") / "a.<UDIM>.glint"), "udim.pattern");
  EXPECT_EQ(ruleOf(pattern), "udim.pack");
  api::NdfOptions options;
  options.normals = formats::udimFile(tiles.writeNormals(), 1001);
  EXPECT_EQ(ruleOf(pattern, options), "udim.normals");
  // A tile under the name of another, a map of its own, and tiles of two kinds.
  std::filesystem::copy(formats::udimFile(pattern, 1001), tiles.file("moved.1002.glint"));
  EXPECT_EQ(ruleOf(tiles.file("moved.<UDIM>.glint")), "udim.tile");
  NormalMap map;
  map.width = 2 * kWidth, map.height = 2 * kHeight, map.normals = tiles.large();
  formats::writeAsset(tiles.file("own.1001.glint"), map, {});
  EXPECT_EQ(ruleOf(tiles.file("own.<UDIM>.glint")), "udim.tile");
  std::filesystem::copy(formats::udimFile(pattern, 1001), tiles.file("two.1001.glint"));
  std::filesystem::copy(formats::udimFile(tiles.writeNormals(), 1002), tiles.file("two.1002.glint"));
  EXPECT_EQ(ruleOf(tiles.file("two.<UDIM>.glint")), "udim.kind");
}

TEST(Udim, PatternsFindTilesOfEveryForm) {
  const Tiles tiles({1001, 1012});
  const auto pattern = tiles.writeNormals();
  EXPECT_EQ(formats::udimTiles(pattern), (std::vector<int>{1001, 1012}));
  EXPECT_EQ(formats::udimTiles(tiles.file("map.%(UDIM)d.glint")), (std::vector<int>{1001, 1012}));
  EXPECT_EQ(formats::udimFile("a/x.%(UDIM)d.exr", 1023), std::filesystem::path("a/x.1023.exr"));
  EXPECT_FALSE(formats::isUdimPattern("a/x.1001.exr"));
  EXPECT_EQ(formats::udimTiles(tiles.file("map.<udim>.glint")), (std::vector<int>{1001, 1012}));
  EXPECT_EQ(formats::udimFile("a/x.<udim>.exr", 1023), std::filesystem::path("a/x.1023.exr"));
}

TEST(Udim, NumbersThatAreNoTilesAreNamed) {
  const Tiles tiles({1001});
  const auto pattern = tiles.writeNormals();
  EXPECT_TRUE(formats::udimStrays(pattern).empty());
  for (const char* name :
       {"map.1000.glint", "map.0999.glint", "map.10011.glint", "map.7.glint", "map.10a1.glint", "map..glint"})
    std::filesystem::copy(formats::udimFile(pattern, 1001), tiles.file(name));
  EXPECT_EQ(formats::udimTiles(pattern), std::vector<int>{1001});
  EXPECT_EQ(formats::udimStrays(pattern),
            (std::vector<std::string>{"map.0999.glint", "map.1000.glint", "map.10011.glint", "map.7.glint"}));
}

TEST(Udim, TilesAreValidAssetsAndBadPlacesAreNot) {
  const Tiles tiles;
  const auto file = formats::udimFile(tiles.writePyramids(), 1011);
  EXPECT_TRUE(formats::validateAsset(file).findings.empty());
  const formats::Asset asset = formats::Asset::open(file);
  ASSERT_TRUE(asset.info().udim.has_value());
  EXPECT_EQ(asset.info().udim->tile, 1011);
  EXPECT_EQ(asset.info().udim->margins, (std::array<int, 4>{0, kMargin, kMargin, 0}));
  EXPECT_EQ(asset.info().required_features, (std::vector<std::string>{"udim"}));
  NormalMap map;
  map.width = 2 * kWidth, map.height = 2 * kHeight, map.normals = tiles.large();
  formats::UdimPlace place{1001, {kWidth, 0, kWidth, 0}};
  EXPECT_THROW(formats::writeAsset(tiles.file("bad.glint"), map, {}, {.overwrite = true, .udim = place}), Error);
  place = {1000, {}};
  EXPECT_THROW(formats::writeAsset(tiles.file("bad.glint"), map, {}, {.overwrite = true, .udim = place}), Error);
  EXPECT_FALSE(std::filesystem::exists(tiles.file("bad.glint")));
}

}  // namespace
}  // namespace glint::udim_test
