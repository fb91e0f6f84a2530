#include "glint/query/texture_transform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "glint/model/slope_sums.h"
#include "glint/query/brdf/microfacet_brdf.h"
#include "glint/query/reference.h"
#include "support/directions.h"
#include "support/test_maps.h"

namespace glint::texture_transform_test {
namespace {

static_assert(NdfModel<PlacedNdf<Reference>>);
static_assert(!std::is_constructible_v<PlacedNdf<Reference>, Reference, MapPlacement>);

constexpr int kSize = 16;
constexpr float kSigmaR = 0.03f;
const Tangents kFrame = {{1, 0, 0}, {0, 1, 0}};

Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Vec3 normalised(Vec3 a) { return (1 / std::sqrt(dot(a, a))) * a; }

/// How a map lies on the plane z = 0: derivatives by uv, and the height of a texel.
struct Laid {
  Vec3 dpdu, dpdv;
  float units_per_height;

  MapPlacement placement(int width = kSize, int height = kSize) const {
    return {dpdu, dpdv, kFrame, width, height, units_per_height};
  }
  float unitsPerHeight() const {
    const float area = std::fabs(dpdu.x * dpdv.y - dpdu.y * dpdv.x) / static_cast<float>(kSize * kSize);
    return units_per_height > 0 ? units_per_height : std::sqrt(area);
  }
  /// The normal of the surface where the map has this normal: the cross product of the edges of a texel in space.
  Vec3 normal(Vec3 of_map) const {
    const float dzdi = -of_map.x / of_map.z, dzdj = -of_map.y / of_map.z, z = unitsPerHeight(), texel = 1.0f / kSize;
    const Vec3 edge_i = {texel * dpdu.x, texel * dpdu.y, z * dzdi}, edge_j = {texel * dpdv.x, texel * dpdv.y, z * dzdj};
    const Vec3 n = normalised(cross(edge_i, edge_j));
    return n.z < 0 ? -1.0f * n : n;
  }
};

/// Enlarged evenly and turned; twice as long along v; slanted; mirrored and measured heights.
const Laid kLaid[] = {{{3, 1, 0}, {-1, 3, 0}, 0},
                      {{1, 0, 0}, {0, 2, 0}, 0},
                      {{1, 0.3f, 0}, {0.8f, 1.5f, 0}, 0},
                      {{-2, 0, 0}, {0.5f, 1, 0}, 0.08f}};

/// Shares of a footprint's facets in square cells of the disk: every texel of the map by itself, its lobe as many facets that
/// are evenly likely, each laid on the surface by its edges.
std::vector<double> countedOnSurface(const NormalMap& map, const Footprint& p, const Laid& laid, int cells) {
  constexpr int kRadii = 24, kAngles = 48;
  std::vector<double> shares(static_cast<std::size_t>(cells) * cells);
  double total = 0;
  for (int j = 0; j < map.height; ++j) {
    for (int i = 0; i < map.width; ++i) {
      double weight = 0;  // of the texel and of its copies in the maps around
      for (int y = -2; y <= 2; ++y)
        for (int x = -2; x <= 2; ++x) {
          const double dx = i + 0.5 + x * map.width - double{p.centre.x} * map.width,
                       dy = j + 0.5 + y * map.height - double{p.centre.y} * map.height;
          const double xx = p.covariance.xx, xy = p.covariance.xy, yy = p.covariance.yy, det = xx * yy - xy * xy;
          weight += std::exp(-0.5 * (yy * dx * dx - 2 * xy * dx * dy + xx * dy * dy) / det);
        }
      total += weight;
      for (int r = 0; r < kRadii; ++r) {
        const double radius = kSigmaR * std::sqrt(-2 * std::log(1 - (r + 0.5) / kRadii));
        for (int a = 0; a < kAngles; ++a) {
          const double angle = 2 * std::numbers::pi * (a + 0.5 * (r % 2)) / kAngles;
          const Vec2 n =
              map.at(i, j) + Vec2{static_cast<float>(radius * std::cos(angle)), static_cast<float>(radius * std::sin(angle))};
          const float z2 = 1 - dot(n, n);
          if (z2 <= 0) continue;
          const Vec3 h = laid.normal({n.x, n.y, std::sqrt(z2)});
          const auto cell = [&](float c) {
            return std::min(static_cast<int>(0.5f * (c + 1) * static_cast<float>(cells)), cells - 1);
          };
          shares[static_cast<std::size_t>(cell(h.y)) * cells + cell(h.x)] += weight / (kRadii * kAngles);
        }
      }
    }
  }
  for (double& share : shares) share /= total;
  return shares;
}

class Placed : public testing::TestWithParam<Laid> {
 protected:
  test::OwnedMap map_{kSize, kSize, test::randomNormals(kSize, kSize, 0.5f, 5)};
  Reference model_{map_.map(), kSigmaR};
  Footprint p_ = Footprint::gaussian({0.4f, 0.6f}, {8, 2, 4});
};
INSTANTIATE_TEST_SUITE_P(Surfaces, Placed, testing::ValuesIn(kLaid));

/// Cells of the disk that answers are compared in, and the points of a cell along each axis at which densities are asked.
constexpr int kCells = 32, kPoints = 4;

Box2 cellBox(int x, int y) {
  const float side = 2.0f / kCells;
  const Vec2 low = {-1 + side * static_cast<float>(x), -1 + side * static_cast<float>(y)};
  return {low, low + Vec2{side, side}};
}

double integrated(const PlacedNdf<Reference>& placed, const Footprint& p, const Box2& box) {
  double sum = 0;
  for (int k = 0; k < kPoints * kPoints; ++k) {
    const Vec2 at = {(static_cast<float>(k % kPoints) + 0.5f) / kPoints, (static_cast<float>(k / kPoints) + 0.5f) / kPoints};
    sum += placed.density(p, box.low + Vec2{at.x * box.width(), at.y * box.height()});
  }
  return sum / (kPoints * kPoints) * box.area();
}

TEST_P(Placed, DensityIsThatOfTheStretchedMapsOwnNormals) {
  constexpr double kCountingError = 0.02;  // total variation: 1152 facets a lobe, counted in cells with hard borders
  const PlacedNdf placed(model_, GetParam().placement());
  const std::vector<double> counted = countedOnSurface(map_.map(), p_, GetParam(), kCells);
  double difference = 0, unplaced = 0, energy = 0;
  for (int y = 0; y < kCells; ++y) {
    for (int x = 0; x < kCells; ++x) {
      const double share = counted[static_cast<std::size_t>(y) * kCells + x], answered = integrated(placed, p_, cellBox(x, y));
      difference += 0.5 * std::fabs(answered - share);
      unplaced += 0.5 * std::fabs(model_.mean(p_, cellBox(x, y)) * cellBox(x, y).area() - share);
      energy += answered;
    }
  }
  EXPECT_LT(difference, kCountingError);
  EXPECT_NEAR(energy, 1, 0.01);
  EXPECT_GT(unplaced, 10 * kCountingError);  // or the placement would not matter
}

TEST_P(Placed, MeansAreThoseOfTheDensity) {
  constexpr double kCellError = 0.06;  // share of the largest mean: cells are boxes on the map
  const PlacedNdf placed(model_, GetParam().placement());
  double largest = 0, worst = 0;
  for (int y = 2; y < kCells - 5; y += 3) {
    for (int x = 2; x < kCells - 5; x += 3) {
      const Box2 box = {cellBox(x, y).low, cellBox(x + 3, y + 1).high};
      double exact = 0;
      for (int k = 0; k < 8; ++k) exact += integrated(placed, p_, cellBox(x + k % 4, y + k / 4)) / box.area();
      largest = std::max(largest, exact);
      worst = std::max(worst, std::fabs(placed.mean(p_, box) - exact));
    }
  }
  EXPECT_LT(worst, kCellError * largest);
  EXPECT_EQ(placed.mean(p_, {{0.1f, 0.1f}, {0.1f, 0.2f}}), 0);
  EXPECT_NEAR(placed.mean(p_, {{-3, -3}, {3, 3}}), 1.0 / 36, 0.05 / 36);
}

TEST_P(Placed, SamplesHaveTheDensityAsPdf) {
  const PlacedNdf placed(model_, GetParam().placement());
  constexpr int kSide = 60;
  constexpr double kSampled = 0.05;  // 3600 stratified samples in 64 cells
  std::vector<double> drawn(64), expected(64);
  for (int k = 0; k < kSide * kSide; ++k) {
    const Vec2 xi = {(static_cast<float>(k % kSide) + 0.5f) / kSide, (static_cast<float>(k / kSide) + 0.5f) / kSide};
    const HalfVectorSample s = placed.sample(p_, xi);
    if (s.pdf == 0) continue;
    EXPECT_NEAR(placed.density(p_, s.h) / s.pdf, 1, 2e-3);
    drawn[static_cast<std::size_t>(4 * (s.h.y + 1)) * 8 + static_cast<std::size_t>(4 * (s.h.x + 1))] += 1.0 / (kSide * kSide);
  }
  for (int y = 0; y < kCells; ++y)
    for (int x = 0; x < kCells; ++x)
      expected[static_cast<std::size_t>(y / 4 * 8 + x / 4)] += integrated(placed, p_, cellBox(x, y));
  double difference = 0;
  for (std::size_t k = 0; k < 64; ++k) difference += 0.5 * std::fabs(drawn[k] - expected[k]);
  EXPECT_LT(difference, kSampled);
}

TEST_P(Placed, MaskingIsByTheSlopesOfTheSurface) {
  const Laid& laid = GetParam();
  std::vector<Vec2> normals;
  for (const Vec2 n : map_.normals()) {
    const Vec3 on_surface = laid.normal({n.x, n.y, std::sqrt(1 - dot(n, n))});
    normals.push_back({on_surface.x, on_surface.y});
  }
  const MapSlopes of_map = slopeSums(map_.normals().data(), normals.size()).moments(kSize * kSize);
  const MapSlopes of_surface = slopeSums(normals.data(), normals.size()).moments(kSize * kSize);
  const SmithMasking placed = placedMasking(of_map, 0, laid.placement()), expected(of_surface, 0);
  for (const double azimuth : {0.0, 1.0, 2.5, 4.0}) {
    const Vec3 w = test::direction(1.3, azimuth);
    EXPECT_NEAR(placed.projectedArea(w), expected.projectedArea(w), 1e-4f);
  }
}

TEST_P(Placed, NormalsComeBack) {
  const MapPlacement placement = GetParam().placement();
  for (const double azimuth : {0.3, 2.0, 5.0}) {
    const Vec3 n = test::direction(0.9, azimuth), back = placement.toSurface(placement.toMap(n));
    EXPECT_NEAR(dot(n - back, n - back), 0, 1e-10f);
    const Vec3 laid = GetParam().normal(placement.toMap(n));
    EXPECT_NEAR(dot(n - laid, n - laid), 0, 1e-10f);
  }
}

TEST_P(Placed, FootprintsOfConesAreThoseOfThePlane) {
  // A round beam of deviation 0.2 seen from straight above, and its axes as steps of uv.
  const Laid& laid = GetParam();
  const Footprint p = footprintOfCone({0.2f, 0}, {0.1f, 0.2f}, {0, 0, 1}, laid.placement());
  const Vec2 dx = uvDifferential(laid.dpdu, laid.dpdv, {0.2f, 0, 0}), dy = uvDifferential(laid.dpdu, laid.dpdv, {0, 0.2f, 0});
  const Footprint same = footprintFromDifferentials({0.1f, 0.2f}, dx, dy, kSize, kSize, 1);
  EXPECT_NEAR(p.covariance.xx, same.covariance.xx, 1e-4f * same.covariance.xx);
  EXPECT_NEAR(p.covariance.yy, same.covariance.yy, 1e-4f * same.covariance.yy);
  EXPECT_NEAR(p.covariance.xy, same.covariance.xy, 1e-3f);
}

TEST(MapPlacement, KeepsDirectionsWhereTexelsAreSquareAndWhereItIsUnusable) {
  constexpr float kRounding = 1e-5f;  // of a half vector, beside a lobe of 0.03
  const test::OwnedMap map(kSize, kSize, test::randomNormals(kSize, kSize, 0.5f, 5));
  const Reference model(map.map(), kSigmaR);
  const Footprint p = Footprint::isotropic({0.2f, 0.3f}, 4);
  const float nan = std::nanf("");
  const MapPlacement same[] = {MapPlacement(), Laid{{7, 0, 0}, {0, 7, 0}, 0}.placement(),
                               Laid{{1, 2, 0}, {2, 4, 0}, 0}.placement(), Laid{{nan, 0, 0}, {0, 1, 0}, 0}.placement(),
                               Laid{{0, 0, 0}, {0, 0, 0}, 0}.placement()};
  for (const MapPlacement& placement : same) {
    const PlacedNdf placed(model, placement);
    EXPECT_NEAR(placed.density(p, {0.1f, -0.2f}) / model.density(p, {0.1f, -0.2f}), 1, kRounding);
  }
}

TEST(PlacedNdf, ReflectsAtMostWhatArrives) {
  // A white surface that is stretched: the BRDF of the placed model with the masking of the placed slopes.
  const test::OwnedMap map(kSize, kSize, test::roughSurface(kSize, kSize, 0.4f));
  const Reference model(map.map(), kSigmaR);
  const MapSlopes slopes = slopeSums(map.normals().data(), map.normals().size()).moments(kSize * kSize);
  const MapPlacement placement = kLaid[2].placement();
  const PlacedNdf placed(model, placement);
  const MicrofacetBrdf brdf(placed, Footprint::isotropic({0.5f, 0.5f}, 20), placedMasking(slopes, kSigmaR, placement),
                            Fresnel::mirror());
  const Vec3 wo = test::direction(0.7, 2);
  constexpr int kSide = 20;
  double reflected = 0;
  for (int k = 0; k < kSide * kSide; ++k)
    reflected +=
        brdf.sample(wo, {(static_cast<float>(k % kSide) + 0.5f) / kSide, (static_cast<float>(k / kSide) + 0.5f) / kSide})
            .weight.r;
  reflected /= kSide * kSide;
  EXPECT_LT(reflected, 1.02);
  EXPECT_GT(reflected, 0.8);  // facets that are hidden, or reflect below the horizon
}

TEST(TextureTransform, ScalesThenTurnsThenMoves) {
  const double quarter = std::numbers::pi / 2;
  const TextureTransform t =
      TextureTransform::scale(4, 2).then(TextureTransform::rotation(quarter)).then(TextureTransform::offset(0.25, 0.5));
  const Vec2 uv = t.at(0.1, 0.2);  // (0.4, 0.4), turned to (-0.4, 0.4)
  EXPECT_NEAR(uv.x, 0.85f, 1e-6f);
  EXPECT_NEAR(uv.y, 0.9f, 1e-6f);
  const Vec2 step = t.change({0.01f, 0.02f});
  EXPECT_NEAR(step.x, -0.04f, 1e-7f);
  EXPECT_NEAR(step.y, 0.04f, 1e-7f);
}

TEST(TextureTransform, TangentsOfTheMapGiveThoseOfTheMesh) {
  const TextureTransform t = TextureTransform::scale(4, 2).then(TextureTransform::rotation(0.7));
  const Vec3 dpds = {1, 0.2f, 0.1f}, dpdt = {0.3f, 2, -0.4f};
  const Tangents map = t.tangents(dpds, dpdt);
  const Vec2 along_s = t.change({1, 0}), along_t = t.change({0, 1});
  const Vec3 s = along_s.x * map.s + along_s.y * map.t, u = along_t.x * map.s + along_t.y * map.t;
  EXPECT_NEAR(dot(s - dpds, s - dpds), 0, 1e-12f);
  EXPECT_NEAR(dot(u - dpdt, u - dpdt), 0, 1e-12f);
  EXPECT_EQ(TextureTransform::scale(0, 2).tangents(dpds, dpdt).s, (Vec3{}));
}

TEST(TextureTransform, KeepsTexelsFarOut) {
  const TextureTransform far = TextureTransform::offset(4096, -4096);
  EXPECT_EQ(far.at(0.3, 0.7), (Vec2{0.3f, 0.7f}));
}

}  // namespace
}  // namespace glint::texture_transform_test
