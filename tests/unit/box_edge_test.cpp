#include "glint/query/detail/pyramid/box_edge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "glint/bake/pyramid/pyramid.h"
#include "glint/query/detail/pyramid/block_cover.h"
#include "glint/query/pyramid_ndf.h"
#include "support/test_maps.h"

namespace glint::box_edge_test {
namespace {

/// Sums of whole pixels of one axis of a block, 0 to 16 of them.
class Sums {
 public:
  explicit Sums(unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> unit(0, 1);
    for (int k = 0; k < kBlockSize; ++k) pixels_.push_back(unit(random));
  }
  float pixel(int k) const { return k < 0 || k >= kBlockSize ? 0.0f : pixels_[static_cast<std::size_t>(k)]; }
  float below(int end) const {
    float sum = 0;
    for (int k = 0; k < end; ++k) sum += pixel(k);
    return sum;
  }
  float between(float low, float high, Pixels kind) const {
    return sumBetween(BoxEdge(low, kind), BoxEdge(high, kind), [&](int k) { return below(k); });
  }
  /// The density at a position, pixels: a parabola with the mean of the neighbours as its value at a border.
  double density(double x) const {
    const int k = static_cast<int>(std::floor(x));
    const double t = x - k, here = pixel(k), low = 0.5 * (pixel(k - 1) + here), high = 0.5 * (here + pixel(k + 1));
    return low * (1 - t) + high * t + 6 * (here - 0.5 * (low + high)) * t * (1 - t);
  }

 private:
  std::vector<float> pixels_;
};

constexpr Pixels kKinds[] = {Pixels::smooth, Pixels::constant};

TEST(BoxEdge, IsExactBetweenBordersOfPixels) {
  const Sums sums(1);
  for (const Pixels kind : kKinds)
    for (int low = -3; low < 20; ++low)
      for (int high = low; high < 20; ++high)
        EXPECT_FLOAT_EQ(sums.between(static_cast<float>(low), static_cast<float>(high), kind),
                        sums.below(std::clamp(high, 0, 16)) - sums.below(std::clamp(low, 0, 16)))
            << low << ' ' << high;
}

TEST(BoxEdge, OfConstantPixelsCountsCoveredParts) {
  const Sums sums(2);
  EXPECT_NEAR(sums.between(3.25f, 5.5f, Pixels::constant), 0.75f * sums.pixel(3) + sums.pixel(4) + 0.5f * sums.pixel(5), 1e-6);
}

TEST(BoxEdge, OfSmoothPixelsIntegratesTheParabolas) {
  constexpr int kSteps = 2000;
  const Sums sums(3);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> position(-1, 17);  // the pixels beside the block are 0
  for (int round = 0; round < 200; ++round) {
    const double low = position(random), high = position(random);
    double integral = 0;
    for (int step = 0; step < kSteps; ++step) integral += sums.density(low + (high - low) * (step + 0.5) / kSteps);
    integral *= (high - low) / kSteps;
    EXPECT_NEAR(sums.between(static_cast<float>(low), static_cast<float>(high), Pixels::smooth), integral, 1e-4)
        << low << ' ' << high;
  }
}

TEST(BoxEdge, CoversOfBlocksHaveTheSameSums) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> position(-2, 18), unit(0, 1);
  float block[kBlockPixels];
  for (float& pixel : block) pixel = unit(random);
  for (int round = 0; round < 2000; ++round) {
    const Pixels kind = kKinds[random() % 2];
    // Some edges are on borders of pixels, and some boxes are inside one pixel.
    const auto edges = [&](BoxEdge& low, BoxEdge& high) {
      float from = position(random), to = random() % 2 ? from + unit(random) : position(random);
      if (random() % 3 == 0) from = std::floor(from);
      if (random() % 3 == 0) to = std::ceil(to);
      low = BoxEdge(std::min(from, to), kind);
      high = BoxEdge(std::max(from, to), kind);
    };
    BlockBox box;
    edges(box.x0, box.x1);
    edges(box.y0, box.y1);
    BlockCover cover;
    cover.set(box);
    const float* blocks[] = {block};
    const float weight = 1;
    const float expected = sumBetween(box.y0, box.y1, [&](int end) {
      float sum = 0;
      for (int y = 0; y < end; ++y)
        sum += sumBetween(box.x0, box.x1, [&](int last) {
          float row = 0;
          for (int x = 0; x < last; ++x) row += block[y * kBlockSize + x];
          return row;
        });
      return sum;
    });
    ASSERT_NEAR(cover.sumByFour(blocks, &weight, 1), expected, 2e-4) << round;
    if (cover.isWhole()) {
      ASSERT_NEAR(std::accumulate(block, block + kBlockPixels, 0.0f), expected, 2e-4);
    }
  }
}

TEST(BoxEdge, BlocksAreVisitedAsFarAsEdgesReach) {
  // The whole plane of pixels, against the sums of blocks that forEachBlock visits.
  PyramidShape shape;
  shape.resolution = 64;
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(0, 1);
  std::vector<float> image(64 * 64);
  for (float& pixel : image) pixel = unit(random);
  const auto sumOf = [&](const Box2& range, Pixels kind, bool all) {
    double sum = 0;
    const auto add = [&](int block, const BlockBox& box) {
      float pixels[kBlockPixels];
      for (int y = 0; y < kBlockSize; ++y)
        std::copy_n(image.begin() + (block / 4 * kBlockSize + y) * 64 + block % 4 * kBlockSize, kBlockSize,
                    pixels + y * kBlockSize);
      BlockCover cover;
      cover.set(box);
      const float* blocks[] = {pixels};
      const float weight = 1;
      sum += double{cover.sumByFour(blocks, &weight, 1)};
    };
    if (!all) {
      forEachBlock(shape, range, kind, add);
      return sum;
    }
    for (int block = 0; block < 16; ++block) {
      const auto edge = [&](float h, int first) {
        return BoxEdge((h + 1) * 32 - static_cast<float>(first * kBlockSize), kind);
      };
      add(block, {edge(range.low.x, block % 4), edge(range.high.x, block % 4), edge(range.low.y, block / 4),
                  edge(range.high.y, block / 4)});
    }
    return sum;
  };
  for (int round = 0; round < 3000; ++round) {
    const Pixels kind = kKinds[random() % 2];
    const auto position = [&] {  // often near a border of blocks, and often on a border of pixels
      const float near = static_cast<float>(random() % 5) * kBlockSize + 3 * (unit(random) - 0.5f);
      const float at = random() % 2 ? near : 64 * unit(random);
      return std::clamp((random() % 2 ? std::round(at) : at) / 32 - 1, -1.0f, 1.0f);
    };
    const float a = position(), b = position(), c = position(), d = position();
    const Box2 range = {{std::min(a, b), std::min(c, d)}, {std::max(a, b), std::max(c, d)}};
    if (!(range.width() > 0 && range.height() > 0)) continue;
    ASSERT_NEAR(sumOf(range, kind, false), sumOf(range, kind, true), 1e-3) << round;
  }
}

TEST(BoxEdge, MeansOfSmallBoxesErrLessWithSmoothPixels) {
  // One texel of sigma_r .64 pixels, as a map of one direction, seen through boxes of a quarter of a pixel to two pixels.
  constexpr float kSigma = 0.02f;
  constexpr int kResolution = 64, kBoxes = 400;
  const Vec2 normal = {0.113f, -0.237f};
  const test::OwnedMap map(8, 8, std::vector<Vec2>(64, normal));
  bake::PyramidOptions options;
  options.stride = 4;
  options.resolution = kResolution;
  options.sigma_r = kSigma;
  options.levels = 1;
  const bake::NdfPyramidData data = bake::buildPyramid(map.map(), options);
  const PyramidNdf smooth(data.view()), constant(data.view(), Interpolation::footprint, Pixels::constant);
  std::mt19937 random(5);
  std::uniform_real_distribution<float> unit(0, 1);
  struct Case {
    float side;  // pixels
    double of_smooth, of_constant;
  };
  for (const auto& [side, expected_smooth, expected_constant] :
       {Case{0.25f, 0.185, 0.37}, Case{1, 0.09, 0.185}, Case{2, 0.054, 0.14}}) {
    double errors[2] = {}, squares = 0;
    for (int k = 0; k < kBoxes; ++k) {
      const Vec2 low = {normal.x + 0.16f * (unit(random) - 0.5f), normal.y + 0.16f * (unit(random) - 0.5f)};
      const Vec2 size = {side * 2 / kResolution, side * 2 / kResolution};
      const auto share = [&](double a, double b, double at) {
        return 0.5 * (std::erf((b - at) / (kSigma * std::sqrt(2.0))) - std::erf((a - at) / (kSigma * std::sqrt(2.0))));
      };
      const double truth = share(low.x, low.x + size.x, normal.x) * share(low.y, low.y + size.y, normal.y) / (size.x * size.y);
      const Footprint p = Footprint::isotropic({0.4f, 0.6f}, 2);
      errors[0] += std::pow(smooth.mean(p, {low, low + size}) - truth, 2);
      errors[1] += std::pow(constant.mean(p, {low, low + size}) - truth, 2);
      squares += truth * truth;
    }
    const double of_smooth = std::sqrt(errors[0] / squares), of_constant = std::sqrt(errors[1] / squares);
    EXPECT_NEAR(of_smooth, expected_smooth, 0.01) << side;
    EXPECT_NEAR(of_constant, expected_constant, 0.01) << side;
  }
}

}  // namespace
}  // namespace glint::box_edge_test
