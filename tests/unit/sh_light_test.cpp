#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "glint/bake/sh/gauss_legendre.h"
#include "glint/bake/sh/light.h"
#include "glint/math/half.h"
#include "glint/model/error.h"
#include "glint/query/light/sh_basis.h"

namespace glint::bake::sh_light_test {
namespace {

constexpr double kPi = std::numbers::pi;

struct Direction {
  double x, y, z;
};

std::vector<double> harmonics(int order, Direction d) {
  std::vector<double> memory(ShRecurrence<double>::size(order)), out(shCount(order));
  std::vector<double> scratch(ShAccumulator<double>::scratchSize(order));
  const ShRecurrence<double> recurrence(order, memory);
  ShAccumulator<double> sum(recurrence, order, out, scratch);
  sum.add(d.x, d.y, d.z, 1);
  sum.flush();
  return out;
}

Environment makeEnvironment(int height, const std::function<float(Direction, int)>& radiance) {
  Environment e{2 * height, height, {}};
  for (int j = 0; j < height; ++j) {
    for (int i = 0; i < 2 * height; ++i) {
      const double theta = kPi * (1 - (j + 0.5) / height), phi = kPi * (i + 0.5) / height;
      for (int c = 0; c < 3; ++c)
        e.rgb.push_back(radiance({std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)}, c));
    }
  }
  return e;
}

Environment noisyEnvironment(int height) {
  std::mt19937 random(7);
  return makeEnvironment(height, [&](Direction, int) { return std::exp(std::normal_distribution<float>(0, 1.5f)(random)); });
}

/// Frame of an outgoing direction of the grid, as ShLight defines it.
struct Frame {
  Direction x, y, z;
  Frame(double theta, double phi)
      : x{std::cos(theta) * std::cos(phi), std::cos(theta) * std::sin(phi), -std::sin(theta)},
        y{-std::sin(phi), std::cos(phi), 0},
        z{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)} {}
  Direction world(Direction d) const {
    return {d.x * x.x + d.y * y.x + d.z * z.x, d.x * x.y + d.y * y.y + d.z * z.y, d.x * x.z + d.y * y.z + d.z * z.z};
  }
  Direction local(Direction d) const {
    return {d.x * x.x + d.y * x.y + d.z * x.z, d.x * y.x + d.y * y.y + d.z * y.z, d.x * z.x + d.y * z.y + d.z * z.z};
  }
};

std::vector<double> storedCoefficients(const ShLight& light, std::size_t direction, int channel) {
  const std::size_t count = shCount(light.order), start = (direction * 3 + static_cast<std::size_t>(channel)) * count;
  std::vector<double> values;
  for (std::size_t k = 0; k < count; ++k) {
    const double stored = light.precision == ShPrecision::f16
                              ? halfToFloat(static_cast<const std::uint16_t*>(light.coefficients)[start + k])
                              : static_cast<const float*>(light.coefficients)[start + k];
    values.push_back(stored * light.scales[direction]);
  }
  return values;
}

double relativeError(const std::vector<double>& a, const std::vector<double>& b) {
  double error = 0, norm = 0;
  for (std::size_t k = 0; k < a.size(); ++k) error += std::pow(a[k] - b[k], 2), norm += b[k] * b[k];
  return std::sqrt(error / norm);
}

TEST(Environment, ProjectionEqualsSumsOverFinePixels) {
  constexpr int kOrder = 9, kHeight = 4, kFine = 48;
  const Environment e = noisyEnvironment(kHeight);
  const std::vector<double> result = projectEnvironment(e, kOrder);
  std::vector<double> expected(result.size());
  for (int j = 0; j < kHeight * kFine; ++j) {
    for (int i = 0; i < 2 * kHeight * kFine; ++i) {
      const double step = kPi / (kHeight * kFine), theta = kPi - (j + 0.5) * step, phi = (i + 0.5) * step;
      const auto y = harmonics(kOrder, {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)});
      for (std::size_t c = 0; c < 3; ++c) {
        const double light =
            e.rgb[(static_cast<std::size_t>(j / kFine) * 2 * kHeight + static_cast<std::size_t>(i / kFine)) * 3 + c];
        for (std::size_t k = 0; k < y.size(); ++k) expected[c * y.size() + k] += light * y[k] * std::sin(theta) * step * step;
      }
    }
  }
  // The midpoint rule of the fine pixels: (9 * 0.0164)^2 / 24.
  EXPECT_LT(relativeError(result, expected), 1e-3);
  EXPECT_GT(relativeError(result, expected), 0);
}

TEST(Environment, ProjectionOfBandsBeyondTheImageIsExact) {
  // One pixel of a coarse image, integrated by many more nodes than the builder takes.
  constexpr int kOrder = 40;
  Environment e{6, 3, std::vector<float>(54)};
  e.rgb[(1 * 6 + 2) * 3 + 1] = 5;
  const std::vector<double> result = projectEnvironment(e, kOrder);
  std::vector<double> expected(shCount(kOrder)), green(expected.size());
  const GaussLegendre theta = gaussLegendre(60, kPi / 3, 2 * kPi / 3), phi = gaussLegendre(60, 2 * kPi / 3, kPi);
  for (std::size_t a = 0; a < 60; ++a) {
    for (std::size_t b = 0; b < 60; ++b) {
      const double s = std::sin(theta.nodes[a]);
      const auto y = harmonics(kOrder, {s * std::cos(phi.nodes[b]), s * std::sin(phi.nodes[b]), std::cos(theta.nodes[a])});
      for (std::size_t k = 0; k < y.size(); ++k) expected[k] += 5 * s * theta.weights[a] * phi.weights[b] * y[k];
    }
  }
  std::copy_n(result.begin() + static_cast<std::ptrdiff_t>(shCount(kOrder)), green.size(), green.begin());
  EXPECT_LT(relativeError(green, expected), 1e-10);
  EXPECT_EQ(result[0], 0);
}

/// The definition: integral over half vectors of L(mirror direction) 4 (wo . h) y(h), for the faded environment.
std::vector<double> coefficientsByQuadrature(const Environment& e, int order, int band_limit, const Frame& frame, int channel) {
  std::vector<double> light = projectEnvironment(e, band_limit);
  light.erase(light.begin(), light.begin() + static_cast<std::ptrdiff_t>(shCount(band_limit)) * channel);
  for (int l = 0; l <= band_limit; ++l)
    for (int m = -l; m <= l; ++m) light[shIndex(l, m)] *= lightTaper(l, band_limit);
  std::vector<double> sum(shCount(order));
  const GaussLegendre rule = gaussLegendre(2 * band_limit + order, 0, 1);
  const int columns = 2 * (band_limit + order);
  for (std::size_t a = 0; a < rule.nodes.size(); ++a) {
    for (int b = 0; b < columns; ++b) {
      const double z = rule.nodes[a], s = std::sqrt(1 - z * z), phi = 2 * kPi * (b + 0.5) / columns;
      const Direction h = {s * std::cos(phi), s * std::sin(phi), z};
      const auto there = harmonics(band_limit, frame.world({2 * z * h.x, 2 * z * h.y, 2 * z * z - 1}));
      double radiance = 0;
      for (std::size_t k = 0; k < there.size(); ++k) radiance += light[k] * there[k];
      const auto here = harmonics(order, h);
      for (std::size_t k = 0; k < here.size(); ++k) sum[k] += radiance * 4 * z * here[k] * rule.weights[a] * 2 * kPi / columns;
    }
  }
  return sum;
}

TEST(ShLight, TablesEqualQuadrature) {
  constexpr double kTolerance = 1e-6;
  constexpr int kOrder = 5;
  const Environment e = noisyEnvironment(16);
  const ShLightData data = buildShLight(e, {.order = kOrder, .grid = {5, 7}, .precision = ShPrecision::f32});
  for (const int row : {0, 1, 3, 4}) {
    for (const int column : {0, 4}) {
      const auto expected =
          coefficientsByQuadrature(e, kOrder, lightBandLimit(kOrder), Frame(kPi * row / 4, 2 * kPi * column / 7), 1);
      const auto stored = storedCoefficients(data.view(), static_cast<std::size_t>(row * 7 + column), 1);
      EXPECT_LT(relativeError(stored, expected), kTolerance) << row << " " << column;
    }
  }
}

/// Relative error of the coefficients of a spot of one pixel, for outgoing directions 10 degrees apart, from the spot on.
std::vector<double> spotErrors(int order, int band_limit) {
  constexpr int kHeight = 180, kRows = 19;
  Environment e{2 * kHeight, kHeight, std::vector<float>(6 * kHeight * kHeight)};
  const std::size_t spot = static_cast<std::size_t>(kHeight - 1) * 2 * kHeight + 90;  // beside the pole
  e.rgb[spot * 3] = 1000;
  const ShLightData data =
      buildShLight(e, {.order = order, .grid = {kRows, 8}, .band_limit = band_limit, .precision = ShPrecision::f32});
  std::vector<double> errors;
  for (int row = 0; row < kRows - 1; ++row) {
    const Frame frame(kPi * row / (kRows - 1), 0);
    std::vector<double> expected(shCount(order));
    const GaussLegendre polar = gaussLegendre(4, 0, kPi / kHeight),
                        around = gaussLegendre(4, 0.5 * kPi, (0.5 + 1.0 / kHeight) * kPi);
    for (std::size_t a = 0; a < 4; ++a) {
      for (std::size_t b = 0; b < 4; ++b) {
        const double t = polar.nodes[a], p = around.nodes[b];
        const Direction wi = frame.local({std::sin(t) * std::cos(p), std::sin(t) * std::sin(p), std::cos(t)});
        const auto y = harmonics(order, {wi.x, wi.y, wi.z + 1});
        for (std::size_t k = 0; k < y.size(); ++k)
          expected[k] += 1000 * std::sin(t) * polar.weights[a] * around.weights[b] * y[k];
      }
    }
    errors.push_back(relativeError(storedCoefficients(data.view(), static_cast<std::size_t>(row) * 8, 0), expected));
  }
  return errors;
}

TEST(ShLight, OfASpotAreHarmonicsOfItsHalfVector) {
  for (const int order : {20, 30, 60}) {
    const std::vector<double> errors = spotErrors(order, 0);
    for (int row = 0; row <= 12; ++row) EXPECT_LT(errors[row], 1e-6) << "order " << order << ", " << 10 * row << " degrees";
    EXPECT_LT(errors[15], 1e-3) << order;
  }
}

TEST(ShLight, HigherBandLimitsBringInLightFromBehind) {
  const std::vector<double> usual = spotErrors(30, 0), higher = spotErrors(30, 2 * lightBandLimit(30));
  for (int row = 0; row <= 14; ++row) EXPECT_LT(higher[row], 1e-6) << 10 * row << " degrees";
  EXPECT_LT(higher[16], 0.1 * usual[16]);
}

TEST(ShLight, OfAConstantEnvironmentAreZonalAndTheSameForAllDirections) {
  const Environment e = makeEnvironment(8, [](Direction, int c) { return static_cast<float>(c + 1); });
  const ShLightData data = buildShLight(e, {.order = 12, .grid = {5, 8}, .precision = ShPrecision::f32});
  const GaussLegendre rule = gaussLegendre(20, 0, 1);
  for (std::size_t direction = 0; direction < 40; ++direction) {
    const auto stored = storedCoefficients(data.view(), direction, 2);
    for (int l = 0; l <= 12; ++l) {
      double expected = 0;  // of 3 * 4 cos(theta) on the upper hemisphere
      for (std::size_t k = 0; k < 20; ++k)
        expected += 3 * 4 * rule.nodes[k] * rule.weights[k] * 2 * kPi * std::sqrt((2 * l + 1) / (4 * kPi)) *
                    std::legendre(static_cast<unsigned>(l), rule.nodes[k]);
      for (int m = -l; m <= l; ++m) ASSERT_NEAR(stored[shIndex(l, m)], m == 0 ? expected : 0, 1e-5) << l << " " << m;
    }
  }
}

TEST(ShLight, HalfPrecisionCostsLessThanAThousandth) {
  const Environment e = noisyEnvironment(16);
  const ShLightData exact = buildShLight(e, {.order = 20, .grid = {5, 8}, .precision = ShPrecision::f32});
  const ShLightData half = buildShLight(e, {.order = 20, .grid = {5, 8}});
  for (std::size_t d = 0; d < 40; ++d)
    EXPECT_LT(relativeError(storedCoefficients(half.view(), d, 0), storedCoefficients(exact.view(), d, 0)), 5e-4);
}

TEST(ShLight, BandNormsAreTheLargestChannels) {
  const ShLightData data = buildShLight(noisyEnvironment(8), {.order = 6, .grid = {3, 4}, .precision = ShPrecision::f32});
  for (std::size_t d = 0; d < 12; ++d) {
    for (int l = 0; l <= 6; ++l) {
      double largest = 0;
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        const auto v = storedCoefficients(data.view(), d, c);
        for (int m = -l; m <= l; ++m) sum += v[shIndex(l, m)] * v[shIndex(l, m)];
        largest = std::max(largest, std::sqrt(sum));
      }
      EXPECT_NEAR(data.band_norms[d * 7 + static_cast<std::size_t>(l)] / largest, 1, 1e-5);
    }
  }
}

TEST(ShLight, TheSameWhateverTheChunksOfWork) {
  const Environment e = noisyEnvironment(8);
  const auto a = buildShLight(e, {.order = 8, .grid = {5, 8}}), b = buildShLight(e, {.order = 8, .grid = {5, 8}});
  EXPECT_EQ(a.halves, b.halves);
  EXPECT_EQ(a.scales, b.scales);
}

TEST(ShLight, LowestOrdersAndBlackLightWork) {
  const Environment black{4, 2, std::vector<float>(24)};
  for (const int order : {0, 1}) {
    const ShLightData data = buildShLight(black, {.order = order, .grid = {2, 3}});
    for (const std::uint16_t v : data.halves) EXPECT_EQ(v, 0);
  }
  const ShLightData data = buildShLight(noisyEnvironment(4), {.order = 0, .grid = {2, 3}, .precision = ShPrecision::f32});
  EXPECT_EQ(data.floats.size(), 18u);
}

std::string ruleOf(const std::function<void()>& action) {
  try {
    action();
    return "none";
  } catch (const Error& error) {
    return error.rule();
  }
}

TEST(ShLight, RefusesOrdersAndGridsThatCannotBe) {
  const Environment e = noisyEnvironment(4);
  const auto rule = [&](const ShLightOptions& options) { return ruleOf([&] { buildShLight(e, options); }); };
  EXPECT_EQ(rule({.order = -1}), "sh.order");
  EXPECT_EQ(rule({.order = 1000}), "sh.order");
  EXPECT_EQ(rule({.order = 300, .grid = {65, 128}}), "memory.limit");
  EXPECT_EQ(rule({.order = 4, .grid = {0, 0}}), "sh.grid");
  EXPECT_EQ(rule({.order = 4, .grid = {2, 3}, .band_limit = 2}), "sh.band_limit");
}

TEST(Environment, BadImagesAreRefused) {
  const auto rule = [](const Environment& e) { return ruleOf([&] { requireUsable(e); }); };
  EXPECT_EQ(rule({}), "environment.size");
  EXPECT_EQ(rule({0, 0, {}}), "environment.size");
  EXPECT_EQ(rule({3, 2, std::vector<float>(18)}), "environment.aspect");
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    Environment e = noisyEnvironment(2);
    e.rgb[4] = bad;
    EXPECT_EQ(rule(e), "environment.finite");
  }
  Environment e = noisyEnvironment(2);
  e.rgb[4] = -1e-3f;
  EXPECT_EQ(rule(e), "environment.positive");
}

TEST(AreaLights, SphereCoversItsSolidAngle) {
  const SphereLight sphere{{0, 3, 1}, 1, {2, 1, 0.5f}, 0, 0, {}};
  const Environment e = renderAreaLights({}, {&sphere, 1}, 128, 4);
  const double solid_angle = 2 * kPi * (1 - std::sqrt(1 - 1.0 / 10));
  const std::vector<double> y0 = projectEnvironment(e, 0);
  EXPECT_NEAR(y0[0] * std::sqrt(4 * kPi) / (2 * solid_angle), 1, 2e-3);
  EXPECT_NEAR(y0[1] / y0[0], 0.5, 1e-6);
}

TEST(AreaLights, RectangleCoversItsSolidAngleFromTheFrontOnly) {
  RectangleLight light{{0, 0, 2}, {1, 0, 0}, {0, -1, 0}, {1, 1, 1}, 0, 0, {}};  // shines down
  const double solid_angle = 4 * std::asin(1.0 / 5);  // of a square: 4 asin(a b / (...)), a = b = 1, d = 2
  const auto flux = [&] { return projectEnvironment(renderAreaLights({&light, 1}, {}, 128, 4), 0)[0] * std::sqrt(4 * kPi); };
  EXPECT_NEAR(flux() / solid_angle, 1, 2e-3);
  light.axis_v = {0, 1, 0};
  EXPECT_EQ(flux(), 0);
}

/// Light of an environment from all directions.
double fluxOf(const Environment& e) { return projectEnvironment(e, 0)[0] * std::sqrt(4 * kPi); }

TEST(AreaLights, LightsOfAnySizeSendTheirLight) {
  constexpr double kTolerance = 5e-3;
  for (const float radius : {0.2f, 0.05f, 0.02f, 0.0047f, 1e-3f, 1e-5f}) {  // .0047: the sun
    for (const Vec3 centre : {Vec3{0, 0, 1}, Vec3{0.3f, 0.1f, 0.9486833f}, Vec3{1e5f, 0, 1e5f}}) {
      const float size = std::sqrt(dot(centre, centre));
      const SphereLight light{centre, radius * size, {1, 1, 1}, 0, 0, {}};
      const double solid_angle = 2 * kPi * radius * radius / (1 + std::sqrt(1 - radius * radius));
      EXPECT_NEAR(fluxOf(renderAreaLights({}, {&light, 1}, 128, 4)) / solid_angle, 1, kTolerance) << radius;
    }
    // A strip as long as 2 and as wide as the diameter, at distance 1: 4 asin(a b / (sqrt(1 + a^2) sqrt(1 + b^2))).
    const RectangleLight strip{{0.001f, 0, 1}, {1, 0, 0}, {0, -radius, 0}, {1, 1, 1}, 0, 0, {}};
    const double solid_angle = 4 * std::asin(radius / (std::sqrt(2.0) * std::sqrt(1 + radius * radius)));
    EXPECT_NEAR(fluxOf(renderAreaLights({&strip, 1}, {}, 128, 4)) / solid_angle, 1, kTolerance) << radius;
  }
}

/// Flux of a rectangle, and of the same rectangle cut into so many pieces along its first axis.
std::pair<double, double> wholeAndCut(const RectangleLight& light, int pieces) {
  std::vector<RectangleLight> cut;
  for (int k = 0; k < pieces; ++k) {
    RectangleLight piece = light;
    const float share = 1.0f / static_cast<float>(pieces);
    piece.axis_u = share * light.axis_u;
    piece.centre = light.centre + (share * (2 * static_cast<float>(k) + 1) - 1) * light.axis_u;
    cut.push_back(piece);
  }
  return {fluxOf(renderAreaLights({&light, 1}, {}, 128, 4)), fluxOf(renderAreaLights(cut, {}, 128, 4))};
}

TEST(AreaLights, ThinLightsInPerspectiveAreTheSumOfTheirPieces) {
  constexpr double kTolerance = 5e-3;
  const RectangleLight window{{0, 0.02f, 2}, {0, 0, 1.5f}, {-0.5f, 0, 0}, {1, 1, 1}, 0, 0, {}};  // seen along its plane
  const RectangleLight tube{{0, 0, 1}, {50, 0, 0}, {0, -0.02f, 0}, {1, 1, 1}, 0, 0, {}};
  for (const RectangleLight& light : {window, tube}) {
    const auto [whole, cut] = wholeAndCut(light, 50);
    ASSERT_GT(whole, 0);
    EXPECT_NEAR(whole / cut, 1, kTolerance);
  }
}

TEST(AreaLights, SmallTexturesSendTheirMean) {
  constexpr int kTexels = 16;
  RectangleLight panel{{0, 0, 3}, {0.02f, 0, 0}, {0, -0.02f, 0}, {1, 1, 1}, 0, 0, {}};
  const double plain = fluxOf(renderAreaLights({&panel, 1}, {}, 128, 4));
  panel.texture_width = panel.texture_height = kTexels;
  for (int j = 0; j < kTexels; ++j)
    for (int i = 0; i < kTexels; ++i) panel.texture.insert(panel.texture.end(), 3, static_cast<float>((i + j) % 2));
  EXPECT_NEAR(fluxOf(renderAreaLights({&panel, 1}, {}, 128, 4)) / plain, 0.5, 1e-3);
}

TEST(AreaLights, SmallAndLargeLightsHideEachOther) {
  const SphereLight wall{{0, 0, 3}, 1, {1, 1, 1}, 0, 0, {}}, behind{{0, 0, 5}, 0.01f, {9, 0, 0}, 0, 0, {}};
  const SphereLight hidden[] = {wall, behind};
  EXPECT_EQ(fluxOf(renderAreaLights({}, hidden, 64, 4)), fluxOf(renderAreaLights({}, {&wall, 1}, 64, 4)));
  const SphereLight before{{0, 0, 1}, 0.05f, {0, 0, 0}, 0, 0, {}};
  const SphereLight seen[] = {wall, before};
  const double dark = 2 * kPi * 0.05 * 0.05 / (1 + std::sqrt(1 - 0.05 * 0.05));
  const double whole = fluxOf(renderAreaLights({}, {&wall, 1}, 128, 8));
  EXPECT_NEAR(whole - fluxOf(renderAreaLights({}, seen, 128, 8)), dark, 0.05 * dark);
}

TEST(AreaLights, TextureLiesAlongTheAxes) {
  // Red along +u, green along +v.
  const RectangleLight light{{0, 0, 2}, {1, 0, 0}, {0, -1, 0}, {1, 1, 1}, 2, 2, {0, 0, 1, 1, 0, 1, 0, 1, 1, 1, 1, 1}};
  const Environment e = renderAreaLights({&light, 1}, {}, 64, 2);
  const auto at = [&](float x, float y) { return e.at({x, y, 2}); };
  EXPECT_EQ(at(0.5f, 0.5f)[0], 1);
  EXPECT_EQ(at(-0.5f, 0.5f)[0], 0);
  EXPECT_EQ(at(0.5f, -0.5f)[1], 1);
  EXPECT_EQ(at(0.5f, 0.5f)[1], 0);
  EXPECT_EQ(at(3, 0)[2], 0);
}

TEST(AreaLights, NearerLightsHideOthers) {
  const SphereLight spheres[] = {{{0, 0, 5}, 1, {1, 0, 0}, 0, 0, {}}, {{0, 0, 3}, 1, {0, 1, 0}, 0, 0, {}}};
  const Environment e = renderAreaLights({}, spheres, 64, 4);
  EXPECT_EQ(e.at({0, 0, 1})[0], 0);
  EXPECT_EQ(e.at({0, 0, 1})[1], 1);
}

TEST(AreaLights, DegenerateLightsAreRefused) {
  const auto rule = [](const RectangleLight& r) { return ruleOf([&] { renderAreaLights({&r, 1}, {}, 8, 1); }); };
  EXPECT_EQ(rule({{0, 0, 1}, {1, 0, 0}, {2, 0, 0}, {1, 1, 1}, 0, 0, {}}), "light.shape");
  EXPECT_EQ(rule({{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, 1, 1}, 0, 0, {}}), "light.shape");
  EXPECT_EQ(rule({{0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {1, 1, 1}, 2, 2, {1, 1, 1}}), "light.shape");
  const SphereLight around{{0, 0, 1}, 2, {1, 1, 1}, 0, 0, {}};
  EXPECT_EQ(ruleOf([&] { renderAreaLights({}, {&around, 1}, 8, 1); }), "light.shape");
  EXPECT_EQ(ruleOf([&] { renderAreaLights({}, {}, 0, 1); }), "light.resolution");
}

}  // namespace
}  // namespace glint::bake::sh_light_test
