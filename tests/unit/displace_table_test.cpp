#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <limits>
#include <numbers>
#include <random>

#include "glint/bake/displace/displace.h"
#include "glint/bake/displace/merl_table.h"
#include "glint/model/error.h"
#include "glint/query/brdf/displaced_brdf.h"
#include "support/merl_files.h"
#include "support/test_heights.h"

namespace glint::bake::displace_table_test {
namespace {

using test::OwnedSurface;
constexpr double kPi = std::numbers::pi;
const BaseBrdf kGgx{BaseBrdf::Kind::ggx, 1, 0.3f, 1, 0};

double ggx(Vec3 wi, Vec3 wo) {
  return wi.z > 0 && wo.z > 0 ? baseTimesCosines(kGgx, {0, 0, 1}, wi, wo) / (double{wi.z} * wo.z) : -1;
}

std::shared_ptr<const MeasuredBrdf> measured(const test::BrdfFunction& brdf, int half = 90, int difference = 90,
                                             int azimuth = 180) {
  return std::make_shared<const MeasuredBrdf>(readMerl(test::merlFile(brdf, half, difference, azimuth)));
}

/// A white Lambert; a few bins hold a constant as well as many.
const std::shared_ptr<const MeasuredBrdf>& white() {
  static const auto brdf = measured([](Vec3, Vec3, int) { return 1 / kPi; }, 4, 4, 4);
  return brdf;
}

const std::shared_ptr<const MeasuredBrdf>& glossy() {
  static const auto brdf = measured([](Vec3 wi, Vec3 wo, int) { return ggx(wi, wo); }, 90, 60, 36);
  return brdf;
}

Vec3 towards(double degrees, double azimuth) {
  const double t = degrees * kPi / 180;
  return {static_cast<float>(std::sin(t) * std::cos(azimuth)), static_cast<float>(std::sin(t) * std::sin(azimuth)),
          static_cast<float>(std::cos(t))};
}

EffectiveOptions effectiveOptions(const std::shared_ptr<const MeasuredBrdf>& table, int bounces) {
  EffectiveOptions options;
  options.base = table->base(), options.table = table, options.bounces = bounces;
  return options;
}

EffectiveBrdf effective(const OwnedSurface& map, const EffectiveOptions& options, std::span<const Vec3> directions) {
  const auto surface = map.surface();
  const VisibilityMasks masks(surface, directions);
  return effectiveBrdf(surface, masks, directions, {1, 1, map.width, map.height, 1}, options);
}

std::string refused(const std::vector<std::byte>& bytes) {
  try {
    MeasuredBrdf{readMerl(bytes)};
  } catch (const Error& error) {
    return error.rule() + ": " + error.what();
  }
  return "accepted";
}

TEST(MerlTable, BinsAreAtTheAnglesOfTheForm) {
  // A value that tells its angles, read back by them; linear functions survive interpolation.
  const auto angles = [](Vec3 wi, Vec3 wo, int c) {
    const test::MerlAngles a = test::merlAngles(wi, wo, {0, 0, 1});
    return c == 0 ? std::sqrt(a.half / (kPi / 2)) : c == 1 ? a.difference : std::cos(2 * a.azimuth) + 1;
  };
  const MerlTable table = readMerl(test::merlFile(angles, 30, 30, 60));
  for (const double t : {0.05, 0.3, 0.9})
    for (const double d : {0.1, 0.7, 1.3})
      for (const double p : {0.2, 1.1, 2.9, 3.4}) {
        const auto v = table.at(t, d, p);
        EXPECT_NEAR(v[0], std::sqrt(t / (kPi / 2)), 1e-4);
        EXPECT_NEAR(v[1], d, 1e-4);
        EXPECT_NEAR(v[2], std::cos(2 * p) + 1, 2e-3);
      }
}

TEST(MerlTable, FilesThatAreNoTableAreRefused) {
  std::vector<std::byte> good = test::merlFile([](Vec3, Vec3, int) { return 0.2; }, 3, 4, 5);
  EXPECT_EQ(refused(good), "accepted");
  EXPECT_NE(refused({}).find("merl.size"), std::string::npos);
  for (std::size_t size = 0; size < good.size(); ++size)
    ASSERT_EQ(refused({good.begin(), good.begin() + static_cast<std::ptrdiff_t>(size)}).substr(0, 9), "merl.size");
  std::vector<std::byte> longer = good;
  longer.push_back({});
  EXPECT_NE(refused(longer).find("too many"), std::string::npos);
  const auto with = [&](std::size_t bin, double value) {
    std::vector<std::byte> bytes = good;
    std::memcpy(&bytes[12 + 8 * bin], &value, sizeof value);
    return bytes;
  };
  // The second plane, half angle 1, difference 2, azimuth 3.
  const std::string nan = refused(with(60 + 20 + 10 + 3, std::numeric_limits<double>::quiet_NaN()));
  EXPECT_NE(nan.find("green, theta_half 1, theta_diff 2, phi_diff 3"), std::string::npos) << nan;
  EXPECT_EQ(refused(with(0, std::numeric_limits<double>::infinity())).substr(0, 11), "merl.values");
  EXPECT_EQ(refused(with(0, 1e300)).substr(0, 11), "merl.values");
  EXPECT_EQ(readMerl(with(7, -1)).negative, 1U);
  EXPECT_EQ(readMerl(with(7, -1)).values[7], 0);
  EXPECT_EQ(refused(test::merlFile([](Vec3, Vec3, int) { return -1.0; }, 3, 4, 5)).substr(0, 11), "merl.values");
  EXPECT_EQ(refused(test::merlFile([](Vec3, Vec3, int) { return 2.0; }, 3, 4, 5)).substr(0, 9), "merl.gain");
  const std::int32_t image = 0x474e5089;  // the first bytes of a PNG
  std::memcpy(good.data(), &image, sizeof image);
  EXPECT_EQ(refused(good).substr(0, 9), "merl.size");
}

TEST(MeasuredBrdf, LookupsEqualTheTableByItsAngles) {
  // Against the table asked by trigonometry, for facets of any direction. The nodes are as dense as the bins: twice their
  // interpolation.
  const MerlTable table =
      readMerl(test::merlFile([](Vec3 wi, Vec3 wo, int c) { return (c + 1) * ggx(wi, wo) / 3; }, 90, 60, 36));
  const MeasuredBrdf brdf(table);
  EXPECT_EQ(brdf.channels(), 3);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  double squares = 0, all = 0;
  for (int k = 0; k < 4000; ++k) {
    const auto any = [&] { return towards(90 * uniform(random), 2 * kPi * uniform(random)); };
    const Vec3 wi = any(), wo = any(), n = any();
    if (dot(n, wi) < 0.1f || dot(n, wo) < 0.1f) continue;
    const test::MerlAngles a = test::merlAngles(wi, wo, n);
    const auto wanted = table.at(a.half, a.difference, a.azimuth);
    const Rgb f = brdf.value(tablePair(wi, wo), n);
    squares += std::pow(f.g - wanted[1], 2), all += std::pow(wanted[1], 2);
    EXPECT_NEAR(f.g, wanted[1], 0.02 * wanted[1] + 2e-3);
    EXPECT_NEAR(f.b, 1.5f * f.g, 1e-4f * f.b);
    EXPECT_EQ(f.g, brdf.value(tablePair(wo, wi), n).g);
  }
  EXPECT_LT(std::sqrt(squares / all), 0.005);
}

TEST(MeasuredBrdf, TablesOfAnAssetAreMeansOverLobes) {
  const std::vector<float> tables = glossy()->assetTables(1);
  ASSERT_EQ(tables.size(), kBaseTables * kBaseTableNodes);
  const Vec3 wi = towards(35, 0.4), wo = towards(50, 2.5);
  double squares = 0, all = 0;
  for (const float kappa : {2.0f, 16.0f, 256.0f})
    for (const Vec3 centre : {towards(5, 1), towards(20, 1.8), towards(50, 4)}) {
      // Even directions of the sphere, weighted by the lobe.
      double wanted = 0;
      const int n = 400;
      for (int k = 0; k < n * n; ++k) {
        const Vec3 normal = gridDirection(k, n);
        for (const Vec3 m : {normal, Vec3{normal.x, normal.y, -normal.z}})
          wanted += 2 * kPi / (n * n) * vmfDensity(dot(centre, m), kappa) * baseTimesCosines(kGgx, m, wi, wo);
      }
      const double value = tableLobe(tables.data(), 1, tablePair(wi, wo), centre, kappa, wi, wo).r;
      EXPECT_NEAR(value, wanted, 0.03 * wanted + 1e-4) << kappa;
      squares += std::pow(value - wanted, 2), all += wanted * wanted;
    }
  EXPECT_LT(std::sqrt(squares / all), 0.01);
  // Without width: the base.
  const Vec3 up = {0, 0, 1};
  EXPECT_NEAR(tableLobe(tables.data(), 1, tablePair(wi, wo), up, kMaxKappa, wi, wo).r, baseTimesCosines(kGgx, up, wi, wo),
              0.02 * baseTimesCosines(kGgx, up, wi, wo));
}

TEST(MeasuredBrdf, AWhiteTableIsDrawnByTheCosineAndKeepsLight) {
  EXPECT_EQ(white()->channels(), 1);
  EXPECT_GT(white()->diffuseShare(), 0.9f);
  EXPECT_NEAR(white()->albedo(), 1, 0.01);
  EXPECT_LT(glossy()->diffuseShare(), 0.2f);
  EXPECT_NEAR(glossy()->base().alpha, 0.3f, 0.1f);
}

TEST(MeasuredBrdf, SinglyScatteredLightIsThatOfTheBase) {
  const auto directions = angularDirections(7);
  const OwnedSurface map = test::synthSurface(SynthKind::isotropic, 96, 64);
  EffectiveOptions wanted_options;
  wanted_options.base = kGgx, wanted_options.bounces = 1;
  const EffectiveBrdf wanted = effective(map, wanted_options, directions);
  const EffectiveBrdf e = effective(map, effectiveOptions(glossy(), 1), directions);
  EffectiveOptions diffuse;
  diffuse.bounces = 1;
  const EffectiveBrdf lambert = effective(map, diffuse, directions);
  const EffectiveBrdf even = effective(map, effectiveOptions(white(), 1), directions);
  for (std::size_t i = 0; i < directions.size(); ++i)
    for (std::size_t o = 0; o < directions.size(); ++o) {
      const std::size_t k = i * directions.size() + o;
      EXPECT_NEAR(even.values[k], lambert.values[k], 1e-4f * lambert.values[k] + 1e-7f);
      EXPECT_EQ(e.values[k], e.values[o * directions.size() + i]);
      if (directions[i].z < kGrazingCosine || directions[o].z < kGrazingCosine) continue;
      EXPECT_NEAR(e.values[k], wanted.values[k], 0.015f * wanted.values[k] + 1e-5f) << i << " " << o;
    }
}

TEST(MeasuredBrdf, InterreflectionsAreThoseOfTheBase) {
  const auto directions = angularDirections(7);
  const OwnedSurface map = test::grooves(64, 16, 8, 1);
  const auto light = [&](const EffectiveOptions& options, double& share) {
    const EffectiveBrdf e = effective(map, options, directions);
    share = e.interreflected;
    double sum = 0;
    for (const float value : e.values) sum += value;
    return sum;
  };
  double share = 0, wanted_share = 0;
  EffectiveOptions options;
  double wanted = light(options, wanted_share);
  EXPECT_NEAR(light(effectiveOptions(white(), kAllBounces), share), wanted, 0.005 * wanted);
  // The diffuse estimator counts light where it leaves facets, the other one where it reaches views.
  EXPECT_NEAR(share, wanted_share, 0.06 * wanted_share);
  options.base = kGgx;
  wanted = light(options, wanted_share);
  EXPECT_NEAR(light(effectiveOptions(glossy(), kAllBounces), share), wanted, 0.01 * wanted);
  EXPECT_NEAR(share, wanted_share, 0.03 * wanted_share);
}

TEST(MeasuredBrdf, AWhiteTableKeepsTheLightOfAFurnace) {
  const auto directions = angularDirections(9);
  const EffectiveBrdf e =
      effective(test::synthSurface(SynthKind::weave, 128, 96), effectiveOptions(white(), kAllBounces), directions);
  const std::size_t n = directions.size();
  for (std::size_t o = 0; o < n; ++o) {
    if (directions[o].z < kGrazingCosine) continue;
    double light = 0, flat = 0;
    for (std::size_t i = 0; i < n; ++i) light += e.values[i * n + o], flat += directions[i].z * directions[o].z / kPi;
    EXPECT_NEAR(light / flat, 1, 0.01) << o;
  }
}

/// A displaced surface with a coloured table: red Lambert, green GGX, blue both.
class DisplacedTable : public testing::Test {
 protected:
  static const DisplacementData& data() {
    static const DisplacementData built = [] {
      const OwnedSurface map = test::synthSurface(SynthKind::isotropic, 64, 64);
      DisplaceOptions options;
      options.factors = {8, 16}, options.angular = 7, options.spatial = 1;
      options.table = measured(
          [](Vec3 wi, Vec3 wo, int c) {
            const double lambert = 0.5 / kPi, gloss = std::max(0.0, ggx(wi, wo));
            return c == 0 ? lambert : c == 1 ? gloss : 0.5 * (lambert + gloss);
          },
          60, 45, 36);
      options.base = options.table->base();
      return displace({map.width, map.height, 0, map.heights}, options);
    }();
    return built;
  }
  DisplacedTable() : asset_(data().view()), brdf_(asset_) {}

  Displacement asset_;
  DisplacedBrdf brdf_;
};

TEST_F(DisplacedTable, IsReciprocalInEveryChannel) {
  for (const DisplacedVariant variant : {DisplacedVariant::full, DisplacedVariant::lobes, DisplacedVariant::single})
    for (int k = 0; k < 50; ++k) {
      const Vec3 wi = gridDirection(k * 31 % 225, 15), wo = gridDirection(k * 53 % 225, 15);
      const Vec2 uv = {0.37f * static_cast<float>(k), 0.11f * static_cast<float>(k)};
      const Rgb there = brdf_.evaluate(0, uv, wi, wo, variant), back = brdf_.evaluate(0, uv, wo, wi, variant);
      EXPECT_NEAR(there.r, back.r, 1e-4f * (there.r + 1e-3f));
      EXPECT_NEAR(there.g, back.g, 1e-4f * (there.g + 1e-3f));
    }
}

TEST_F(DisplacedTable, ReflectsWhatTheOriginalDoes) {
  // Red and green are what displacements of a Lambert and of GGX reflect; the whole map, where its cells hide nothing.
  const OwnedSurface map = test::synthSurface(SynthKind::isotropic, 64, 64);
  const auto directions = angularDirections(7);
  EffectiveOptions diffuse, glossy_options;
  diffuse.base.albedo = 0.5f, glossy_options.base = kGgx;
  const EffectiveBrdf red = effective(map, diffuse, directions), green = effective(map, glossy_options, directions);
  ASSERT_EQ(asset_.channels, 3);
  const DisplacementLevel& l = asset_.levels[0];
  for (std::size_t i = 0; i < directions.size(); ++i)
    for (std::size_t o = 0; o < directions.size(); ++o) {
      if (directions[i].z < 0.6f || directions[o].z < 0.6f) continue;
      Rgb sum;
      for (int cell = 0; cell < l.columns * l.rows; ++cell)
        for (const float inside : {0.25f, 0.75f}) {
          const Vec2 uv = {(static_cast<float>(cell % l.columns) + inside) / static_cast<float>(l.columns) + 0.5f / 64,
                           (static_cast<float>(cell / l.columns) + inside) / static_cast<float>(l.rows) + 0.5f / 64};
          const Vec3 n = brdf_.normal(0, uv);
          sum = sum + 0.5f / static_cast<float>(l.columns * l.rows) * dot(n, directions[i]) * dot(n, directions[o]) / n.z *
                          brdf_.evaluate(0, uv, directions[i], directions[o]);
        }
      const std::size_t k = i * directions.size() + o;
      EXPECT_NEAR(sum.r, red.values[k], 0.015 * red.values[k]);
      EXPECT_NEAR(sum.g, green.values[k], 0.03 * green.values[k] + 1e-4);
    }
}

TEST_F(DisplacedTable, SamplesFollowTheirDensity) {
  const Vec2 uv = {0.4f, 0.7f};
  std::mt19937 random(9);
  std::uniform_real_distribution<float> uniform(0, 1);
  const LevelBlend levels{0, 1, 0.3f};
  const Vec3 wo = towards(40, 2);
  double sampled = 0, even = 0, mass = 0;
  const int count = 60000, n = 200;
  for (int k = 0; k < count; ++k) {
    const DirectionSample s = brdf_.sample(levels, uv, wo, {uniform(random), uniform(random)});
    if (s.pdf <= 0) continue;
    EXPECT_NEAR(s.pdf, brdf_.pdf(levels, uv, s.direction, wo), 1e-5f * s.pdf);
    sampled += brdf_.reflected(levels, uv, s.direction, wo).b / s.pdf;
  }
  for (int d = 0; d < n * n; ++d) {
    const Vec3 above = gridDirection(d, n);
    const double part = 2 * kPi / (n * n);
    for (const Vec3 wi : {above, Vec3{above.x, above.y, -above.z}}) {
      even += part * brdf_.reflected(levels, uv, wi, wo).b;
      mass += part * brdf_.pdf(levels, uv, wi, wo);
    }
  }
  EXPECT_NEAR(sampled / count, even, 0.02 * even);
  EXPECT_LT(mass, 1.01);
  EXPECT_GT(mass, 0.8);
}

TEST_F(DisplacedTable, AnswersWhatNoRendererMeansToAsk) {
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  const Vec3 good = towards(30, 1);
  for (const DisplacedVariant variant : {DisplacedVariant::full, DisplacedVariant::lobes, DisplacedVariant::single}) {
    for (const Vec3 bad : {Vec3{0, 0, -1}, {0, 0, 0}, {kNan, 0, 1}, {3, 4, 5}})
      EXPECT_EQ(brdf_.reflected({0, 1, 0.5f}, {0.2f, 0.9f}, bad, good, variant), Rgb{});
    for (const Vec3 same : {good, Vec3{0, 0, 1}, towards(89.9, 2)}) {
      const Rgb value = brdf_.reflected({0, 1, 0.5f}, {0.2f, 0.9f}, same, same, variant);
      EXPECT_TRUE(std::isfinite(value.r) && value.r >= 0);
    }
  }
}

TEST(DisplaceTable, DoesNotDependOnThreads) {
  const OwnedSurface map = test::synthSurface(SynthKind::isotropic, 32, 32);
  const auto directions = angularDirections(4);
  const EffectiveBrdf many = effective(map, effectiveOptions(glossy(), kAllBounces), directions);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  EXPECT_EQ(effective(map, effectiveOptions(glossy(), kAllBounces), directions).values, many.values);
}

TEST(DisplaceTable, RoughnessAndTablesThatAreMissingAreRefused) {
  const OwnedSurface map = test::synthSurface(SynthKind::isotropic, 32, 32);
  DisplaceOptions options;
  options.table = white(), options.base = white()->base();
  const auto build = [&] { return displace({map.width, map.height, 0, map.heights}, options); };
  options.texture.roughness.assign(32 * 32, 1);
  EXPECT_THROW(build(), Error);
  options.texture.roughness.clear(), options.table = nullptr;
  EXPECT_THROW(build(), Error);
}

}  // namespace
}  // namespace glint::bake::displace_table_test
