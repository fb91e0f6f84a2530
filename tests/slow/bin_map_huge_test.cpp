#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "glint/bake/bin_map/bin_map.h"
#include "glint/formats/asset_reader.h"
#include "glint/formats/asset_writer.h"
#include "glint/formats/validate.h"
#include "glint/query/bin_map_ndf.h"
#include "support/bin_weights.h"
#include "support/temp_folder.h"

namespace glint {
namespace {

constexpr int kSize = 16384;

/// Independent normals of tilts up to 37 degrees, from a hash of the texel's place.
std::vector<Vec2> hashedNormals() {
  std::vector<Vec2> normals(std::size_t{kSize} * kSize);
  tbb::parallel_for(0, kSize, [&](int j) {
    for (int i = 0; i < kSize; ++i) {
      const std::size_t k = static_cast<std::size_t>(j) * kSize + static_cast<std::size_t>(i);
      std::uint64_t x = (k + 1) * 0x9e3779b97f4a7c15;
      x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9;
      x = (x ^ (x >> 27)) * 0x94d049bb133111eb;
      const auto unit = [&](int shift) { return static_cast<float>(x >> shift & 0xffffff) * 0x1p-24f; };
      const float radius = 0.6f * std::sqrt(unit(0)), angle = 6.2831853f * unit(32);
      normals[k] = {radius * std::cos(angle), radius * std::sin(angle)};
    }
  });
  return normals;
}

// Coordinates of 14 bits each leave two for the place in a bin: the largest map. Needs 6 GB of memory and 1.6 GB on disk.
TEST(HugeBinMap, WeightsOf268MillionTexelsEqualBruteForce) {
  const std::vector<Vec2> normals = hashedNormals();
  NormalMap map;
  map.width = map.height = kSize;
  map.normals = normals;
  const test::TempFolder folder;
  for (const float alpha : {0.01f, 0.16f}) {
    const std::filesystem::path path = folder / "huge.glint";
    formats::writeAsset(path, bake::buildBinMap(map, {alpha, 8}).view(), {}, {.overwrite = true});
    const formats::Asset asset = formats::Asset::open(path, {.verify_hashes = true});
    for (const formats::Finding& finding : formats::validateAsset(path).findings)
      ADD_FAILURE() << finding.rule << finding.message;
    const BinMapNdf ndf(asset.get<BinMap>());
    EXPECT_LT(std::filesystem::file_size(path), 6 * normals.size());
    std::mt19937 random(3);
    const auto unit = [&] { return static_cast<float>(random() >> 8) * 0x1p-24f; };
    for (const float side : {3.0f, 40.0f, 300.0f, 1500.0f}) {
      for (int k = 0; k < (side > 1000 ? 2 : 8); ++k) {
        // Half of them across the corner of the map, where columns and rows have all bits set.
        const Vec2 centre = k % 2 == 0 ? Vec2{unit(), unit()} : Vec2{0.99999f, 0.99999f};
        const float a = k % 4 < 2 ? 0 : unit(), c = 0.5f * side * std::cos(a), s = 0.5f * side * std::sin(a);
        test::expectWeights(map, ndf, Footprint::box(centre, {c, s}, {-s, c}), normals[random() % normals.size()]);
      }
    }
    // The whole map: counts beyond what 16 bits, and sums beyond what 24 bits hold.
    const BinWeights all = ndf.weights(Footprint::box({0.5f, 0.5f}, {kSize / 2.0f, 0}, {0, kSize / 2.0f}), {0.1f, 0.2f});
    for (int k = 0; k < all.count; ++k) {
      const std::uint32_t bins = static_cast<std::uint32_t>(ndf.map().bins_per_axis);
      const auto inside = [&](std::uint32_t bin, float x) {
        return std::floor((x + 1) * 0.5f * static_cast<float>(bins)) == static_cast<float>(bin);
      };
      std::uint64_t count = 0;
      if (k % 7 != 0) continue;
      for (const Vec2 n : normals) count += inside(all.bins[k] % bins, n.x) && inside(all.bins[k] / bins, n.y);
      EXPECT_DOUBLE_EQ(all.weights[k] * static_cast<double>(normals.size()), static_cast<double>(count));
    }
  }
}

}  // namespace
}  // namespace glint
