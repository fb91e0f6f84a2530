// Footprints longer than the map: they wind round it, whatever their direction.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <random>
#include <vector>

#include "glint/bake/bin_map/bin_map.h"
#include "glint/bake/histogram/histogram_sat.h"
#include "glint/query/anisotropic_ndf.h"
#include "glint/query/bin_map_ndf.h"
#include "glint/query/histogram_ndf.h"
#include "glint/query/manifold_ndf.h"
#include "glint/query/reference.h"
#include "support/bin_weights.h"
#include "support/test_maps.h"

namespace glint::long_footprints_test {
namespace {

/// Shares of a footprint that the texels of a map have, [height][width].
struct Shares {
  Shares(int w, int h) : width(w), height(h), of(static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  double& at(int i, int j) { return of[static_cast<std::size_t>(wrapIndex(j, height)) * width + wrapIndex(i, width)]; }
  void normalise() {
    double total = 0;
    for (const double x : of) total += x;
    for (double& x : of) x /= total;
  }
  int width, height;
  std::vector<double> of;
};

/// Total variation: the share of the footprint that is in a wrong place.
double distance(const Shares& a, const Shares& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.of.size(); ++k) sum += std::fabs(a.of[k] - b.of[k]);
  return 0.5 * sum;
}

Shares even(int width, int height) {
  Shares shares(width, height);
  for (double& x : shares.of) x = 1.0 / static_cast<double>(shares.of.size());
  return shares;
}

/// What Reference sums.
Shares summed(const Footprint& p, int width, int height) {
  const FootprintWeights weights(p, width, height);
  Shares shares(width, height);
  for (int j = weights.row_begin; j < weights.row_end; ++j) {
    const FootprintWeights::Columns columns = weights.columnsIn(j, j + 1);
    for (int i = columns.begin; i < columns.end; ++i) shares.at(i, j) += weights.texel(i, j);
  }
  shares.normalise();
  return shares;
}

/// What bin maps count.
Shares covered(const Footprint& p, int width, int height) {
  const TexelCover cover(p, width, height);
  Shares shares(width, height);
  for (int y = 0; y < cover.rows(); ++y) {
    CoverSpan outer, inner;
    cover.spans(y, y + 1, outer, inner);
    const int last = std::min(cover.columns() - 1, static_cast<int>(outer.high));
    for (int x = std::max(0, static_cast<int>(outer.low)); x <= last; ++x)
      shares.at(cover.originX() + x, cover.originY() + y) += cover.texel(x, y) / cover.area();
  }
  return shares;
}

/// A box cut at the sides of every texel of the endless plane, however many it has.
Shares cut(const Footprint& p, int width, int height) {
  const std::vector<test::Point> polygon = test::cornersOf(p, width, height);
  double low = 1e30, high = -1e30;
  for (const test::Point q : polygon) low = std::min(low, q.y), high = std::max(high, q.y);
  const double total = test::areaOf(polygon);
  Shares shares(width, height);
  for (int y = static_cast<int>(std::floor(low)); y < high; ++y) {
    const std::vector<test::Point> row = test::clipped(test::clipped(polygon, 0, 1, y + 1), 0, -1, -y);
    double left = 1e30, right = -1e30;
    for (const test::Point q : row) left = std::min(left, q.x), right = std::max(right, q.x);
    for (int x = static_cast<int>(std::floor(left)); x < right; ++x) {
      const std::vector<test::Point> part = test::clipped(test::clipped(row, 1, 0, x + 1), -1, 0, -x);
      if (part.size() >= 3) shares.at(x, y) += test::areaOf(part) / total;
    }
  }
  return shares;
}

/// A box of any size by points, even in cells of a grid over it: for those that have too many texels to cut.
Shares scattered(const Footprint& p, int width, int height) {
  constexpr std::int64_t kAlong = 150000, kAcross = 16;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit;
  const bool a_longer = dot(p.axis_a, p.axis_a) > dot(p.axis_b, p.axis_b);
  const Vec2 a = a_longer ? p.axis_a : p.axis_b, b = a_longer ? p.axis_b : p.axis_a;
  Shares shares(width, height);
  for (std::int64_t k = 0; k < kAlong * kAcross; ++k) {
    const double s = 2 * (static_cast<double>(k / kAcross) + unit(random)) / kAlong - 1;
    const double t = 2 * (static_cast<double>(k % kAcross) + unit(random)) / kAcross - 1;
    const double x = double{p.centre.x} * width + s * double{a.x} + t * double{b.x};
    const double y = double{p.centre.y} * height + s * double{a.y} + t * double{b.y};
    shares.at(static_cast<int>(x - std::floor(x / width) * width), static_cast<int>(y - std::floor(y / height) * height)) += 1;
  }
  shares.normalise();
  return shares;
}

/// A Gaussian by its waves, a series that ends the sooner the longer it is; texels count at their centres.
Shares byWaves(const Footprint& p, int width, int height) {
  Shares shares(width, height);
  const Covariance& c = p.covariance;
  const int most_u = width, most_v = height;  // texel centres cannot tell shorter waves from longer ones
  for (int ku = -most_u; ku <= most_u; ++ku) {
    for (int kv = -most_v; kv <= most_v; ++kv) {
      const double u = 1.0 * ku / width, v = 1.0 * kv / height;
      const double power = std::exp(-2 * 9.869604401089358 * (u * u * c.xx + 2 * u * v * c.xy + v * v * c.yy));
      if (power < 1e-12) continue;
      for (int j = 0; j < height; ++j)
        for (int i = 0; i < width; ++i)
          shares.at(i, j) +=
              power *
              std::cos(2 * 3.141592653589793 *
                       (ku * ((i + 0.5) / width - double{p.centre.x}) + kv * ((j + 0.5) / height - double{p.centre.y})));
    }
  }
  shares.normalise();
  return shares;
}

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  float between(float low, float high) { return std::uniform_real_distribution<float>(low, high)(engine_); }
  float upTo(float high) { return between(0, high); }
  Vec2 vector(float length) {
    const float angle = upTo(2 * kPi);
    return {length * std::cos(angle), length * std::sin(angle)};
  }
  Vec2 point() { return {upTo(1), upTo(1)}; }

 private:
  std::mt19937 engine_;
};

/// A long box and one across it, at most some way slanted.
Footprint strip(Random& random, float length, float width) {
  const Vec2 a = random.vector(length);
  const float slant = random.between(-0.5f, 0.5f), scale = width / length;
  return Footprint::box(random.point(), a, {scale * (slant * a.x - a.y), scale * (slant * a.y + a.x)});
}

struct Size {
  int width, height;
};
constexpr Size kSizes[] = {{64, 64}, {48, 20}, {7, 90}, {1, 33}, {5, 1}};

/// Sums of floats, and centres that are rounded to them.
constexpr double kExact = 2e-4;

TEST(LongBoxes, AreCutExactlyWhileTheyCanBeSummed) {
  Random random(1);
  for (int k = 0; k < 60; ++k) {
    const auto [width, height] = kSizes[k % 5];
    const Footprint p = strip(random, random.between(1, 40) * static_cast<float>(std::min(width, height) + 5),
                              0.1f * static_cast<float>(width) * random.upTo(1) + 0.05f);
    const Shares expected = cut(p, width, height);
    EXPECT_LT(distance(summed(p, width, height), expected), kExact) << k;
    EXPECT_LT(distance(covered(p, width, height), expected), kExact) << k;
  }
}

TEST(LongBoxes, KeepDirectionAndWidth) {
  // Between these and their limit are the last turns; between these and a box that is shortened along u and v everything.
  const Footprint p = Footprint::box({0.4f, 0.45f}, {2000, 1900}, {-15, 16});
  const Shares expected = cut(p, 256, 256);
  EXPECT_LT(distance(summed(p, 256, 256), expected), kExact);
  EXPECT_LT(distance(covered(p, 256, 256), expected), kExact);
  const Footprint shorter = Footprint::box({0.4f, 0.45f}, {512, 512}, {-15.0f * 512 / 2016, 16.0f * 512 / 1915});
  EXPECT_GT(distance(cut(shorter, 256, 256), expected), 0.2);
}

/// Share of a footprint that shortening may misplace: about the last of its turns. 1 % is the noise of `scattered`.
constexpr double kShortened = 0.03;

TEST(LongBoxes, ThatAreShortenedKeepTheirLimit) {
  constexpr int kSize = 32;
  // Closed lines, lines with a drift of all sizes, lines that come everywhere; thick and thin.
  const Footprint boxes[] = {
      Footprint::box({0.3f, 0.6f}, {5e5f, 5e5f}, {-2, 2}),       Footprint::box({0.3f, 0.6f}, {5e5f, 2.5e5f}, {-1, 2}),
      Footprint::box({0.3f, 0.6f}, {5e4f, 8}, {-0.5f, 2}),       Footprint::box({0.3f, 0.6f}, {5e4f, 40}, {-0.5f, 2}),
      Footprint::box({0.3f, 0.6f}, {2e4f, 1.9e4f}, {-2, 2}),     Footprint::box({0.3f, 0.6f}, {1e5f, 100004}, {-2, 2}),
      Footprint::box({0.3f, 0.6f}, {1e5f, 100040}, {-2, 2}),     Footprint::box({0.3f, 0.6f}, {1e5f, 31415}, {-0.2f, 1}),
      Footprint::box({0.3f, 0.6f}, {5e3f, 4e3f}, {-4e3f, 5e3f}), Footprint::box({0.3f, 0.6f}, {5e3f, 4e3f}, {5e3f, 4.01e3f}),
      Footprint::box({0.3f, 0.6f}, {0, 4e4f}, {3, 0}),           Footprint::box({0.3f, 0.6f}, {-3e4f, 2e4f}, {4, 0})};
  for (const Footprint& p : boxes) {
    const Shares expected = scattered(p, kSize, kSize);
    EXPECT_LT(distance(summed(p, kSize, kSize), expected), kShortened) << p.axis_a.x << ' ' << p.axis_a.y;
    EXPECT_LT(distance(covered(p, kSize, kSize), expected), kShortened) << p.axis_a.x << ' ' << p.axis_a.y;
  }
  Random random(2);
  double sum = 0;
  constexpr int kCount = 16;
  for (int k = 0; k < kCount; ++k) {
    const auto [width, height] = kSizes[k % 3];
    const Footprint p = strip(random, random.between(5e3f, 2e5f), std::exp2(random.between(-2, 3)));
    const double misplaced = distance(summed(p, width, height), scattered(p, width, height));
    EXPECT_LT(misplaced, 2 * kShortened) << k;
    sum += misplaced / kCount;
  }
  EXPECT_LT(sum, kShortened);
}

TEST(LongBoxes, AreCheapHoweverLong) {
  Random random(3);
  for (const float size : {1e4f, 1e6f, 1e9f, 1e15f, 1e30f, 3e38f}) {
    for (int k = 0; k < 40; ++k) {
      const auto [width, height] = k % 2 == 0 ? Size{300, 200} : Size{3000, 1};
      const Vec2 a = random.vector(size), b = k % 4 < 2 ? random.vector(random.upTo(20)) : random.vector(random.upTo(size));
      const Footprint p = Footprint::box(random.point(), a, b);
      const FootprintWeights weights(p, width, height);
      double texels = 0;
      for (int j = weights.row_begin; j < weights.row_end; ++j) {
        const FootprintWeights::Columns columns = weights.columnsIn(j, j + 1);
        texels += std::max(0, columns.end - columns.begin);
      }
      const TexelCover cover(p, width, height);
      const double rows = 4 * kMostBoxPeriods * (width + height);
      EXPECT_LT(texels, 2 * kMostBoxTexels + 20 * rows) << size << ' ' << k;
      EXPECT_LT(cover.rows() + cover.columns(), rows + 4) << size << ' ' << k;
      EXPECT_TRUE(std::isfinite(cover.area()) && cover.area() > 0);
    }
  }
}

TEST(LongGaussians, WindRoundTheMapAsTheirWavesSay) {
  Random random(4);
  for (int k = 0; k < 40; ++k) {
    const auto [width, height] = k % 2 == 0 ? Size{32, 32} : Size{40, 12};
    const float length = static_cast<float>(width) * std::exp2(random.between(-1, 5)), narrow = random.between(0.8f, 6);
    const Vec2 d = k % 5 == 0 ? Vec2{std::sqrt(0.5f), std::sqrt(0.5f)} : k % 5 == 1 ? Vec2{1, 0} : random.vector(1);
    const float l = length * length, n = narrow * narrow;
    const Footprint p = Footprint::gaussian(
        random.point(), {l * d.x * d.x + n * d.y * d.y, (l - n) * d.x * d.y, l * d.y * d.y + n * d.x * d.x});
    constexpr double kRounding = 3e-3;  // of covariances in float, which long Gaussians have their width from
    EXPECT_LT(distance(summed(p, width, height), byWaves(p, width, height)), kRounding) << k << ' ' << length << ' ' << narrow;
  }
}

TEST(LongGaussians, OfBoxesAreOneTurnAtMost) {
  // What a bin map answers for round footprints of the size of the map and more is the mean over the map.
  for (const auto [width, height] : kSizes) {
    for (const float times : {0.3f, 0.5f, 1.0f, 3.0f, 10.0f, 1e5f, 1e30f}) {
      const Footprint p = Footprint::isotropic({0.3f, 0.7f}, times * static_cast<float>(std::max(width, height)));
      EXPECT_LT(distance(covered(p, width, height), even(width, height)), kExact) << width << ' ' << times;
    }
  }
  // Along a diagonal they are even along that diagonal, and as wide as they are across.
  const float l = 1e6f, n = 9;
  const Footprint p = Footprint::gaussian({0.3f, 0.6f}, {0.5f * (l + n), 0.5f * (l - n), 0.5f * (l + n)});
  const Footprint turn = Footprint::box({0.3f, 0.6f}, {16, 16}, {-std::sqrt(13.5f), std::sqrt(13.5f)});
  constexpr double kWidthOfFloats = 0.02;
  EXPECT_LT(distance(covered(p, 32, 32), cut(turn, 32, 32)), kWidthOfFloats);
}

TEST(LongGaussians, OfBoxesChangeSmoothly) {
  // A footprint that grows by .4 % moves about as much of itself; thin ones turn into their way while they grow by 2 %.
  constexpr double kStep = 1.004, kMost = 0.1, kMostOfThick = 0.02;
  for (const float aspect : {1.0f, 1.5f, 4.0f, 20.0f}) {
    for (const float angle : {0.0f, 0.3f, 0.785398f, 1.2f}) {
      const Vec2 d = {std::cos(angle), std::sin(angle)};
      Shares last = even(32, 48);
      for (double size = 2; size < 120; size *= kStep) {
        const auto l = static_cast<float>(size * size), n = l / (aspect * aspect);
        const Shares now = covered(Footprint::gaussian({0.3f, 0.6f}, {l * d.x * d.x + n * d.y * d.y, (l - n) * d.x * d.y,
                                                                      l * d.y * d.y + n * d.x * d.x}),
                                   32, 48);
        if (size > 2) {
          EXPECT_LT(distance(now, last), aspect < 10 ? kMostOfThick : kMost) << aspect << ' ' << angle << ' ' << size;
        }
        last = now;
      }
    }
  }
}

TEST(LongGaussians, OfRoundPartsAreEvenAlongTheirWay) {
  constexpr int kSize = 64;
  constexpr double kRipple = 0.02;  // parts two deviations apart, and wider ones where they are too few
  for (const Vec2 way : {Vec2{1, 0}, Vec2{1, 1}, Vec2{2, 1}, Vec2{-3, 1}}) {
    for (const float turns : {1.0f, 8.0f, 30.0f}) {
      for (const float narrow : {5.0f, 8.0f, 20.0f}) {
        const float l = turns * turns * kSize * kSize, n = narrow * narrow, x = way.x, y = way.y, d = x * x + y * y;
        const Covariance c = {l * x * x + n * y * y / d, l * x * y - n * x * y / d, l * y * y + n * x * x / d};
        const Footprint p = Footprint::gaussian({0.9f, 0.2f}, c);
        const IsotropicParts parts = isotropicParts(p, kSize, kSize);
        Shares shares(kSize, kSize);
        double weight = 0;
        for (int k = 0; k < parts.count; ++k) {
          const Shares part = summed(parts.footprints[k], kSize, kSize);
          for (std::size_t t = 0; t < part.of.size(); ++t) shares.of[t] += parts.weights[k] * part.of[t];
          weight += parts.weights[k];
        }
        EXPECT_NEAR(weight, 1, 1e-5);
        EXPECT_LT(distance(shares, byWaves(p, kSize, kSize)), kRipple) << x << ' ' << y << ' ' << turns << ' ' << narrow;
      }
    }
  }
}

/// Error of one answer of ManifoldNdf with the default loss, of the peak of a lobe: 1e-4 is left out at the rim of the ball.
constexpr double kNearOfPeak = 2e-4;
/// Of the answer: the functions of a lane.
constexpr double kNearOfAnswer = 2e-4;

/// A map of four rough quarters, so that footprints that miss some of it are wrong.
std::vector<Vec2> quarters(int width, int height) {
  std::vector<Vec2> normals = test::randomNormals(width, height, 0.1f, 5);
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i)
      normals[static_cast<std::size_t>(j) * width + i] =
          normals[static_cast<std::size_t>(j) * width + i] + Vec2{2 * i < width ? -0.3f : 0.3f, 2 * j < height ? -0.2f : 0.2f};
  return normals;
}

TEST(LongFootprints, HaveTheSameAnswersFromAllThatSumTexels) {
  constexpr float kAlpha = 0.1f;
  constexpr double kLobe = 0.02;  // of a bin map: normals are kept to a fraction of a bin
  Random random(6);
  for (const auto [width, height] : {Size{64, 64}, Size{96, 24}, Size{256, 1}}) {
    const test::OwnedMap map(width, height, quarters(width, height));
    const bake::BinMapData bins = bake::buildBinMap(map.map(), {kAlpha, 8});
    const BinMapNdf ndf(bins.view());
    const bake::HistogramSatData sat = bake::buildHistogramSat(map.map(), {});
    const HistogramNdf histogram(sat.view(), GaussianBoxes::one, 0, HistogramBins::even);
    const Reference all(map.map(), ndf.sigma());
    const Reference pruned(map.map(), ndf.sigma(), Surface::flat, Boundary::wrap, Reference::Search::pruned);
    const ManifoldNdf near(map.map(), ndf.sigma());
    for (int k = 0; k < 30; ++k) {
      const Footprint p = strip(random, std::exp2(random.between(5, 14)), std::exp2(random.between(-1, 4)));
      const Vec2 h = {random.between(-0.4f, 0.4f), random.between(-0.3f, 0.3f)};
      const double expected = all.density(p, h);
      constexpr double kSmall = 1e-3;
      EXPECT_NEAR(pruned.density(p, h), expected, 1e-4 * expected + 1e-5) << k;
      EXPECT_NEAR(near.density(p, h), expected, kNearOfAnswer * expected + kNearOfPeak * gaussianDensity({}, ndf.sigma())) << k;
      EXPECT_NEAR(ndf.density(p, h), expected, kLobe * expected + kSmall) << k;
      const Shares shares = covered(p, width, height);
      double count = 0;
      const int bin = histogram.bins().find(h);
      for (std::size_t t = 0; t < shares.of.size(); ++t)
        if (histogram.bins().find(map.normals()[t]) == bin) count += shares.of[t];
      const double exact = count / histogram.bins().area(bin);
      EXPECT_NEAR(histogram.density(p, h), exact, 1e-3 * exact + kSmall) << k;
    }
  }
}

/// A map, and what sums its texels.
struct Models {
  static constexpr float kAlpha = 0.1f;
  Models(int w, int h)
      : width(w),
        height(h),
        map(w, h, quarters(w, h)),
        bins(bake::buildBinMap(map.map(), {kAlpha, 8})),
        sat(bake::buildHistogramSat(map.map(), {})),
        bin_map(bins.view()),
        histogram(sat.view(), GaussianBoxes::one, 0, HistogramBins::even),
        three(sat.view(), GaussianBoxes::three, 0, HistogramBins::even),
        reference(map.map(), bin_map.sigma(), Surface::flat, Boundary::wrap, Reference::Search::pruned),
        near(map.map(), bin_map.sigma()) {}
  double nearTolerance() const { return kNearOfPeak * gaussianDensity({}, bin_map.sigma()); }
  double binMapOf(const Shares& shares, Vec2 h) const {
    double sum = 0;
    for (std::size_t k = 0; k < shares.of.size(); ++k)
      if (shares.of[k] > 0) sum += shares.of[k] * gaussianDensity(map.normals()[k] - h, bin_map.sigma());
    return sum;
  }
  double histogramOf(const Shares& shares, Vec2 h) const {
    double sum = 0;
    const int bin = histogram.bins().find(h);
    for (std::size_t k = 0; k < shares.of.size(); ++k)
      if (histogram.bins().find(map.normals()[k]) == bin) sum += shares.of[k];
    return sum / histogram.bins().area(bin);
  }
  int width, height;
  test::OwnedMap map;
  bake::BinMapData bins;
  bake::HistogramSatData sat;
  BinMapNdf bin_map;
  HistogramNdf histogram, three;
  Reference reference;
  ManifoldNdf near;
};

constexpr Size kShapes[] = {{1, 1}, {1, 7}, {7, 1}, {512, 1}, {1, 300}, {3, 5}, {33, 17}, {7000, 4}, {2, 2048}};

TEST(FootprintsOfAllSizes, AreRightOnMapsOfAllShapes) {
  constexpr double kLobe = 0.02, kSmall = 1e-3;
  Random random(7);
  for (const auto& [width, height] : kShapes) {
    const Models models(width, height);
    for (int k = 0; k < 24; ++k) {
      const float length = std::exp2(random.between(-3, 7.5f)), narrow = length * random.between(0.05f, 1);
      const Vec2 d = k % 3 == 0 ? Vec2{1, 0} : k % 3 == 1 ? Vec2{0, 1} : random.vector(1);
      const Footprint p = Footprint::box(random.point(), length * d, narrow * Vec2{-d.y, d.x});
      const Shares shares = cut(p, width, height);
      const Vec2 h = {random.between(-0.4f, 0.4f), random.between(-0.3f, 0.3f)};
      const double expected = models.binMapOf(shares, h), counted = models.histogramOf(shares, h);
      constexpr float kSurePeriods = 64;  // of boxes along the axes, for a histogram; others are longer
      const bool is_shortened = 4 * length * narrow > kFewestBoxMaps * static_cast<float>(width * height) ||
                                length + narrow > kSurePeriods * static_cast<float>(std::min(width, height));
      const double rounding = is_shortened ? kShortened : 1e-3;
      ASSERT_NEAR(models.reference.density(p, h), expected, rounding * expected + kSmall) << width << 'x' << height << ' ' << k;
      ASSERT_NEAR(models.near.density(p, h), expected, (kNearOfAnswer + rounding) * expected + models.nearTolerance() + kSmall)
          << width << 'x' << height << ' ' << k;
      ASSERT_NEAR(models.bin_map.density(p, h), expected, (kLobe + rounding) * expected + kSmall) << width << ' ' << k;
      ASSERT_NEAR(models.histogram.density(p, h), counted, 2 * rounding * counted + kSmall) << width << ' ' << k;
    }
  }
}

TEST(FootprintsOfAllSizes, AboveTheMapAreItsMean) {
  constexpr double kFarField = 0.02, kSmall = 1e-3;
  for (const auto& [width, height] : kShapes) {
    const Models models(width, height);
    const Shares all = even(width, height);
    for (const float times : {1.0f, 2.3f, 5.0f, 10.0f, 1e3f, 1e12f}) {
      const float sigma = times * static_cast<float>(std::max(width, height));
      for (const Vec2 h : {Vec2{0.3f, 0.2f}, {-0.25f, 0.15f}, {0, 0}}) {
        for (const Vec2 centre : {Vec2{0.25f, 0.5f}, {0.75f, 0.1f}}) {
          const Footprint p = Footprint::isotropic(centre, sigma);
          const double expected = models.binMapOf(all, h), counted = models.histogramOf(all, h);
          EXPECT_NEAR(models.reference.density(p, h), expected, kFarField * expected + kSmall) << width << 'x' << height;
          EXPECT_NEAR(models.near.density(p, h), expected, kFarField * expected + models.nearTolerance() + kSmall)
              << width << 'x' << height;
          EXPECT_NEAR(models.bin_map.density(p, h), expected, kFarField * expected + kSmall) << width << 'x' << height;
          EXPECT_NEAR(models.histogram.density(p, h), counted, kFarField * counted + kSmall) << width << 'x' << height;
          EXPECT_NEAR(models.three.density(p, h), counted, kFarField * counted + kSmall) << width << 'x' << height;
        }
      }
    }
  }
}

TEST(FootprintsOfAllSizes, AreFiniteWhateverTheyAre) {
  const float sizes[] = {0, -1, 1e-30f, 1e-3f, 0.25f, 1, 300, 1e6f, 1e15f, 3e38f, INFINITY, -INFINITY, std::nanf("")};
  Random random(8);
  const auto size = [&] { return sizes[static_cast<int>(random.upTo(12.99f))]; };
  for (const auto& [width, height] : {Size{1, 1}, Size{1, 7}, Size{60, 1}, Size{31, 17}}) {
    const Models models(width, height);
    const Reference clamped(models.map.map(), 0.1f, Surface::flat, Boundary::clamp);
    const Reference smooth(models.map.map(), 0.1f, Surface::smooth, Boundary::wrap, Reference::Search::pruned);
    const ManifoldNdf near_smooth(models.map.map(), 0.1f, Surface::smooth);
    const Vec2 h = {0.2f, 0.15f};
    for (int k = 0; k < 80; ++k) {
      const Footprint p = k % 2 == 0 ? Footprint::box({size(), random.upTo(1)}, {size(), size()}, {size(), size()})
                                     : Footprint::gaussian({size(), random.upTo(1)}, {size(), size(), size()});
      SCOPED_TRACE(k);
      const auto expectFinite = [&](const auto& model) {
        const float density = model.density(p, h), mean = model.mean(p, {{0, 0}, {0.3f, 0.3f}});
        const HalfVectorSample s = model.sample(p, {random.upTo(1), random.upTo(1)});
        EXPECT_TRUE(std::isfinite(density) && density >= 0);
        EXPECT_TRUE(std::isfinite(mean) && mean >= 0);
        EXPECT_TRUE(std::isfinite(s.h.x) && std::isfinite(s.h.y) && std::isfinite(s.pdf));
      };
      expectFinite(models.bin_map);
      expectFinite(models.histogram);
      expectFinite(models.three);
      expectFinite(models.reference);
      expectFinite(models.near);
      expectFinite(near_smooth);
      expectFinite(clamped);
      if (k % 8 < 2) expectFinite(smooth);  // a hundred times slower
      EXPECT_LE(models.bin_map.weights(p, h).count, BinWeights::kMost);
    }
  }
}

TEST(LongFootprints, SeeOnlyTheMapWhereItEnds) {
  constexpr int kSize = 40;
  const test::OwnedMap map(kSize, kSize, quarters(kSize, kSize));
  const Reference reference(map.map(), 0.1f, Surface::flat, Boundary::clamp);
  double mean = 0;
  const Vec2 h = {0.25f, 0.15f};
  for (const Vec2 n : map.normals()) mean += gaussianDensity(n - h, 0.1f) / (kSize * kSize);
  constexpr double kRounding = 1e-4;
  for (const float size : {1e4f, 1e9f, 1e15f, 1e30f}) {
    for (const Footprint& p : {Footprint::box({0.3f, 0.6f}, {size, 0.3f * size}, {-0.4f * size, size}),
                               Footprint::box({0.3f, 0.6f}, {size, 0}, {0, size}), Footprint::isotropic({0.1f, 0.9f}, size)})
      EXPECT_NEAR(reference.density(p, h), mean, kRounding * mean) << size;
    // A strip: a texel weighs its area inside the strip, whatever is outside.
    const Footprint strip = Footprint::box({0.3f, 0.6f}, {size, 0.5f * size}, {-1, 3});
    const Footprint as_long_as_needed = Footprint::box({0.3f, 0.6f}, {400, 200}, {-1, 3});
    EXPECT_NEAR(reference.density(strip, h), reference.density(as_long_as_needed, h), kRounding * mean) << size;
    const HalfVectorSample s = reference.sample(strip, {0.3f, 0.7f});
    EXPECT_TRUE(std::isfinite(s.h.x) && std::isfinite(s.pdf));
  }
}

}  // namespace
}  // namespace glint::long_footprints_test
