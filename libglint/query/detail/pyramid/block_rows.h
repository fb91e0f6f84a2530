#pragma once

#include <cstdint>

#include "glint/math/float4.h"
#include "glint/model/ndf_pyramid.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"

namespace glint {

inline GLINT_HD Float4 loadPixels(const float* pixels) { return Float4::load(pixels); }
inline GLINT_HD Float4 loadPixels(const std::uint16_t* pixels) { return Float4::loadPositive(pixels); }

/// Row y of a block.
/// @param pixels  floats, or half-precision numbers >= 0
template <class Pixel>
GLINT_HD Float16 rowOf(const Pixel* pixels, int y) {
  const Pixel* row = pixels + y * kBlockSize;
  return {{loadPixels(row), loadPixels(row + 4), loadPixels(row + 8), loadPixels(row + 12)}};
}

/// The sum of each row of a block.
template <class Pixel>
GLINT_HD Float16 sumRows(const Pixel* pixels) {
  const auto four = [&](int y) {
    const Pixel* row = pixels + y * kBlockSize;
    return (loadPixels(row) + loadPixels(row + 4)) + (loadPixels(row + 8) + loadPixels(row + 12));
  };
  Float16 sums;
  for (int k = 0; k < 4; ++k) sums.v[k] = sumsOf(four(4 * k), four(4 * k + 1), four(4 * k + 2), four(4 * k + 3));
  return sums;
}
static_assert(kBlockSize == 16);

/// The half vector at position `xi` of a pixel. Stays 2^-23 resolution inside the pixel's border, so that rounding cannot move
/// it into a neighbouring pixel.
inline GLINT_HD Vec2 pointInPixel(const PyramidShape& shape, const PixelPlace& place, Vec2 xi) {
  const float margin = 0x1p-23f * static_cast<float>(shape.resolution);
  const int blocks = shape.blocksPerAxis();
  const auto coordinate = [&](int pixel, float t) {
    const float inside = margin + (1 - 2 * margin) * t;
    return (static_cast<float>(pixel - shape.resolution / 2) + inside) * (2 / static_cast<float>(shape.resolution));
  };
  return {coordinate(place.block % blocks * kBlockSize + place.x, xi.x),
          coordinate(place.block / blocks * kBlockSize + place.y, xi.y)};
}

/// The half vectors of a pixel.
inline GLINT_HD Box2 boxOfPixel(const PyramidShape& shape, const PixelPlace& place) {
  const int blocks = shape.blocksPerAxis();
  const float size = 2 / static_cast<float>(shape.resolution);
  const auto begin = [&](int pixel) { return static_cast<float>(pixel - shape.resolution / 2) * size; };
  const Vec2 low = {begin(place.block % blocks * kBlockSize + place.x), begin(place.block / blocks * kBlockSize + place.y)};
  return {low, low + Vec2{size, size}};
}

}  // namespace glint
