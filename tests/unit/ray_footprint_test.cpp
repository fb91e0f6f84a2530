#include "glint/query/ray_footprint.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "glint/query/detail/common/footprint_weights.h"

namespace glint::ray_footprint_test {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(RayFootprint, OfAPixelIsItsFilterInTexels) {
  // Pixels 8 texels apart along x and 2 along y, a quarter turn: a filter of half a pixel is 4 by 1 texels.
  const Footprint p = footprintFromDifferentials({0.3f, 0.6f}, {0, 8.0f / 100}, {2.0f / 200, 0}, 200, 100);
  EXPECT_EQ(p.kind, Footprint::Kind::gaussian);
  EXPECT_EQ(p.centre, (Vec2{0.3f, 0.6f}));
  EXPECT_NEAR(p.covariance.xx, 1, 1e-5f);
  EXPECT_NEAR(p.covariance.yy, 16, 1e-4f);
  EXPECT_NEAR(p.covariance.xy, 0, 1e-6f);
  const Footprint sheared = footprintFromDifferentials({0, 0}, {0.04f, 0.02f}, {0, 0.01f}, 100, 100, 1);
  EXPECT_NEAR(sheared.covariance.xx, 16, 1e-4f);
  EXPECT_NEAR(sheared.covariance.xy, 8, 1e-4f);
  EXPECT_NEAR(sheared.covariance.yy, 5, 1e-4f);
}

TEST(RayFootprint, JitterAndFootprintsOfSamplesAddUpToAboutThePixelsFilter) {
  // Samples that are spread like the filter of a pixel, each with its own footprint: variances add.
  constexpr float kTexels = 8;  // of a pixel
  for (const auto& [samples, widened] : {std::pair{1, 1.41421356f}, {4, 1.11803399f}, {16, 1.03077641f}}) {
    const Footprint p =
        footprintFromDifferentials({}, {kTexels / 100, 0}, {0, kTexels / 100}, 100, 100, sampleFilterSigma(samples));
    const float jitter = kPixelFilterSigma * kTexels, whole = std::sqrt(jitter * jitter + p.covariance.xx);
    EXPECT_NEAR(whole / jitter, widened, 1e-5f) << samples;
  }
  EXPECT_EQ(sampleFilterSigma(0), kPixelFilterSigma);
}

TEST(RayFootprint, BadDifferentialsGiveUsableFootprints) {
  const float values[] = {0, 1e-30f, 0.01f, -3, 1e30f, kInfinity, -kInfinity, kNan};
  for (const float a : values) {
    for (const float b : values) {
      const Footprint p = footprintFromDifferentials({a, b}, {a, b}, {b, 0.01f}, 1024, 512);
      const Covariance raw = p.covariance;
      EXPECT_TRUE(std::isfinite(raw.xx) && std::isfinite(raw.xy) && std::isfinite(raw.yy)) << a << ' ' << b;
      const UsableCovariance c = usableCovariance(raw, 1024, 512);
      EXPECT_TRUE(c.xx > 0 && c.xx <= 1024 * 1024 * 1.01f && c.yy > 0 && c.yy <= 512 * 512 * 1.01f) << a << ' ' << b;
    }
  }
}

TEST(RayFootprint, UvDifferentialSolvesForTheStep) {
  const Vec3 dpdu = {2, 0.3f, -0.1f}, dpdv = {-0.5f, 1.5f, 0.4f};
  const Vec2 duv = uvDifferential(dpdu, dpdv, 0.01f * dpdu + (-0.03f) * dpdv);
  EXPECT_NEAR(duv.x, 0.01f, 1e-6f);
  EXPECT_NEAR(duv.y, -0.03f, 1e-6f);
  EXPECT_EQ(uvDifferential(dpdu, 2.0f * dpdu, dpdv), Vec2{});
  EXPECT_EQ(uvDifferential({}, dpdv, dpdv), Vec2{});
  EXPECT_EQ(uvDifferential(dpdu, dpdv, {kNan, 0, 0}), Vec2{});
  EXPECT_EQ(uvDifferential({kInfinity, 0, 0}, dpdv, dpdu), Vec2{});
}

TEST(RayCone, WidensByItsSpreadAndByRoughness) {
  const RayCone cone = propagated({0.3f, 0.02f}, 20);
  EXPECT_NEAR(cone.width, 0.5f, 1e-6f);
  EXPECT_EQ(cone.spread, 0.02f);
  const RayCone after = bounced(cone, 0.05f);
  EXPECT_EQ(after.width, cone.width);
  EXPECT_NEAR(after.spread, std::sqrt(0.02f * 0.02f + 0.1f * 0.1f), 1e-4f);
  EXPECT_EQ(bounced(cone, 0).spread, cone.spread);
  EXPECT_LT(bounced(cone, 0.1f).spread, bounced(cone, 0.2f).spread);
  EXPECT_LE(bounced(cone, 100).spread, 0.75f);  // no wider than the hemisphere
}

TEST(RayCone, MakesAFootprintStretchedAlongTheRay) {
  const Footprint level = footprintOfCone({0.1f, 0}, {0.5f, 0.5f}, {0, 0, 1}, 50);
  EXPECT_NEAR(level.covariance.xx, 25, 1e-4f);
  EXPECT_NEAR(level.covariance.yy, 25, 1e-4f);
  const Footprint slant = footprintOfCone({0.1f, 0}, {0.5f, 0.5f}, {0.8f, 0, 0.6f}, 50);
  EXPECT_NEAR(slant.covariance.xx, 25 / 0.36f, 1e-3f);
  EXPECT_NEAR(slant.covariance.yy, 25, 1e-4f);
  for (const Vec3& direction : {Vec3{1, 0, 0}, Vec3{1, 0, -1}, Vec3{kNan, 0, 1}, Vec3{0, 1, kNan}, Vec3{}}) {
    for (const float width : {0.0f, 0.1f, 1e30f, kInfinity, kNan}) {
      const Covariance c = footprintOfCone({width, 0}, {}, direction, 50).covariance;
      EXPECT_TRUE(c.xx >= 0 && c.yy >= 0 && c.xx < kInfinity && c.yy < kInfinity) << width;
    }
  }
}

}  // namespace
}  // namespace glint::ray_footprint_test
