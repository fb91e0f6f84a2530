#include "glint/bake/displace/displace.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cstring>
#include <limits>
#include <numbers>
#include <random>

#include "glint/bake/displace/low_brdf.h"
#include "glint/model/error.h"
#include "glint/query/brdf/displaced_brdf.h"
#include "support/test_heights.h"

namespace glint::bake::displace_test {
namespace {

using test::OwnedSurface;
constexpr float kHalf = 0x1p-11f;  // relative rounding of stored factors

/// An asset and the memory behind it.
struct Built {
  DisplacementData data;
  Displacement asset;
  Built(const OwnedSurface& map, const DisplaceOptions& options)
      : data(displace({map.width, map.height, 0, map.heights}, options)), asset(data.view()) {}
};

DisplaceOptions quick(std::vector<int> factors, BaseBrdf base = {}) {
  DisplaceOptions options;
  options.factors = std::move(factors);
  options.base = base;
  options.angular = 7;
  options.spatial = 2;
  return options;
}

BaseBrdf ggx(float alpha) { return {BaseBrdf::Kind::ggx, 1, alpha, 1, 0}; }

Vec3 towards(float degrees, float azimuth) {
  const float t = degrees * std::numbers::pi_v<float> / 180;
  return {std::sin(t) * std::cos(azimuth), std::sin(t) * std::sin(azimuth), std::cos(t)};
}

TEST(Displace, FlatMapsNeedNoScaling) {
  const OwnedSurface flat{32, 16, std::vector<float>(32 * 16, 1.5f)};
  for (const BaseBrdf& base : {BaseBrdf{}, ggx(0.3f)}) {
    const Built built(flat, quick({4, 8}, base));
    for (int l = 0; l < 2; ++l) {
      const DisplacementLevel& level = built.asset.levels[l];
      for (const float t : level.spatial_scale) EXPECT_NEAR(t, 1, 1e-4f);
      // Half precision; and the glossy lobe of bandwidth 1e6 is a little wider than the facet's own.
      for (const std::uint16_t s : level.angular_scale) EXPECT_NEAR(halfToFloat(s), 1, 2e-3f);
      for (const float h : level.heights) EXPECT_NEAR(h, 1.5f, 1e-5f);
      EXPECT_LT(level.rank1_residual, 1e-3f);
      EXPECT_EQ(level.distant_share, 0);
    }
    const DisplacedBrdf brdf(built.asset);
    const Vec3 wi = towards(40, 1), wo = towards(20, 3);
    EXPECT_NEAR(brdf.evaluate(0, {0.3f, 0.6f}, wi, wo).r, baseTimesCosines(base, {0, 0, 1}, wi, wo) / (wi.z * wo.z), 1e-3f);
  }
}

/// What the asset reflects as a whole where its smooth surface hides nothing: the mean over its cells of the answers of the
/// query.
Rgb meanOfQueries(const DisplacedBrdf& brdf, int level, Vec3 wi, Vec3 wo) {
  const DisplacementLevel& l = brdf.asset().levels[level];
  Rgb sum;
  for (int j = 0; j < l.rows; ++j) {
    for (int i = 0; i < l.columns; ++i) {
      for (const float inside : {0.25f, 0.75f}) {  // one point of each triangle
        const Vec2 uv = {
            (static_cast<float>(i) + inside) / static_cast<float>(l.columns) + 0.5f / static_cast<float>(brdf.asset().width),
            (static_cast<float>(j) + inside) / static_cast<float>(l.rows) + 0.5f / static_cast<float>(brdf.asset().height)};
        const Vec3 n = brdf.normal(level, uv);
        sum = sum + dot(n, wi) * dot(n, wo) / n.z * brdf.evaluate(level, uv, wi, wo);
      }
    }
  }
  return 0.5f / static_cast<float>(l.columns * l.rows) * sum;
}

/// Expects the asset's answers, added up over a map, to be the light that facets of the original reflect by brute force.
void expectQueriesAddUp(const OwnedSurface& map, const BaseBrdf& base, DisplaceOptions options) {
  options.base = base, options.spatial = 1;
  const Built built(map, options);
  const DisplacedBrdf brdf(built.asset);
  const auto surface = map.surface();
  const auto directions = angularDirections(options.angular);
  const VisibilityMasks masks(surface, directions);
  const EffectiveBrdf original =
      effectiveBrdf(surface, masks, directions, {1, 1, map.width, map.height, 1}, {base, kAllBounces, options.seed, {}, 0, 0});
  for (std::size_t i = 0; i < directions.size(); ++i) {
    for (std::size_t o = 0; o < directions.size(); ++o) {
      if (directions[i].z < 0.6f || directions[o].z < 0.6f) continue;  // where cells of the weave begin to hide each other
      const double wanted = original.values[i * directions.size() + o];
      EXPECT_NEAR(meanOfQueries(brdf, 0, directions[i], directions[o]).r, wanted, 0.01 * wanted) << i << " " << o;
    }
  }
}

TEST(Displace, QueriesAddUpToTheEffectiveBrdfOfTheOriginal) {
  for (const BaseBrdf& base : {BaseBrdf{BaseBrdf::Kind::diffuse, 0.8f, 0, 1, 0}, ggx(0.4f)})
    for (const SynthKind kind : {SynthKind::isotropic, SynthKind::weave})
      expectQueriesAddUp(test::synthSurface(kind, 128, 64), base, quick({8}));
}

TEST(Displace, QueriesAddUpOnMapsThatTheFactorDoesNotDivide) {
  // 7.5 and 4.6 cells: 8 x 5, of 11.25 x 11 texels.
  expectQueriesAddUp(test::synthSurface(SynthKind::isotropic, 90, 55), {BaseBrdf::Kind::diffuse, 0.8f, 0, 1, 0}, quick({12}));
  // A strip of one texel in height, as thin as a map may be.
  expectQueriesAddUp(test::synthSurface(SynthKind::isotropic, 101, 9), ggx(0.4f), quick({8}));
}

TEST(Displace, CellsThatDoNotDivideTheMapLieOverTheReliefThatTheyStandFor) {
  // One wave across the map: the vertices of 8 x 7 cells follow it at (I 100 / 8, J 72 / 7), and normals lean as the wave does.
  const int width = 100, height = 72;
  OwnedSurface map{width, height, {}};
  const auto phase = [&](float x, float y) {
    return 2 * std::numbers::pi_v<float> * (x / static_cast<float>(width) + y / static_cast<float>(height));
  };
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) map.heights.push_back(3 * std::sin(phase(static_cast<float>(i), static_cast<float>(j))));
  const Built built(map, quick({5}));
  const DisplacementLevel& level = built.asset.levels[0];
  ASSERT_EQ(level.columns, 20);
  ASSERT_EQ(level.rows, 14);  // 14.4
  const DisplacedBrdf brdf(built.asset);
  for (int j = 0; j < level.rows; ++j) {
    for (int i = 0; i < level.columns; ++i) {
      const float x = static_cast<float>(i) * 100 / 20, y = static_cast<float>(j) * 72 / 14;
      // The Laplacian's weight lowers the wave by 1 %; borders rounded to texels move it by half a texel at most.
      EXPECT_NEAR(level.heights[static_cast<std::size_t>(j * 20 + i)], 3 * std::sin(phase(x, y)), 0.09f) << i << " " << j;
      // The mean slope of the two triangles of the cell.
      const Vec3 low = brdf.normal(0, {(x + 1.5f) / width, (y + 1.5f) / height}),
                 high = brdf.normal(0, {(x + 4.5f) / width, (y + 4.5f) / height});
      const float slope = 3 * std::cos(phase(x + 2.5f, y + 2.5f)) * 2 * std::numbers::pi_v<float>;
      EXPECT_NEAR(-0.5f * (low.x / low.z + high.x / high.z), slope / width, 0.01f);
      EXPECT_NEAR(-0.5f * (low.y / low.z + high.y / high.z), slope / height, 0.01f);
    }
  }
}

TEST(Displace, LevelsOfOneRunAreThoseOfSeparateRuns) {
  const OwnedSurface map = test::synthSurface(SynthKind::scratches, 64, 64);
  const Built both(map, quick({4, 8})), second(map, quick({8}));
  EXPECT_EQ(both.data.levels[1].heights, second.data.levels[0].heights);
  EXPECT_EQ(both.data.levels[1].angular_scale, second.data.levels[0].angular_scale);
  EXPECT_EQ(both.asset.levels[1].distant_share, second.asset.levels[0].distant_share);
  EXPECT_LE(both.asset.levels[1].distant_share, both.asset.levels[0].distant_share);
}

TEST(Displace, DoesNotDependOnThreads) {
  const OwnedSurface map = test::synthSurface(SynthKind::isotropic, 64, 48);
  for (const BaseBrdf& base : {BaseBrdf{}, ggx(0.3f)}) {
    const Built many(map, quick({8}, base));
    const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
    const Built single(map, quick({8}, base));
    const auto& a = many.data.levels[0];
    const auto& b = single.data.levels[0];
    EXPECT_EQ(a.angular_scale, b.angular_scale);
    EXPECT_EQ(a.spatial_scale, b.spatial_scale);
    ASSERT_EQ(a.lobes.size(), b.lobes.size());
    EXPECT_EQ(std::memcmp(a.lobes.data(), b.lobes.data(), a.lobes.size() * sizeof(VmfLobe)), 0);
  }
}

TEST(Displace, SpatialScaleFollowsTheReliefAndTheResidualSaysWhenItCannot) {
  // Grooves in one half of the map only, below the level of the other half: they are darker than their lobes.
  OwnedSurface map = test::grooves(64, 64, 4, 1);
  for (int j = 0; j < 64; ++j)
    for (int i = 32; i < 64; ++i) map.heights[static_cast<std::size_t>(j) * 64 + i] = 4;
  DisplaceOptions options = quick({8});
  options.bounces = 1;
  const Built built(map, options);
  const DisplacementLevel& level = built.asset.levels[0];
  ASSERT_EQ(level.spatial_columns, 2);
  EXPECT_LT(level.spatial_scale[0], 0.95f * level.spatial_scale[1]);
  EXPECT_GT(level.rank1_residual, 0.05f);
  EXPECT_GE(level.rank1_residual * level.rank1_residual + 1e-3f,
            1 - level.rank1_energy);  // the singular value is the best there is
  options.spatial = 1;
  EXPECT_LT(Built(map, options).asset.levels[0].rank1_residual, 1e-3f);
}

/// Root mean square of the error of the light that each patch reflects, over that of the light.
double patchError(const Built& built, const EffectiveBrdf& original, const EffectiveBrdf& low) {
  const Displacement& d = built.asset;
  const DisplacementLevel& l = d.levels[0];
  const auto directions = angularDirections(d.angular);
  double error = 0, all = 0;
  for (std::size_t p = 0; p < original.patches; ++p) {
    for (std::size_t o = 0; o < directions.size(); ++o) {
      for (std::size_t i = 0; i <= o; ++i) {
        if (directions[i].z < kGrazingCosine || directions[o].z < kGrazingCosine) continue;
        const std::size_t pair = o * (o + 1) / 2 + i, k = i * directions.size() + o;
        float scale = l.spatial_scale[p] * halfToFloat(l.angular_scale[pair]);
        for (std::size_t t = 0; t < static_cast<std::size_t>(d.more_terms); ++t)
          scale += l.spatial_terms[t * original.patches + p] * halfToFloat(l.angular_terms[t * l.angular_scale.size() + pair]);
        const double wanted = original.patch(p)[k], got = scale * low.patch(p)[k];
        error += (got - wanted) * (got - wanted), all += wanted * wanted;
      }
    }
  }
  return std::sqrt(error / all);
}

/// Four kinds of relief, one in each quarter: deep grooves along x, along y, noise, and nothing.
OwnedSurface fourReliefs() {
  OwnedSurface map{64, 64, std::vector<float>(64 * 64)};
  const OwnedSurface noise = test::synthSurface(SynthKind::isotropic, 64, 64);
  for (int j = 0; j < 64; ++j) {
    for (int i = 0; i < 64; ++i) {
      float& h = map.heights[static_cast<std::size_t>(j) * 64 + i];
      if (j < 32) h = 1.2f * std::abs(static_cast<float>(i < 32 ? i % 4 : j % 4) - 2);
      if (j >= 32 && i < 32) h = noise.heights[static_cast<std::size_t>(j) * 64 + i];
    }
  }
  return map;
}

/// |R - scale| / |R| of the scaling function that queries answer at the middles of 2 x 2 patches, of the worst channel.
double queriedResidual(const OwnedSurface& map, const DisplaceOptions& options, const DisplacedBrdf& brdf, int level) {
  const DisplacementLevel& l = brdf.asset().levels[level];
  const auto surface = map.surface();
  const auto directions = angularDirections(options.angular);
  const VisibilityMasks masks(surface, directions);
  const PatchGrid grid{2, 2, l.columns, l.rows, l.factor};
  EffectiveOptions effective{options.base, options.bounces, options.seed, {}, 0, 0, options.texture};
  const EffectiveBrdf original = effectiveBrdf(surface, masks, directions, grid, effective);
  std::vector<float> cells;
  for (const float h : l.heights) cells.push_back(h / static_cast<float>(l.factor));
  const auto channels = static_cast<std::size_t>(brdf.asset().channels);
  const LobeField field{options.base, static_cast<std::size_t>(options.lobes), channels, l.lobes, l.lobe_colors, l.lobe_alphas};
  const EffectiveBrdf low = lowBrdf(cells, field, directions, grid);
  double error[3] = {}, norm[3] = {};
  for (std::size_t p = 0; p < 4; ++p) {
    const Vec2 uv = {0.25f + 0.5f * static_cast<float>(p % 2) + 0.5f / static_cast<float>(map.width),
                     0.25f + 0.5f * static_cast<float>(p / 2) + 0.5f / static_cast<float>(map.height)};
    for (std::size_t o = 0; o < directions.size(); ++o) {
      for (std::size_t i = 0; i <= o; ++i) {
        if (directions[i].z < kGrazingCosine || directions[o].z < kGrazingCosine) continue;
        const Rgb scale = brdf.scale(level, uv, directions[i], directions[o]);
        const float of_channel[3] = {scale.r, scale.g, scale.b};
        for (std::size_t c = 0; c < channels; ++c) {
          const std::size_t k = i * directions.size() + o;
          const double ratio = double{original.patch(p, c)[k]} / low.patch(p, c)[k];
          error[c] += (ratio - of_channel[c]) * (ratio - of_channel[c]), norm[c] += ratio * ratio;
        }
      }
    }
  }
  double worst = 0;
  for (std::size_t c = 0; c < channels; ++c) worst = std::max(worst, std::sqrt(error[c] / norm[c]));
  return worst;
}

TEST(Displace, MoreTermsOfColoursAndTwoLevelsAreWhatARendererGets) {
  const OwnedSurface map = fourReliefs();
  for (const BaseBrdf& base : {BaseBrdf{BaseBrdf::Kind::diffuse, 0.8f, 0, 1, 0}, ggx(0.3f)}) {
    DisplaceOptions options = quick({8, 16}, base);
    options.bounces = 1;
    options.texture.channels = 3;
    for (int k = 0; k < 64 * 64; ++k)  // red grooves along x, green grooves along y, and blue noise
      for (int c = 0; c < 3; ++c) options.texture.colors.push_back(0.2f + 0.7f * (c == k / 32 % 2 + 2 * (k / 2048 % 2)));
    options.scale_tolerance = 0.03f;
    const Built built(map, options);
    const DisplacedBrdf brdf(built.asset);
    const auto terms = static_cast<std::size_t>(built.asset.more_terms);
    EXPECT_GT(terms, 0u);
    for (int l = 0; l < 2; ++l) {
      const DisplacementLevel& level = built.asset.levels[l];
      EXPECT_EQ(level.spatial_terms.size(), terms * 4 * 3);
      EXPECT_EQ(level.angular_terms.size(), terms * 49 * 50 / 2 * 3);
      EXPECT_GT(level.rank1_residual, 0.08f);
      EXPECT_LE(level.scale_residual, 0.03f);
      // Grid directions and the middles of patches are met but for rounding.
      EXPECT_NEAR(queriedResidual(map, options, brdf, l), level.scale_residual, 1e-3) << l;
    }
  }
}

TEST(Displace, MoreTermsKeepMapsWhoseScalingDiffersFromPlaceToPlace) {
  const OwnedSurface map = fourReliefs();
  DisplaceOptions options = quick({8});
  options.bounces = 1;
  const Built one(map, options);
  options.scale_tolerance = 0.02f;
  const Built more(map, options);
  const DisplacementLevel &a = one.asset.levels[0], &b = more.asset.levels[0];
  EXPECT_EQ(one.asset.more_terms, 0);
  EXPECT_GT(more.asset.more_terms, 0);
  EXPECT_GT(a.rank1_residual, 0.1f);
  EXPECT_EQ(a.scale_residual, a.rank1_residual);
  EXPECT_EQ(b.rank1_residual, a.rank1_residual);
  EXPECT_LE(b.scale_residual, 0.02f);
  ASSERT_EQ(b.singular_shares.size(), 8u);
  EXPECT_EQ(b.singular_shares[0], b.rank1_energy);
  EXPECT_GT(b.singular_shares[1], 0.001f);
  EXPECT_NEAR(b.singular_shares[0] + b.singular_shares[1] + b.singular_shares[2] + b.singular_shares[3], 1, 1e-4f);
  EXPECT_EQ(b.singular_shares[4], 0);  // four patches have four singular values
  // The same by brute force: light of each patch.
  const auto surface = map.surface();
  const auto directions = angularDirections(options.angular);
  const VisibilityMasks masks(surface, directions);
  const PatchGrid grid{2, 2, 8, 8, 8};
  const EffectiveBrdf original = effectiveBrdf(surface, masks, directions, grid, {options.base, 1, options.seed, {}, 0, 0});
  std::vector<float> cells;
  for (const float h : b.heights) cells.push_back(h / 8);
  const LobeField field{options.base, static_cast<std::size_t>(options.lobes), 1, b.lobes, {}, {}};
  const EffectiveBrdf low = lowBrdf(cells, field, directions, grid);
  EXPECT_GT(patchError(one, original, low), 3 * patchError(more, original, low));
  EXPECT_LT(patchError(more, original, low), 0.03);
  // Queries use them.
  const DisplacedBrdf brdf(more.asset);
  const Vec3 wi = towards(50, 0.2f), wo = towards(40, 2);
  const Vec2 uv = {0.25f + 0.5f / 64, 0.25f + 0.5f / 64};
  Rgb sum;
  for (int t = 0; t <= more.asset.more_terms; ++t) sum = sum + brdf.spatialScale(0, uv, t) * brdf.angularScale(0, wi, wo, t);
  EXPECT_EQ(brdf.scale(0, uv, wi, wo), sum);
  EXPECT_NE(sum, brdf.spatialScale(0, uv) * brdf.angularScale(0, wi, wo));
}

TEST(Displace, SmallLevelsHaveFewerPatches) {
  const Built built(test::synthSurface(SynthKind::isotropic, 32, 16), quick({16}));
  EXPECT_EQ(built.asset.levels[0].spatial_columns, 2);
  EXPECT_EQ(built.asset.levels[0].spatial_rows, 1);
  EXPECT_EQ(built.asset.levels[0].rows, 1);
}

TEST(Displace, GrazingAnglesStayFinite) {
  const Built built(test::synthSurface(SynthKind::weave, 64, 64, 1.5f), quick({8}, ggx(0.1f)));
  for (const std::uint16_t s : built.asset.levels[0].angular_scale) EXPECT_LT(halfToFloat(s), 1001);
  const DisplacedBrdf brdf(built.asset);
  for (const float degrees : {80.0f, 88.0f, 89.99f, 90.0f}) {
    for (float azimuth = 0; azimuth < 6; azimuth += 0.5f) {
      for (const DisplacedVariant variant : {DisplacedVariant::full, DisplacedVariant::lobes, DisplacedVariant::single}) {
        const float value = brdf.evaluate(0, {0.1f * azimuth, 0.3f}, towards(degrees, azimuth), towards(89, 1), variant).r;
        EXPECT_TRUE(std::isfinite(value) && value >= 0) << degrees;
      }
    }
  }
}

TEST(Displace, RefusesWhatItCannotUse) {
  const OwnedSurface good = test::synthSurface(SynthKind::isotropic, 48, 32);
  const auto refused = [](const OwnedSurface& map, const DisplaceOptions& options) {
    try {
      displace({map.width, map.height, 0, map.heights}, options);
    } catch (const Error& error) {
      return error.rule();
    }
    return std::string("accepted");
  };
  EXPECT_EQ(refused(good, quick({8})), "accepted");
  EXPECT_EQ(refused(good, quick({5})), "accepted");
  EXPECT_EQ(refused(good, quick({33})), "displace.factor");
  DisplaceOptions many = quick({8});
  many.angular = kMostAngular + 1;
  EXPECT_EQ(refused(good, many), "displace.range");
  EXPECT_EQ(refused(good, quick({16, 8})), "displace.range");
  EXPECT_EQ(refused(good, quick({1})), "displace.range");
  EXPECT_EQ(refused(good, quick({8}, {BaseBrdf::Kind::diffuse, 1.1f, 0, 1, 0})), "displace.range");
  EXPECT_EQ(refused(good, quick({8}, {BaseBrdf::Kind::diffuse, 0, 0, 1, 0})), "displace.range");
  EXPECT_EQ(refused(good, quick({8}, ggx(0.01f))), "displace.range");
  OwnedSurface bad = good;
  bad.heights[40] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(refused(bad, quick({8})), "heights.finite");
  bad = good;
  for (float& h : bad.heights) h *= 100;
  EXPECT_EQ(refused(bad, quick({8})), "displace.steep");
}

TEST(Displace, RefusesTexturesThatItCannotUse) {
  const OwnedSurface map = test::synthSurface(SynthKind::isotropic, 48, 32);
  const std::size_t texels = map.heights.size();
  const auto refused = [&](const BaseBrdf& base, BaseTexture texture) {
    DisplaceOptions options = quick({8}, base);
    options.texture = std::move(texture);
    try {
      displace({map.width, map.height, 0, map.heights}, options);
    } catch (const Error& error) {
      return error.rule();
    }
    return std::string("accepted");
  };
  const auto colors = [&](std::size_t count, float last) {
    std::vector<float> values(count, 0.5f);
    values.back() = last;
    return values;
  };
  EXPECT_EQ(refused({}, {3, colors(3 * texels, 0), {}}), "accepted");
  EXPECT_EQ(refused({}, {3, colors(texels, 1), {}}), "displace.texture");
  EXPECT_EQ(refused({}, {3, colors(3 * texels, 1.01f), {}}), "displace.texture");
  EXPECT_EQ(refused({}, {1, colors(texels, -0.01f), {}}), "displace.texture");
  EXPECT_EQ(refused({}, {1, colors(texels, std::numeric_limits<float>::quiet_NaN()), {}}), "displace.texture");
  EXPECT_EQ(refused({}, {1, std::vector<float>(texels), {}}), "displace.texture");  // black
  EXPECT_EQ(refused({}, {1, {}, colors(texels, 1)}), "displace.texture");           // no roughness to vary
  EXPECT_EQ(refused(ggx(0.4f), {1, {}, colors(texels, 1)}), "accepted");
  EXPECT_EQ(refused(ggx(0.4f), {1, {}, colors(texels, 0.1f)}), "displace.texture");
  EXPECT_EQ(refused(ggx(0.4f), {1, {}, colors(texels, 2.6f)}), "displace.texture");
  EXPECT_EQ(refused(ggx(0.4f), {1, {}, colors(texels - 1, 1)}), "displace.texture");
}

struct QueryCase {
  const char* name;
  BaseBrdf base;
  bool textured;
};

/// Colours that follow the slope along u, and roughness.
BaseTexture someTexture(const OwnedSurface& map, bool rough) {
  BaseTexture texture{3, {}, {}};
  const auto surface = map.surface();
  for (std::size_t k = 0; k < surface.cellCount(); ++k) {
    const float slope = std::clamp(surface.slope(2 * k).x, -1.0f, 1.0f);
    for (const float c : {0.5f + 0.5f * slope, 0.25f, 0.5f - 0.5f * slope}) texture.colors.push_back(c);
    if (rough) texture.roughness.push_back(0.75f + 0.25f * slope);
  }
  return texture;
}

class DisplacedBrdfQuery : public testing::TestWithParam<QueryCase> {
 protected:
  DisplacedBrdfQuery() : map_(test::synthSurface(SynthKind::isotropic, 64, 64)), built_(map_, options()) {}

  DisplaceOptions options() const {
    DisplaceOptions o = quick({8, 16}, GetParam().base);
    if (GetParam().textured) o.texture = someTexture(map_, o.base.kind == BaseBrdf::Kind::ggx);
    return o;
  }

  OwnedSurface map_;
  Built built_;
};

TEST_P(DisplacedBrdfQuery, IsReciprocal) {
  const DisplacedBrdf brdf(built_.asset);
  for (const DisplacedVariant variant : {DisplacedVariant::full, DisplacedVariant::lobes, DisplacedVariant::single}) {
    for (int k = 0; k < 50; ++k) {
      const Vec3 wi = gridDirection(k * 31 % 225, 15), wo = gridDirection(k * 53 % 225, 15);
      const Vec2 uv = {0.37f * static_cast<float>(k), 0.11f * static_cast<float>(k)};
      const Rgb there = brdf.evaluate(0, uv, wi, wo, variant), back = brdf.evaluate(0, uv, wo, wi, variant);
      EXPECT_NEAR(there.r, back.r, 1e-4f * (there.r + 1e-3f));
      EXPECT_NEAR(there.b, back.b, 1e-4f * (there.b + 1e-3f));
    }
  }
}

TEST_P(DisplacedBrdfQuery, SamplesFollowTheirDensity) {
  // The mean of f cos / pdf over samples is the integral of f cos, which the same integrand over even directions also gives.
  const DisplacedBrdf brdf(built_.asset);
  const auto sum = [](Rgb c) { return static_cast<double>(c.r + c.g + c.b); };
  const Vec2 uv = {0.4f, 0.7f};
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform(0, 1);
  for (const LevelBlend levels : {LevelBlend{1, 1, 0}, LevelBlend{0, 1, 0.3f}}) {
    for (const Vec3 wo : {towards(10, 2), towards(55, 0.3f)}) {
      double sampled = 0, even = 0, mass = 0;
      const int count = 200000;
      for (int k = 0; k < count; ++k) {
        const DirectionSample s = brdf.sample(levels, uv, wo, {uniform(random), uniform(random)});
        if (s.pdf > 0) {
          EXPECT_NEAR(s.pdf, brdf.pdf(levels, uv, s.direction, wo), 1e-6f * s.pdf);
          EXPECT_NEAR(dot(s.direction, s.direction), 1, 1e-4f);
          sampled += sum(brdf.reflected(levels, uv, s.direction, wo)) / s.pdf;
        }
      }
      const int n = 400;
      for (int d = 0; d < n * n; ++d) {
        const Vec3 above = gridDirection(d, n);
        const double part = 2 * std::numbers::pi / (n * n);
        for (const Vec3 wi : {above, Vec3{above.x, above.y, -above.z}}) {  // a tilted facet is lit from below the horizon, too
          even += part * sum(brdf.reflected(levels, uv, wi, wo));
          mass += part * brdf.pdf(levels, uv, wi, wo);
        }
      }
      EXPECT_NEAR(sampled / count, even, 0.01 * even);  // noise of the samples
      EXPECT_LT(mass, 1.01);
      EXPECT_GT(mass, 0.8);  // normals that face away from the view reflect nothing
    }
  }
}

TEST_P(DisplacedBrdfQuery, AnswersWhatNoRendererMeansToAsk) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinity = std::numeric_limits<float>::infinity();
  const DisplacedBrdf brdf(built_.asset);
  const Vec3 good = towards(30, 1);
  const Vec2 at = {0.2f, 0.9f};
  for (const DisplacedVariant variant : {DisplacedVariant::full, DisplacedVariant::lobes, DisplacedVariant::single}) {
    for (const Vec3 bad : {Vec3{0, 0, -1}, {0, 0, 0}, {kNan, 0, 1}, {0, kInfinity, 1}, {3, 4, 5}, {-1e-9f, 0, -1e-9f}}) {
      EXPECT_EQ(brdf.reflected({0, 1, 0.5f}, at, bad, good, variant), Rgb{}) << bad.x << bad.z;
      EXPECT_EQ(brdf.reflected({0, 1, 0.5f}, at, good, bad, variant), Rgb{}) << bad.x << bad.z;
    }
    for (const float u : {kNan, kInfinity, -1e30f, -1e-12f, 1e9f})
      for (const Vec2 uv : {Vec2{u, 0.4f}, {0.4f, u}}) {
        const Rgb value = brdf.reflected({0, 1, 0.5f}, uv, good, towards(20, 3), variant);
        EXPECT_TRUE(std::isfinite(value.r) && value.r >= 0) << u;
      }
    // Both in the plane of the facet: no division by a cosine of 0.
    const Vec3 n = brdf.normal(0, at), along = {n.z, 0, -n.x};
    const float length = 1 / std::sqrt(dot(along, along));
    for (const float sign : {-1.0f, 1.0f}) {
      const Rgb value = brdf.reflected({0, 0, 0}, at, length * along, sign * length * along, variant);
      EXPECT_TRUE(std::isfinite(value.r) && value.r >= 0);
    }
  }
  for (const Vec3 bad : {Vec3{kNan, 0, 1}, {0, kInfinity, 1}, {3, 4, 5}}) {
    EXPECT_EQ(brdf.pdf({0, 1, 0.5f}, at, bad, good), 0);
    EXPECT_EQ(brdf.pdf({0, 1, 0.5f}, at, good, bad), 0);
    EXPECT_EQ(brdf.sample({0, 1, 0.5f}, at, bad, {0.5f, 0.5f}).pdf, 0);
  }
  EXPECT_TRUE(std::isfinite(brdf.pdf(0, at, -1.0f * good, good)));  // no half vector
  for (const Vec2 xi : {Vec2{-1, 2}, {kNan, kNan}, {1, 1}, {kInfinity, -kInfinity}}) {
    const DirectionSample s = brdf.sample({0, 1, 0.5f}, at, good, xi);
    EXPECT_TRUE(std::isfinite(s.pdf) && s.pdf >= 0 && std::isfinite(dot(s.direction, s.direction))) << xi.x;
  }
  EXPECT_EQ(brdf.levelsFor(kNan).weight, 0);
  EXPECT_EQ(brdf.levelsFor(kInfinity).first, 1);
  EXPECT_EQ(brdf.levelsAt(kNan).second, 0);
  EXPECT_EQ(brdf.levelsAt(-3).second, 0);
  EXPECT_EQ(brdf.levelsAt(kInfinity).first, 1);
  EXPECT_FLOAT_EQ(brdf.levelsAt(0.25f).weight, 0.25f);
}

TEST_P(DisplacedBrdfQuery, BlendsBetweenLevels) {
  const DisplacedBrdf brdf(built_.asset);
  EXPECT_EQ(brdf.levelsFor(1).weight, 0);
  EXPECT_EQ(brdf.levelsFor(8).weight, 0);
  EXPECT_NEAR(brdf.levelsFor(8 * std::sqrt(2.0f)).weight, 0.5f, 1e-5f);
  EXPECT_EQ(brdf.levelsFor(1e6f).first, 1);
  const Vec3 wi = towards(30, 1), wo = towards(40, 2);
  const Vec2 uv = {0.2f, 0.9f};
  const float a = brdf.reflected({0, 0, 0}, uv, wi, wo).b, b = brdf.reflected({1, 1, 0}, uv, wi, wo).b;
  EXPECT_NEAR(brdf.reflected({0, 1, 0.25f}, uv, wi, wo).b, 0.75f * a + 0.25f * b, 1e-5f * (a + b));
  EXPECT_NE(a, b);
}

TEST_P(DisplacedBrdfQuery, RepeatsBeyondTheMap) {
  const DisplacedBrdf brdf(built_.asset);
  const Vec3 wi = towards(30, 1), wo = towards(40, 2);
  for (const Vec2 uv : {Vec2{0.001f, 0.002f}, Vec2{0.5f, 0.9999f}, Vec2{0.3f, 0.3f}}) {
    const float here = brdf.evaluate(0, uv, wi, wo).g;
    EXPECT_NEAR(brdf.evaluate(0, {uv.x + 2, uv.y - 1}, wi, wo).g, here, 1e-3f * here);
  }
}

INSTANTIATE_TEST_SUITE_P(Bases, DisplacedBrdfQuery,
                         testing::Values(QueryCase{"Diffuse", {BaseBrdf::Kind::diffuse, 0.8f, 0, 1, 0}, false},
                                         QueryCase{"Ggx", {BaseBrdf::Kind::ggx, 1, 0.3f, 0.2f, 3.9f}, false},
                                         QueryCase{"ColoredDiffuse", {BaseBrdf::Kind::diffuse, 0.8f, 0, 1, 0}, true},
                                         QueryCase{"ColoredGgx", {BaseBrdf::Kind::ggx, 1, 0.4f, 0.2f, 3.9f}, true}),
                         [](const auto& test) { return test.param.name; });

TEST(DisplacedBrdf, OneBeckmannLobeIsRightForAGaussianSurface) {
  // A Gaussian field's slopes are what LEADR assumes; its single lobe and the six lobes must then nearly agree before scaling.
  OwnedSurface map = test::synthSurface(SynthKind::isotropic, 256, 256, 0.3f);
  DisplaceOptions options = quick({64}, ggx(0.3f));
  const Built built(map, options);
  const DisplacedBrdf brdf(built.asset);
  for (const float degrees : {0.0f, 15.0f, 30.0f}) {
    const float single =
        brdf.evaluate(0, {0.4f, 0.4f}, towards(degrees, 0), towards(degrees, 3.1415927f), DisplacedVariant::single).r;
    const float lobes =
        brdf.evaluate(0, {0.4f, 0.4f}, towards(degrees, 0), towards(degrees, 3.1415927f), DisplacedVariant::lobes).r;
    EXPECT_NEAR(single, lobes, 0.2f * lobes) << degrees;  // Beckmann against GGX tails
  }
}

}  // namespace
}  // namespace glint::bake::displace_test
