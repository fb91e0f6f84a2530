#include "glint/query/reference.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "glint/bake/common/reference_image.h"
#include "support/test_maps.h"

namespace glint::reference_test {
namespace {

using test::OwnedMap;

/// Weights and lobes are computed in float: errors of a few 1e-6 each, times the exponents of the outer parts of a footprint.
constexpr double kFloatError = 2e-4;
/// What falls outside kLobeReach or kFootprintReach, as a part of the largest lobe.
constexpr double kCutOff = 1e-6;

double normalCdf(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

double peakOf(double sigma) { return 1 / (2 * std::numbers::pi * sigma * sigma); }

/// Length of the part of the vertical line at x that lies in a convex polygon and in [y_low, y_high].
double chordLength(const std::vector<std::pair<double, double>>& corners, double x, double y_low, double y_high) {
  double low = 1e9, high = -1e9;
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const auto [x0, y0] = corners[k];
    const auto [x1, y1] = corners[(k + 1) % corners.size()];
    if ((x0 <= x) == (x1 <= x)) continue;
    const double y = y0 + (x - x0) * (y1 - y0) / (x1 - x0);
    low = std::min(low, y);
    high = std::max(high, y);
  }
  return std::max(0.0, std::min(high, y_high) - std::max(low, y_low));
}

/// The definition of section "Footprint" written out: loops over the endless plane in double precision.
class BruteForce {
 public:
  BruteForce(const NormalMap& map, double sigma_r, Boundary boundary) : map_(map), sigma_r_(sigma_r), boundary_(boundary) {}

  double density(const Footprint& p, Vec2 h) const {
    return average(p, [&](Vec2 n) {
      const double x = double{n.x} - h.x, y = double{n.y} - h.y;
      return peakOf(sigma_r_) * std::exp(-(x * x + y * y) / (2 * sigma_r_ * sigma_r_));
    });
  }

  double mean(const Footprint& p, const Box2& range) const {
    const double area = (double{range.high.x} - range.low.x) * (double{range.high.y} - range.low.y);
    return average(p,
                   [&](Vec2 n) { return mass(range.low.x, range.high.x, n.x) * mass(range.low.y, range.high.y, n.y) / area; });
  }

 private:
  double mass(double low, double high, double n) const {
    return normalCdf((high - n) / sigma_r_) - normalCdf((low - n) / sigma_r_);
  }

  template <class Value>
  double average(const Footprint& p, const Value& value) const {
    const double cx = double{p.centre.x} * map_.width, cy = double{p.centre.y} * map_.height;
    const bool box = p.kind == Footprint::Kind::box;
    const double reach_x = box ? std::abs(p.axis_a.x) + std::abs(p.axis_b.x) : 8 * std::sqrt(double{p.covariance.xx});
    const double reach_y = box ? std::abs(p.axis_a.y) + std::abs(p.axis_b.y) : 8 * std::sqrt(double{p.covariance.yy});
    double sum = 0, total = 0;
    for (int j = static_cast<int>(std::floor(cy - reach_y)); j <= cy + reach_y; ++j) {
      for (int i = static_cast<int>(std::floor(cx - reach_x)); i <= cx + reach_x; ++i) {
        if (boundary_ == Boundary::clamp && (i < 0 || j < 0 || i >= map_.width || j >= map_.height)) continue;
        const double w = box ? boxWeight(p, i - cx, j - cy) : gaussianWeight(p.covariance, i + 0.5 - cx, j + 0.5 - cy);
        if (w == 0) continue;
        const auto wrap = [](int k, int n) { return ((k % n) + n) % n; };
        total += w;
        sum += w * value(map_.at(wrap(i, map_.width), wrap(j, map_.height)));
      }
    }
    return sum / total;
  }

  static double gaussianWeight(const Covariance& c, double x, double y) {
    const double det = double{c.xx} * c.yy - double{c.xy} * c.xy;
    return std::exp(-0.5 * (c.yy * x * x - 2 * c.xy * x * y + c.xx * y * y) / det);
  }

  /// Covered area of the texel whose lower left corner lies at (x, y) from the centre, by midpoint lines.
  static double boxWeight(const Footprint& p, double x, double y) {
    const double ax = p.axis_a.x, ay = p.axis_a.y, bx = p.axis_b.x, by = p.axis_b.y;
    const std::vector<std::pair<double, double>> corners = {
        {-ax - bx, -ay - by}, {ax - bx, ay - by}, {ax + bx, ay + by}, {bx - ax, by - ay}};
    constexpr int kLines = 128;
    double area = 0;
    for (int k = 0; k < kLines; ++k) area += chordLength(corners, x + (k + 0.5) / kLines, y, y + 1) / kLines;
    return area;
  }

  NormalMap map_;
  double sigma_r_;
  Boundary boundary_;
};

/// Footprints, half vectors and ranges that exercise every branch of a search.
class RandomQueries {
 public:
  explicit RandomQueries(unsigned seed) : random_(seed) {}

  float unit() { return std::uniform_real_distribution<float>(0, 1)(random_); }
  float between(float low, float high) { return low + (high - low) * unit(); }
  float logBetween(float low, float high) { return low * std::pow(high / low, unit()); }
  Vec2 uv() { return {unit(), unit()}; }

  Footprint isotropic(float low, float high) { return Footprint::isotropic(uv(), logBetween(low, high)); }

  Footprint anisotropic(float low, float high) {
    const float a = logBetween(low, high), b = logBetween(low, high), angle = between(0, 6.28f);
    const float c = std::cos(angle), s = std::sin(angle);
    return Footprint::gaussian(uv(), {c * c * a * a + s * s * b * b, c * s * (a * a - b * b), s * s * a * a + c * c * b * b});
  }

  /// A parallelogram whose angle is at least 30 degrees.
  Footprint box(float low, float high) {
    const float a = logBetween(low, high), b = logBetween(low, high), angle = between(0, 6.28f), turn = between(0.52f, 2.62f);
    return Footprint::box(uv(), {a * std::cos(angle), a * std::sin(angle)},
                          {b * std::cos(angle + turn), b * std::sin(angle + turn)});
  }

  Footprint any(int k, float low, float high) {
    return k % 3 == 0 ? isotropic(low, high) : k % 3 == 1 ? anisotropic(low, high) : box(low, high);
  }

  /// Near the normal of a texel under the centre of the footprint.
  Vec2 half(const NormalMap& map, const Footprint& p, float distance) {
    const int i = std::min(static_cast<int>(p.centre.x * static_cast<float>(map.width)), map.width - 1);
    const int j = std::min(static_cast<int>(p.centre.y * static_cast<float>(map.height)), map.height - 1);
    return map.at(i, j) + Vec2{between(-distance, distance), between(-distance, distance)};
  }

  Box2 range(Vec2 centre, float low, float high) {
    const Vec2 half = {logBetween(low, high), logBetween(low, high)};
    return {centre - half, centre + half};
  }

 private:
  std::mt19937 random_;
};

const OwnedMap& rough() {
  static const OwnedMap map(64, 48, test::roughSurface(64, 48, 0.2f));
  return map;
}

const OwnedMap& noise() {
  static const OwnedMap map(48, 64, test::randomNormals(48, 64, 0.6f, 3));
  return map;
}

const OwnedMap& oddFlakes() {
  static const OwnedMap map(61, 37, test::synthesised(bake::SynthKind::flakes, 61, 37, 0.2f));
  return map;
}

std::array<const OwnedMap*, 3> maps() { return {&rough(), &noise(), &oddFlakes()}; }
constexpr float kSigmas[] = {0.005f, 0.03f};

void expectBruteForce(RandomQueries& random, const Footprint& p, double tolerance) {
  for (const OwnedMap* owned : maps()) {
    for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
      const float sigma_r = kSigmas[static_cast<int>(random.between(0, 1.99f))];
      const Reference reference(owned->map(), sigma_r, Surface::flat, boundary);
      const BruteForce expected(owned->map(), sigma_r, boundary);
      const Vec2 h = random.half(owned->map(), p, 2 * sigma_r);
      const double density = expected.density(p, h);
      EXPECT_NEAR(reference.density(p, h), density, tolerance * density + kCutOff * peakOf(sigma_r));
      const Box2 range = random.range(h, 0.002f, 0.1f);
      const double mean = expected.mean(p, range);
      EXPECT_NEAR(reference.mean(p, range), mean, tolerance * mean + kCutOff * std::min(peakOf(sigma_r), 1.0 / range.area()));
    }
  }
}

TEST(Reference, GaussianFootprintsOnFlatSurfacesAgreeWithBruteForce) {
  RandomQueries random(1);
  for (int k = 0; k < 12; ++k) expectBruteForce(random, random.isotropic(0.3f, 40), kFloatError);
  for (int k = 0; k < 12; ++k) expectBruteForce(random, random.anisotropic(0.3f, 40), kFloatError);
}

TEST(Reference, BoxFootprintsOnFlatSurfacesAgreeWithBruteForce) {
  // Midpoint lines find the area of a cut texel to 1 / 128^2 or, beside a corner or upright edge, 1 / 128 of it.
  constexpr double kLineError = 1e-2;
  RandomQueries random(2);
  for (int k = 0; k < 16; ++k) expectBruteForce(random, random.box(0.7f, 20), kLineError);
}

TEST(Reference, BoxesOnTexelBordersAreExact) {
  const NormalMap& map = rough().map();
  const Footprint p = Footprint::box({16.0f / 64, 12.0f / 48}, {2, 0}, {0, 3});  // texels 14..17 x 9..14
  for (const Vec2 h : {Vec2{0, 0}, Vec2{0.1f, -0.05f}}) {
    double sum = 0;
    for (int j = 9; j < 15; ++j)
      for (int i = 14; i < 18; ++i) sum += gaussianDensity(map.at(i, j) - h, 0.05f);
    EXPECT_NEAR(Reference(map, 0.05f).density(p, h), sum / 24, 1e-5 * sum / 24);
  }
}

TEST(Reference, SmoothSurfacesAreTheMeanOfFinerAndFinerFlatOnes) {
  // Every triangle of the surface is replaced by 64^2 facets; lobes are wide enough for these to fill it.
  constexpr int kParts = 64;
  constexpr double kFacetError = 2e-3;
  const NormalMap& map = rough().map();
  const float sigma_r = 0.02f;
  RandomQueries random(3);
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
    for (int k = 0; k < 4; ++k) {
      const Footprint p = random.isotropic(0.5f, 2);
      const Vec2 h = random.half(map, p, sigma_r);
      double sum = 0, total = 0;
      const float cx = p.centre.x * static_cast<float>(map.width), cy = p.centre.y * static_cast<float>(map.height);
      const auto wrap = [](int i, int n) { return ((i % n) + n) % n; };
      for (int j = static_cast<int>(cy) - 14; j < static_cast<int>(cy) + 14; ++j) {
        for (int i = static_cast<int>(cx) - 14; i < static_cast<int>(cx) + 14; ++i) {
          if (boundary == Boundary::clamp && (i < 0 || j < 0 || i + 1 >= map.width || j + 1 >= map.height)) continue;
          const auto at = [&](int x, int y) { return map.at(wrap(x, map.width), wrap(y, map.height)); };
          for (const bool upper : {false, true}) {
            const Vec2 a = at(i, j), b = upper ? at(i, j + 1) : at(i + 1, j), c = at(i + 1, j + 1);
            const double gx = i + 0.5 + (upper ? 1 : 2) / 3.0 - cx, gy = j + 0.5 + (upper ? 2 : 1) / 3.0 - cy;
            const double w = std::exp(-(gx * gx + gy * gy) / (2 * p.covariance.xx));
            if (w < 1e-7) continue;
            double mean = 0;
            for (int u = 0; u < kParts; ++u)
              for (int v = 0; v < kParts; ++v) {  // the unit square folded onto the triangle
                float s = (static_cast<float>(u) + 0.5f) / kParts, t = (static_cast<float>(v) + 0.5f) / kParts;
                if (s + t > 1) s = 1 - s, t = 1 - t;
                mean += gaussianDensity(a + s * (b - a) + t * (c - a) - h, sigma_r) / (kParts * kParts);
              }
            sum += w * mean;
            total += w;
          }
        }
      }
      EXPECT_NEAR(Reference(map, sigma_r, Surface::smooth, boundary).density(p, h), sum / total,
                  kFacetError * sum / total + 1e-4 * peakOf(sigma_r));
    }
  }
}

TEST(Reference, PrunedSearchFindsWhatExhaustiveSearchFinds) {
  // Skipped lobes are below exp(-kLobeReach^2 / 2) = 2.7e-7 of a peak, or have 4e-8 of their mass in the range.
  constexpr double kSkippedDensity = 3e-7, kSkippedMass = 4e-8;
  constexpr double kSumError = 3e-5;  // of float weights against the closed form of their total
  RandomQueries random(4);
  for (const OwnedMap* owned : maps()) {
    for (const Surface surface : {Surface::flat, Surface::smooth}) {
      for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
        const float largest = surface == Surface::flat ? 40.0f
                              : owned == &noise()      ? 1.0f
                                                       : 5.0f;  // the exhaustive search takes seconds beyond
        for (int k = 0; k < 18; ++k) {
          const float sigma_r = kSigmas[k % 2];
          const Reference exhaustive(owned->map(), sigma_r, surface, boundary),
              pruned(owned->map(), sigma_r, surface, boundary, Reference::Search::pruned);
          const Footprint p = random.any(k, 0.3f, largest);
          const Vec2 h = random.half(owned->map(), p, 4 * sigma_r);
          const double density = exhaustive.density(p, h);
          EXPECT_NEAR(pruned.density(p, h), density, kSumError * density + kSkippedDensity * peakOf(sigma_r));
          const Box2 range = random.range(h, 0.002f, 0.2f);
          const double mean = exhaustive.mean(p, range);
          EXPECT_NEAR(pruned.mean(p, range), mean, kSumError * mean + kSkippedMass / range.area());
        }
      }
    }
  }
}

TEST(Reference, ImagesHoldTheMeanOverEveryPixel) {
  constexpr int kResolution = 64;
  constexpr double kPixelArea = 4.0 / kResolution / kResolution;
  // Smooth images sum a rule of degree 1 over parts of 0.4 deviations.
  constexpr double kFlatError = 1e-4, kSmoothError = 1e-2;
  RandomQueries random(5);
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    for (int k = 0; k < 6; ++k) {
      const OwnedMap& owned = *maps()[k % 3];
      const Boundary boundary = k < 3 ? Boundary::wrap : Boundary::clamp;
      const Footprint p = random.any(k + k / 3, 0.5f, 1.5f);
      const float sigma_r = 0.02f;
      const auto image = bake::referenceImage(owned.map(), sigma_r, surface, boundary, p, kResolution);
      const Reference reference(owned.map(), sigma_r, surface, boundary);
      for (int q = 0; q < 30; ++q) {
        const Vec2 h = random.half(owned.map(), p, 3 * sigma_r);
        const int x = static_cast<int>((h.x + 1) * kResolution / 2), y = static_cast<int>((h.y + 1) * kResolution / 2);
        const Vec2 low = {-1 + static_cast<float>(x) * 2 / kResolution, -1 + static_cast<float>(y) * 2 / kResolution};
        const double mean = reference.mean(p, {low, low + Vec2{2.0f / kResolution, 2.0f / kResolution}});
        const double tolerance = surface == Surface::flat ? kFlatError : kSmoothError;
        EXPECT_NEAR(image[static_cast<std::size_t>(y) * kResolution + x], mean, tolerance * mean + kCutOff / kPixelArea);
      }
    }
  }
}

/// Density of a box on a clamped smooth surface from a grid of points inside it; those off the surface do not count.
double boxByPoints(const NormalMap& map, const Footprint& box, Vec2 centre_texels, Vec2 h, float sigma_r) {
  constexpr int kPoints = 300;
  double sum = 0, count = 0;
  for (int k = 0; k < kPoints * kPoints; ++k) {
    const float s = 2 * (static_cast<float>(k % kPoints) + 0.5f) / kPoints - 1;
    const float t = 2 * (static_cast<float>(k / kPoints) + 0.5f) / kPoints - 1;
    const Vec2 at = centre_texels + s * box.axis_a + t * box.axis_b - Vec2{0.5f, 0.5f};
    const int i = static_cast<int>(std::floor(at.x)), j = static_cast<int>(std::floor(at.y));
    if (i < 0 || j < 0 || i + 1 >= map.width || j + 1 >= map.height) continue;
    const float x = at.x - static_cast<float>(i), y = at.y - static_cast<float>(j);
    const Vec2 side = x > y ? map.at(i + 1, j) : map.at(i, j + 1);
    const Vec2 n = (1 - std::max(x, y)) * map.at(i, j) + std::fabs(x - y) * side + std::min(x, y) * map.at(i + 1, j + 1);
    sum += gaussianDensity(n - h, sigma_r);
    ++count;
  }
  return sum / count;
}

TEST(Reference, BoxesInTheOuterHalfTexelSeeTheBorderOfAClampedSmoothSurface) {
  // Triangles count by the covered area, with all of their normals: boxes as wide as a texel and wider have most of them.
  constexpr float kSigmaR = 0.1f;
  constexpr double kTrianglesError = 0.05;
  const NormalMap& map = rough().map();
  const Vec2 size = {static_cast<float>(map.width), static_cast<float>(map.height)};
  for (const auto search : {Reference::Search::exhaustive, Reference::Search::pruned}) {
    const Reference reference(map, kSigmaR, Surface::smooth, Boundary::clamp, search);
    for (const Vec2 texels :
         {Vec2{0.2f, 20.3f}, {size.x - 0.1f, 7.8f}, {30.4f, 0.01f}, {12.7f, size.y - 0.4f}, {0.3f, size.y - 0.2f}}) {
      const Vec2 nearest = {std::clamp(texels.x, 0.5f, size.x - 0.5f), std::clamp(texels.y, 0.5f, size.y - 0.5f)};
      const Vec2 uv = {texels.x / size.x, texels.y / size.y};
      const Vec2 h = map.at(static_cast<int>(nearest.x), static_cast<int>(nearest.y)) + Vec2{0.03f, -0.02f};
      for (const Footprint& p : {Footprint::box(uv, {0.1f, 0}, {0, 0.1f}), Footprint::box(uv, {0.05f, 0.1f}, {-0.1f, 0.04f})}) {
        EXPECT_NEAR(reference.mean(p, {{-1, -1}, {1, 1}}), 0.25, 1e-3)
            << texels.x << ' ' << texels.y;  // lobes leave the square
        EXPECT_GT(reference.density(p, h), 0);
        EXPECT_GT(reference.sample(p, {0.4f, 0.7f}).pdf, 0);
        Footprint moved = p;  // to the nearest point, from where nothing is moved
        moved.centre = {nearest.x / size.x, nearest.y / size.y};
        EXPECT_NEAR(reference.density(p, h), reference.density(moved, h), 1e-4 * peakOf(kSigmaR));
      }
      const Footprint wide = Footprint::box(uv, {3, 0}, {0, 2});
      const double expected = boxByPoints(map, wide, nearest, h, kSigmaR);
      EXPECT_NEAR(reference.density(wide, h), expected, kTrianglesError * peakOf(kSigmaR)) << texels.x << ' ' << texels.y;
    }
  }
}

TEST(Reference, MeanOverTheWholeSquareIsAQuarter) {
  RandomQueries random(6);
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    for (int k = 0; k < 12; ++k) {
      const Reference reference(rough().map(), 0.01f, surface, k % 2 ? Boundary::clamp : Boundary::wrap,
                                Reference::Search::pruned);
      EXPECT_NEAR(reference.mean(random.any(k, 0.3f, 10), {{-1, -1}, {1, 1}}), 0.25, 1e-5);
      EXPECT_NEAR(reference.mean(random.any(k, 0.3f, 10), {{-3, -1}, {1, 1}}), 0.125, 1e-5);  // 0 outside the square
    }
  }
}

TEST(Reference, RepeatedMapsAnswerAlikeInEveryTile) {
  constexpr double kCentreError = 1e-4;  // a footprint's centre is rounded differently in the larger map
  const OwnedMap twice(128, 96, test::repeated(rough().normals(), 64, 48, 2));
  RandomQueries random(7);
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    const Reference one(rough().map(), 0.02f, surface, Boundary::wrap, Reference::Search::pruned);
    const Reference tiled(twice.map(), 0.02f, surface, Boundary::wrap, Reference::Search::pruned);
    for (int k = 0; k < 24; ++k) {
      Footprint p = random.any(k, 0.5f, 10);
      const Vec2 h = random.half(rough().map(), p, 0.02f);
      const double expected = one.density(p, h);
      for (const float tile_v : {0.0f, 1.0f}) {
        for (const float tile_u : {0.0f, 1.0f}) {
          Footprint q = p;
          q.centre = {0.5f * (p.centre.x + tile_u), 0.5f * (p.centre.y + tile_v)};
          EXPECT_NEAR(tiled.density(q, h), expected, kCentreError * expected + kCutOff * peakOf(0.02));
        }
      }
    }
  }
}

TEST(Reference, TexturePlaneIsPeriodic) {
  RandomQueries random(8);
  const Reference reference(rough().map(), 0.02f, Surface::flat, Boundary::wrap, Reference::Search::pruned);
  for (int k = 0; k < 20; ++k) {
    Footprint p = random.any(k, 0.5f, 10);
    p.centre = {std::floor(64 * p.centre.x) / 64, std::floor(64 * p.centre.y) / 64};  // stays exact far away
    const Vec2 h = random.half(rough().map(), p, 0.02f);
    const float expected = reference.density(p, h);
    for (const Vec2 far : {Vec2{1, -1}, Vec2{-7, 3}, Vec2{4096, -100000}}) {
      Footprint q = p;
      q.centre = p.centre + far;
      EXPECT_EQ(reference.density(q, h), expected);
    }
  }
}

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

TEST(Reference, DegenerateFootprintsHaveDocumentedAnswers) {
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    const Reference reference(rough().map(), 0.03f, surface, Boundary::wrap, Reference::Search::pruned);
    const Vec2 uv = {0.3f, 0.6f}, h = rough().map().at(19, 28);
    const float narrowest = reference.density(Footprint::isotropic(uv, kMinSigmaTexels), h);
    EXPECT_GT(narrowest, 1);
    // Too narrow, or not finite: the narrowest Gaussian.
    for (const float sigma : {0.0f, 1e-30f, -0.1f, kNan})
      EXPECT_EQ(reference.density(Footprint::isotropic(uv, sigma), h), narrowest) << sigma;
    EXPECT_EQ(reference.density(Footprint::gaussian(uv, {-1, 0, -1}), h), narrowest);
    EXPECT_EQ(reference.density(Footprint::gaussian(uv, {1, kNan, 1}), h), narrowest);
    EXPECT_EQ(reference.density(Footprint::box(uv, {0, 0}, {0, 0}), h), narrowest);
    EXPECT_EQ(reference.density(Footprint::box(uv, {kNan, 0}, {0, 1}), h), narrowest);
    EXPECT_EQ(reference.density(Footprint::box(uv, {kInfinity, 0}, {0, 1}), h), narrowest);
    // A centre that is not finite counts as 0.
    EXPECT_EQ(reference.density(Footprint::isotropic({kNan, 0.6f}, 2), h),
              reference.density(Footprint::isotropic({0, 0.6f}, 2), h));
    EXPECT_EQ(reference.density(Footprint::isotropic({kInfinity, kNan}, 2), h),
              reference.density(Footprint::isotropic({0, 0}, 2), h));
    // Larger than the map: an even mean of all of it, wherever the centre is.
    const float everywhere = reference.density(Footprint::isotropic(uv, 1e3f), h);
    EXPECT_GT(everywhere, 0);
    for (const float sigma : {1e5f, 1e18f})
      EXPECT_NEAR(reference.density(Footprint::isotropic({0.9f, 0.1f}, sigma), h), everywhere, 1e-4f * everywhere);
    for (const float size : {1e6f, 1e20f})
      EXPECT_NEAR(reference.density(Footprint::box(uv, {size, 0}, {0, size}), h), everywhere, 1e-4f * everywhere);
  }
}

TEST(Reference, ThinBoxesHaveFiniteAnswersOnBothSidesOfTheLimit) {
  for (const Boundary boundary : {Boundary::wrap, Boundary::clamp}) {
    for (const Surface surface : {Surface::flat, Surface::smooth}) {
      for (const auto search : {Reference::Search::pruned, Reference::Search::exhaustive}) {
        const Reference reference(rough().map(), 0.03f, surface, boundary, search);
        for (const float thickness : {0.0f, 1e-6f, 0.9e-3f, 1.1e-3f, 1e-2f, 0.3f}) {
          for (const float angle : {0.0f, 0.3f, 1.2f}) {
            const Vec2 along = {std::cos(angle), std::sin(angle)};
            const Footprint p = Footprint::box({0.03f, 0.97f}, 8 * along, thickness * Vec2{-along.y, along.x});
            // The thinner kind of Gaussian sees a wider strip, so only mass and sign are compared.
            EXPECT_NEAR(reference.mean(p, {{-1, -1}, {1, 1}}), 0.25, 2e-3) << thickness << ' ' << angle;
            EXPECT_GE(reference.density(p, {0, 0}), 0);
            EXPECT_TRUE(std::isfinite(reference.density(p, {0, 0})));
          }
        }
      }
    }
  }
}

TEST(Reference, HalfVectorsOutsideTheSquareAndEmptyRangesAreZero) {
  for (const Surface surface : {Surface::flat, Surface::smooth}) {
    const Reference reference(rough().map(), 0.2f, surface);
    const Footprint p = Footprint::isotropic({0.5f, 0.5f}, 3);
    EXPECT_GT(reference.density(p, {1, 0}), 0);  // the border belongs to the square
    for (const Vec2 h : {Vec2{1.001f, 0}, Vec2{0, -1.001f}, Vec2{kNan, 0}, Vec2{0, kNan}, Vec2{kInfinity, 0}})
      EXPECT_EQ(reference.density(p, h), 0);
    for (const Box2 range :
         {Box2{{0, 0}, {0, 1}}, Box2{{0.5f, 0}, {-0.5f, 1}}, Box2{{kNan, 0}, {1, 1}}, Box2{{0, 0}, {1, kNan}},
          Box2{{2, 2}, {3, 3}}, Box2{{-kInfinity, -kInfinity}, {kInfinity, kInfinity}}})
      EXPECT_EQ(reference.mean(p, range), 0) << range.low.x << ' ' << range.high.x;
  }
}

TEST(Reference, SmallestMapsWork) {
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 7}, {9, 1}, {2, 2}}) {
    const OwnedMap owned(width, height, std::vector<Vec2>(static_cast<std::size_t>(width) * height, Vec2{0.1f, 0.2f}));
    for (const Surface surface : {Surface::flat, Surface::smooth}) {
      for (const auto search : {Reference::Search::pruned, Reference::Search::exhaustive}) {
        const Reference reference(owned.map(), 0.05f, surface, Boundary::wrap, search);
        for (const Footprint& p : {Footprint::isotropic({0.3f, 0.9f}, 0), Footprint::isotropic({0.5f, 0}, 3),
                                   Footprint::box({0.1f, 0.2f}, {1, 2}, {-2, 1})})
          EXPECT_NEAR(reference.density(p, {0.1f, 0.2f}), peakOf(0.05), kFloatError * peakOf(0.05)) << width << 'x' << height;
      }
    }
    // On a map that ends at its border, a smooth surface needs two texels each way; without one, there is no surface.
    const Reference clamped(owned.map(), 0.05f, Surface::smooth, Boundary::clamp);
    const float density = clamped.density(Footprint::isotropic({0.5f, 0.5f}, 1), {0.1f, 0.2f});
    if (width > 1 && height > 1)
      EXPECT_NEAR(density, peakOf(0.05), kFloatError * peakOf(0.05));
    else
      EXPECT_EQ(density, 0);
  }
}

}  // namespace
}  // namespace glint::reference_test
