#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <random>
#include <set>

#include "glint/bake/wang/repetition.h"
#include "glint/bake/wang/seam_cut.h"
#include "glint/bake/wang/tile_border.h"
#include "glint/bake/wang/wang_tiles.h"
#include "glint/model/error.h"
#include "glint/model/slope_sums.h"
#include "glint/query/wang_layout.h"
#include "support/test_maps.h"

namespace glint::wang_test {
namespace {

using bake::SeamSide;

bake::WangOptions optionsOf(WangScheme scheme, int size, int tile_count = 16) {
  bake::WangOptions options;
  options.scheme = scheme;
  options.size = size;
  options.tile_count = tile_count;
  return options;
}

NormalMap mapOf(int width, int height, const std::vector<Vec2>& normals) {
  NormalMap map;
  map.width = width, map.height = height, map.normals = normals;
  return map;
}

/// The default: a 16th, at least 4.
int overlapOf(int size) { return std::max(4, size / 16); }

/// Bits of a normal, to find it in its input: random normals are all different.
std::uint64_t bitsOf(Vec2 n) {
  std::uint64_t bits;
  std::memcpy(&bits, &n, sizeof bits);
  return bits;
}

/// Where the input has each normal.
std::map<std::uint64_t, std::pair<int, int>> placesOf(const NormalMap& map) {
  std::map<std::uint64_t, std::pair<int, int>> places;
  for (int j = 0; j < map.height; ++j)
    for (int i = 0; i < map.width; ++i) places[bitsOf(map.at(i, j))] = {i, j};
  return places;
}

/// Whether one normal is `dx`, `dy` texels from the other in the input.
bool areApart(const std::map<std::uint64_t, std::pair<int, int>>& places, Vec2 a, Vec2 b, int dx, int dy) {
  const auto p = places.at(bitsOf(a)), q = places.at(bitsOf(b));
  return q.first - p.first == dx && q.second - p.second == dy;
}

/// Sum of the costs of the seams of a labelling, from the definition.
double costOf(const bake::SeamProblem& problem, const std::vector<SeamSide>& sides) {
  double cost = 0;
  for (int y = 0; y < problem.height; ++y)
    for (int x = 0; x < problem.width; ++x) {
      const std::size_t p = rowMajorIndex(x, y, problem.width);
      for (const auto& [dx, dy] : {std::pair{1, 0}, std::pair{0, 1}}) {
        if (x + dx >= problem.width || y + dy >= problem.height) continue;
        const std::size_t q = rowMajorIndex(x + dx, y + dy, problem.width);
        if (sides[p] == SeamSide::none || sides[q] == SeamSide::none || sides[p] == sides[q]) continue;
        const Vec2 here = problem.first[p] - problem.second[p], there = problem.first[q] - problem.second[q];
        cost += std::hypot(double{here.x}, double{here.y}) + std::hypot(double{there.x}, double{there.y});
      }
    }
  return cost;
}

TEST(SeamCut, IsTheCheapestOfAllSeams) {
  constexpr int kWidth = 5, kHeight = 4, kFree = 12;
  // Costs are rounded to 2^-16 for each of up to 31 pairs, and 2^-16 is added for each.
  constexpr double kRounding = 31 * 2.0 / 65536;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const std::vector<Vec2> a = test::randomNormals(kWidth, kHeight, 0.5f, seed),
                            b = test::randomNormals(kWidth, kHeight, 0.5f, seed + 100);
    std::vector<SeamSide> given(a.size(), SeamSide::free);
    for (int y = 0; y < kHeight; ++y)
      given[rowMajorIndex(0, y, kWidth)] = SeamSide::first, given[rowMajorIndex(4, y, kWidth)] = SeamSide::second;
    if (seed % 2 == 1) given[7] = SeamSide::none;  // a hole
    const bake::SeamProblem problem = {kWidth, kHeight, a, b, given};
    const std::vector<SeamSide> found = bake::cutSeam(problem);
    double least = INFINITY;
    std::vector<std::size_t> open;
    for (std::size_t k = 0; k < given.size(); ++k)
      if (given[k] == SeamSide::free) open.push_back(k);
    ASSERT_GE(open.size() + 1, std::size_t{kFree});
    for (unsigned labels = 0; labels < 1u << open.size(); ++labels) {
      std::vector<SeamSide> sides = given;
      for (std::size_t k = 0; k < open.size(); ++k) sides[open[k]] = labels >> k & 1 ? SeamSide::first : SeamSide::second;
      least = std::min(least, costOf(problem, sides));
    }
    for (std::size_t k = 0; k < given.size(); ++k) {
      if (given[k] == SeamSide::free)
        EXPECT_TRUE(found[k] == SeamSide::first || found[k] == SeamSide::second);
      else
        EXPECT_EQ(found[k], given[k]);
    }
    EXPECT_NEAR(costOf(problem, found), least, kRounding) << seed;
  }
}

TEST(SeamCut, RunsWhereImagesAgree) {
  constexpr int kSize = 24;
  const std::vector<Vec2> a = test::randomNormals(kSize, kSize, 0.5f, 1);
  std::vector<Vec2> b = test::randomNormals(kSize, kSize, 0.5f, 2);
  for (int y = 0; y < kSize; ++y)
    for (int x = 9; x < 11; ++x) b[rowMajorIndex(x, y, kSize)] = a[rowMajorIndex(x, y, kSize)];
  std::vector<SeamSide> given(a.size(), SeamSide::free);
  for (int y = 0; y < kSize; ++y)
    given[rowMajorIndex(0, y, kSize)] = SeamSide::first, given[rowMajorIndex(23, y, kSize)] = SeamSide::second;
  const std::vector<SeamSide> found = bake::cutSeam({kSize, kSize, a, b, given});
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x)
      EXPECT_EQ(found[rowMajorIndex(x, y, kSize)], x < 10 ? SeamSide::first : SeamSide::second) << x;
}

class WangTilesOf : public testing::TestWithParam<WangScheme> {};
INSTANTIATE_TEST_SUITE_P(Schemes, WangTilesOf, testing::Values(WangScheme::edge, WangScheme::corner),
                         [](const auto& scheme) { return scheme.param == WangScheme::edge ? "Edge" : "Corner"; });

TEST_P(WangTilesOf, TexelsOnBothSidesOfAnEdgeAreNeighboursInTheInput) {
  constexpr int kSize = 32, kCells = 6;
  const std::vector<Vec2> normals = test::randomNormals(150, 130, 0.6f, 3);
  const NormalMap map = mapOf(150, 130, normals);
  const auto places = placesOf(map);
  const auto data = bake::buildWangTiles(map, optionsOf(GetParam(), kSize));
  const std::vector<Vec2> plane = bake::explicitPlane(data.view(), 0, 0, kCells * kSize, kCells * kSize);
  const auto at = [&](int x, int y) { return plane[rowMajorIndex(x, y, kCells * kSize)]; };
  const bool corners = GetParam() == WangScheme::corner;
  for (int cell = 1; cell < kCells; ++cell)
    for (int k = 0; k < kCells * kSize; ++k) {
      const int edge = cell * kSize, along = k % kSize;
      if (!corners && (along == 0 || along == kSize - 1)) continue;  // texels in corners belong to no edge
      EXPECT_TRUE(areApart(places, at(edge - 1, k), at(edge, k), 1, 0)) << edge << " " << k;
      EXPECT_TRUE(areApart(places, at(k, edge - 1), at(k, edge), 0, 1)) << edge << " " << k;
    }
  // The four texels around a vertex: one patch if corners have colours. Edges alone do not agree there.
  int agree = 0;
  for (int j = 1; j < kCells; ++j)
    for (int i = 1; i < kCells; ++i) {
      const int x = i * kSize, y = j * kSize;
      agree +=
          areApart(places, at(x - 1, y - 1), at(x, y), 1, 1) && areApart(places, at(x, y - 1), at(x - 1, y), -1, 1) ? 1 : 0;
    }
  EXPECT_EQ(agree, corners ? (kCells - 1) * (kCells - 1) : 0);
}

TEST_P(WangTilesOf, AreMadeOfTexelsOfTheInputAndKeepItsNormals) {
  const std::vector<Vec2> normals = test::roughSurface(1024, 1024, 0.3f);
  const NormalMap map = mapOf(1024, 1024, normals);
  const auto data = bake::buildWangTiles(map, optionsOf(GetParam(), 256));
  std::set<std::uint64_t> known;
  for (const Vec2 n : normals) known.insert(bitsOf(n));
  for (const Vec2 n : data.normals) ASSERT_TRUE(known.contains(bitsOf(n)));
  // Total variation on cells of 1/64 of the disk's width, computed anew.
  std::map<std::pair<int, int>, double> difference;
  const auto cell = [](Vec2 n) { return std::pair{static_cast<int>(32 * (n.x + 1)), static_cast<int>(32 * (n.y + 1))}; };
  for (const Vec2 n : data.normals) difference[cell(n)] += 1.0 / static_cast<double>(data.normals.size());
  for (const Vec2 n : normals) difference[cell(n)] -= 1.0 / static_cast<double>(normals.size());
  double tv = 0;
  for (const auto& [place, d] : difference) tv += 0.5 * std::abs(d);
  constexpr double kRounding = 1e-9;
  EXPECT_NEAR(data.report.ndf_tv, tv, kRounding);
  constexpr double kKept = 0.02;  // the target
  EXPECT_LT(tv, kKept);
  const MapSlopes slopes = slopesOf(mapOf(256, 16 * 256, data.normals));
  constexpr float kSlopes = 1e-5f;
  EXPECT_NEAR(data.shape.slopes.covariance.xx, slopes.covariance.xx, kSlopes);
}

TEST_P(WangTilesOf, SeamsAreBetterThanStraightOnes) {
  const std::vector<Vec2> normals = test::roughSurface(512, 512, 0.3f, 8);
  bake::WangOptions options = optionsOf(GetParam(), 128);
  options.overlap = 32;
  const auto data = bake::buildWangTiles(mapOf(512, 512, normals), options);
  // Two unrelated texels differ by about sqrt(2) spreads; the tool's unit is the difference of neighbours.
  double neighbours = 0, unrelated = 0;
  const std::size_t count = normals.size() / 2;
  for (std::size_t k = 0; k < count; ++k) {
    neighbours += std::hypot(normals[k].x - normals[k + 1].x, normals[k].y - normals[k + 1].y);
    unrelated += std::hypot(normals[k].x - normals[k + count].x, normals[k].y - normals[k + count].y);
  }
  EXPECT_GT(data.report.seam_cost, 0);
  constexpr double kGain = 1.7;  // least: measured 1.8
  EXPECT_LT(kGain * data.report.seam_cost, unrelated / neighbours);
}

TEST_P(WangTilesOf, AreTheSameOnAnyNumberOfThreads) {
  const std::vector<Vec2> normals = test::roughSurface(200, 170, 0.3f);
  const NormalMap map = mapOf(200, 170, normals);
  const auto many = bake::buildWangTiles(map, optionsOf(GetParam(), 48));
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  const auto single = bake::buildWangTiles(map, optionsOf(GetParam(), 48));
  EXPECT_EQ(many.normals, single.normals);
  EXPECT_EQ(many.report.repetition, single.report.repetition);
  bake::WangOptions other = optionsOf(GetParam(), 48);
  other.seed = 2;
  const auto seeded = bake::buildWangTiles(map, other);
  EXPECT_NE(seeded.normals, single.normals);
  EXPECT_NE(seeded.shape.plane_seed, single.shape.plane_seed);
}

TEST_P(WangTilesOf, WorkOnMapsThatAreSmallOrNarrowOrConstant) {
  struct Shape {
    int width, height, size;
  };
  for (const Shape& s : {Shape{16, 16, 16}, Shape{16, 200, 64}, Shape{90, 33, 49}, Shape{40, 40, 128}, Shape{61, 300, 17}}) {
    const std::vector<Vec2> normals = test::randomNormals(s.width, s.height, 0.4f, 5);
    const NormalMap map = mapOf(s.width, s.height, normals);
    const auto places = placesOf(map);
    for (const Boundary boundary : {Boundary::clamp, Boundary::wrap}) {
      bake::WangOptions options = optionsOf(GetParam(), s.size);
      options.boundary = boundary;
      const auto data = bake::buildWangTiles(map, options);
      ASSERT_EQ(data.normals.size(), 16u * static_cast<unsigned>(s.size * s.size));
      for (const Vec2 n : data.normals) ASSERT_TRUE(places.contains(bitsOf(n)));
      const int needed = GetParam() == WangScheme::corner ? (s.size + 1) / 2 * 2 + 2 * overlapOf(s.size) : s.size;
      EXPECT_EQ(data.report.enlarged, boundary == Boundary::clamp && needed > std::min(s.width, s.height)) << s.size;
    }
  }
  const std::vector<Vec2> constant(64 * 64, Vec2{0.25f, -0.5f});
  const auto data = bake::buildWangTiles(mapOf(64, 64, constant), optionsOf(GetParam(), 32));
  EXPECT_THAT(data.normals, testing::Each(Vec2{0.25f, -0.5f}));
  EXPECT_EQ(data.report.seam_cost, 0);
  EXPECT_EQ(data.report.repetition, 0);
  EXPECT_EQ(data.report.ndf_tv, 0);
}

TEST_P(WangTilesOf, ReportHowMuchThePlaneRepeats) {
  constexpr int kSize = 32, kCells = 24;
  const std::vector<Vec2> normals = test::randomNormals(160, 160, 0.6f, 8);
  const auto data = bake::buildWangTiles(mapOf(160, 160, normals), optionsOf(GetParam(), kSize));
  // The autocorrelation of a part of the plane, from the definition.
  const int side = kCells * kSize;
  const std::vector<Vec2> plane = bake::explicitPlane(data.view(), 1000 * kSize, -7 * kSize, side, side);
  double square = 0;
  for (const Vec2 n : plane) square += double{dot(n, n)} / static_cast<double>(plane.size());
  double peak = 0;
  for (const auto& [i, j] : {std::pair{1, 0}, std::pair{0, 1}, std::pair{1, 1}, std::pair{-1, 1}}) {
    double sum = 0;
    std::size_t count = 0;
    for (int y = 0; y + j * kSize < side; ++y)
      for (int x = std::max(0, -i * kSize); x + std::max(0, i * kSize) < side; ++x, ++count)
        sum += double{dot(plane[rowMajorIndex(x, y, side)], plane[rowMajorIndex(x + i * kSize, y + j * kSize, side)])};
    peak = std::max(peak, sum / (static_cast<double>(count) * square));
  }
  constexpr double kOfCells = 0.06;  // 500 pairs of cells, each of which agrees or not in some parts; other distances
  EXPECT_NEAR(data.report.repetition, peak, kOfCells);
  EXPECT_GT(data.report.repetition, 0.05);
}

TEST(WangTiles, OfOneTextureEverywhereRepeatCompletely) {
  WangTiles tiles;
  tiles.size = 16, tiles.colors_h = tiles.colors_v = 2, tiles.tile_count = 16;
  std::vector<Vec2> normals;
  const std::vector<Vec2> one = test::randomNormals(16, 16, 0.5f, 1);
  for (int t = 0; t < 16; ++t) normals.insert(normals.end(), one.begin(), one.end());
  tiles.normals = normals;
  constexpr double kRounding = 1e-5;
  EXPECT_NEAR(bake::planeRepetition(tiles), 1, kRounding);
  // A map that repeats after 16 texels, and one of noise.
  const std::vector<Vec2> periodic = test::repeated(one, 16, 16, 8), noise = test::randomNormals(128, 128, 0.5f, 2);
  EXPECT_NEAR(bake::mapRepetition({128, 128, periodic, Boundary::clamp}, 16), 1, kRounding);
  constexpr double kNoise = 0.06;  // 4 deviations of the mean of 128^2 / 2 products
  EXPECT_LT(bake::mapRepetition({128, 128, noise, Boundary::wrap}, 16), kNoise);
}

TEST(WangTiles, MoreVariantsRepeatLess) {
  const std::vector<Vec2> normals = test::roughSurface(512, 512, 0.3f);
  const NormalMap map = mapOf(512, 512, normals);
  const auto few = bake::buildWangTiles(map, optionsOf(WangScheme::corner, 64, 16));
  const auto many = bake::buildWangTiles(map, optionsOf(WangScheme::corner, 64, 64));
  EXPECT_LT(many.report.repetition, few.report.repetition);
}

TEST(WangTiles, RefuseWhatCannotBe) {
  const std::vector<Vec2> normals = test::randomNormals(64, 64, 0.5f, 1);
  const NormalMap map = mapOf(64, 64, normals);
  const auto refused = [&](const NormalMap& from, auto change) {
    bake::WangOptions options = optionsOf(WangScheme::corner, 16);
    change(options);
    try {
      bake::buildWangTiles(from, options);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  using O = bake::WangOptions;
  EXPECT_THAT(refused(map, [](O& o) { o.colors_h = o.colors_v = 1, o.tile_count = 1; }), testing::HasSubstr("--colors"));
  EXPECT_THAT(refused(map, [](O& o) { o.colors_v = 3, o.tile_count = 36; }), testing::HasSubstr("--scheme edge"));
  EXPECT_THAT(refused(map, [](O& o) { o.tile_count = 24; }), testing::HasSubstr("give 16"));
  EXPECT_THAT(refused(map, [](O& o) { o.size = 8; }), testing::HasSubstr("--size"));
  EXPECT_THAT(refused(map, [](O& o) { o.overlap = 5; }), testing::HasSubstr("--overlap"));
  EXPECT_THAT(refused(map, [](O& o) { o.size = 4096, o.tile_count = 4096; }), testing::HasSubstr("2^30"));
  EXPECT_THAT(refused(mapOf(64, 15, normals), [](O&) {}), testing::HasSubstr("16 x 16"));
  EXPECT_EQ(refused(map, [](O&) {}), "accepted");
}

WangTiles layoutTiles(WangScheme scheme, int colors_h, int colors_v, int variants) {
  WangTiles tiles;
  tiles.size = 16, tiles.scheme = scheme, tiles.colors_h = colors_h, tiles.colors_v = colors_v;
  tiles.tile_count = variants * tiles.combinations();
  tiles.plane_seed = 12345;
  return tiles;
}

TEST(WangLayout, NeighboursShareColoursAnywhere) {
  for (const std::int64_t origin : {std::int64_t{0}, std::int64_t{-3}, std::int64_t{1} << 40, -(std::int64_t{1} << 62)}) {
    for (int k = 0; k < 400; ++k) {
      const std::int64_t i = origin + k % 20 - 10, j = -origin + k / 20 - 10;
      const WangTiles edges = layoutTiles(WangScheme::edge, 3, 2, 2), corners = layoutTiles(WangScheme::corner, 3, 3, 1);
      const WangLayout edge_plane(edges), corner_plane(corners);
      const auto edge = [&](std::int64_t x, std::int64_t y) { return edges.colorsOfTile(edge_plane.tileAt(x, y)); };
      const auto corner = [&](std::int64_t x, std::int64_t y) { return corners.colorsOfTile(corner_plane.tileAt(x, y)); };
      EXPECT_EQ(edge(i, j)[1], edge(i, j + 1)[0]);  // north side and south side
      EXPECT_EQ(edge(i, j)[3], edge(i + 1, j)[2]);  // east side and west side
      EXPECT_EQ(corner(i, j)[3], corner(i + 1, j + 1)[0]);
      EXPECT_EQ(corner(i, j)[1], corner(i + 1, j)[0]);
      EXPECT_EQ(corner(i, j)[2], corner(i, j + 1)[0]);
    }
  }
}

TEST(WangLayout, EveryTileOccursEquallyOften) {
  constexpr int kSide = 200;
  for (const WangTiles& tiles : {layoutTiles(WangScheme::edge, 2, 2, 3), layoutTiles(WangScheme::corner, 2, 2, 1)}) {
    const WangLayout layout(tiles);
    std::vector<int> counts(static_cast<std::size_t>(tiles.tile_count));
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i) ++counts[static_cast<std::size_t>(layout.tileAt(i - 100, j))];
    const double expected = 1.0 * kSide * kSide / tiles.tile_count;
    // Cells share colours with neighbours, so counts spread more than those of independent draws: eight deviations of these.
    for (const int count : counts) EXPECT_NEAR(count, expected, 8 * std::sqrt(expected));
  }
}

TEST(WangLayout, IsTheSameForEver) {
  // The specification fixes the plane of a seed: these tiles must not change.
  const WangLayout corner(layoutTiles(WangScheme::corner, 2, 2, 1)), edge(layoutTiles(WangScheme::edge, 2, 3, 2));
  std::vector<int> found;
  for (int k = -2; k < 3; ++k) found.push_back(corner.tileAt(k, 3 * k)), found.push_back(edge.tileAt(k, std::int64_t{k} << 40));
  EXPECT_THAT(found, testing::ElementsAre(3, 61, 2, 7, 8, 41, 12, 32, 15, 32));
}

TEST(WangLayout, PlacesKeepTheirDigitsFarOut) {
  WangTiles tiles = layoutTiles(WangScheme::corner, 2, 2, 1);
  tiles.size = 100;
  const WangLayout layout(tiles);
  const WangPlace near = layout.placeOf(250.25, -0.5);
  EXPECT_EQ(near.cell_x, 2);
  EXPECT_EQ(near.cell_y, -1);
  EXPECT_EQ(near.x, 50.25f);
  EXPECT_EQ(near.y, 99.5f);
  const WangPlace far = layout.placeOf(0x1p40 + 0.125, -0x1p40);
  EXPECT_EQ(far.cell_x, (std::int64_t{1} << 40) / 100);
  EXPECT_EQ(far.x, 76.125f);
  EXPECT_EQ(far.cell_y, -(std::int64_t{1} << 40) / 100 - 1);
  EXPECT_EQ(far.y, 24);
  for (const double none : {double{NAN}, double{INFINITY}, 1e300}) EXPECT_EQ(layout.placeOf(none, none).cell_x, 0);
}

TEST(ExplicitPlane, PartsFitTogether) {
  const std::vector<Vec2> normals = test::randomNormals(64, 64, 0.5f, 1);
  const auto data = bake::buildWangTiles(mapOf(64, 64, normals), optionsOf(WangScheme::corner, 17));
  for (const std::int64_t origin : {std::int64_t{-50}, std::int64_t{1} << 40}) {
    const std::vector<Vec2> whole = bake::explicitPlane(data.view(), origin, origin, 100, 100);
    const std::vector<Vec2> part = bake::explicitPlane(data.view(), origin + 31, origin + 5, 40, 60);
    for (int j = 0; j < 60; ++j)
      for (int i = 0; i < 40; ++i) ASSERT_EQ(part[rowMajorIndex(i, j, 40)], whole[rowMajorIndex(i + 31, j + 5, 100)]);
  }
}

}  // namespace
}  // namespace glint::wang_test
