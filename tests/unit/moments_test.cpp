#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "glint/bake/common/reference_image.h"
#include "glint/bake/common/slopes.h"
#include "glint/bake/moments/slope_moments.h"
#include "glint/model/error.h"
#include "glint/model/slope_sums.h"
#include "glint/query/moments_ndf.h"
#include "glint/query/reference.h"
#include "support/beckmann_ndf.h"
#include "support/test_maps.h"

namespace glint::moments_test {
namespace {

constexpr double kPi = std::numbers::pi;

/// A lobe by its moments: narrow, wide, stretched along a diagonal, leaning.
const std::vector<MapSlopes>& someSlopes() {
  static const std::vector<MapSlopes> list = {
      {{0, 0}, {0.01f, 0, 0.01f}},
      {{0, 0}, {1.5f, 0, 0.3f}},
      {{0.3f, -0.2f}, {0.04f, 0.03f, 0.03f}},
      {{-2, 1}, {0.2f, -0.1f, 0.1f}},
      {{0.1f, 0.1f}, {0.09f, 0.0895f, 0.0899f}},
  };
  return list;
}

/// Mass of a density in a box, by the midpoint rule on a lattice that is finer than the lobe.
template <class Density>
double massByLattice(const Density& density, const Box2& box, int points) {
  double sum = 0;
  for (int j = 0; j < points; ++j)
    for (int i = 0; i < points; ++i)
      sum += density(Vec2{box.low.x + box.width() * (static_cast<float>(i) + 0.5f) / static_cast<float>(points),
                          box.low.y + box.height() * (static_cast<float>(j) + 0.5f) / static_cast<float>(points)});
  return sum * box.width() * box.height() / points / points;
}

TEST(SlopeLobe, IsTheBeckmannLobeOfItsSlopes) {
  for (const MapSlopes& slopes : someSlopes()) {
    const SlopeLobe lobe(slopes, 0);
    const test::BeckmannNdf truth(slopes);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(0, 1);
    for (int k = 0; k < 200; ++k) {
      const HalfVectorSample s = lobe.sample({unit(random), unit(random)});
      const float expected = truth.density({}, s.h);
      // Slopes of a float near the rim have lost digits, and the covariance of the last lobe is nearly singular.
      EXPECT_NEAR(s.pdf, expected, 2e-3f * expected);
      EXPECT_EQ(s.pdf, lobe.density(s.h));
    }
  }
  EXPECT_EQ(SlopeLobe(someSlopes()[0], 0.1f).density({1, 0}), 0);
  EXPECT_EQ(SlopeLobe(someSlopes()[0], 0.1f).density({0.8f, 0.8f}), 0);
}

TEST(SlopeLobe, HasAllItsMassInTheDisk) {
  for (const MapSlopes& slopes : someSlopes()) EXPECT_NEAR(SlopeLobe(slopes, 0.02f).mass({{-1, -1}, {1, 1}}), 1, 2e-3);
}

/// Boxes of all sizes, at the rim and beyond it, around the axes, and of the size of a pixel.
TEST(SlopeLobe, MassOfABoxIsTheIntegralOfTheDensity) {
  constexpr double kSumOfLattice = 2e-4;
  std::mt19937 random(2);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (const MapSlopes& slopes : someSlopes()) {
    const SlopeLobe lobe(slopes, 0.02f);
    const auto density = [&](Vec2 h) { return double{lobe.density(h)}; };
    for (int k = 0; k < 30; ++k) {
      const Vec2 corner = {unit(random), unit(random)}, size = {std::abs(unit(random)), std::abs(unit(random))};
      const Box2 box = {corner, corner + (k % 3 == 0 ? 1.0f / 128 : 1.0f) * size};
      const Box2 inside = insideSquare(box);
      EXPECT_NEAR(lobe.mass(box), massByLattice(density, inside, 600), kSumOfLattice)
          << k << " " << slopes.mean.x << ": " << box.low.x << " " << box.low.y << " " << box.high.x << " " << box.high.y;
    }
  }
}

TEST(SlopeLobe, OfMomentsThatAreNoNumbersAnswersWithNumbers) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  for (const float bad : {kNan, kInf, -kInf, 1e30f}) {
    for (const MapSlopes& slopes : {MapSlopes{{bad, 0}, {}}, MapSlopes{{0, bad}, {}}, MapSlopes{{0, 0}, {bad, 0, 0.01f}},
                                    MapSlopes{{0, 0}, {0.01f, bad, 0.01f}}, MapSlopes{{0, 0}, {0.01f, 0, bad}}}) {
      const SlopeLobe lobe(slopes, 0.01f);
      const float mass = lobe.mass({{-0.3f, -0.2f}, {0.4f, 0.6f}}), density = lobe.density({0.1f, 0.2f});
      EXPECT_TRUE(mass >= 0 && mass <= 1) << mass;
      EXPECT_TRUE(density >= 0 && density < kInf) << density;
    }
  }
}

TEST(SlopeLobe, MassesOfPixelsAddUp) {
  constexpr int kPixels = 64;
  for (const MapSlopes& slopes : someSlopes()) {
    const SlopeLobe lobe(slopes, 0.02f);
    double sum = 0;
    for (int j = 0; j < kPixels; ++j) {
      for (int i = 0; i < kPixels; ++i) {
        const Vec2 low = {2 * static_cast<float>(i) / kPixels - 1, 2 * static_cast<float>(j) / kPixels - 1};
        sum += lobe.mass({low, low + Vec2{2.0f / kPixels, 2.0f / kPixels}});
      }
    }
    EXPECT_NEAR(sum, 1, 1e-4);
  }
}

TEST(SlopeLobe, RoughnessIsThatOfTheFacet) {
  // A facet of roughness sigma_r has the Gaussian lobe of the Reference around its normal, also where it leans.
  constexpr float kSigmaR = 0.01f;
  for (const Vec2 normal : {Vec2{0, 0}, Vec2{0.5f, 0}, Vec2{-0.4f, 0.6f}}) {
    const SlopeLobe lobe({slopeOf(normal), {}}, kSigmaR);
    for (const Vec2 offset : {Vec2{0, 0}, Vec2{0.01f, 0}, Vec2{0, -0.012f}, Vec2{0.007f, 0.007f}}) {
      const float expected = gaussianDensity(offset, kSigmaR);
      EXPECT_NEAR(lobe.density(normal + offset), expected, 0.1f * expected);  // the Gaussian is one of normals, not of slopes
    }
  }
}

/// Weighted moments of slopes by their definition.
MapSlopes slopeMomentsOf(const std::vector<Vec2>& slopes, const std::vector<double>& weights) {
  double total = 0, p = 0, q = 0, pp = 0, pq = 0, qq = 0;
  for (std::size_t k = 0; k < slopes.size(); ++k) {
    total += weights[k];
    p += weights[k] * slopes[k].x, q += weights[k] * slopes[k].y;
  }
  p /= total, q /= total;
  for (std::size_t k = 0; k < slopes.size(); ++k) {
    const double x = slopes[k].x - p, y = slopes[k].y - q;
    pp += weights[k] * x * x, pq += weights[k] * x * y, qq += weights[k] * y * y;
  }
  return {{static_cast<float>(p), static_cast<float>(q)},
          {static_cast<float>(pp / total), static_cast<float>(pq / total), static_cast<float>(qq / total)}};
}

void expectNear(const MapSlopes& a, const MapSlopes& b, double error, const std::string& place) {
  EXPECT_NEAR(a.mean.x, b.mean.x, error) << place;
  EXPECT_NEAR(a.mean.y, b.mean.y, error) << place;
  EXPECT_NEAR(a.covariance.xx, b.covariance.xx, error) << place;
  EXPECT_NEAR(a.covariance.xy, b.covariance.xy, error) << place;
  EXPECT_NEAR(a.covariance.yy, b.covariance.yy, error) << place;
}

TEST(SlopeMoments, OfEachTexelAreThoseOfTheAreaThatItCovers) {
  constexpr int kWidth = 64, kHeight = 32;
  const test::OwnedMap map(kWidth, kHeight, test::roughSurface(kWidth, kHeight, 0.4f));
  const bake::SlopeMomentsData data = bake::buildSlopeMoments(map.map(), {.finest_level = 0});
  ASSERT_EQ(data.shape.level_count, 7);
  for (int l = 0; l < 7; ++l) {
    const SlopeMomentsLevel level = data.view().levels[l];
    ASSERT_EQ(level.columns, std::max(1, kWidth >> l));
    ASSERT_EQ(level.rows, std::max(1, kHeight >> l));
    const int w = kWidth / level.columns, h = kHeight / level.rows;
    for (int j = 0; j < level.rows; ++j) {
      for (int i = 0; i < level.columns; ++i) {
        std::vector<Vec2> slopes;
        for (int y = j * h; y < (j + 1) * h; ++y)
          for (int x = i * w; x < (i + 1) * w; ++x) slopes.push_back(slopeOf(map.map().at(x, y)));
        expectNear(level.texels[static_cast<std::size_t>(j) * level.columns + i],
                   slopeMomentsOf(slopes, std::vector<double>(slopes.size(), 1)), 1e-6, "level " + std::to_string(l));
      }
    }
  }
}

TEST(SlopeMoments, KeepTheMeanOfMapsOfAnySize) {
  for (const auto& [width, height] :
       std::vector<std::pair<int, int>>{{1, 1}, {7, 5}, {97, 61}, {257, 3}, {1, 40}, {255, 255}}) {
    const test::OwnedMap map(width, height, test::randomNormals(width, height, 0.7f, 3));
    const bake::SlopeMomentsData data = bake::buildSlopeMoments(map.map(), {});
    const MapSlopes truth = bake::mapSlopes(map.map());
    expectNear(data.levels.back()[0], truth, 2e-6, std::to_string(width) + " x " + std::to_string(height));
    for (const auto& level : data.levels) {
      std::vector<Vec2> means;
      for (const MapSlopes& s : level) means.push_back(s.mean);
      expectNear({slopeMomentsOf(means, std::vector<double>(means.size(), 1)).mean, {}}, {truth.mean, {}}, 2e-6, "level");
    }
  }
}

TEST(SlopeMoments, OfHeightsAreThoseOfTheirNormals) {
  bake::SynthOptions options = bake::defaultSynthOptions(bake::SynthKind::isotropic);
  options.width = 120, options.height = 90;
  const std::vector<float> heights = bake::synthHeights(options);
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
    const HeightMap height_map{120, 90, 0, heights};
    const test::OwnedMap normals(120, 90, bake::normalsFromHeights(120, 90, heights, boundary));
    const bake::SlopeMomentsData a = bake::buildSlopeMoments(height_map, {.boundary = boundary});
    const bake::SlopeMomentsData b = bake::buildSlopeMoments(normals.map(), {.boundary = boundary});
    for (std::size_t l = 0; l < a.levels.size(); ++l)
      for (std::size_t k = 0; k < a.levels[l].size(); ++k) expectNear(a.levels[l][k], b.levels[l][k], 2e-6, "texel");
  }
}

TEST(SlopeMoments, OfSobelGradientsAreThoseOfAPlaneAndLessOfANoise) {
  bake::SynthOptions options = bake::defaultSynthOptions(bake::SynthKind::isotropic);
  options.width = options.height = 64;
  const std::vector<float> noise = bake::synthHeights(options);
  std::vector<float> plane;
  for (int j = 0; j < 64; ++j)
    for (int i = 0; i < 64; ++i) plane.push_back(0.25f * static_cast<float>(i) - 0.5f * static_cast<float>(j));
  std::vector<Vec2> row(64);
  bake::rowSlopes(64, 64, plane, 7, Boundary::clamp, bake::Gradient::sobel, row);
  for (int i = 1; i < 63; ++i) {
    EXPECT_FLOAT_EQ(row[i].x, 0.25f);
    EXPECT_FLOAT_EQ(row[i].y, -0.5f);
  }
  const auto variance = [&](bake::Gradient gradient) {
    return bake::buildSlopeMoments(HeightMap{64, 64, 0, noise}, {.gradient = gradient}).shape.slopes.covariance.xx;
  };
  EXPECT_LT(variance(bake::Gradient::sobel), 0.99f * variance(bake::Gradient::central));
  EXPECT_GT(variance(bake::Gradient::sobel), 0.7f * variance(bake::Gradient::central));
}

TEST(SlopeMoments, DoNotDependOnThreads) {
  const test::OwnedMap map(203, 151, test::roughSurface(203, 151, 0.4f));
  const bake::SlopeMomentsData all = bake::buildSlopeMoments(map.map(), {});
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const bake::SlopeMomentsData single = bake::buildSlopeMoments(map.map(), {});
  for (std::size_t l = 0; l < all.levels.size(); ++l)
    EXPECT_EQ(std::memcmp(all.levels[l].data(), single.levels[l].data(), all.levels[l].size() * sizeof(MapSlopes)), 0);
}

TEST(SlopeMoments, RefuseHeightsThatAreTooSteepOrNotFinite) {
  for (const float bad : {1e30f, std::numeric_limits<float>::quiet_NaN()}) {
    std::vector<float> heights(64);
    heights[9] = bad;
    EXPECT_THROW(bake::buildSlopeMoments(HeightMap{8, 8, 0, heights}, {}), Error);
  }
}

/// A map whose slopes are waves: a footprint of variance v turns a wave of k radians a texel down by exp(-k^2 v / 2).
test::OwnedMap waves(int size, double turns_x, double turns_y) {
  std::vector<Vec2> normals;
  for (int j = 0; j < size; ++j)
    for (int i = 0; i < size; ++i) {
      const double phase = 2 * kPi * (turns_x * (i + 0.5) + turns_y * (j + 0.5)) / size;
      normals.push_back(
          bake::normalFromSlopes(static_cast<float>(0.5 * std::cos(phase)), static_cast<float>(0.25 * std::sin(phase))));
    }
  return {size, size, std::move(normals)};
}

TEST(MomentsNdf, SeesAsFarAsTheFootprintWhereverItLies) {
  constexpr int kSize = 256;
  std::mt19937 random(4);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const auto& [turns_x, turns_y] : std::vector<std::pair<int, int>>{{2, 0}, {0, 2}, {2, 1}}) {
    const test::OwnedMap map = waves(kSize, turns_x, turns_y);
    const bake::SlopeMomentsData data = bake::buildSlopeMoments(map.map(), {});
    const MomentsNdf ndf(data.view(), 0.01f);
    const double wave = 2 * kPi * std::hypot(turns_x, turns_y) / kSize;
    for (int k = 0; k < 300; ++k) {
      const float sigma = 1.2f * std::exp2(4 * unit(random));  // to 19 texels: a sixth of the wave
      const Vec2 uv = {unit(random), unit(random)};
      const double phase = 2 * kPi * (turns_x * double{uv.x} + turns_y * double{uv.y});
      const double left = std::exp(-0.5 * wave * wave * sigma * sigma);
      const MapSlopes slopes = ndf.slopes(Footprint::isotropic(uv, sigma));
      // Fourth moments of the weights are not those of a Gaussian: (k sigma)^4 / 24 of a wave, of which a part is wrong.
      const double error = 2e-3 + 0.1 * std::pow(wave * sigma, 4);
      EXPECT_NEAR(slopes.mean.x, 0.5 * std::cos(phase) * left, error) << sigma;
      EXPECT_NEAR(slopes.mean.y, 0.25 * std::sin(phase) * left, error) << sigma;
      // E[p^2] = (1 + cos(2 phase) left^4) / 8 is kept whatever the footprint.
      EXPECT_NEAR(slopes.covariance.xx + slopes.mean.x * slopes.mean.x, (1 + std::cos(2 * phase) * std::pow(left, 4)) / 8,
                  2e-3 + 0.5 * std::pow(wave * sigma, 4))
          << sigma;
    }
  }
}

TEST(MomentsNdf, SeesStretchedFootprintsAlongTheirAxis) {
  constexpr int kSize = 256;
  const test::OwnedMap map = waves(kSize, 4, 0);
  const bake::SlopeMomentsData data = bake::buildSlopeMoments(map.map(), {});
  const MomentsNdf ndf(data.view(), 0.01f);
  const double wave = 2 * kPi * 4 / kSize;
  for (const float length : {4.0f, 8.0f, 16.0f}) {
    const auto amplitude = [&](const Footprint& p) { return double{ndf.slopes(p).mean.x} / 0.5; };
    const float c = length * length, d = 4;
    EXPECT_NEAR(amplitude(Footprint::gaussian({0, 0.3f}, {c, 0, d})), std::exp(-0.5 * wave * wave * c), 0.05) << length;
    EXPECT_NEAR(amplitude(Footprint::gaussian({0, 0.3f}, {d, 0, c})), std::exp(-0.5 * wave * wave * d), 0.01) << length;
    const float mean = 0.5f * (c + d), half = 0.5f * (c - d);
    EXPECT_NEAR(amplitude(Footprint::gaussian({0, 0.3f}, {mean, half, mean})), std::exp(-0.5 * wave * wave * mean), 0.03)
        << length;
  }
}

TEST(MomentsNdf, TendsToTheMapAndEndsAtItsBorder) {
  const test::OwnedMap map(120, 75, test::roughSurface(120, 75, 0.3f));
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
    const bake::SlopeMomentsData data = bake::buildSlopeMoments(map.map(), {.boundary = boundary});
    const MomentsNdf ndf(data.view(), 0.01f);
    for (const Footprint& p : {Footprint::isotropic({0.2f, 0.9f}, 120), Footprint::isotropic({0.7f, 0.4f}, 1e9f),
                               Footprint::gaussian({0, 0}, {1e6f, 9e5f, 1e6f})})
      expectNear(ndf.slopes(p), data.shape.slopes, boundary == Boundary::wrap ? 2e-3 : 2e-2, "far");
  }
  // The left half leans to one side and the right half to the other. At the left border of a map that ends there is no right half.
  std::vector<Vec2> halves;
  for (int j = 0; j < 32; ++j)
    for (int i = 0; i < 64; ++i) halves.push_back({i < 32 ? -0.3f : 0.3f, 0});
  const test::OwnedMap two(64, 32, halves);
  const float slope = slopeOf({-0.3f, 0}).x;
  for (const float u : {0.0f, 0.001f, 0.02f}) {
    const bake::SlopeMomentsData ends = bake::buildSlopeMoments(two.map(), {.boundary = Boundary::clamp});
    const bake::SlopeMomentsData wraps = bake::buildSlopeMoments(two.map(), {.boundary = Boundary::wrap});
    const Footprint p = Footprint::isotropic({u, 0.5f}, 2);
    EXPECT_FLOAT_EQ(MomentsNdf(ends.view(), 0.01f).slopes(p).mean.x, slope);
    EXPECT_LT(MomentsNdf(wraps.view(), 0.01f).slopes(p).mean.x, 0.8f * slope);
  }
}

TEST(MomentsNdf, IsContinuousInPlaceAndSize) {
  const test::OwnedMap map(120, 75, test::randomNormals(120, 75, 0.6f, 5));
  const bake::SlopeMomentsData data = bake::buildSlopeMoments(map.map(), {});
  const MomentsNdf ndf(data.view(), 0.02f);
  const auto difference = [&](const Footprint& a, const Footprint& b) {
    const MapSlopes x = ndf.slopes(a), y = ndf.slopes(b);
    return std::abs(x.mean.x - y.mean.x) + std::abs(x.covariance.xx - y.covariance.xx) +
           std::abs(x.covariance.xy - y.covariance.xy);
  };
  for (int k = 0; k < 4000; ++k) {  // steps of 1/33 of a texel, and of 1/500 of an octave
    const float u = static_cast<float>(k) / 4000;
    EXPECT_LT(difference(Footprint::isotropic({u, 0.37f}, 3.3f), Footprint::isotropic({u + 1.0f / 4000, 0.37f}, 3.3f)), 0.01f)
        << u;
    const float sigma = std::exp2(8 * u);
    EXPECT_LT(difference(Footprint::isotropic({0.41f, 0.37f}, sigma),
                         Footprint::isotropic({0.41f, 0.37f}, sigma * std::exp2(8.0f / 4000))),
              0.01f)
        << sigma;
  }
}

/// A Gaussian random field has normally distributed slopes: there one lobe is right, up to the fluctuation of what a footprint holds.
TEST(MomentsNdf, IsRightWhereSlopesAreNormallyDistributed) {
  constexpr int kSize = 512, kResolution = 128;
  constexpr float kSigmaR = 0.02f;
  const test::OwnedMap map(kSize, kSize, test::roughSurface(kSize, kSize, 0.2f, 3));
  const bake::SlopeMomentsData data = bake::buildSlopeMoments(map.map(), {});
  const MomentsNdf ndf(data.view(), kSigmaR);
  const auto variationAt = [&](float sigma) {
    double sum = 0;
    constexpr int kPlaces = 6;
    for (int k = 0; k < kPlaces; ++k) {
      const Footprint p = Footprint::isotropic({0.13f + 0.3f * static_cast<float>(k), 0.7f * static_cast<float>(k)}, sigma);
      const std::vector<float> truth = bake::referenceImage(map.map(), kSigmaR, Surface::flat, Boundary::wrap, p, kResolution);
      std::vector<float> image(truth.size());
      for (std::size_t i = 0; i < image.size(); ++i) {
        const Vec2 centre = test::pixelCentre(i, kResolution), half = {1.0f / kResolution, 1.0f / kResolution};
        image[i] = ndf.mean(p, {centre - half, centre + half});
      }
      sum += test::totalVariation(image, truth);
    }
    return sum / kPlaces;
  };
  // One map of some thousand independent facets: the rest is their fluctuation.
  const double middle = variationAt(30), large = variationAt(100);
  EXPECT_LT(large, 0.04);
  EXPECT_LT(large, 0.7 * middle);
}

TEST(MomentsNdf, AnswersUnusableQuestions) {
  const test::OwnedMap map(16, 16, test::randomNormals(16, 16, 0.99f, 6));
  const bake::SlopeMomentsData data = bake::buildSlopeMoments(map.map(), {});
  const MomentsNdf ndf(data.view(), 0.005f);
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInf = std::numeric_limits<float>::infinity();
  for (const float bad : {kNan, kInf, -kInf, -1.0f, 0.0f, 1e30f}) {
    for (const Footprint& p : {Footprint::isotropic({0.5f, 0.5f}, bad), Footprint::isotropic({bad, 0.5f}, 3),
                               Footprint::gaussian({0, 0}, {bad, bad, 4}), Footprint::box({0, bad}, {bad, 1}, {1, bad})}) {
      EXPECT_TRUE(std::isfinite(ndf.density(p, {0.1f, 0.2f})));
      EXPECT_TRUE(std::isfinite(ndf.mean(p, {{0, 0}, {0.1f, bad}})));
      EXPECT_TRUE(std::isfinite(ndf.sample(p, {0.3f, bad}).pdf));
    }
    EXPECT_TRUE(std::isfinite(ndf.density(Footprint::isotropic({0, 0}, 2), {bad, 0})));
  }
}

}  // namespace
}  // namespace glint::moments_test
