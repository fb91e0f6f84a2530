#pragma once

#include <algorithm>

#include "glint/math/float4.h"
#include "glint/math/vec.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/query/detail/common/sampling.h"
#include "glint/query/detail/pyramid/block_rows.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"
#include "glint/query/ndf_model.h"

namespace glint {

/// A pixel of an NDF image and its eight neighbours: [row][column] from the lower left neighbour on; 0 outside the image.
struct PixelWindow {
  static constexpr int kSize = 3;
  float pixels[kSize][kSize] = {};

  GLINT_HD float centre() const { return pixels[1][1]; }
  GLINT_HD PixelWindow& operator*=(float factor) {
    for (auto& row : pixels)
      for (float& pixel : row) pixel *= factor;
    return *this;
  }
};

/// The same while it is summed: lanes 0 to 2 of each row are pixels.
struct WindowRows {
  GLINT_HD WindowRows() {
    for (Float4& row : rows) row = Float4::zero();
  }
  GLINT_HD PixelWindow pixels() const {
    PixelWindow window;
    for (int y = 0; y < PixelWindow::kSize; ++y) {
      float lanes[4];
      rows[y].store(lanes);
      std::copy(lanes, lanes + PixelWindow::kSize, window.pixels[y]);
    }
    return window;
  }

  Float4 rows[PixelWindow::kSize];
};

/// Calls visitor(block, x, y) for each block that holds a part of the window around a pixel: up to four. The first pixel of the
/// window is at column x and row y of the block, -2 to 15.
template <class Visitor>
GLINT_HD void forEachBlockOfWindow(const PyramidShape& shape, const PixelPlace& place, Visitor&& visitor) {
  constexpr int kLast = kBlockSize - 1;
  const auto neighbour = [](int pixel) { return pixel == 0 ? -1 : pixel == kLast ? 1 : 0; };
  const int right = neighbour(place.x), up = neighbour(place.y);
  visitor(place.block, place.x - 1, place.y - 1);
  if (right == 0 && up == 0) return;
  const int blocks = shape.blocksPerAxis(), column = place.block % blocks, row = place.block / blocks;
  const auto visit = [&](int dx, int dy) {
    if (column + dx < 0 || column + dx >= blocks || row + dy < 0 || row + dy >= blocks) return;
    visitor(place.block + dy * blocks + dx, place.x - 1 - dx * kBlockSize, place.y - 1 - dy * kBlockSize);
  };
  if (right != 0) visit(right, 0);
  if (up != 0) visit(0, up);
  if (right != 0 && up != 0) visit(right, up);
}

/// A density >= 0 along one axis of a pixel, for positions t in [0, 1]: the parabola that has given values at both ends and a
/// given mean. No value at an end exceeds twice the mean, so the parabola is not negative.
struct PixelParabola {
  /// The value at the border of two pixels depends on these two alone, so that the density is continuous. Twice the smaller mean
  /// bounds it.
  GLINT_HD PixelParabola(float before, float here, float after)
      : low(border(before, here)), mean(here), high(border(here, after)), bend(6 * mean - 3 * (low + high)) {}

  GLINT_HD float at(float t) const { return low + t * ((high - low) + (1 - t) * bend); }
  /// Integral from 0 to t.
  GLINT_HD float below(float t) const { return t * (low + t * (0.5f * (high - low) + bend * (0.5f - t * (1.0f / 3)))); }
  /// The position below which the share xi of the mass lies: Newton's steps, kept between bounds that close in.
  GLINT_HD float placeOf(float xi) const {
    constexpr int kMostSteps = 12;
    constexpr float kPrecision = 1e-7f;  // of the mass
    const float asked = xi * mean, precision = kPrecision * mean;
    float first = 0, last = 1, t = xi;
    for (int step = 0; step < kMostSteps; ++step) {
      const float excess = below(t) - asked;
      if (!(excess < -precision || excess > precision)) break;
      (excess > 0 ? last : first) = t;
      t -= excess / at(t);
      if (!(t > first && t < last)) t = 0.5f * (first + last);
    }
    return clampUnit(t);
  }

  float low, mean, high;
  float bend;

 private:
  static GLINT_HD float border(float a, float b) { return std::min(0.5f * a + 0.5f * b, 2 * std::min(a, b)); }
};

/// The density inside a pixel: continuous over the borders of pixels, not negative, and with the mean of the pixel as its mean.
/// Means over whole pixels are therefore those of the images, and half vectors can be drawn exactly.
///
/// Along x the three rows of the window are parabolas. Along y their values at one x are means again, of a parabola along y. So x
/// is drawn from the middle row, and y from the parabola at this x.
/// For a Gaussian facet the density errs by .19 of its root mean square where sigma_r is .64 pixels, by .08 at 1 pixel and by .04
/// at 1.5 pixels; constant pixels err by .41, .28 and .19 (PixelSpline.ErrsLessThanConstantPixels).
class PixelSpline {
 public:
  /// @param window  pixels >= 0
  GLINT_HD explicit PixelSpline(const PixelWindow& window) : rows_{row(window, 0), row(window, 1), row(window, 2)} {}

  /// @param t  position in the pixel, in [0, 1]^2
  GLINT_HD float density(Vec2 t) const { return alongY(t.x).at(t.y); }
  /// A position in the pixel in proportion to the density.
  GLINT_HD Vec2 sample(Vec2 xi) const {
    const float x = rows_[1].placeOf(xi.x);
    return {x, alongY(x).placeOf(xi.y)};
  }

 private:
  static GLINT_HD PixelParabola row(const PixelWindow& window, int y) {
    const float* pixels = window.pixels[y];
    return {pixels[0], pixels[1], pixels[2]};
  }
  GLINT_HD PixelParabola alongY(float x) const { return {rows_[0].at(x), rows_[1].at(x), rows_[2].at(x)}; }

  PixelParabola rows_[PixelWindow::kSize];
};

/// Density towards h, a half vector of the pixel in the middle of the window.
inline GLINT_HD float splineDensity(const PyramidShape& shape, const PixelWindow& window, Vec2 h) {
  return finitePositive(PixelSpline(window).density(positionInPixel(shape, h)));
}

/// A half vector of the pixel in the middle of the window, in proportion to the density. The pdf is splineDensity.
inline GLINT_HD HalfVectorSample splineSample(const PyramidShape& shape, const PixelPlace& place, const PixelWindow& window,
                                              Vec2 xi) {
  const PixelSpline spline(window);
  const Vec2 h = pointInPixel(shape, place, spline.sample(xi));
  return drawnAt(h, finitePositive(spline.density(positionInPixel(shape, h))));
}

}  // namespace glint
