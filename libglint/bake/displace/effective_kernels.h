#pragma once

#include <span>
#include <vector>

#include "glint/model/displacement.h"

namespace glint::bake {

/// Directions as arrays, padded with zero vectors to a multiple of 16.
struct DirectionTable {
  explicit DirectionTable(std::span<const Vec3> directions);
  std::size_t count = 0;
  std::size_t padded = 0;
  std::vector<float> x, y, z;
  Vec3 at(std::size_t d) const { return {x[d], y[d], z[d]}; }
};

/// row[d] *= max(0, dot(normal, direction d)).
void multiplyCosines(const DirectionTable& directions, Vec3 normal, float* row);

/// c[i][j] += sum over k of a[k][i] b[k][j].
/// @param size  a multiple of 16; a, b are [count][size], c is [size][size]
void addProducts(const float* a, const float* b, std::size_t count, std::size_t size, float* c);

/// Facets as arrays [count], count a multiple of 8.
struct FacetArrays {
  const float* x;
  const float* y;
  const float* z;
  const float* bend;    ///< alpha^2 - 1
  const float* masked;  ///< [directions][count]: root of the facet's weight * visibility * masking, 0 behind the facet
  std::size_t count;
};

/// c[i][o] += sum over facets of masked[i] masked[o] / t^2 with t = 1 + bend dot(n, h)^2, for i <= o: the sums of the
/// GGX quadrature without their constant factors.
/// @param half    [directions][directions] unit half vectors
/// @param stride  of a row of c
void addGgxPairs(const FacetArrays& facets, std::span<const Vec3> half, std::size_t directions, std::size_t stride, float* c);

/// The same for three channels, with each facet's colour as a factor: c is [3][stride][stride].
/// @param colors  color_stride floats for each channel
void addColoredGgxPairs(const FacetArrays& facets, const float* colors, std::size_t color_stride, std::span<const Vec3> half,
                        std::size_t directions, std::size_t stride, float* c);

/// out[i] += scale * visible[i] * f(i, view) cos(i) of one GGX facet, for light from every direction i.
void addGgxLights(const DirectionTable& directions, const float* visible, Vec3 normal, Vec3 view, const BaseBrdf& base,
                  float scale, float* out);

}  // namespace glint::bake
