#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "glint/bake/compressed/floors.h"
#include "glint/query/detail/compressed/pixel_floors.h"

namespace glint::bake::compress_floors_test {
namespace {

constexpr float kDensity = 30;  // of a pixel of 1

BlockScale slope() {
  BlockScale scale;
  for (int t = 0; t < kBlockSize; ++t) scale.x[t] = std::exp(0.1f * static_cast<float>(t)), scale.y[t] = 1;
  return scale;
}

/// Slices in which few pixels are lit, and their decoded forms, which are off by noise.
struct NoisySlices {
  NoisySlices(int count, float lit, float noise) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit(0, 1);
    std::normal_distribution<float> normal;
    for (int s = 0; s < count; ++s) {
      std::vector<float> slice(kBlockPixels), decoded(kBlockPixels);
      for (int p = 0; p < kBlockPixels; ++p) {
        slice[static_cast<std::size_t>(p)] = unit(random) < lit ? unit(random) : 0;
        decoded[static_cast<std::size_t>(p)] = slice[static_cast<std::size_t>(p)] + noise * normal(random);
      }
      slices.push_back(slice);
      images.push_back(decoded);
    }
  }

  /// Mean density of a cell, of the slices and of their decoded forms less a floor.
  struct Means {
    double truth = 0, shown = 0, error2 = 0;
  };
  Means meansOf(const BlockScale& scale, int cell, float floor) const {
    Means means;
    for (std::size_t s = 0; s < slices.size(); ++s) {
      for (int p = 0; p < kBlockPixels; ++p) {
        if (floorCell(p % kBlockSize, p / kBlockSize) != cell) continue;
        const auto at = static_cast<std::size_t>(p);
        const double unscale = kDensity / (scale.x[p % kBlockSize] * scale.y[p / kBlockSize]),
                     count = 16.0 * static_cast<double>(slices.size());
        const double truth = unscale * slices[s][at], shown = std::max(0.0, unscale * images[s][at] - floor);
        means.truth += truth / count;
        means.shown += shown / count;
        means.error2 += (shown - truth) * (shown - truth) / count;
      }
    }
    return means;
  }
  std::vector<std::vector<float>> slices, images;
};

ClusterFloors floorsOf(const NoisySlices& noisy, const BlockScale& scale) {
  FloorFinder finder(scale, kDensity);
  for (std::size_t s = 0; s < noisy.slices.size(); ++s) finder.add(noisy.slices[s].data(), noisy.images[s].data());
  return finder.find();
}

TEST(FloorFinder, KeepsTheMeanOfEveryCell) {
  constexpr double kCodes = 0.04;  // of a floor: codes are a sixteenth apart, and bins are taken as even
  const BlockScale scale = slope();
  for (const float lit : {0.01f, 0.1f, 0.5f}) {
    const NoisySlices noisy(300, lit, 0.03f);
    const ClusterFloors floors = floorsOf(noisy, scale);
    for (int cell = 0; cell < kFloorCells; ++cell) {
      const auto with = noisy.meansOf(scale, cell, floors.at(cell)), without = noisy.meansOf(scale, cell, 0);
      EXPECT_NEAR(with.shown, with.truth, kCodes * floors.at(cell)) << lit << " cell " << cell;
      EXPECT_GT(without.shown - without.truth, 3 * std::abs(with.shown - with.truth)) << lit << " cell " << cell;
      EXPECT_LT(with.error2, without.error2) << lit << " cell " << cell;
    }
  }
}

TEST(FloorFinder, TakesNothingOffWhereNothingIsTooMuch) {
  NoisySlices exact(50, 0.2f, 0);
  for (auto& image : exact.images)
    for (float& pixel : image) pixel *= 0.9f;
  const ClusterFloors floors = floorsOf(exact, slope());
  for (int cell = 0; cell < kFloorCells; ++cell) EXPECT_EQ(floors.at(cell), 0) << cell;
}

TEST(FloorFinder, TakesEverythingOffADarkCell) {
  NoisySlices dark(50, 0, 0.1f);
  const BlockScale scale = slope();
  const ClusterFloors floors = floorsOf(dark, scale);
  for (int cell = 0; cell < kFloorCells; ++cell) {
    const auto means = dark.meansOf(scale, cell, floors.at(cell));
    EXPECT_EQ(means.truth, 0);
    EXPECT_LT(means.shown, 1e-3 * dark.meansOf(scale, cell, 0).shown) << cell;
  }
}

TEST(PixelFloors, AreThoseOfTheCellsThatPixelsLieIn) {
  std::vector<NdfCluster> clusters(2);
  clusters[1].floor_unit = 0x3c00;  // 1
  std::vector<std::uint8_t> codes(2 * kFloorCells);
  for (int cell = 0; cell < kFloorCells; ++cell)
    codes[static_cast<std::size_t>(kFloorCells + cell)] = static_cast<std::uint8_t>(100 + cell);
  NdfCp ndf;
  ndf.clusters = clusters;
  ndf.floors = codes;
  const PixelFloors floors(ndf, clusters[1]);
  const auto inside = [](int p) { return std::clamp(p, 0, kBlockSize - 1); };
  for (int y = -2; y < kBlockSize; ++y) {
    for (int x = -2; x < kBlockSize; ++x) {
      Float4 rows[PixelWindow::kSize];
      floors.window(x, y, rows);
      for (int j = 0; j < PixelWindow::kSize; ++j) {
        float lanes[4];
        rows[j].store(lanes);
        for (int i = 0; i < PixelWindow::kSize; ++i)
          EXPECT_EQ(lanes[i], floors.at(inside(x + i), inside(y + j))) << x << ' ' << y;
      }
    }
  }
  for (int y = 0; y < kBlockSize; ++y) {
    float row[kBlockSize], sums[kBlockSize], sum = 0;
    floors.row(y).store(row);
    floors.rowSums().store(sums);
    for (int x = 0; x < kBlockSize; ++x) {
      EXPECT_EQ(row[x], blockMass(static_cast<std::uint8_t>(100 + floorCell(x, y))));
      sum += row[x];
    }
    EXPECT_FLOAT_EQ(sums[y], sum);
  }
}

}  // namespace
}  // namespace glint::bake::compress_floors_test
