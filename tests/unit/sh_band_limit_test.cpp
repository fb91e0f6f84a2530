#include "glint/query/light/sh_band_limit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "glint/bake/sh/light.h"
#include "glint/bake/sh/lobes.h"
#include "glint/query/light/sh_light_query.h"
#include "support/light_reference.h"

namespace glint::sh_band_limit_test {
namespace {

using test::FixedHistogram;

constexpr float kSigma = 0.05f;
constexpr int kOrder = 60;
constexpr float kEpsilon = 1e-6f;  // the paper's

/// Normals on a fine grid of the disk, weighted by a Gaussian: no gaps that a lobe of kSigma would show.
FixedHistogram smoothNormals(float deviation) {
  FixedHistogram histogram;
  const float step = 0.5f * kSigma, reach = 5.3f * deviation;
  float total = 0;
  for (float y = -reach; y <= reach; y += step) {
    for (float x = -reach; x <= reach; x += step) {
      if (x * x + y * y > reach * reach) continue;
      histogram.normals.push_back({x, y});
      histogram.weights.push_back(std::exp(-0.5f * (x * x + y * y) / (deviation * deviation)));
      total += histogram.weights.back();
    }
  }
  for (float& w : histogram.weights) w /= total;
  return histogram;
}

FixedHistogram scatteredNormals(int count, float deviation) {
  FixedHistogram histogram;
  std::mt19937 random(7);
  std::normal_distribution<float> slope(0, deviation);
  for (int k = 0; k < count; ++k) {
    const float x = slope(random), y = slope(random), scale = 1 / std::sqrt(1 + x * x + y * y);
    histogram.normals.push_back({scale * x, scale * y});
    histogram.weights.push_back(1.0f / static_cast<float>(count));
  }
  return histogram;
}

Vec3 normalOf(Vec2 n) { return {n.x, n.y, std::sqrt(1 - dot(n, n))}; }

ShBandLimit limitOf(const FixedHistogram& histogram, int order) {
  ShBandLimit limit(order);
  for (std::size_t k = 0; k < histogram.normals.size(); ++k) limit.add(normalOf(histogram.normals[k]), histogram.weights[k]);
  return limit;
}

/// |Y_l| from all coefficients.
std::vector<double> bruteForceNorms(const FixedHistogram& histogram, int order) {
  std::vector<double> memory(ShRecurrence<double>::size(order)), sums(shCount(order)),
      scratch(ShAccumulator<double>::scratchSize(order));
  const ShRecurrence<double> recurrence(order, memory);
  ShAccumulator<double> harmonics(recurrence, order, sums, scratch);
  for (std::size_t k = 0; k < histogram.normals.size(); ++k)
    harmonics.add(normalOf(histogram.normals[k]), histogram.weights[k]);
  harmonics.flush();
  std::vector<double> norms;
  for (int l = 0; l <= order; ++l) {
    double square = 0;
    for (std::size_t k = shIndex(l, 0); k < shIndex(l + 1, 0); ++k) square += sums[k] * sums[k];
    norms.push_back(std::sqrt(square));
  }
  return norms;
}

TEST(ShBandLimit, NormsAreThoseOfAllCoefficientsWithinTheSafety) {
  for (const FixedHistogram& histogram :
       {smoothNormals(0.06f), smoothNormals(0.12f), scatteredNormals(1, 0.2f), scatteredNormals(40, 0.2f)}) {
    const ShBandLimit limit = limitOf(histogram, kOrder);
    const std::vector<double> norms = bruteForceNorms(histogram, kOrder);
    for (int l = 0; l <= kOrder; ++l) {
      EXPECT_GT(ShBandLimit::kSafety * limit.norm(l), norms[static_cast<std::size_t>(l)] * (1 - 1e-9)) << l;
      EXPECT_LT(limit.norm(l), 2.5 * norms[static_cast<std::size_t>(l)] + 1e-12) << l;
    }
  }
}

TEST(ShBandLimit, NothingBeyondTheLastBandIsAboveEpsilon) {
  const std::vector<double> f = bake::zonalLobe(kSigma, kOrder);
  const std::vector<float> zonal(f.begin(), f.end());
  int before = kOrder + 1;
  for (const float deviation : {0.03f, 0.06f, 0.09f, 0.12f}) {
    const FixedHistogram histogram = smoothNormals(deviation);
    const int last = limitOf(histogram, kOrder).last(zonal, kEpsilon);
    const std::vector<double> norms = bruteForceNorms(histogram, kOrder);
    for (int l = last + 1; l <= kOrder; ++l)
      EXPECT_LE(zonalFactor(l, zonal[static_cast<std::size_t>(l)]) * norms[static_cast<std::size_t>(l)],
                kEpsilon * zonalFactor(0, zonal[0]) * norms[0])
          << deviation << " " << l;
    std::printf("deviation %.2f: band %d\n", static_cast<double>(deviation), last);
    EXPECT_LE(last, before);  // broader distributions need fewer bands
    before = last;
  }
  EXPECT_LT(before, 0.8 * kOrder);
  // A single facet has the bands of its lobe.
  EXPECT_EQ(limitOf(scatteredNormals(1, 0.2f), kOrder).last(zonal, kEpsilon), kOrder);
}

/// The light of a studio, asked with and without the band limit.
class Studio {
 public:
  Studio()
      : table_(bake::buildShLight(test::testEnvironment(test::TestLight::studio, 64), {.order = kOrder, .grid = {9, 16}})) {
    const std::vector<double> f = bake::zonalLobe(kSigma, kOrder);
    zonal_.assign(f.begin(), f.end());
    memory_.resize(ShRecurrence<float>::size(kOrder));
    recurrence_ = ShRecurrence<float>(kOrder, memory_);
    scratch_.resize(ShLightQuery<float>::scratchSize(kOrder));
  }
  ShLightIntegral ask(const FixedHistogram& histogram, float epsilon) {
    const Vec3 wo = test::unit({0.3f, 0.2f, 0.9f});
    return ShLightQuery<float>(table_.view(), zonal_, recurrence_, kSigma)
        .integral(histogram, Footprint::isotropic({0.5f, 0.5f}, 8), {}, wo, {.ndf_epsilon = epsilon}, scratch_);
  }

 private:
  bake::ShLightData table_;
  std::vector<float> zonal_, memory_, scratch_;
  ShRecurrence<float> recurrence_;
};

TEST(ShBandLimit, SmoothPixelsSumFewerBandsAndAnswerTheSame) {
  Studio studio;
  const FixedHistogram smooth = smoothNormals(0.12f), glints = scatteredNormals(12, 0.2f);
  const ShLightIntegral all = studio.ask(smooth, 0), few = studio.ask(smooth, kEpsilon);
  EXPECT_EQ(all.order, kOrder);
  EXPECT_LT(few.order, 0.8 * kOrder);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(few.value[c], all.value[c], 1e-4f * all.value[c]);
  // Glints have all bands, and lose nothing.
  const ShLightIntegral sharp = studio.ask(glints, kEpsilon), whole = studio.ask(glints, 0);
  EXPECT_EQ(sharp.order, kOrder);
  for (int c = 0; c < 3; ++c) EXPECT_EQ(sharp.value[c], whole.value[c]);
  // A coarser epsilon leaves out more, and changes the answer by more.
  EXPECT_LT(studio.ask(smooth, 1e-2f).order, few.order);
}

}  // namespace
}  // namespace glint::sh_band_limit_test
