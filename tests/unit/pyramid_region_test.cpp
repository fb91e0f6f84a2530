#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "glint/bake/pyramid/join.h"
#include "glint/bake/pyramid/pyramid.h"
#include "support/test_maps.h"

namespace glint::pyramid_region_test {
namespace {

bake::PyramidOptions smallImages(Surface surface, float stride) {
  bake::PyramidOptions options;
  options.stride = stride;
  options.resolution = 32;
  options.sigma_r = 0.05f;
  options.surface = surface;
  return options;
}

TEST(PyramidRegion, EveryRowIsInOneRegion) {
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    const PyramidShape shape = bake::pyramidShape(100, 300, smallImages(surface, 4));
    for (const int count : {1, 2, 3, 7, 64, kMostRegions}) {
      for (int l = 0; l < shape.level_count; ++l) {
        int next = 0;
        for (int index = 1; index <= count; ++index) {
          const ImageRows rows = regionRows(shape, l, {index, count});
          if (rows.count() == 0) continue;
          EXPECT_EQ(rows.first, next);
          next = rows.end;
        }
        EXPECT_EQ(next, shape.levels[l].rows) << "level " << l << " in " << count << " regions";
      }
    }
  }
}

TEST(PyramidRegion, RowsOfFlatSurfacesLieInTheirBand) {
  const PyramidShape shape = bake::pyramidShape(64, 200, smallImages(Surface::flat, 4));
  constexpr int kCount = 5;
  for (int l = 0; l < shape.footprintLevels(); ++l) {
    for (int index = 1; index <= kCount; ++index) {
      const ImageRows rows = regionRows(shape, l, {index, kCount});
      for (int j = rows.first; j < rows.end; ++j) {
        const float band = shape.centre(l, 0, j).y * kCount / 200;
        EXPECT_GE(band, static_cast<float>(index - 1) - 1e-4f);  // rounding of the centre
        EXPECT_LE(band, static_cast<float>(index) + 1e-4f);
      }
    }
  }
}

/// Compares the blocks of a pyramid with those of its shards, one after the other.
void expectJoined(const NormalMap& map, const bake::PyramidOptions& options, int count) {
  const bake::NdfPyramidData whole = bake::buildPyramid(map, options);
  std::vector<bake::NdfPyramidShardData> shards;
  for (int index = 1; index <= count; ++index) shards.push_back(bake::buildPyramidShard(map, options, {index, count}));
  std::vector<NdfPyramidShard> views;
  for (const auto& shard : shards) views.push_back(shard.view());
  const PyramidShape shape = bake::joinedShape(views);
  ASSERT_EQ(shape.level_count, whole.shape.level_count);
  for (int l = 0; l < shape.level_count; ++l) {
    const auto from = static_cast<std::size_t>(bake::levelInShards(views.front(), shape, l));
    std::vector<std::uint64_t> masks;
    std::vector<std::uint16_t> pixels;
    for (const auto& shard : shards) {
      const auto& level = shard.images.levels[from];
      masks.insert(masks.end(), level.masks.begin(), level.masks.end());
      pixels.insert(pixels.end(), level.half_pixels.begin(), level.half_pixels.end());
    }
    const auto& expected = whole.levels[static_cast<std::size_t>(l)];
    EXPECT_EQ(masks, expected.masks);
    EXPECT_EQ(pixels, expected.half_pixels);
    EXPECT_TRUE(std::ranges::equal(bake::joinedRanks(views, static_cast<int>(from)), expected.mask_ranks));
    EXPECT_EQ(shape.levels[l].stride, whole.shape.levels[l].stride);
  }
}

TEST(PyramidRegion, ShardsAreThePyramid) {
  const test::OwnedMap map(96, 160, test::roughSurface(96, 160, 0.3f));
  expectJoined(map.map(), smallImages(Surface::flat, 8), 3);
  expectJoined(map.map(), smallImages(Surface::smooth, 4), 3);
  bake::PyramidOptions given = smallImages(Surface::smooth, 4);
  given.levels = 1;
  given.boundary = Boundary::clamp;
  expectJoined(map.map(), given, 4);
}

TEST(PyramidRegion, WideMapsAreDividedToo) {
  const test::OwnedMap map(160, 96, test::roughSurface(160, 96, 0.3f));
  expectJoined(map.map(), smallImages(Surface::flat, 8), 4);
  expectJoined(map.map(), smallImages(Surface::smooth, 4), 2);
}

TEST(PyramidRegion, TexelsThatAreNotReachedAreNotRead) {
  // Where they were read, steep normals in their place would show in the images.
  constexpr int kHeight = 512;
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    std::vector<Vec2> normals = test::roughSurface(64, kHeight, 0.3f);
    const test::OwnedMap whole(64, kHeight, normals);
    bake::PyramidOptions options = smallImages(surface, 4);
    options.levels = 2;
    // Region 1 of 4 has no image of the mean of the map.
    const PyramidRegion region = {1, 4};
    const auto reached = bake::rowsReached(bake::pyramidShape(64, kHeight, options), region);
    std::size_t spared = 0;
    for (int j = 0; j < kHeight; ++j) {
      if (reached[static_cast<std::size_t>(j)] != 0) continue;
      ++spared;
      for (int i = 0; i < 64; ++i) normals[static_cast<std::size_t>(j) * 64 + static_cast<std::size_t>(i)] = {0.9f, 0.3f};
    }
    EXPECT_GT(spared, std::size_t{kHeight} / 2);
    const test::OwnedMap changed(64, kHeight, normals);
    NormalMap map = changed.map();
    map.slopes = MapSlopes{};
    NormalMap original = whole.map();
    original.slopes = MapSlopes{};
    const auto a = bake::buildPyramidShard(original, options, region), b = bake::buildPyramidShard(map, options, region);
    for (std::size_t l = 0; l < a.images.levels.size(); ++l)
      EXPECT_EQ(a.images.levels[l].half_pixels, b.images.levels[l].half_pixels);
  }
}

}  // namespace
}  // namespace glint::pyramid_region_test
