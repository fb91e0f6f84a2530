#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "glint/bake/common/reference_image.h"
#include "glint/bake/compressed/compress.h"
#include "glint/bake/pyramid/pyramid.h"
#include "glint/query/anisotropic_ndf.h"
#include "glint/query/cp_ndf.h"
#include "glint/query/pyramid_ndf.h"
#include "glint/query/reference.h"
#include "support/directions.h"
#include "support/test_maps.h"

namespace glint::anisotropic_test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr int kSize = 256, kResolution = 64;

class Random {
 public:
  explicit Random(unsigned seed) : random_(seed) {}
  float unit() { return std::uniform_real_distribution<float>(0, 1)(random_); }
  Vec2 pair() { return {unit(), unit()}; }
  /// A Gaussian of the given deviations, turned at random.
  Footprint stretched(float longest, float shortest) {
    const float angle = 3.14159265f * unit(), c = std::cos(angle), s = std::sin(angle);
    const float a = longest * longest, b = shortest * shortest;
    return Footprint::gaussian(pair(), {c * c * a + s * s * b, c * s * (a - b), s * s * a + c * c * b});
  }

 private:
  std::mt19937 random_;
};

TEST(IsotropicParts, HaveTheMomentsOfTheFootprint) {
  constexpr float kRounding = 2e-4f;  // of the largest moment: offsets in uv, times the map
  Random random(1);
  for (const float aspect : {1.05f, 1.5f, 2.0f, 4.0f, 7.0f}) {
    for (int k = 0; k < 50; ++k) {
      const float shortest = 1 + 4 * random.unit();
      const Footprint p = random.stretched(aspect * shortest, shortest);
      const IsotropicParts parts = isotropicParts(p, kSize, 200);
      ASSERT_GE(parts.count, 1);
      ASSERT_LE(parts.count, IsotropicParts::kMost);
      double weight = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
      for (int i = 0; i < parts.count; ++i) {
        const Footprint& part = parts.footprints[i];
        EXPECT_GT(parts.weights[i], 0);
        EXPECT_EQ(part.covariance.xx, part.covariance.yy);
        EXPECT_EQ(part.covariance.xy, 0);
        const double w = parts.weights[i], dx = (double{part.centre.x} - p.centre.x) * kSize,
                     dy = (double{part.centre.y} - p.centre.y) * 200;
        weight += w, x += w * dx, y += w * dy;
        xx += w * (dx * dx + part.covariance.xx), xy += w * dx * dy, yy += w * (dy * dy + part.covariance.yy);
      }
      const double scale = kRounding * (p.covariance.xx + p.covariance.yy);
      EXPECT_NEAR(weight, 1, 1e-5);
      EXPECT_NEAR(x, 0, 1e-3);
      EXPECT_NEAR(y, 0, 1e-3);
      if (parts.count == 1) continue;  // round: aspect 1.05 by design
      EXPECT_NEAR(xx, p.covariance.xx, scale) << aspect;
      EXPECT_NEAR(xy, p.covariance.xy, scale) << aspect;
      EXPECT_NEAR(yy, p.covariance.yy, scale) << aspect;
    }
  }
}

Footprint alongX(float longest, float aspect) {
  return Footprint::gaussian({0.5f, 0.5f}, {longest * longest, 0, longest * longest / (aspect * aspect)});
}

/// Offsets along x and the deviation of parts, in texels.
struct Parts {
  explicit Parts(const Footprint& p)
      : parts(isotropicParts(p, kSize, kSize)), sigma(std::sqrt(parts.footprints[0].covariance.xx)) {
    for (int k = 0; k < parts.count; ++k) x.push_back((double{parts.footprints[k].centre.x} - 0.5) * kSize);
  }
  IsotropicParts parts;
  double sigma;
  std::vector<double> x;
};

TEST(IsotropicParts, KeepTheLengthAtAnyAspectAndTheWidthWhileTheyAreEnough) {
  constexpr double kRounding = 1e-3;
  for (const float aspect : {2.0f, 7.0f, 14.5f, 16.0f, 64.0f, 1000.0f}) {
    const float longest = 30;
    const Parts p(alongX(longest, aspect));
    double along = 0;
    for (int k = 0; k < p.parts.count; ++k) along += p.parts.weights[k] * (p.x[k] * p.x[k] + p.sigma * p.sigma);
    EXPECT_NEAR(along, longest * longest, kRounding * longest * longest) << aspect;
    if (aspect < kMostAspect) {
      EXPECT_NEAR(p.sigma, longest / aspect, kRounding * p.sigma) << aspect;
      for (int k = 1; k < p.parts.count; ++k) EXPECT_LT(p.x[k] - p.x[k - 1], 1.2 * kPartGap * p.sigma) << aspect;
    } else {
      EXPECT_EQ(p.parts.count, IsotropicParts::kMost);
    }
  }
}

/// Squared error of a sum over parts on a map of unrelated texels, relative to that of no answer: all from integrals of
/// products of normal densities.
double noiseError(const Footprint& p, const std::vector<double>& x, const float* weights, double sigma) {
  const auto product = [](double dx, double var_x, double var_y) {
    return std::exp(-0.5 * dx * dx / var_x) / std::sqrt(var_x * var_y);
  };
  const double a = p.covariance.xx, b = p.covariance.yy, s = sigma * sigma, whole = product(0, 2 * a, 2 * b);
  double sum = whole;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sum -= 2 * weights[i] * product(x[i], a + s, b + s);
    for (std::size_t j = 0; j < x.size(); ++j) sum += double{weights[i]} * weights[j] * product(x[i] - x[j], 2 * s, 2 * s);
  }
  return sum / whole;
}

TEST(IsotropicParts, AreAsWideAsSuitsUnrelatedTexels) {
  constexpr double kNearBest = 1.1;
  for (const float aspect : {16.0f, 24.0f, 32.0f, 64.0f}) {
    const Footprint p = alongX(60, aspect);
    const Parts chosen(p);
    const double error = noiseError(p, chosen.x, chosen.parts.weights, chosen.sigma);
    double best = 1e9;
    for (double wider = 0.6; wider < 2; wider += 0.02) {
      std::vector<double> x;  // parts of another width, moved so that the length stays
      const double length2 = 60.0 * 60,
                   scale = (length2 - chosen.sigma * chosen.sigma * wider * wider) / (length2 - chosen.sigma * chosen.sigma);
      for (const double old : chosen.x) x.push_back(old * std::sqrt(scale));
      best = std::min(best, noiseError(p, x, chosen.parts.weights, wider * chosen.sigma));
    }
    RecordProperty("aspect_" + std::to_string(int(aspect)), std::to_string(std::sqrt(error)));
    EXPECT_LT(std::sqrt(error), kNearBest * std::sqrt(best)) << aspect;
  }
}

TEST(IsotropicParts, AreOneForRoundFootprintsAndNeverNarrowerThanAsked) {
  const auto count = [](const Footprint& p, float narrowest = 0) { return isotropicParts(p, kSize, kSize, narrowest).count; };
  Random random(2);
  EXPECT_EQ(count(Footprint::isotropic({0.5f, 0.5f}, 5)), 1);
  EXPECT_EQ(count(Footprint::box({0.5f, 0.5f}, {3, 3}, {-3, 3})), 1);
  EXPECT_EQ(count(random.stretched(6, 2)), 7);
  EXPECT_EQ(count(random.stretched(6, 2), 6), 1);
  EXPECT_EQ(isotropicParts(random.stretched(6, 2), kSize, kSize, 4).footprints[0].covariance.xx, 16);
  EXPECT_EQ(isotropicParts(random.stretched(6, 2), kSize, kSize, 7).footprints[0].covariance.xx, 49);
}

/// A model whose NDF is one lobe that leans as far as the footprint is to the right: what a mixture draws from is known.
struct LeaningLobe {
  static constexpr float kSigma = 0.05f;
  static Vec2 lean(const Footprint& p) { return {p.centre.x - 0.5f, 0.2f}; }
  float density(const Footprint& p, Vec2 h) const { return gaussianDensity(h - lean(p), kSigma); }
  float mean(const Footprint& p, const Box2& range) const { return lobeMass(range, lean(p), kSigma) / range.area(); }
  HalfVectorSample sample(const Footprint& p, Vec2 xi) const {
    const float r = kSigma * std::sqrt(-2 * std::log1p(-xi.x)), angle = 2 * kPi * xi.y;
    const Vec2 h = lean(p) + Vec2{r * std::cos(angle), r * std::sin(angle)};
    return {h, density(p, h)};
  }
};

TEST(AnisotropicNdf, SamplesFollowTheDensity) {
  constexpr int kCells = 24, kSamples = 100000;
  constexpr double kSignificance = 1e-4;
  const LeaningLobe lobe;
  const AnisotropicNdf ndf(lobe, kSize, kSize);
  const Footprint p = Footprint::gaussian({0.5f, 0.5f}, {900, 0, 36});
  ASSERT_GT(ndf.parts(p).count, 8);
  std::vector<double> counts(kCells * kCells + 1), expected(kCells * kCells + 1);
  Random random(3);
  for (int k = 0; k < kSamples; ++k) {
    const HalfVectorSample s = ndf.sample(p, random.pair());
    EXPECT_NEAR(s.pdf, ndf.density(p, s.h), 1e-4f * s.pdf);
    const int x = static_cast<int>((s.h.x + 0.5f) * kCells), y = static_cast<int>((s.h.y + 0.3f) * kCells);
    const bool inside = x >= 0 && x < kCells && y >= 0 && y < kCells;
    ++counts[static_cast<std::size_t>(inside ? y * kCells + x : kCells * kCells)];
  }
  double rest = kSamples;
  for (int y = 0; y < kCells; ++y) {
    for (int x = 0; x < kCells; ++x) {
      const float size = 1.0f / kCells, left = -0.5f + size * static_cast<float>(x), low = -0.3f + size * static_cast<float>(y);
      double& cell = expected[static_cast<std::size_t>(y * kCells + x)];
      cell = double{ndf.mean(p, {{left, low}, {left + size, low + size}})} * size * size * kSamples;
      rest -= cell;
    }
  }
  expected.back() = std::max(0.0, rest);
  const double fit = test::goodnessOfFit(counts, expected);
  RecordProperty("p", std::to_string(fit));
  EXPECT_GT(fit, kSignificance);
}

struct Baked {
  Baked(bake::SynthKind kind, float stride) : map(kSize, kSize, test::synthesised(kind, kSize, kSize, 0.2f)) {
    bake::PyramidOptions options;
    options.stride = stride;
    options.resolution = kResolution;
    options.sigma_r = 0.04f;
    options.levels = 4;
    pyramid = bake::buildPyramid(map.map(), options);
  }
  test::OwnedMap map;
  bake::NdfPyramidData pyramid;
};

TEST(AnisotropicNdf, SamplesOfAPyramidAverageToItsMeans) {
  constexpr int kSamples = 20000;
  const Baked baked(bake::SynthKind::flakes, 8);
  const PyramidNdf round(baked.pyramid.view());
  const AnisotropicNdf ndf(round);
  static_assert(NdfModel<AnisotropicNdf<PyramidNdf>>);
  Random random(7);
  const Footprint p = random.stretched(40, 5);
  const Box2 range = {{-0.05f, -0.1f}, {0.1f, 0.2f}};
  int inside = 0;
  for (int k = 0; k < kSamples; ++k) {
    const HalfVectorSample s = ndf.sample(p, random.pair());
    ASSERT_NEAR(s.pdf, ndf.density(p, s.h), 1e-4f * s.pdf);
    inside += s.h.x > range.low.x && s.h.x < range.high.x && s.h.y > range.low.y && s.h.y < range.high.y;
  }
  const double share = ndf.mean(p, range) * range.area();
  EXPECT_NEAR(static_cast<double>(inside) / kSamples, share, 4 * std::sqrt(share * (1 - share) / kSamples) + 1e-3);
}

TEST(AnisotropicNdf, MeanOverPixelsIsTheMeanOfPointQueries) {
  const Baked baked(bake::SynthKind::isotropic, 8);
  const PyramidNdf round(baked.pyramid.view());
  const AnisotropicNdf ndf(round);
  const Footprint p = Random(4).stretched(30, 6);
  const float pixel = 2.0f / kResolution;
  double sum = 0;
  for (int y = 0; y < 6; ++y)
    for (int x = 0; x < 9; ++x)
      sum += ndf.pixelMean(p, {-0.125f + (static_cast<float>(x) + 0.5f) * pixel, (static_cast<float>(y) + 0.5f) * pixel});
  EXPECT_NEAR(ndf.mean(p, {{-0.125f, 0}, {-0.125f + 9 * pixel, 6 * pixel}}), sum / 54, 1e-4 * sum / 54);
  EXPECT_NEAR(ndf.mean(p, {{-1, -1}, {1, 1}}), 0.25, 1e-3);
}

TEST(AnisotropicNdf, IsClearlyCloserToTheTexelsThanARoundFootprint) {
  // Mean relative errors over three footprints of short deviation 4 to 8 texels at each aspect, beside those of the round
  // footprint of the same mean square size. Recorded as properties, for charts. What is left is the pyramid's own error.
  for (const auto& [kind, name] : {std::pair{bake::SynthKind::isotropic, "isotropic"},
                                   {bake::SynthKind::flakes, "flakes"},
                                   {bake::SynthKind::brushed, "brushed"}}) {
    const Baked baked(kind, 8);
    const PyramidNdf round(baked.pyramid.view(), baked.map.map());
    const AnisotropicNdf stretched(round);
    for (const int aspect : {1, 4, 16, 64}) {
      Random random(5);
      double round_error = 0, error = 0;
      for (int k = 0; k < 3; ++k) {
        // Up to 64 texels long, a quarter of the map: very thin ones are as long, not longer.
        const float shortest = std::min(4 + 4 * random.unit(), 64.0f / static_cast<float>(aspect));
        const Footprint p = random.stretched(static_cast<float>(aspect) * shortest, shortest);
        const auto exact = bake::referenceImage(baked.map.map(), 0.04f, Surface::flat, Boundary::wrap, p, kResolution);
        round_error += test::relL2(test::imageOf(round, p, kResolution), exact) / 3;
        error += test::relL2(test::imageOf(stretched, p, kResolution), exact) / 3;
      }
      RecordProperty(std::string(name) + "_aspect_" + std::to_string(aspect),
                     std::to_string(error) + " instead of " + std::to_string(round_error));
      if (aspect == 1) {
        EXPECT_NEAR(error, round_error, 1e-4);
      } else {
        EXPECT_LT(error, 0.75 * round_error) << name << ' ' << aspect;
      }
    }
  }
}

TEST(AnisotropicNdf, AMapThatEndsIsNotSeenFromItsOtherSide) {
  // The halves of the map lean to either side: of a footprint near the left border, parts that wrapped would be of the right half.
  constexpr double kBetweenCentres = 0.08;  // of the share of the right half: what interpolation between images widens
  std::vector<Vec2> normals;
  for (int k = 0; k < 128 * 128; ++k) normals.push_back({k % 128 < 64 ? -0.3f : 0.3f, 0});
  const test::OwnedMap map(128, 128, std::move(normals));
  bake::PyramidOptions options;
  options.stride = 8;
  options.resolution = kResolution;
  options.sigma_r = 0.04f;
  options.boundary = Boundary::clamp;
  const bake::NdfPyramidData data = bake::buildPyramid(map.map(), options);
  const PyramidNdf round(data.view());
  const AnisotropicNdf ndf(round);
  const Reference reference(map.map(), 0.04f, Surface::flat, Boundary::clamp);
  const Box2 right = {{0.0625f, -0.25f}, {0.5625f, 0.25f}};
  Random random(9);
  double moved = 0;
  for (int k = 0; k < 60; ++k) {
    const float shortest = 4 + 4 * random.unit();
    const Footprint p = random.stretched(shortest * std::exp2(1 + 7 * random.unit()), shortest);
    const double exact = right.area() * reference.mean(p, right);
    EXPECT_NEAR(right.area() * ndf.mean(p, right), exact, kBetweenCentres)
        << p.centre.x << ' ' << p.centre.y << ' ' << p.covariance.xx << ' ' << p.covariance.xy << ' ' << p.covariance.yy;
    const AnisotropicNdf wrapping(round, 128, 128, finestSigma(data.shape));
    moved = std::max(moved, std::abs(right.area() * wrapping.mean(p, right) - exact));
  }
  EXPECT_GT(moved, 0.2);  // what wrapped parts would err by
}

TEST(AnisotropicNdf, AnswersCompressedModelsAlike) {
  const Baked baked(bake::SynthKind::flakes, 8);
  bake::CompressionOptions options;
  options.tolerance = 0.05;
  const bake::NdfCpData data = bake::compressPyramid(baked.pyramid.view(), options);
  const CpNdf round(data.view(), baked.map.map());
  const AnisotropicNdf ndf(round);
  const Footprint p = Random(6).stretched(40, 5);
  const auto exact = bake::referenceImage(baked.map.map(), 0.04f, Surface::flat, Boundary::wrap, p, kResolution);
  EXPECT_LT(test::relL2(test::imageOf(ndf, p, kResolution), exact),
            0.6 * test::relL2(test::imageOf(round, p, kResolution), exact));
}

TEST(AnisotropicNdf, DegenerateFootprintsHaveFiniteAnswers) {
  const Baked baked(bake::SynthKind::isotropic, 8);
  const PyramidNdf round(baked.pyramid.view());
  const AnisotropicNdf ndf(round);
  const Vec2 uv = {0.3f, 0.7f};
  for (const Footprint& p :
       {Footprint::isotropic(uv, 0), Footprint::isotropic(uv, kNan), Footprint::gaussian(uv, {kInfinity, 0, 1}),
        Footprint::gaussian(uv, {1e30f, 0, 0}), Footprint::gaussian(uv, {1e30f, 1e30f, 1e30f}),
        Footprint::gaussian(uv, {4, 100, 4}), Footprint::gaussian(uv, {-1, 0, 5}), Footprint::box(uv, {1e18f, 0}, {0, 1e-18f}),
        Footprint::gaussian({kNan, 1e30f}, {100, 0, 1}), Footprint::gaussian({-1e7f, 12345.5f}, {100, 50, 90})}) {
    const IsotropicParts parts = ndf.parts(p);
    EXPECT_TRUE(parts.count >= 1 && parts.count <= IsotropicParts::kMost);
    const float density = ndf.density(p, {0.05f, 0});
    EXPECT_TRUE(std::isfinite(density) && density >= 0);
    EXPECT_NEAR(ndf.mean(p, {{-1, -1}, {1, 1}}), 0.25f, 1e-3f);
  }
  EXPECT_EQ(ndf.density(Footprint::gaussian(uv, {100, 0, 4}), {kNan, 0}), 0);
  EXPECT_EQ(ndf.density(Footprint::gaussian(uv, {100, 0, 4}), {1.5f, 0}), 0);
}

}  // namespace
}  // namespace glint::anisotropic_test
