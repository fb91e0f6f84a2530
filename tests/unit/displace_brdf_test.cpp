#include <gtest/gtest.h>

#include <numbers>

#include "glint/bake/displace/effective_brdf.h"
#include "glint/query/brdf/base_brdf.h"
#include "support/test_heights.h"

namespace glint::bake::displace_brdf_test {
namespace {

using test::OwnedSurface;
constexpr double kPi = std::numbers::pi;
constexpr float kGrazing = 0.2588f;  // cosine of 75 degrees

/// The bounds.
constexpr double kFurnace = 0.005;
constexpr double kReciprocity = 0.005;

EffectiveBrdf effective(const OwnedSurface& map, const EffectiveOptions& options, std::span<const Vec3> directions,
                        int patches = 1) {
  const auto surface = map.surface();
  const VisibilityMasks masks(surface, directions);
  return effectiveBrdf(surface, masks, directions, {patches, patches, map.width, map.height, 1}, options);
}

OwnedSurface flatSurface() { return {16, 12, std::vector<float>(16 * 12, 2.0f)}; }

TEST(EffectiveBrdf, OfAFlatSurfaceIsTheBase) {
  const auto directions = angularDirections(9);
  for (const BaseBrdf& base :
       {BaseBrdf{BaseBrdf::Kind::diffuse, 0.7f, 0, 1, 0}, BaseBrdf{BaseBrdf::Kind::ggx, 1, 0.3f, 0.2f, 3.9f}}) {
    const EffectiveBrdf e = effective(flatSurface(), {base, kAllBounces, 1, {4}, 0, 64}, directions);
    EXPECT_EQ(e.interreflected, 0);
    for (std::size_t i = 0; i < directions.size(); ++i) {
      for (std::size_t o = 0; o < directions.size(); ++o) {
        const float wanted = baseTimesCosines(base, {0, 0, 1}, directions[i], directions[o]);
        // Sums of some hundred floats.
        EXPECT_NEAR(e.values[i * directions.size() + o], wanted, 2e-4f * wanted + 1e-6f);
      }
    }
  }
}

TEST(EffectiveBrdf, OfAGrooveIsMaskedAsGeometrySays) {
  // Walls of slope s and horizontal half width d; the view comes from +x with a rise of c for each unit, the light from above.
  // The wall that faces +x is seen down to x = min(d, 2 d c / (s + c)) from its ridge, the other wall if c > s.
  const double s = 1, albedo = 0.8;
  const int d = 32;
  std::vector<Vec3> directions = {{0, 0, 1}};
  std::vector<double> angles;
  for (const double degrees : {20.0, 50.0, 60.0, 70.0, 80.0}) {
    angles.push_back(degrees * kPi / 180);
    directions.push_back({static_cast<float>(std::sin(angles.back())), 0, static_cast<float>(std::cos(angles.back()))});
  }
  EffectiveOptions options;
  options.base.albedo = static_cast<float>(albedo);
  options.bounces = 1;
  const EffectiveBrdf e = effective(test::grooves(2 * d, 4, d, static_cast<float>(s)), options, directions);
  const double length = std::sqrt(1 + s * s);
  for (std::size_t k = 0; k < angles.size(); ++k) {
    const double x = std::sin(angles[k]), z = std::cos(angles[k]), c = z / x;
    const double seen = std::min(1.0, 2 * c / (s + c));
    const double near = 0.5 * seen * (s * x + z) / length, far = c > s ? 0.5 * (z - s * x) / length : 0;
    const double wanted = albedo / kPi * (near + far);
    // One column of facets more or less is 1 / d of a wall.
    EXPECT_NEAR(e.values[k + 1], wanted, 0.01 * wanted) << k;
    // Light and view together at more than 45 degrees see the same wall as far as either does.
    const double both =
        albedo / kPi *
        (0.5 * seen * (s * x + z) * (s * x + z) / length + (c > s ? 0.5 * (z - s * x) * (z - s * x) / length : 0));
    EXPECT_NEAR(e.values[(k + 1) * directions.size() + k + 1], both, 0.03 * both) << k;
  }
}

/// Largest deviation, over views within 75 degrees, of the light reflected under an even sky from that of a flat surface.
double furnaceDeviation(const EffectiveBrdf& e, std::span<const Vec3> directions, double& mean) {
  const std::size_t n = directions.size();
  double worst = 0, all = 0, all_flat = 0;
  for (std::size_t o = 0; o < n; ++o) {
    if (directions[o].z < kGrazing) continue;
    double light = 0, flat = 0;
    for (std::size_t i = 0; i < n; ++i) light += e.values[i * n + o], flat += directions[i].z * directions[o].z / kPi;
    worst = std::max(worst, std::abs(light / flat - 1));
    all += light, all_flat += flat;
  }
  mean = all / all_flat - 1;
  return worst;
}

TEST(EffectiveBrdf, KeepsTheLightOfAWhiteFurnaceWithInterreflectionsOnly) {
  const auto directions = angularDirections(9);
  for (const SynthKind kind : {SynthKind::isotropic, SynthKind::weave, SynthKind::scratches, SynthKind::sawtooth}) {
    const OwnedSurface map = test::synthSurface(kind, 128, 192);
    EffectiveOptions options;
    double mean = 0;
    const EffectiveBrdf all = effective(map, options, directions);
    EXPECT_LT(furnaceDeviation(all, directions, mean), kFurnace) << static_cast<int>(kind);
    EXPECT_NEAR(mean, 0, kFurnace);
    EXPECT_LT(all.asymmetry, kReciprocity);
    options.bounces = 1;
    furnaceDeviation(effective(map, options, directions), directions, mean);
    EXPECT_LT(mean, -0.4 * all.interreflected) << static_cast<int>(kind);
    EXPECT_LT(mean, -0.005) << static_cast<int>(kind);
  }
}

TEST(EffectiveBrdf, GlossyPathsLoseNoMoreThanTheirFacetsDo) {
  // A GGX facet alone loses light to its own masking. Grooves of 45 degrees send most light on to the other wall: with
  // interreflections the surface must reflect clearly more than without, and less than all.
  const auto directions = angularDirections(9);
  EffectiveOptions options{{BaseBrdf::Kind::ggx, 1, 0.3f, 1, 0}, 1, 1, {}, 0, 0};
  const OwnedSurface map = test::grooves(64, 16, 8, 1);
  const EffectiveBrdf once = effective(map, options, directions);
  options.bounces = kAllBounces;
  const EffectiveBrdf all = effective(map, options, directions);
  const std::size_t n = directions.size(), view = n / 2;
  double light_once = 0, light_all = 0;
  for (std::size_t i = 0; i < n; ++i) light_once += once.values[i * n + view], light_all += all.values[i * n + view];
  const double part = 2 * kPi / static_cast<double>(n);
  EXPECT_GT(all.interreflected, 0.2);
  EXPECT_GT(part * light_all, 1.2 * part * light_once);
  EXPECT_LT(part * light_all, 1.01);  // quadrature of 81 directions
}

TEST(EffectiveBrdf, NarrowLobesStayFinite) {
  const auto directions = angularDirections(15);
  EffectiveOptions options{{BaseBrdf::Kind::ggx, 1, 0.1f, 1, 0}, kAllBounces, 1, {}, 4096, 8192};
  const EffectiveBrdf e = effective(test::synthSurface(SynthKind::isotropic, 128, 128), options, directions);
  for (const float value : e.values) ASSERT_TRUE(std::isfinite(value) && value >= 0);
  EXPECT_GT(e.interreflected, 0.02);
}

TEST(EffectiveBrdf, NoiseIsBelowOnePercentOfEachEntry) {
  const auto directions = angularDirections(15);
  const OwnedSurface map = test::synthSurface(SynthKind::isotropic, 256, 256);
  const std::size_t n = directions.size();
  EffectiveOptions options;
  const EffectiveBrdf a = effective(map, options, directions);
  options.seed = 2;
  const EffectiveBrdf b = effective(map, options, directions);
  double squares = 0, count = 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t o = 0; o < n; ++o) {
      if (directions[i].z < 0.342f || directions[o].z < 0.342f) continue;  // 70 degrees
      const double relative = a.values[i * n + o] / b.values[i * n + o] - 1;
      squares += relative * relative, ++count;
    }
  }
  EXPECT_LT(std::sqrt(squares / count / 2), 0.01);
  EXPECT_GT(squares, 0);
}

TEST(EffectiveBrdf, PatchesAddUpToTheMap) {
  const auto directions = angularDirections(5);
  const OwnedSurface map = test::synthSurface(SynthKind::scratches, 96, 96);
  EffectiveOptions options;
  options.bounces = 1;
  const EffectiveBrdf whole = effective(map, options, directions, 1);
  const EffectiveBrdf parts = effective(map, options, directions, 5);  // 5 does not divide 96
  const auto mean = parts.mean({5, 5, 96, 96, 1});
  for (std::size_t k = 0; k < mean.size(); ++k) EXPECT_NEAR(mean[k], whole.values[k], 1e-4 * whole.values[k] + 1e-7);
}

}  // namespace
}  // namespace glint::bake::displace_brdf_test
