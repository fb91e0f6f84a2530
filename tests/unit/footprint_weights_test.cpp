// What footprints weigh, before any normal is asked.
#include "glint/query/detail/common/footprint_weights.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "glint/math/gaussian.h"
#include "glint/query/anisotropic_ndf.h"
#include "glint/query/detail/bin_map/texel_cover.h"

namespace glint::footprint_weights_test {
namespace {

constexpr int kSize = 2048;
constexpr double kLeastVariance = double{kMinSigmaTexels} * kMinSigmaTexels;

/// A line of texels along a diagonal, of no width: it is widened to kMinSigmaTexels.
struct Diagonal {
  explicit Diagonal(float variance)
      : footprint(Footprint::gaussian({0.3f, 0.6f}, {variance, variance, variance})), along(2.0 * variance + kLeastVariance) {}
  double weight(double dx, double dy) const {
    return std::exp(-0.25 * ((dx - dy) * (dx - dy) / kLeastVariance + (dx + dy) * (dx + dy) / along));
  }
  double rootDeterminant() const { return std::sqrt(along * kLeastVariance); }
  Footprint footprint;
  double along;  ///< variance
};

TEST(FootprintWeights, LongGaussiansKeepTheirWidth) {
  std::mt19937 random(1);
  for (const float variance : {100.0f, 5e4f, 5e5f, 2e6f, 4e6f}) {
    SCOPED_TRACE(variance);
    const Diagonal line(variance);
    const FootprintWeights weights(line.footprint, kSize, kSize);
    EXPECT_NEAR(weights.closedFormTotal(), 2 * kPi * line.rootDeterminant(), 1e-5 * weights.closedFormTotal());
    std::uniform_real_distribution<double> place(-2.5 * std::sqrt(variance), 2.5 * std::sqrt(variance));
    double sum = 0;
    for (int k = 0; k < 20000; ++k) {
      const int i = static_cast<int>(weights.centre().x + place(random)) + static_cast<int>(random() % 5) - 2;
      const int j = static_cast<int>(static_cast<float>(i) - weights.centre().x + weights.centre().y);
      const double expected = line.weight(i + 0.5 - weights.centre().x, j + 0.5 - weights.centre().y);
      ASSERT_NEAR(weights.texel(i, j), expected, 3e-3) << i << ' ' << j;
      sum += expected;
    }
    EXPECT_GT(sum, 3000);
    const auto row = weights.gaussianLine(weights.centre().y + 30);
    EXPECT_NEAR(row.mean, weights.centre().x + 30, 1e-3 * 30);
    EXPECT_NEAR(row.sigma, std::sqrt(2 * kLeastVariance), 1e-3);
  }
}

TEST(TexelCover, LongGaussiansKeepTheirWidth) {
  // The parallelogram of the same moments, or one turn along the diagonal of the map.
  const double width = 2 * std::sqrt(3.0) * kMinSigmaTexels, turn = std::sqrt(2.0) * kSize;
  for (const float variance : {100.0f, 5e4f, 5e5f, 2e6f, 4e6f}) {
    const Diagonal line(variance);
    const double area = std::min(12 * line.rootDeterminant(), width * turn);
    EXPECT_NEAR(TexelCover(line.footprint, kSize, kSize).area(), area, 1e-5 * area) << variance;
  }
}

TEST(IsotropicParts, LongGaussiansKeepTheirWidth) {
  const PrincipalAxes axes = principalAxes(usableCovariance({2e6f, 2e6f, 2e6f}, kSize, kSize));
  EXPECT_NEAR(axes.shortest, kMinSigmaTexels, 1e-5f);
  EXPECT_NEAR(axes.longest, 2000, 0.01f);
  EXPECT_NEAR(axes.x, std::sqrt(0.5), 1e-6);
}

TEST(PrincipalAxes, AreThoseOfTheCovariance) {
  constexpr double kRounding = 1e-12;  // relative, of doubles
  for (int k = 0; k < 64; ++k) {
    const double angle = (k - 32) * 0.05, c = std::cos(angle), s = std::sin(angle), a2 = 900, b2 = 4;
    const UsableCovariance covariance = {a2 * c * c + b2 * s * s, (a2 - b2) * c * s, a2 * s * s + b2 * c * c};
    const PrincipalAxes axes = principalAxes(covariance);
    EXPECT_NEAR(axes.longest, 30, 30 * kRounding) << angle;
    EXPECT_NEAR(axes.shortest, 2, 900 * kRounding) << angle;
    EXPECT_NEAR(axes.x * s - axes.y * c, 0, kRounding) << angle;
    EXPECT_NEAR(std::hypot(axes.x, axes.y), 1, kRounding) << angle;
    const AxisPair pair = deviationsOf(covariance);
    EXPECT_NEAR(pair.a[0] * pair.a[1] + pair.b[0] * pair.b[1], covariance.xy, 900 * kRounding) << angle;
  }
  const PrincipalAxes along_v = principalAxes({4, 0, 900});
  EXPECT_EQ(along_v.x, 0);
  EXPECT_EQ(along_v.y, 1);
}

TEST(FootprintWeights, OfEvenGaussiansCountEachTexelOnce) {
  constexpr float kRounding = 1e-4f;
  const struct {
    int width, height;
    Covariance covariance;
    bool even;
  } cases[] = {{70, 4, {4900, 0, 4900}, true},      {4, 70, {1e12f, 0, 1e12f}, true},    {31, 17, {2000, 300, 2000}, true},
               {31, 17, {2000, 1900, 2000}, false}, {70, 4, {4000, 0, 4000}, false},     {1, 1, {1, 0, 1}, true},
               {2048, 2048, {5e6f, 0, 5e6f}, true}, {2048, 2048, {5e6f, 0, 4e6f}, false}};
  for (const auto& c : cases) {
    SCOPED_TRACE(std::to_string(c.width) + " " + std::to_string(c.covariance.yy));
    const FootprintWeights weights(Footprint::gaussian({0.3f, 0.9f}, c.covariance), c.width, c.height);
    EXPECT_EQ(weights.isBox(), c.even);
    const FootprintWeights clamped(Footprint::gaussian({0.3f, 0.9f}, c.covariance), c.width, c.height, Boundary::clamp);
    EXPECT_FALSE(clamped.isBox());
    if (!c.even) continue;
    EXPECT_EQ(weights.closedFormTotal(), c.width * c.height);
    for (int j = weights.row_begin; j < weights.row_end; ++j) {
      for (int i = weights.column_begin; i<weights.column_end; i += c.width> 1000 && i < c.width - 2 ? 97 : 1) {
        const bool inside = i >= 0 && i < c.width && j >= 0 && j < c.height;
        ASSERT_NEAR(weights.texel(i, j), inside ? 1 : 0, kRounding) << i << ' ' << j;
      }
    }
  }
}

TEST(FootprintWeights, CentresCloseBelow0AreAtTheEndOfTheMap) {
  EXPECT_EQ(wrapUnit(-1e-9f), kBelowOne);
  EXPECT_EQ(wrapUnit(-0.25f), 0.75f);
  EXPECT_EQ(wrapUnit(3.25f), 0.25f);
  EXPECT_EQ(wrapUnit(1), 0);
  EXPECT_EQ(wrapUnit(std::nanf("")), 0);
  EXPECT_EQ(wrapUnit(INFINITY), 0);
}

}  // namespace
}  // namespace glint::footprint_weights_test
