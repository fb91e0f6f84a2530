// Footprints that are large beside the map, and maps that are thin beside their footprints.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "glint/bake/compressed/compress.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/math/gaussian.h"
#include "glint/query/anisotropic_ndf.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/pyramid_ndf.h"
#include "support/test_maps.h"

namespace glint::far_field_test {
namespace {

using test::OwnedMap;

constexpr float kSigmaR = 0.05f;

bake::PyramidOptions options(float stride, Boundary boundary = Boundary::wrap, Surface surface = Surface::flat) {
  bake::PyramidOptions o;
  o.stride = stride;
  o.resolution = 64;
  o.sigma_r = kSigmaR;
  o.surface = surface;
  o.boundary = boundary;
  return o;
}

/// Weights of the texels of one axis in a Gaussian footprint, summed over so many copies of the map that none is missed.
std::vector<double> axisWeights(int size, double centre, double sigma, Boundary boundary) {
  const int copies = boundary == Boundary::clamp ? 0 : static_cast<int>(std::ceil(7 * sigma / size)) + 1;
  std::vector<double> weights(static_cast<std::size_t>(size), 0.0);
  double total = 0;
  for (int i = -copies * size; i < (copies + 1) * size; ++i) {
    const double d = (i + 0.5 - centre) / sigma, weight = std::exp(-0.5 * d * d);
    weights[static_cast<std::size_t>(((i % size) + size) % size)] += weight;
    total += weight;
  }
  for (double& weight : weights) weight /= total;
  return weights;
}

/// Mean density over a box of half vectors, summed over all texels of the map.
double truth(const NormalMap& map, Boundary boundary, Vec2 uv, double sigma, const Box2& box) {
  const auto wx = axisWeights(map.width, double{uv.x} * map.width, sigma, boundary);
  const auto wy = axisWeights(map.height, double{uv.y} * map.height, sigma, boundary);
  double sum = 0;
  for (int j = 0; j < map.height; ++j)
    for (int i = 0; i < map.width; ++i) {
      const Vec2 n = map.at(i, j);
      sum += wx[static_cast<std::size_t>(i)] * wy[static_cast<std::size_t>(j)] *
             double{gaussianMass(box.low.x, box.high.x, n.x, kSigmaR)} *
             double{gaussianMass(box.low.y, box.high.y, n.y, kSigmaR)};
    }
  return sum / box.area();
}

/// The left half of the map nearly flat, the right half rough: it varies as slowly as a map can.
std::vector<Vec2> halves(int width, int height) {
  std::mt19937 random(7);
  std::normal_distribution<float> gaussian(0, 1);
  std::vector<Vec2> normals(static_cast<std::size_t>(width) * height);
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const float deviation = static_cast<int>(k % static_cast<std::size_t>(width)) < width / 2 ? 0.02f : 0.25f;
    normals[k] = {std::clamp(deviation * gaussian(random), -0.6f, 0.6f), std::clamp(deviation * gaussian(random), -0.6f, 0.6f)};
  }
  return normals;
}

/// Pixels of 64^2 images, so that no part of one is asked.
constexpr Box2 kHighlight = {{-0.0625f, -0.0625f}, {0.0625f, 0.0625f}};

/// Largest relative error of a model at random places.
template <class Model>
double worstError(const Model& model, const NormalMap& map, Boundary boundary, double sigma) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> unit(0, 1);
  double worst = 0;
  for (int k = 0; k < 12; ++k) {
    const Vec2 uv = {unit(random), unit(random)};
    const double exact = truth(map, boundary, uv, sigma, kHighlight);
    const double answer = model.mean(Footprint::isotropic(uv, static_cast<float>(sigma)), kHighlight);
    EXPECT_TRUE(std::isfinite(answer)) << uv.x << ' ' << uv.y;
    worst = std::max(worst, std::abs(answer - exact) / exact);
  }
  return worst;
}

/// What images of 64^2 pixels in half precision, cut footprints and filters cost together.
constexpr double kImageError = 0.005;

TEST(FarField, TendsToTheMeanOfTheMapWhereverOneAsks) {
  // Half the period keeps 2 exp(-pi^2 / 2) = 1.4 % of the slowest wave, and kernels keep a little more.
  constexpr double kFarError = 0.025;
  for (const auto& [width, height] : {std::pair{96, 96}, {100, 40}, {128, 6}}) {
    const OwnedMap owned(width, height, halves(width, height));
    for (const Surface surface : {Surface::flat, Surface::smooth}) {
      const bake::NdfPyramidData data = bake::buildPyramid(owned.map(), options(8, Boundary::wrap, surface));
      const PyramidNdf model(data.view());
      for (const double maps : {0.5, 0.6, 1.0, 2.5, 10.0}) {
        if (surface == Surface::smooth) {  // its own mean: triangles blend normals
          const Footprint far = Footprint::isotropic({0.2f, 0.3f}, 1e6f),
                          here = Footprint::isotropic({0.7f, 0.6f}, static_cast<float>(maps * width));
          EXPECT_NEAR(model.mean(here, kHighlight) / model.mean(far, kHighlight), 1, kFarError);
          continue;
        }
        EXPECT_LT(worstError(model, owned.map(), Boundary::wrap, maps * width), kFarError)
            << width << 'x' << height << ", " << maps << " maps";
      }
      if (surface == Surface::flat) {
        EXPECT_LT(worstError(model, owned.map(), Boundary::wrap, 100.0 * width), kImageError);
      }
    }
  }
}

TEST(FarField, FadesAsTheSlowestWaveDoesAboveTheLastFootprints) {
  // At the centres of the last level only what is faster than the slowest wave errs.
  constexpr double kOtherWaves = 0.01;
  const OwnedMap owned(128, 128, halves(128, 128));
  bake::PyramidOptions grid = options(8);
  grid.overlap = 1;
  const bake::NdfPyramidData data = bake::buildPyramid(owned.map(), grid);
  const PyramidNdf model(data.view(), Interpolation::trilinear);
  ASSERT_EQ(data.shape.footprintLevels(), 4);  // strides 8 to 64
  for (const float sigma : {28.0f, 32.0f, 40.0f, 50.0f, 64.0f, 90.0f}) {
    for (const Vec2 uv : {Vec2{0.25f, 0.25f}, Vec2{0.75f, 0.25f}}) {
      const double exact = truth(owned.map(), Boundary::wrap, uv, sigma, kHighlight);
      EXPECT_NEAR(model.mean(Footprint::isotropic(uv, sigma), kHighlight) / exact, 1, kOtherWaves) << uv.x << ' ' << sigma;
    }
  }
}

/// Two shapes with normals of their own on a nearly flat map, as a logo or a trim sheet has them.
std::vector<Vec2> logo(int width, int height) {
  std::mt19937 random(13);
  std::normal_distribution<float> gaussian(0, 0.03f);
  std::vector<Vec2> normals(static_cast<std::size_t>(width) * height);
  for (std::size_t k = 0; k < normals.size(); ++k) {
    const float u = (static_cast<float>(k % static_cast<std::size_t>(width)) + 0.5f) / static_cast<float>(width);
    const float v = (static_cast<float>(k / static_cast<std::size_t>(width)) + 0.5f) / static_cast<float>(height);
    const bool disc = (u - 0.35f) * (u - 0.35f) + (v - 0.4f) * (v - 0.4f)<0.05f, strip = u> 0.8f;
    normals[k] = {gaussian(random) + (disc ? -0.25f : 0), gaussian(random) + (disc ? 0.1f : 0) + (strip ? -0.3f : 0)};
  }
  return normals;
}

TEST(FarField, IsRightFromTheLastLevelOnWhereverShapesLie) {
  // Dim places are dim beside what the map shows on average: both count. Half of the places err by less than 1 %.
  constexpr double kError = 0.03, kShare = 0.5;
  constexpr Box2 kDisc = {{-0.3125f, 0.0625f}, {-0.1875f, 0.1875f}};
  std::mt19937 random(4);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const auto& [width, height] : {std::pair{128, 128}, {100, 90}, {192, 48}, {60, 144}}) {
    const OwnedMap owned(width, height, logo(width, height));
    const bake::NdfPyramidData data = bake::buildPyramid(owned.map(), options(8));
    const PyramidNdf model(data.view());
    const int last = data.shape.footprintLevels() - 1;
    const float sigma = kFootprintPerStride * data.shape.levels[last].stride;
    const double mean = truth(owned.map(), Boundary::wrap, {0, 0}, 1e3, kDisc);
    for (const float times : {1.0f, 1.05f, 1.1f, 1.16f, 1.25f, 1.4f, 1.6f, 2.0f, 3.0f, 10.0f}) {
      for (int k = 0; k < 8; ++k) {
        const Vec2 uv = {unit(random), unit(random)};
        const double exact = truth(owned.map(), Boundary::wrap, uv, double{times * sigma}, kDisc);
        EXPECT_NEAR(model.mean(Footprint::isotropic(uv, times * sigma), kDisc), exact, kError * std::max(exact, kShare * mean))
            << width << 'x' << height << ", " << times << " at " << uv.x << ' ' << uv.y;
      }
    }
  }
}

TEST(FarField, OfAMapThatEndsTendsToItsMean) {
  constexpr double kNearError = 0.08, kFarError = 0.02;
  const OwnedMap owned(128, 128, halves(128, 128));
  const bake::NdfPyramidData data = bake::buildPyramid(owned.map(), options(8, Boundary::clamp));
  const PyramidNdf model(data.view());
  EXPECT_LT(worstError(model, owned.map(), Boundary::clamp, 128), kNearError);
  EXPECT_LT(worstError(model, owned.map(), Boundary::clamp, 256), kFarError);
  EXPECT_LT(worstError(model, owned.map(), Boundary::clamp, 12800), kImageError);
}

TEST(FarField, OfEveryCompressionIsThatOfThePyramid) {
  constexpr double kCompression = 0.02;
  const OwnedMap owned(96, 20, halves(96, 20));
  const bake::NdfPyramidData data = bake::buildPyramid(owned.map(), options(8));
  const PyramidNdf pyramid(data.view());
  for (const CompressionMethod method : {CompressionMethod::cp, CompressionMethod::tucker, CompressionMethod::pca}) {
    bake::CompressionOptions o;
    o.method = method;
    o.rank = 24;
    const auto compressed = bake::compressPyramid(data.view(), o);
    const CpNdf model(compressed.view());
    for (const float sigma : {30.0f, 50.0f, 100.0f, 1000.0f, 1e9f, 1e30f}) {
      for (const Vec2 uv : {Vec2{0.1f, 0.9f}, Vec2{0.8f, 0.4f}}) {
        const Footprint p = Footprint::isotropic(uv, sigma);
        EXPECT_NEAR(model.mean(p, kHighlight) / pyramid.mean(p, kHighlight), 1, kCompression) << int(method) << ' ' << sigma;
      }
    }
  }
}

TEST(ThinMaps, ChooseImagesThatThereAre) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const auto& [width, height] :
       {std::pair{1, 1}, {1, 7}, {9, 1}, {128, 16}, {512, 50}, {64, 700}, {1000, 200}, {16384, 3}}) {
    for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
      for (const float stride : {2.0f, 6.5f, 32.0f, 100.0f}) {
        const PyramidShape shape = bake::pyramidShape(width, height, options(stride, boundary));
        const SliceChooser chooser(shape);
        for (int k = 0; k < 400; ++k) {
          const float sigma = std::exp2(-3 + 25 * unit(random));
          const PyramidSlices chosen = chooser.choose(Footprint::isotropic({3 * unit(random) - 1, unit(random)}, sigma));
          float total = 0;
          for (int j = 0; j < chosen.count; ++j) {
            ASSERT_GE(chosen.weights[j], 0);
            total += chosen.weights[j];
            if (chosen.weights[j] == 0 && chosen.level(j) == shape.level_count) continue;
            ASSERT_LT(chosen.level(j), shape.level_count);
            ASSERT_LT(chosen.images[j], shape.levels[chosen.level(j)].imageCount());
          }
          ASSERT_NEAR(total, 1, 1e-5);
        }
      }
    }
  }
}

TEST(ThinMaps, AnswerAsTheTexelsDo) {
  // What interpolation between the centres of levels costs on unrelated texels, for footprints of at least 3,000 of them.
  constexpr double kBetweenCentres = 0.04;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const auto& [width, height] : {std::pair{1024, 128}, {512, 50}, {64, 700}, {3000, 8}}) {
    const OwnedMap owned(width, height, test::randomNormals(width, height, 0.4f, 3));
    const bake::NdfPyramidData data = bake::buildPyramid(owned.map(), options(32));
    const PyramidNdf model(data.view());
    for (int k = 0; k < 24; ++k) {
      const Vec2 uv = {unit(random), unit(random)};
      const float sigma = 3000.0f / static_cast<float>(std::min(width, height)) * std::exp2(3 * unit(random));
      const double exact = truth(owned.map(), Boundary::wrap, uv, sigma, kHighlight);
      EXPECT_NEAR(model.mean(Footprint::isotropic(uv, sigma), kHighlight) / exact, 1, kBetweenCentres)
          << width << 'x' << height << " at " << uv.x << ' ' << uv.y << ", sigma " << sigma;
    }
  }
}

TEST(ThinMaps, RoundFootprintsKeepTheirSizeAlongTheMap) {
  EXPECT_FLOAT_EQ(isotropicVariance(1e8f, 16, {1e6f, 0, 1e6f}), 1e6f);
  EXPECT_FLOAT_EQ(isotropicVariance(1e8f, 16, {25, 0, 1e6f}), 0.5f * (25 + 25));
}

}  // namespace
}  // namespace glint::far_field_test
