#include "glint/query/detail/common/triangle_lobe.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace glint::triangle_lobe_test {
namespace {

/// Gauss-Legendre panels no longer than one deviation (triangleDensity) and Radon's rule on pieces of about a deviation
/// (triangleMass) leave errors of a few 1e-4 of the value; the reference quadratures below are finer.
constexpr double kRelative = 1e-3;
/// The lobe is cut at kLobeReach: 2.7e-7 of its peak. Sums in float over up to 768 terms add as much again.
constexpr double kOfPeak = 1e-6;

struct Triangle {
  Vec2 a, b, c;
};

double peakOf(double sigma) { return 1 / (2 * std::numbers::pi * sigma * sigma); }

double normalCdf(double x) { return 0.5 * std::erfc(-x / std::numbers::sqrt2); }

double pointDensity(double x, double y, Vec2 h, double sigma) {
  const double dx = x - h.x, dy = y - h.y;
  return peakOf(sigma) * std::exp(-(dx * dx + dy * dy) / (2 * sigma * sigma));
}

double pointMass(double x, double y, const Box2& box, double sigma) {
  return (normalCdf((box.high.x - x) / sigma) - normalCdf((box.low.x - x) / sigma)) *
         (normalCdf((box.high.y - y) / sigma) - normalCdf((box.low.y - y) / sigma));
}

/// Mean of f over a triangle: its centroid rule on n^2 equal parts whose edges are at most a twentieth of a deviation.
template <class F>
double denseMean(const Triangle& t, double sigma, const F& f) {
  const double longest = std::sqrt(std::max({dot(t.b - t.a, t.b - t.a), dot(t.c - t.b, t.c - t.b), dot(t.a - t.c, t.a - t.c)}));
  const int n = std::max(1, static_cast<int>(std::ceil(longest / (0.05 * sigma))));
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; i + j < n; ++j) {
      for (const double third : {1.0 / 3, 2.0 / 3}) {
        if (third > 0.5 && i + j + 1 >= n) continue;
        const double u = (i + third) / n, v = (j + third) / n;
        sum += f(t.a.x + u * (double{t.b.x} - t.a.x) + v * (double{t.c.x} - t.a.x),
                 t.a.y + u * (double{t.b.y} - t.a.y) + v * (double{t.c.y} - t.a.y));
      }
    }
  }
  return sum / (double(n) * n);
}

/// Mean of the lobe over a triangle much larger than it: rows of constant y within nine deviations of h, each by the normal
/// CDF.
double densityByRows(const Triangle& t, Vec2 h, double sigma) {
  const double low = std::max<double>(std::min({t.a.y, t.b.y, t.c.y}), h.y - 9 * sigma);
  const double high = std::min<double>(std::max({t.a.y, t.b.y, t.c.y}), h.y + 9 * sigma);
  if (low >= high) return 0;
  constexpr int kRows = 4000;
  double sum = 0;
  for (int k = 0; k < kRows; ++k) {
    const double y = low + (high - low) * (k + 0.5) / kRows;
    double left = 1e9, right = -1e9;
    const std::pair<Vec2, Vec2> edges[] = {{t.a, t.b}, {t.b, t.c}, {t.c, t.a}};
    for (const auto& [p, q] : edges) {
      if ((p.y <= y) == (q.y <= y)) continue;
      const double x = p.x + (y - p.y) * (double{q.x} - p.x) / (double{q.y} - p.y);
      left = std::min(left, x);
      right = std::max(right, x);
    }
    if (right <= left) continue;
    const double along = normalCdf((right - h.x) / sigma) - normalCdf((left - h.x) / sigma);
    sum += along * std::exp(-(y - h.y) * (y - h.y) / (2 * sigma * sigma));
  }
  const double area =
      0.5 * std::abs((double{t.b.x} - t.a.x) * (double{t.c.y} - t.a.y) - (double{t.c.x} - t.a.x) * (double{t.b.y} - t.a.y));
  return sum * (high - low) / kRows / (sigma * std::sqrt(2 * std::numbers::pi)) / area;
}

class RandomTriangles {
 public:
  explicit RandomTriangles(unsigned seed) : random_(seed) {}
  float unit() { return std::uniform_real_distribution<float>(-1, 1)(random_); }
  Vec2 point(float extent) { return {extent * unit(), extent * unit()}; }

  Triangle any(float extent) {
    const Vec2 at = point(0.3f);
    return {at + point(extent), at + point(extent), at + point(extent)};
  }
  /// The apex lies within `height` of the segment a-b, inside or beyond its ends.
  Triangle sliver(float extent, float height) {
    Triangle t = any(extent);
    t.c = t.a + (0.5f + unit()) * (t.b - t.a) + point(height);
    return t;
  }
  /// A half vector near a random point of the triangle.
  Vec2 near(const Triangle& t, float distance) {
    const float u = 0.5f + 0.5f * unit(), v = (1 - u) * (0.5f + 0.5f * unit());
    return t.a + u * (t.b - t.a) + v * (t.c - t.a) + point(distance);
  }

 private:
  std::mt19937 random_;
};

void expectDensity(const Triangle& t, Vec2 h, float sigma) {
  const double expected = denseMean(t, sigma, [&](double x, double y) { return pointDensity(x, y, h, sigma); });
  ASSERT_NEAR(triangleDensity(t.a, t.b, t.c, h, sigma), expected, kRelative * expected + kOfPeak * peakOf(sigma))
      << t.a.x << ' ' << t.a.y << ' ' << t.b.x << ' ' << t.b.y << ' ' << t.c.x << ' ' << t.c.y << " at " << h.x << ' ' << h.y
      << " sigma " << sigma;
}

void expectMass(const Triangle& t, const Box2& box, float sigma) {
  const double expected = denseMean(t, sigma, [&](double x, double y) { return pointMass(x, y, box, sigma); });
  ASSERT_NEAR(triangleMass(t.a, t.b, t.c, box, sigma), expected, kRelative * expected + kOfPeak)
      << t.a.x << ' ' << t.a.y << ' ' << t.b.x << ' ' << t.b.y << ' ' << t.c.x << ' ' << t.c.y << " box " << box.low.x << ' '
      << box.low.y << ' ' << box.high.x << ' ' << box.high.y << " sigma " << sigma;
}

Box2 randomBox(RandomTriangles& random, const Triangle& t, float size) {
  const Vec2 centre = random.near(t, size);
  const Vec2 half = {size * (0.1f + std::fabs(random.unit())), size * (0.1f + std::fabs(random.unit()))};
  return {centre - half, centre + half};
}

TEST(TriangleLobe, DensityIsTheMeanOfTheLobeOverRandomTriangles) {
  RandomTriangles random(1);
  for (const float extent : {0.2f, 1.0f, 5.0f}) {  // in deviations
    for (int k = 0; k < 60; ++k) {
      const float sigma = 0.01f;
      const Triangle t = random.any(extent * sigma);
      expectDensity(t, random.near(t, 2 * sigma), sigma);
    }
  }
}

TEST(TriangleLobe, DensityIsRightOnSliversSegmentsAndPoints) {
  RandomTriangles random(2);
  const float sigma = 0.01f;
  for (int k = 0; k < 60; ++k) {
    const Triangle sliver = random.sliver(5 * sigma, 1e-3f * sigma);
    expectDensity(sliver, random.near(sliver, 2 * sigma), sigma);
    Triangle segment = random.any(5 * sigma);
    segment.c = k % 3 == 0 ? segment.a : k % 3 == 1 ? segment.b : 0.5f * (segment.a + segment.b);
    expectDensity(segment, random.near(segment, 2 * sigma), sigma);
    const Vec2 p = random.point(0.5f);
    const Vec2 h = p + random.point(2 * sigma);
    EXPECT_NEAR(triangleDensity(p, p, p, h, sigma), pointDensity(p.x, p.y, h, sigma),
                kRelative * pointDensity(p.x, p.y, h, sigma));
  }
}

TEST(TriangleLobe, DensityIsRightOnHugeTriangles) {
  RandomTriangles random(3);
  for (const float sigma : {0.001f, 0.005f, 0.05f}) {
    for (int k = 0; k < 40; ++k) {
      const Triangle t = random.any(0.7f);
      const Vec2 h = random.near(t, 2 * sigma);
      const double expected = densityByRows(t, h, sigma);
      EXPECT_NEAR(triangleDensity(t.a, t.b, t.c, h, sigma), expected, kRelative * expected + kOfPeak * peakOf(sigma));
    }
  }
}

TEST(TriangleLobe, DensityDoesNotDependOnTheOrderOfCorners) {
  RandomTriangles random(4);
  for (int k = 0; k < 50; ++k) {
    const Triangle t = random.any(0.05f);
    const Vec2 h = random.near(t, 0.01f);
    const double expected = triangleDensity(t.a, t.b, t.c, h, 0.01f);
    for (const double other : {triangleDensity(t.b, t.c, t.a, h, 0.01f), triangleDensity(t.b, t.a, t.c, h, 0.01f)})
      EXPECT_NEAR(other, expected, kRelative * expected + kOfPeak * peakOf(0.01));
  }
}

TEST(TriangleLobe, MassIsTheMeanOfTheLobesMassOverRandomTriangles) {
  RandomTriangles random(5);
  const float sigma = 0.01f;
  for (const float extent : {0.2f, 1.0f, 5.0f}) {
    for (int k = 0; k < 40; ++k) {
      const Triangle t = random.any(extent * sigma);
      for (const float size : {0.3f, 1.0f, 10.0f}) expectMass(t, randomBox(random, t, size * sigma), sigma);
    }
  }
}

TEST(TriangleLobe, MassIsRightOnSliversSegmentsPointsAndHugeTriangles) {
  RandomTriangles random(6);
  const float sigma = 0.01f;
  for (int k = 0; k < 30; ++k) {
    const Triangle sliver = random.sliver(5 * sigma, 1e-3f * sigma);
    expectMass(sliver, randomBox(random, sliver, sigma), sigma);
    Triangle segment = random.any(5 * sigma);
    segment.c = segment.a;
    expectMass(segment, randomBox(random, segment, sigma), sigma);
    const Vec2 p = random.point(0.5f);
    expectMass({p, p, p}, randomBox(random, {p, p, p}, sigma), sigma);
  }
  for (int k = 0; k < 3; ++k) {
    const Triangle t = random.any(0.4f);
    expectMass(t, randomBox(random, t, 0.1f), 0.03f);
  }
}

TEST(TriangleLobe, AllMassLiesInALargeEnoughBox) {
  RandomTriangles random(7);
  for (int k = 0; k < 50; ++k) {
    const Triangle t = random.any(0.3f);
    EXPECT_NEAR(triangleMass(t.a, t.b, t.c, {{-2, -2}, {2, 2}}, 0.005f), 1, kOfPeak);
  }
}

TEST(TriangleLobe, MassOfATinyBoxIsTheDensityTimesItsArea) {
  // The box is a twentieth of a deviation: the lobe's curvature changes its mean by 1e-4 of the peak.
  constexpr double kCurvature = 2e-4;
  RandomTriangles random(8);
  const float sigma = 0.02f, half = 0.025f * sigma;
  for (const float extent : {0.01f, 1.0f, 20.0f}) {
    for (int k = 0; k < 60; ++k) {
      const Triangle t = random.any(extent * sigma);
      const Vec2 h = random.near(t, 2 * sigma);
      const Box2 box = {h - Vec2{half, half}, h + Vec2{half, half}};
      const double density = triangleDensity(t.a, t.b, t.c, h, sigma);
      EXPECT_NEAR(triangleMass(t.a, t.b, t.c, box, sigma) / box.area(), density,
                  kRelative * density + kCurvature * peakOf(sigma));
    }
  }
}

}  // namespace
}  // namespace glint::triangle_lobe_test
