// Displacement maps whose colour and roughness vary (Wu 2019, Fig. 14).

#include <gtest/gtest.h>

#include <numbers>

#include "glint/bake/displace/displace.h"
#include "glint/query/brdf/displaced_brdf.h"
#include "support/path_tracer.h"
#include "support/test_heights.h"

namespace glint::bake::displace_color_test {
namespace {

using test::OwnedSurface;
constexpr double kPi = std::numbers::pi;

/// The bound.
constexpr double kTruth = 0.01;

EffectiveBrdf effective(const OwnedSurface& map, const BaseBrdf& base, const BaseTexture& texture,
                        std::span<const Vec3> directions, int bounces = kAllBounces) {
  const auto surface = map.surface();
  const VisibilityMasks masks(surface, directions);
  return effectiveBrdf(surface, masks, directions, {1, 1, map.width, map.height, 1},
                       {base, bounces, 1, {}, 8192, 1024, texture});
}

std::vector<float> repeated(std::size_t texels, std::initializer_list<float> color) {
  std::vector<float> values;
  for (std::size_t k = 0; k < texels; ++k) values.insert(values.end(), color);
  return values;
}

TEST(BaseTexture, OneColourEverywhereIsAnotherAlbedo) {
  // The random walks are the same, so all but rounding is.
  const auto directions = angularDirections(5);
  const OwnedSurface map = test::synthSurface(SynthKind::weave, 64, 48);
  const BaseBrdf base{BaseBrdf::Kind::diffuse, 0.8f, 0, 1, 0};
  const EffectiveBrdf colored = effective(map, base, {3, repeated(map.heights.size(), {1, 0.5f, 0.125f}), {}}, directions);
  ASSERT_EQ(colored.channels, 3u);
  for (const auto& [channel, factor] : {std::pair{0u, 1.0f}, std::pair{1u, 0.5f}, std::pair{2u, 0.125f}}) {
    BaseBrdf grey = base;
    grey.albedo *= factor;
    const EffectiveBrdf wanted = effective(map, grey, {}, directions);
    for (std::size_t k = 0; k < wanted.values.size(); ++k)
      ASSERT_NEAR(colored.patch(0, channel)[k], wanted.values[k], 1e-5f * wanted.values[k] + 1e-9f) << channel;
  }
}

TEST(BaseTexture, OneRoughnessEverywhereIsAnotherBase) {
  const auto directions = angularDirections(5);
  const OwnedSurface map = test::synthSurface(SynthKind::isotropic, 64, 48);
  const BaseBrdf rough{BaseBrdf::Kind::ggx, 1, 0.8f, 1, 0}, half{BaseBrdf::Kind::ggx, 1, 0.4f, 1, 0};
  const EffectiveBrdf varied = effective(map, rough, {1, {}, repeated(map.heights.size(), {0.5f})}, directions);
  const EffectiveBrdf wanted = effective(map, half, {}, directions);
  for (std::size_t k = 0; k < wanted.values.size(); ++k)
    ASSERT_NEAR(varied.values[k], wanted.values[k], 1e-4f * wanted.values[k] + 1e-9f);
}

TEST(BaseTexture, TintsOfSingleReflectionsAreFactors) {
  const auto directions = angularDirections(5);
  const OwnedSurface map = test::synthSurface(SynthKind::isotropic, 64, 48);
  const BaseBrdf base{BaseBrdf::Kind::ggx, 1, 0.4f, 0.2f, 3.9f};
  const EffectiveBrdf plain = effective(map, base, {}, directions, 1);
  const EffectiveBrdf rgb = effective(map, base, {3, repeated(map.heights.size(), {1, 0.5f, 0.25f}), {}}, directions, 1);
  const EffectiveBrdf grey = effective(map, base, {1, repeated(map.heights.size(), {0.5f}), {}}, directions, 1);
  for (std::size_t k = 0; k < plain.values.size(); ++k) {
    const float tolerance = 1e-5f * plain.values[k] + 1e-9f;
    ASSERT_NEAR(rgb.patch(0, 0)[k], plain.values[k], tolerance);
    ASSERT_NEAR(rgb.patch(0, 2)[k], 0.25f * plain.values[k], tolerance);
    ASSERT_NEAR(grey.values[k], 0.5f * plain.values[k], tolerance);
  }
}

TEST(BaseTexture, AGrooveShowsTheColourOfTheWallThatFacesTheView) {
  // As EffectiveBrdf.OfAGrooveIsMaskedAsGeometrySays: light from above, walls of slope 1, one seen down to `seen` of its width.
  const int d = 32;
  const OwnedSurface map = test::grooves(2 * d, 4, d, 1);
  const BaseTexture texture = test::twoColors(map);
  const BaseBrdf base{BaseBrdf::Kind::diffuse, 0.8f, 0, 1, 0};
  for (const double degrees : {20.0, 50.0, 70.0}) {
    const double x = std::sin(degrees * kPi / 180), z = std::cos(degrees * kPi / 180), c = z / x;
    const Vec3 right = {static_cast<float>(x), 0, static_cast<float>(z)};
    const std::vector<Vec3> directions = {{0, 0, 1}, right, {-right.x, 0, right.z}};
    const EffectiveBrdf e = effective(map, base, texture, directions, 1);
    const double seen = std::min(1.0, 2 * c / (1 + c));
    const double near = 0.5 * seen * (x + z) / std::sqrt(2.0), far = c > 1 ? 0.5 * (z - x) / std::sqrt(2.0) : 0;
    const double red = 0.8 / kPi * (0.9 * near + 0.1 * far), blue = 0.8 / kPi * (0.2 * near + 0.8 * far);
    // Facets at ridges and valleys have colours of both walls: a third of two facets of 32 on each wall. The view from the left
    // sees the other wall as the view from the right sees this one, with the colours of it.
    EXPECT_NEAR(e.patch(0, 0)[1], red, 0.03 * 0.9 * 0.8 / kPi * near) << degrees;
    EXPECT_NEAR(e.patch(0, 2)[1], blue, 0.03 * 0.9 * 0.8 / kPi * near) << degrees;
    EXPECT_NEAR(e.patch(0, 0)[2], 0.8 / kPi * (0.1 * near + 0.9 * far), 0.03 * 0.9 * 0.8 / kPi * near) << degrees;
  }
}

TEST(BaseTexture, ASawtoothWithTwoColoursAgreesWithAPathTracer) {
  // tests/slow has more surfaces, directions and paths, and glossy bases.
  const auto directions = angularDirections(5);
  const std::size_t pairs = directions.size() * directions.size();
  const OwnedSurface map = test::synthSurface(SynthKind::sawtooth, 96, 16);
  const BaseTexture texture = test::twoColors(map);
  const BaseBrdf base{BaseBrdf::Kind::diffuse, 0.9f, 0, 1, 0};
  const auto surface = map.surface();
  const VisibilityMasks masks(surface, directions);
  const EffectiveBrdf fast =
      effectiveBrdf(surface, masks, directions, {1, 1, 96, 16, 1}, {base, kAllBounces, 1, {}, 0, 0, texture});
  const auto truth = test::PathTracer(surface, base, texture, directions, 100000).diffuse();
  for (std::size_t c = 0; c < 3; ++c)
    EXPECT_LT(test::rmsWithin70Degrees(fast.patch(0, c), std::span(truth).subspan(c * pairs, pairs), directions), kTruth) << c;
  EXPECT_GT(fast.interreflected, 0.005);
}

/// Everything of a two-coloured sawtooth; cells are one period of it.
struct Sawtooth {
  OwnedSurface map = test::grooves(64, 32, 8, 1);
  DisplaceOptions options;
  DisplacementData data;
  Displacement asset;
  explicit Sawtooth(const BaseBrdf& base) {
    options.factors = {16};
    options.base = base, options.texture = test::twoColors(map);
    options.angular = 9, options.spatial = 1;
    data = displace({map.width, map.height, 0, map.heights}, options);
    asset = data.view();
  }
};

TEST(DisplacedColours, LobesHaveTheColoursOfTheirNormals) {
  const Sawtooth s({BaseBrdf::Kind::diffuse, 0.9f, 0, 1, 0});
  const DisplacementLevel& level = s.asset.levels[0];
  ASSERT_EQ(level.lobe_colors.size(), 3 * level.lobes.size());
  for (std::size_t k = 0; k < level.lobes.size(); ++k) {
    if (level.lobes[k].amplitude == 0) continue;
    EXPECT_NEAR(std::abs(level.lobes[k].mu.x), std::sqrt(0.5f), 1e-3f);
    const bool right = level.lobes[k].mu.x > 0;
    // Facets at ridges and valleys: a twelfth of a wall has a colour between the two.
    EXPECT_NEAR(level.lobe_colors[3 * k], right ? 0.9f : 0.1f, 0.08f);
    EXPECT_NEAR(level.lobe_colors[3 * k + 2], right ? 0.2f : 0.8f, 0.08f);
    EXPECT_NEAR(level.lobe_colors[3 * k + 1], 0.3f, 1e-5f);
  }
}

TEST(DisplacedColours, FollowTheViewAsThoseOfTheOriginalDo) {
  for (const BaseBrdf& base :
       {BaseBrdf{BaseBrdf::Kind::diffuse, 0.9f, 0, 1, 0}, BaseBrdf{BaseBrdf::Kind::ggx, 1, 0.4f, 1, 0}}) {
    const Sawtooth s(base);
    const DisplacedBrdf brdf(s.asset);
    const auto directions = angularDirections(s.options.angular);
    const auto surface = s.map.surface();
    const VisibilityMasks masks(surface, directions);
    const EffectiveBrdf original = effectiveBrdf(surface, masks, directions, {1, 1, 4, 2, 16},
                                                 {base, kAllBounces, s.options.seed, {}, 0, 0, s.options.texture});
    const std::size_t n = directions.size();
    std::size_t compared = 0;
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t o = 0; o < n; ++o) {
        if (directions[i].z < 0.5f || directions[o].z < 0.5f) continue;
        // What no lobe reflects cannot be scaled: light that only interreflections turn from one wall to the other.
        if (brdf.evaluate(0, {0.3f, 0.6f}, directions[i], directions[o], DisplacedVariant::lobes).g < 1e-5f) continue;
        ++compared;
        // The downsampled surface is flat, so one query is the mean over the map.
        const Rgb f = directions[i].z * directions[o].z * brdf.evaluate(0, {0.3f, 0.6f}, directions[i], directions[o]);
        const std::size_t k = i * n + o;
        // Rounding of S to half precision, and the little that is left of the downsampled relief.
        EXPECT_NEAR(f.r, original.patch(0, 0)[k], 0.01 * original.patch(0, 0)[k]);
        EXPECT_NEAR(f.g, original.patch(0, 1)[k], 0.01 * original.patch(0, 1)[k]);
        EXPECT_NEAR(f.b, original.patch(0, 2)[k], 0.01 * original.patch(0, 2)[k]);
      }
    }
    EXPECT_GT(compared, 1000u);
  }
}

TEST(DisplacedColours, ComeFromTheLobesAlready) {
  // The scaling function only has to add masking: the lobes alone turn from red to blue. Light and view 40 degrees to one side.
  const Sawtooth s({BaseBrdf::Kind::diffuse, 0.9f, 0, 1, 0});
  const DisplacedBrdf brdf(s.asset);
  const float x = std::sin(0.7f), z = std::cos(0.7f);
  const Rgb right = brdf.evaluate(0, {0.3f, 0.6f}, {x, 0, z}, {x, 0, z}, DisplacedVariant::lobes);
  const Rgb left = brdf.evaluate(0, {0.3f, 0.6f}, {-x, 0, z}, {-x, 0, z}, DisplacedVariant::lobes);
  EXPECT_GT(right.r, 3 * right.b);
  EXPECT_GT(left.b, 3 * left.r);
  const Rgb one =
      brdf.evaluate(0, {0.3f, 0.6f}, {x, 0, z}, {x, 0, z}, DisplacedVariant::single);  // the mean colour, whatever the view
  EXPECT_NEAR(one.r, one.b, 0.05f * one.r);
}

TEST(DisplacedColours, RoughnessOfLobesIsThatOfTheirNormals) {
  OwnedSurface map = test::grooves(64, 32, 8, 1);
  DisplaceOptions options;
  options.factors = {16}, options.angular = 5, options.spatial = 1;
  options.base = {BaseBrdf::Kind::ggx, 1, 1, 1, 0};
  const BaseTexture colors = test::twoColors(map);
  for (std::size_t k = 0; k < map.heights.size(); ++k)
    options.texture.roughness.push_back(colors.colors[3 * k] > 0.5f ? 0.6f : 0.3f);
  const DisplacementData data = displace({map.width, map.height, 0, map.heights}, options);
  const DisplacementData::Level& level = data.levels[0];
  EXPECT_EQ(data.shape.channels, 1);
  EXPECT_TRUE(level.lobe_colors.empty());
  ASSERT_EQ(level.lobe_alphas.size(), level.lobes.size());
  for (std::size_t k = 0; k < level.lobes.size(); ++k) {
    if (level.lobes[k].amplitude == 0) continue;
    EXPECT_NEAR(level.lobe_alphas[k], level.lobes[k].mu.x > 0 ? 0.6f : 0.3f, 0.04f);
  }
}

}  // namespace
}  // namespace glint::bake::displace_color_test
