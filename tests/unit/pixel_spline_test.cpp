#include "glint/query/detail/pyramid/pixel_spline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace glint::pixel_spline_test {
namespace {

constexpr int kSteps = 64;  // of integrals along each axis of a pixel

float middle(int step) { return (static_cast<float>(step) + 0.5f) / kSteps; }

/// A map of pixels of very different sizes, some of them 0.
class Map {
 public:
  explicit Map(unsigned seed) : pixels_(kSize * kSize) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> exponent(-6, 3);
    for (float& pixel : pixels_) pixel = random() % 5 == 0 ? 0.0f : std::exp(exponent(random));
  }
  static constexpr int kSize = 8;
  float operator()(int x, int y) const { return pixels_[static_cast<std::size_t>(y * kSize + x)]; }
  PixelWindow window(int x, int y) const {
    PixelWindow window;
    for (int j = 0; j < PixelWindow::kSize; ++j)
      for (int i = 0; i < PixelWindow::kSize; ++i)
        if (x + i - 1 >= 0 && x + i - 1 < kSize && y + j - 1 >= 0 && y + j - 1 < kSize)
          window.pixels[j][i] = (*this)(x + i - 1, y + j - 1);
    return window;
  }
  template <class Visitor>
  void forEachPixel(Visitor&& visitor) const {
    for (int y = 0; y < kSize; ++y)
      for (int x = 0; x < kSize; ++x) visitor(x, y, PixelSpline(window(x, y)));
  }

 private:
  std::vector<float> pixels_;
};

TEST(PixelSpline, KeepsTheMassOfEveryPixel) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    const Map map(seed);
    map.forEachPixel([&](int x, int y, const PixelSpline& spline) {
      double sum = 0;
      for (int j = 0; j < kSteps; ++j)
        for (int i = 0; i < kSteps; ++i) {
          const float density = spline.density({middle(i), middle(j)});
          ASSERT_GE(density, 0);
          sum += double{density} / (kSteps * kSteps);
        }
      EXPECT_NEAR(sum, map(x, y), 1e-3 * map(x, y)) << x << ' ' << y;  // the rule of the middle errs by some 1e-4
    });
  }
}

TEST(PixelSpline, IsContinuousOverTheBordersOfPixels) {
  const Map map(3);
  for (int y = 0; y + 1 < Map::kSize; ++y) {
    for (int x = 0; x + 1 < Map::kSize; ++x) {
      const PixelSpline here(map.window(x, y)), right(map.window(x + 1, y)), above(map.window(x, y + 1));
      for (int step = 0; step < kSteps; ++step) {
        const float t = middle(step), most = 1e-5f * (map(x, y) + map(x + 1, y) + map(x, y + 1));
        EXPECT_NEAR(here.density({1, t}), right.density({0, t}), most);
        EXPECT_NEAR(here.density({t, 1}), above.density({t, 0}), most);
      }
    }
  }
}

TEST(PixelSpline, DrawsPositionsByItsDensity) {
  // Equal steps of xi have equal masses: the integral of the density up to the drawn position is xi.
  const Map map(5);
  map.forEachPixel([&](int x, int y, const PixelSpline& spline) {
    if (map(x, y) == 0) return;
    for (float xi = 0.05f; xi < 1; xi += 0.15f) {
      const Vec2 drawn = spline.sample({xi, 1 - xi});
      double left = 0, below = 0, column = 0;
      for (int i = 0; i < kSteps; ++i)
        for (int j = 0; j < kSteps; ++j)
          left += double{spline.density({drawn.x * middle(i), middle(j)})} * drawn.x / (kSteps * kSteps);
      for (int j = 0; j < kSteps; ++j) {
        column += double{spline.density({drawn.x, middle(j)})} / kSteps;
        below += double{spline.density({drawn.x, drawn.y * middle(j)})} * drawn.y / kSteps;
      }
      EXPECT_NEAR(left / map(x, y), xi, 1e-3) << x << ' ' << y;
      EXPECT_NEAR(below / column, 1 - xi, 1e-3) << x << ' ' << y;
    }
  });
}

TEST(PixelSpline, DrawsInsideThePixelWhateverItsNumbers) {
  const float inf = HUGE_VALF, nan = std::nanf("");
  for (const float centre : {0.0f, 1e-38f, 1e38f, inf, nan}) {
    PixelWindow window;
    for (auto& row : window.pixels) std::fill(row, row + PixelWindow::kSize, 3e38f);
    window.pixels[1][1] = centre;
    for (const float xi : {0.0f, 0.5f, 0x1.fffffep-1f}) {
      const Vec2 drawn = PixelSpline(window).sample({xi, xi});
      EXPECT_TRUE(drawn.x >= 0 && drawn.x < 1 && drawn.y >= 0 && drawn.y < 1) << centre << ' ' << xi;
    }
  }
}

/// Error of densities inside pixels for Gaussian facets at random places, over the root mean square of the density.
struct FacetErrors {
  double smooth, linear, constant;
};

/// Linear between the centres of pixels.
double linear(const PixelWindow& window, Vec2 t) {
  const auto partsOf = [](float position, float(&parts)[PixelWindow::kSize]) {
    for (int k = 0; k < PixelWindow::kSize; ++k)
      parts[k] = std::max(0.0f, 1 - std::abs(position + 0.5f - static_cast<float>(k)));
  };
  float x[PixelWindow::kSize], y[PixelWindow::kSize];
  partsOf(t.x, x);
  partsOf(t.y, y);
  float sum = 0;
  for (int j = 0; j < PixelWindow::kSize; ++j)
    for (int i = 0; i < PixelWindow::kSize; ++i) sum += y[j] * x[i] * window.pixels[j][i];
  return double{sum};
}

FacetErrors facetErrors(double sigma) {
  constexpr int kFacets = 2000, kRadius = 5;
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0, 1);
  double smooth = 0, between = 0, constant = 0, squares = 0;
  for (int facet = 0; facet < kFacets; ++facet) {
    const double ox = unit(random), oy = unit(random);
    const auto share = [&](int pixel, double centre) {
      const double scale = 1 / (sigma * std::sqrt(2.0));
      return 0.5 * (std::erf((pixel + 1 - centre) * scale) - std::erf((pixel - centre) * scale));
    };
    for (int y = -kRadius; y <= kRadius; ++y) {
      for (int x = -kRadius; x <= kRadius; ++x) {
        PixelWindow window;
        for (int j = 0; j < PixelWindow::kSize; ++j)
          for (int i = 0; i < PixelWindow::kSize; ++i)
            window.pixels[j][i] = static_cast<float>(share(x + i - 1, ox) * share(y + j - 1, oy));
        const double tx = unit(random), ty = unit(random), dx = x + tx - ox, dy = y + ty - oy;
        const double truth = std::exp(-(dx * dx + dy * dy) / (2 * sigma * sigma)) / (2 * M_PI * sigma * sigma);
        const Vec2 t = {static_cast<float>(tx), static_cast<float>(ty)};
        smooth += std::pow(double{PixelSpline(window).density(t)} - truth, 2);
        between += std::pow(linear(window, t) - truth, 2);
        constant += std::pow(double{window.centre()} - truth, 2);
        squares += truth * truth;
      }
    }
  }
  return {std::sqrt(smooth / squares), std::sqrt(between / squares), std::sqrt(constant / squares)};
}

TEST(PixelSpline, ErrsLessThanConstantPixels) {
  struct Case {
    double sigma;  // pixels
    FacetErrors errors;
  };
  for (const Case& c : {Case{0.64, {0.19, 0.32, 0.415}}, Case{1, {0.083, 0.16, 0.28}}, Case{1.5, {0.04, 0.076, 0.19}}}) {
    const FacetErrors errors = facetErrors(c.sigma);
    EXPECT_NEAR(errors.smooth, c.errors.smooth, 0.005) << c.sigma;
    EXPECT_NEAR(errors.linear, c.errors.linear, 0.005) << c.sigma;
    EXPECT_NEAR(errors.constant, c.errors.constant, 0.005) << c.sigma;
  }
}

}  // namespace
}  // namespace glint::pixel_spline_test
