#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <map>
#include <numbers>
#include <random>
#include <vector>

#include "glint/bake/histogram/histogram_sat.h"
#include "glint/model/error.h"
#include "glint/query/histogram_ndf.h"
#include "glint/query/reference.h"
#include "support/test_maps.h"

namespace glint::histogram_test {
namespace {

using Counts = std::map<int, std::int64_t>;

int wrapped(std::int64_t i, int n) { return static_cast<int>(((i % n) + n) % n); }

Counts countByTable(const HistogramNdf& ndf, std::int64_t x0, std::int64_t y0, std::int64_t x1, std::int64_t y1) {
  Counts counts;
  ndf.countTexels(x0, y0, x1, y1, [&](int bin, std::int64_t count) { counts[ndf.sat().bin_ids[bin]] = count; });
  return counts;
}

/// Shares of all bins of directions by the covered area of every texel, in the shortest way that is right.
std::vector<double> sharesByTexel(const NormalMap& map, const SphericalBins& bins, const Footprint& p) {
  std::vector<double> shares(bins.count());
  const double total = Reference(map, 0.01f).forEachTexel(p, [&](float w, Vec2 n) { shares[bins.find(n)] += w; });
  for (double& share : shares) share /= total;
  return shares;
}

std::vector<double> sharesByTable(const HistogramNdf& ndf, const Footprint& p) {
  std::vector<double> shares(ndf.bins().count());
  ndf.forEachBin(p, [&](int bin, float weight) { shares[ndf.sat().bin_ids[bin]] = weight; });
  return shares;
}

double sumOfDifferences(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += std::abs(a[k] - b[k]);
  return sum;
}

struct BuiltMap {
  BuiltMap(int width, int height, std::vector<Vec2> normals, bake::HistogramSatOptions options = {})
      : map(width, height, std::move(normals)),
        data(bake::buildHistogramSat(map.map(), options)),
        ndf(data.view(), GaussianBoxes::one, 0, HistogramBins::even) {
    for (const Vec2 n : map.normals()) ids.push_back(ndf.bins().find(n));
  }
  test::OwnedMap map;
  bake::HistogramSatData data;
  HistogramNdf ndf;      ///< exact at any angle
  std::vector<int> ids;  ///< direction of every texel, from the map itself
};

Counts countByTexel(const BuiltMap& built, std::int64_t x0, std::int64_t y0, std::int64_t x1, std::int64_t y1) {
  const int width = built.map.map().width, height = built.map.map().height;
  std::vector<std::int64_t> counts(built.ndf.bins().count());
  for (std::int64_t j = y0; j < y1; ++j) {
    const int* row = &built.ids[static_cast<std::size_t>(wrapped(j, height)) * width];
    for (std::int64_t i = x0; i < x1; ++i) ++counts[row[wrapped(i, width)]];
  }
  Counts occurring;
  for (std::size_t id = 0; id < counts.size(); ++id)
    if (counts[id] > 0) occurring[static_cast<int>(id)] = counts[id];
  return occurring;
}

bake::HistogramSatOptions strideOf(int stride) { return {.theta_bins = 9, .phi_bins = 32, .stride = stride}; }

/// Covered areas of brute force are float; sums over a footprint's border of a few hundred texels keep this.
constexpr double kFloatAreas = 2e-4;

TEST(HistogramSat, CountsRectanglesAsTexelsDo) {
  std::mt19937 random(3);
  for (const auto& [width, height, stride] : {std::tuple{64, 64, 4},
                                              {61, 47, 4},
                                              {61, 47, 16},
                                              {33, 70, 1},
                                              {5, 3, 4},
                                              {1, 1, 4},
                                              {40, 40, 7},
                                              {300, 20, 128},
                                              {90, 100, 33},
                                              {16, 16, 16}}) {
    const BuiltMap built(width, height, test::randomNormals(width, height, 0.95f, 7), strideOf(stride));
    for (int k = 0; k < 60; ++k) {
      const auto between = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
      const int x0 = between(-2 * width, width), y0 = between(-2 * height, height);
      const int x1 = x0 + between(1, k % 2 ? width : 3 * width), y1 = y0 + between(1, k % 3 ? height : 3 * height);
      EXPECT_EQ(countByTable(built.ndf, x0, y0, x1, y1), countByTexel(built, x0, y0, x1, y1))
          << width << "x" << height << " stride " << stride << ": " << x0 << " " << y0 << " " << x1 << " " << y1;
    }
  }
}

/// Rectangles of more than 2^16 texels use the coarse table, its frame, and long lines the sums along them.
TEST(HistogramSat, CountsLargeRectanglesAsTexelsDo) {
  std::mt19937 random(4);
  for (const int stride : {2, 4, 16, 50, 128}) {
    const int width = 900, height = 700;
    const BuiltMap built(width, height, test::roughSurface(width, height, 0.5f), strideOf(stride));
    for (int k = 0; k < 5; ++k) {
      const auto between = [&](int low, int high) { return std::uniform_int_distribution<int>(low, high)(random); };
      const int x0 = between(0, width), y0 = between(0, height), x1 = x0 + between(300, 899), y1 = y0 + between(300, 1500);
      EXPECT_EQ(countByTable(built.ndf, x0, y0, x1, y1), countByTexel(built, x0, y0, x1, y1))
          << "stride " << stride << ": " << x0 << " " << y0 << " " << x1 << " " << y1;
    }
  }
}

/// One direction everywhere makes counters as large as they get: 2^16 wraps in the fine table and in lines.
TEST(HistogramSat, CountersThatWrapStillCount) {
  const int width = 70000, height = 40;
  const BuiltMap built(width, height, std::vector<Vec2>(std::size_t{70000} * 40, Vec2{0.3f, 0.1f}), strideOf(16));
  for (const auto& [x0, y0, x1, y1] : {std::array<std::int64_t, 4>{0, 0, 70000, 40},
                                       {1, 1, 69999, 39},
                                       {3, 5, 69000, 6},
                                       {-500, 3, 69000, 37},
                                       {0, 7, 70000, 8},
                                       {9, 0, 66000, 40},
                                       {-70000, -40, 210000, 83}}) {
    const Counts counts = countByTable(built.ndf, x0, y0, x1, y1);
    ASSERT_EQ(counts.size(), 1u);
    EXPECT_EQ(counts.begin()->second, (x1 - x0) * (y1 - y0));
  }
}

/// A map of 64K x 64K texels of one direction without its memory: every table that a query reads is one that can be filled in
/// from the position, and the rows that it points to are kept small by a large stride of lines.
TEST(HistogramSat, CountsBeyond32BitsOn64KMaps) {
  HistogramSat sat;
  sat.width = sat.height = 65536;
  sat.theta_bins = sat.phi_bins = sat.bin_count = 1;
  sat.stride = sat.coarse_stride = 128;
  sat.line_stride = 4096;
  const std::size_t length = sat.rowLength(), points = sat.pointsX(128);
  const std::vector<std::uint16_t> ids = {0};
  const std::vector<Vec2> normals = {{0, 0}};
  const std::vector<std::uint64_t> totals = {std::uint64_t{1} << 32};
  std::vector<std::uint16_t> sums(points * points * length);
  std::vector<std::uint32_t> coarse(points * points * length);
  for (std::size_t b = 0; b < points; ++b) {
    for (std::size_t a = 0; a < points; ++a) {
      sums[(b * points + a) * length] = static_cast<std::uint16_t>(a * b * 16384);
      coarse[(b * points + a) * length] = static_cast<std::uint32_t>(a * b * 16384);
    }
  }
  sat.bin_ids = ids;
  sat.bin_normals = normals;
  sat.bin_totals = totals;
  sat.sums = sums;
  sat.coarse_sums = coarse;
  const HistogramNdf ndf(sat);
  const std::int64_t side = 65536;
  for (const auto& [x0, y0, x1, y1] : {std::array<std::int64_t, 4>{0, 0, side, side},
                                       {0, 0, side, side - 128},
                                       {128, 256, side, side},
                                       {-5 * side, -2 * side, 3 * side, 7 * side},
                                       {-256, -128, side - 384, 4 * side},
                                       {0, 0, 1000 * side, 1000 * side}}) {
    const Counts counts = countByTable(ndf, x0, y0, x1, y1);
    ASSERT_EQ(counts.size(), 1u);
    EXPECT_EQ(counts.begin()->second, (x1 - x0) * (y1 - y0)) << x0 << " " << y0 << " " << x1 << " " << y1;
  }
}

TEST(HistogramSat, BoxesCountTexelsByCoveredArea) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const auto& [width, height, stride] : {std::tuple{64, 64, 4}, {61, 47, 16}, {7, 9, 2}}) {
    const BuiltMap built(width, height, test::randomNormals(width, height, 0.9f, 8), strideOf(stride));
    for (int k = 0; k < 60; ++k) {
      const float scale = k % 3 == 0 ? 1.5f : k % 3 == 1 ? 10.0f : static_cast<float>(width);
      const Footprint p = Footprint::box({3 * unit(random) - 1, unit(random)}, {scale * unit(random) + 0.01f, 0},
                                         {0, scale * unit(random) + 0.01f});
      EXPECT_LT(sumOfDifferences(sharesByTable(built.ndf, p), sharesByTexel(built.map.map(), built.ndf.bins(), p)),
                kFloatAreas);
    }
  }
}

TEST(HistogramSat, BoxesAtAnyAngleCountTexelsByCoveredArea) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> unit(0, 1);
  for (const auto& [width, height, stride] : {std::tuple{64, 64, 4}, {61, 47, 16}, {20, 31, 1}, {64, 48, 5}}) {
    const BuiltMap built(width, height, test::randomNormals(width, height, 0.9f, 9), strideOf(stride));
    for (int k = 0; k < 80; ++k) {
      const float angle = k % 4 == 0 ? 0.01f : k % 4 == 1 ? 1.5607963f : 6.3f * unit(random);
      const float scale = k % 5 == 0 ? 1.0f : 1.2f * static_cast<float>(width);
      const float a = scale * unit(random) + 0.1f, b = scale * unit(random) + 0.1f, skew = k % 2 ? 0.4f * unit(random) : 0;
      const Footprint p = Footprint::box({unit(random), unit(random)}, {a * std::cos(angle), a * std::sin(angle)},
                                         {-b * std::sin(angle + skew), b * std::cos(angle + skew)});
      EXPECT_LT(sumOfDifferences(sharesByTable(built.ndf, p), sharesByTexel(built.map.map(), built.ndf.bins(), p)), kFloatAreas)
          << "angle " << angle << " axes " << a << " " << b << " skew " << skew << " map " << width;
    }
  }
}

double stripPlanBound(const HistogramSat& sat, const Footprint& p, double tolerance) {
  return planStrips(sat, p.axis_a.x, p.axis_a.y, p.axis_b.x, p.axis_b.y, tolerance).misplaced;
}

/// Total variation from the exact histogram against the bound of the plan, for boxes of all sizes and angles. Where every texel
/// has a bin of its own, it is the share that is misplaced.
void expectStripsWithinBound(const BuiltMap& built, float largest, int boxes, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> unit(0, 1);
  const HistogramSat sat = built.data.view();
  int with_strips = 0, moved = 0;
  double sum = 0, bounds = 0;
  for (int k = 0; k < boxes; ++k) {
    const float tolerance = k % 3 == 0 ? 0.03f : k % 3 == 1 ? kSlantTolerance : 0.2f;
    const float angle = k % 4 == 0 ? 0.02f : 6.3f * unit(random), skew = k % 2 ? 0.5f * unit(random) : 0;
    const float a = largest * (0.2f + 0.8f * unit(random)), b = k % 5 == 0 ? 0.3f * a : largest * (0.2f + 0.8f * unit(random));
    const Footprint p = Footprint::box({unit(random), unit(random)}, {a * std::cos(angle), a * std::sin(angle)},
                                       {-b * std::sin(angle + skew), b * std::cos(angle + skew)});
    const double bound = stripPlanBound(sat, p, tolerance);
    const double off =
        0.5 * sumOfDifferences(sharesByTable(HistogramNdf(sat, GaussianBoxes::one, tolerance), p), sharesByTable(built.ndf, p));
    EXPECT_LE(bound, tolerance);
    EXPECT_LE(off, bound + kFloatAreas) << "tolerance " << tolerance << " angle " << angle << " axes " << a << " " << b;
    with_strips += bound > 0, moved += off > kFloatAreas;
    sum += off, bounds += bound;
  }
  EXPECT_GT(with_strips, boxes / 3);
  EXPECT_EQ(moved, with_strips);  // otherwise they are not strips, and the test shows nothing
  EXPECT_LT(sum, 0.8 * bounds);
}

TEST(HistogramSat, StripsMisplaceNoMoreThanTheirBound) {
  const SphericalBins bins(44, 46);
  std::vector<Vec2> normals;
  for (int id = 0; id < bins.count(); ++id) normals.push_back(bins.centre(id));
  for (const int stride : {1, 2, 4}) {
    const BuiltMap built(46, 44, normals, {44, 46, stride});
    ASSERT_EQ(built.ndf.binCount(), 44 * 46);
    expectStripsWithinBound(built, 22, 120, 21);
  }
}

/// Large boxes have their ends moved to points of the tables, and cross the borders of the map.
TEST(HistogramSat, StripsOfLargeBoxesKeepTheirBound) {
  for (const int stride : {4, 7}) {
    const BuiltMap built(900, 700, test::synthesised(bake::SynthKind::flakes, 900, 700, 0.3f), {9, 32, stride});
    expectStripsWithinBound(built, 800, 40, 22);
  }
}

TEST(HistogramSat, StripsHaveThePlansThatTheirSizeAllows) {
  const BuiltMap built(256, 256, test::roughSurface(256, 256, 0.3f), strideOf(4));
  const HistogramSat sat = built.data.view();
  const auto plan = [&](double half, double tolerance) { return planStrips(sat, half, half, -half, half, tolerance); };
  EXPECT_EQ(plan(100, 0).rows, 0);
  EXPECT_EQ(plan(4, kSlantTolerance).rows, 0);
  EXPECT_EQ(plan(22, kSlantTolerance).snap, 0);
  EXPECT_GT(plan(22, kSlantTolerance).rows, 0);
  EXPECT_EQ(plan(90, kSlantTolerance).snap, sat.stride);
  EXPECT_EQ(plan(1000, kSlantTolerance).snap, sat.coarse_stride);
  for (const double half : {22.0, 90.0, 1000.0}) EXPECT_EQ(plan(half, kSlantTolerance).rows % sat.stride, 0);
}

/// A box that moves by a small step changes no more than the texels along its border do.
TEST(HistogramSat, StripsChangeSmoothlyAsABoxMoves) {
  const BuiltMap built(64, 64, test::randomNormals(64, 64, 0.9f, 23), strideOf(4));
  const HistogramNdf ndf(built.data.view());
  constexpr float kStep = 1.0f / 64;  // texel
  const auto at = [](int k) {
    const float moved = static_cast<float>(k) * kStep / 64;
    return Footprint::box({0.3f + moved, 0.4f + 0.3f * moved}, {14, 9}, {-9, 14});
  };
  ASSERT_GT(stripPlanBound(built.data.view(), at(0), kSlantTolerance), 0);
  std::vector<double> before = sharesByTable(ndf, at(0));
  double most = 0;
  for (int k = 1; k < 400; ++k) {
    std::vector<double> here = sharesByTable(ndf, at(k));
    most = std::max(most, sumOfDifferences(before, here));
    before = std::move(here);
  }
  // Every side moves by a step at most: 2 * 46 texels of it and as much of the steps, twice, over 4 * 277 texels.
  EXPECT_GT(most, 0);
  EXPECT_LT(most, 4 * 46 * kStep * 1.5 / (4 * 277));
}

TEST(HistogramSat, ConstantMapsHaveOneBin) {
  const Vec2 n = {0.3f, -0.2f};
  const BuiltMap built(50, 30, std::vector<Vec2>(1500, n), strideOf(4));
  ASSERT_EQ(built.ndf.binCount(), 1);
  EXPECT_FLOAT_EQ(built.ndf.binNormal(0).x, n.x);
  EXPECT_FLOAT_EQ(built.ndf.binNormal(0).y, n.y);
  const int id = built.ndf.bins().find(n);
  for (const Footprint& p : {Footprint::isotropic({0.4f, 0.9f}, 3), Footprint::box({0.1f, 0.1f}, {9, 2}, {-1, 30})}) {
    int visits = 0;
    built.ndf.forEachBin(p, [&](int bin, float weight) {
      ++visits;
      EXPECT_EQ(bin, 0);
      EXPECT_NEAR(weight, 1, 1e-6);
    });
    EXPECT_EQ(visits, 1);
    EXPECT_NEAR(built.ndf.density(p, n), 1 / built.ndf.bins().area(id), 1e-5 / built.ndf.bins().area(id));
    EXPECT_EQ(built.ndf.density(p, {-0.3f, 0.2f}), 0);
  }
}

TEST(HistogramSat, IsTheSameOnAnyNumberOfThreads) {
  const test::OwnedMap map(150, 130, test::roughSurface(150, 130, 0.4f));
  const auto build = [&](int threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return bake::buildHistogramSat(map.map(), strideOf(4));
  };
  const bake::HistogramSatData a = build(1), b = build(4);
  const auto same = [](auto x, auto y) {
    return x.size_bytes() == y.size_bytes() && std::memcmp(x.data(), y.data(), x.size_bytes()) == 0;
  };
  EXPECT_TRUE(same(a.view().bin_ids, b.view().bin_ids));
  EXPECT_TRUE(same(a.view().bin_normals, b.view().bin_normals));
  EXPECT_TRUE(same(a.view().bin_totals, b.view().bin_totals));
  EXPECT_TRUE(same(a.view().texels, b.view().texels));
  EXPECT_TRUE(same(a.view().sums, b.view().sums));
  EXPECT_TRUE(same(a.view().coarse_sums, b.view().coarse_sums));
  EXPECT_TRUE(same(a.view().row_sums, b.view().row_sums));
  EXPECT_TRUE(same(a.view().column_sums, b.view().column_sums));
}

TEST(HistogramSat, RefusesOptionsOutOfRange) {
  const test::OwnedMap map(4, 4, std::vector<Vec2>(16));
  for (const bake::HistogramSatOptions& options : {bake::HistogramSatOptions{0, 32, 4},
                                                   {9, 0, 4},
                                                   {65, 1, 4},
                                                   {1, 257, 4},
                                                   {64, 64, 4},
                                                   {9, 32, 0},
                                                   {9, 32, 129},
                                                   {9, 32, -3}})
    EXPECT_THROW(bake::buildHistogramSat(map.map(), options), Error);
}

TEST(HistogramSat, RefusesMapsBeyondItsCounters) {
  NormalMap map;
  map.width = 65536;
  map.height = 65537;
  EXPECT_THROW(bake::buildHistogramSat(map, {}), Error);
}

/// Every texel has a bin of its own, so that a histogram tells the weight of every texel.
class PositionCodedMap {
 public:
  static constexpr int kSide = 32;
  PositionCodedMap() : built_(kSide, kSide, normals(), {kSide, kSide, 4}) {}

  /// Weights of the texels, row by row, with a Gaussian answered by so many boxes.
  std::vector<double> weights(const Footprint& p, GaussianBoxes boxes) const {
    std::vector<double> weights(kSide * kSide);
    HistogramNdf(built_.data.view(), boxes).forEachBin(p, [&](int bin, float w) {
      weights[built_.ndf.sat().bin_ids[bin]] = w;
    });
    return weights;
  }
  const NormalMap& map() const { return built_.map.map(); }

 private:
  static std::vector<Vec2> normals() {
    const SphericalBins bins(kSide, kSide);
    std::vector<Vec2> normals;
    for (int id = 0; id < bins.count(); ++id) normals.push_back(bins.centre(id));
    return normals;
  }
  BuiltMap built_;
};

TEST(HistogramSat, GaussiansKeepTheirSecondMoments) {
  const PositionCodedMap coded;
  constexpr int kSide = PositionCodedMap::kSide;
  for (const GaussianBoxes boxes : {GaussianBoxes::one, GaussianBoxes::three}) {
    for (const Covariance& c : {Covariance{9, 0, 9}, {9, 4, 6}, {5, -3, 4}}) {
      const std::vector<double> weights = coded.weights(Footprint::gaussian({0.5f, 0.5f}, c), boxes);
      double xx = 0, xy = 0, yy = 0;
      for (int k = 0; k < kSide * kSide; ++k) {
        const double x = k % kSide + 0.5 - 0.5 * kSide, y = k / kSide + 0.5 - 0.5 * kSide;
        xx += weights[k] * x * x, xy += weights[k] * x * y, yy += weights[k] * y * y;
      }
      constexpr double kCentres = 0.2;  // texels count at their centres: about 1/12 less, or more where borders cut them
      EXPECT_NEAR(xx, c.xx, kCentres);
      EXPECT_NEAR(xy, c.xy, kCentres);
      EXPECT_NEAR(yy, c.yy, kCentres);
    }
  }
}

/// Total variation between the weights of a Gaussian and those of its boxes: 0.30 for one and 0.16 for three in the continuum.
TEST(HistogramSat, ThreeBoxesAreCloserToAGaussian) {
  const PositionCodedMap coded;
  const Footprint p = Footprint::isotropic({0.5f, 0.5f}, 3.5f);
  std::vector<double> exact;
  double total = 0;
  const FootprintWeights weights(p, PositionCodedMap::kSide, PositionCodedMap::kSide);
  for (int k = 0; k < PositionCodedMap::kSide * PositionCodedMap::kSide; ++k) {
    exact.push_back(weights.texel(k % PositionCodedMap::kSide, k / PositionCodedMap::kSide));
    total += exact.back();
  }
  for (double& w : exact) w /= total;
  EXPECT_NEAR(0.5 * sumOfDifferences(coded.weights(p, GaussianBoxes::one), exact), 0.30, 0.02);
  // Texels that borders cut make steps softer than in the continuum.
  EXPECT_LT(0.5 * sumOfDifferences(coded.weights(p, GaussianBoxes::three), exact), 0.16);
}

TEST(SphericalBins, PartsOfBinsAddUpToTheBoxAndTheDisk) {
  std::mt19937 random(11);
  std::uniform_real_distribution<float> unit(-1, 1);
  for (const auto& [rings, sectors] : {std::pair{9, 32}, {1, 1}, {4, 2}, {3, 3}, {1, 7}, {16, 128}}) {
    const SphericalBins bins(rings, sectors);
    double disk = 0;
    for (int bin = 0; bin < bins.count(); ++bin) {
      disk += bins.area(bin);
      EXPECT_NEAR(bins.areaInside(bin, {{-1, -1}, {1, 1}}), bins.area(bin), 1e-6);
      EXPECT_EQ(bins.find(bins.centre(bin)), bin);
    }
    EXPECT_NEAR(disk, std::numbers::pi, 1e-6);
    for (int k = 0; k < 30; ++k) {
      // Boxes inside the disk.
      const float x = 0.7f * unit(random), y = 0.7f * unit(random);
      const Box2 box = {{std::min(x, 0.0f), std::min(y, 0.0f)}, {std::max(x, 0.1f), std::max(y, 0.05f)}};
      double sum = 0;
      for (int bin = 0; bin < bins.count(); ++bin) sum += bins.areaInside(bin, box);
      EXPECT_NEAR(sum, box.area(), 1e-6) << rings << "x" << sectors;
    }
  }
}

/// A quadrature of the density over pixels much finer than the bins.
TEST(HistogramNdf, MeanIsTheAverageOfTheDensity) {
  const BuiltMap built(40, 40, test::randomNormals(40, 40, 0.99f, 12), {6, 11, 4});
  const Footprint p = Footprint::box({0.3f, 0.6f}, {6.3f, 0}, {0, 4.1f});
  std::mt19937 random(13);
  std::uniform_real_distribution<float> unit(0, 1);
  constexpr int kSide = 300;
  constexpr double kQuadrature = 0.01;  // borders of bins cut one in a hundred cells
  for (int k = 0; k < 12; ++k) {
    const Vec2 low = {1.6f * unit(random) - 1, 1.6f * unit(random) - 1};
    const Box2 range = {low, low + Vec2{0.05f + 0.5f * unit(random), 0.05f + 0.5f * unit(random)}};
    double sum = 0;
    for (int y = 0; y < kSide; ++y) {
      for (int x = 0; x < kSide; ++x) {
        const Vec2 t = {(static_cast<float>(x) + 0.5f) / kSide, (static_cast<float>(y) + 0.5f) / kSide};
        sum += built.ndf.density(p, range.low + Vec2{t.x * range.width(), t.y * range.height()});
      }
    }
    EXPECT_NEAR(built.ndf.mean(p, range), sum / (kSide * kSide), kQuadrature * (1 + sum / (kSide * kSide)));
  }
}

TEST(HistogramNdf, IntegratesToOne) {
  for (const auto& [bins, alpha] : {std::pair{std::pair{9, 32}, 0.3f}, {std::pair{1, 1}, 0.6f}, {std::pair{18, 64}, 0.1f}}) {
    const BuiltMap built(64, 64, test::roughSurface(64, 64, alpha), {bins.first, bins.second, 4});
    for (const Footprint& p : {Footprint::isotropic({0.4f, 0.7f}, 5), Footprint::box({0.2f, 0.1f}, {8.5f, 3}, {-2, 4.25f}),
                               Footprint::box({0.2f, 0.1f}, {500, 0}, {0, 900})})
      EXPECT_NEAR(4 * built.ndf.mean(p, {{-1, -1}, {1, 1}}), 1, 1e-5);
  }
}

/// Every footprint, however bad, has a finite answer.
TEST(HistogramNdf, AnswersAnyFootprint) {
  const BuiltMap built(64, 48, test::roughSurface(64, 48, 0.3f), strideOf(4));
  const float inf = std::numeric_limits<float>::infinity(), nan = std::numeric_limits<float>::quiet_NaN();
  for (const float size : {0.0f, 1e-30f, 1e-5f, 1.0f, 1e5f, 1e20f, 3e38f, inf, nan, -2.0f}) {
    for (const float u : {0.0f, 0.999999f, -7.3f, 1e9f, nan, inf}) {
      for (const Footprint& p :
           {Footprint::isotropic({u, 0.3f}, size), Footprint::box({u, u}, {size, 0}, {0, 3}),
            Footprint::box({0.1f, u}, {size, size}, {-size, size}), Footprint::box({u, u}, {size, 1}, {size, 1}),
            Footprint::gaussian({u, 0}, {9, size, 9}), Footprint::box({0, 0}, {size, 1e-3f}, {2, 5})}) {
        double sum = 0;
        built.ndf.forEachBin(p, [&](int, float w) { sum += w; });
        EXPECT_NEAR(sum, 1, 1e-5) << size << " " << u;
        EXPECT_TRUE(std::isfinite(built.ndf.density(p, {0.01f, 0.02f})));
        for (const Vec2 xi : {Vec2{0.5f, 0.5f}, {nan, inf}, {-1, 2}}) {
          const HalfVectorSample s = built.ndf.sample(p, xi);
          EXPECT_GT(s.pdf, 0);
          EXPECT_LT(dot(s.h, s.h), 1);
        }
      }
    }
  }
  for (const Vec2 h : {Vec2{nan, 0}, {inf, 0}, {1, 1}, {-2, 0}})
    EXPECT_EQ(built.ndf.density(Footprint::isotropic({0, 0}, 4), h), 0);
  EXPECT_EQ(built.ndf.mean(Footprint::isotropic({0, 0}, 4), {{0.1f, 0.1f}, {0.1f, 0.2f}}), 0);
}

TEST(HistogramNdf, SamplesFollowTheDensity) {
  const BuiltMap built(64, 64, test::roughSurface(64, 64, 0.35f), strideOf(4));
  const Footprint p = Footprint::box({0.4f, 0.3f}, {9, 4}, {-3, 7});
  constexpr int kSide = 300;  // strata along each axis of xi
  constexpr int kCells = 12;  // of the square, along each axis
  std::vector<double> found(kCells * kCells);
  std::mt19937 random(14);
  std::uniform_real_distribution<float> unit(0, 1);
  for (int k = 0; k < kSide * kSide; ++k) {
    const HalfVectorSample s = built.ndf.sample(p, {unit(random), unit(random)});
    ASSERT_LT(dot(s.h, s.h), 1);
    ASSERT_NEAR(s.pdf, built.ndf.density(p, s.h), 1e-4 * s.pdf);
    const int x = static_cast<int>((s.h.x + 1) / 2 * kCells), y = static_cast<int>((s.h.y + 1) / 2 * kCells);
    ++found[y * kCells + x];
  }
  double chi_squared = 0;
  int cells = 0;
  for (int c = 0; c < kCells * kCells; ++c) {
    const float size = 2.0f / kCells, x = -1 + static_cast<float>(c % kCells) * size,
                y = -1 + static_cast<float>(c / kCells) * size;
    const double expected = kSide * kSide * built.ndf.mean(p, {{x, y}, {x + size, y + size}}) * size * size;
    if (expected < 1e-9) {
      EXPECT_EQ(found[c], 0);
    }
    if (expected < 5) continue;
    chi_squared += (found[c] - expected) * (found[c] - expected) / expected;
    ++cells;
  }
  // Mean cells - 1, deviation sqrt(2 (cells - 1)): five deviations above happen once in a million.
  EXPECT_GT(cells, 20);
  EXPECT_LT(chi_squared, cells - 1 + 5 * std::sqrt(2.0 * (cells - 1)));
}

/// Even xi stay even: of n xi.x evenly spaced, a bin gets n times its share, to one at each end.
TEST(HistogramNdf, SamplesKeepStrata) {
  const BuiltMap built(64, 64, test::roughSurface(64, 64, 0.35f), strideOf(4));
  const Footprint p = Footprint::isotropic({0.4f, 0.3f}, 9);
  constexpr int kSamples = 4096;
  std::map<int, int> found;
  for (int k = 0; k < kSamples; ++k) {
    const HalfVectorSample s = built.ndf.sample(p, {(static_cast<float>(k) + 0.5f) / kSamples, 0.37f});
    ++found[built.ndf.bins().find(s.h)];
  }
  built.ndf.forEachBin(
      p, [&](int bin, float weight) { EXPECT_NEAR(found[built.ndf.sat().bin_ids[bin]], kSamples * weight, 1.01) << bin; });
}

}  // namespace
}  // namespace glint::histogram_test
