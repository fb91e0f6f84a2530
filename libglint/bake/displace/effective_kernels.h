#pragma once

#include <span>
#include <vector>

#include "glint/model/displacement.h"

namespace glint::bake {

/// Directions as arrays, padded with zero vectors to a multiple of 16.
struct DirectionTable {
  explicit DirectionTable(std::span<const Vec3> directions);
  std::size_t count = 0;   ///< directions
  std::size_t padded = 0;  ///< directions and padding
  std::vector<float> x, y, z;
  Vec3 at(std::size_t d) const { return {x[d], y[d], z[d]}; }
};

/// row[d] *= max(0, dot(normal, direction d)).
void multiplyCosines(const DirectionTable& directions, Vec3 normal, float* row);

/// c[i][j] += sum over k of a[k][i] b[k][j].
/// @param size  a multiple of 16; a, b are [count][size], c is [size][size]
void addProducts(const float* a, const float* b, std::size_t count, std::size_t size, float* c);

/// Facets as arrays of `count` numbers each; count is a multiple of 8.
struct FacetArrays {
  const float* x;  ///< x of the unit normals
  const float* y;
  const float* z;
  const float* bend;    ///< alpha^2 - 1
  const float* masked;  ///< [directions][count]: root of the facet's weight, times visibility and masking; 0 behind the facet
  std::size_t count;
};

/// c[i][o] += sum over facets of masked[i] masked[o] / t^2 with t = 1 + bend dot(n, h)^2, for i <= o: light that GGX facets
/// reflect once, without constant factors.
/// @param half    [directions][directions] unit half vectors
/// @param stride  floats from one row of c to the next
void addGgxPairs(const FacetArrays& facets, std::span<const Vec3> half, std::size_t directions, std::size_t stride, float* c);

/// addGgxPairs for three channels, with the colour of each facet as a factor: c is [3][stride][stride].
/// @param colors  [3][color_stride]
void addColoredGgxPairs(const FacetArrays& facets, const float* colors, std::size_t color_stride, std::span<const Vec3> half,
                        std::size_t directions, std::size_t stride, float* c);

/// out[i] += scale * visible[i] * f(i, view) cos(i) of one GGX facet, for light from every direction i; cos(i) is the cosine to
/// the normal of the facet.
void addGgxLights(const DirectionTable& directions, const float* visible, Vec3 normal, Vec3 view, const BaseBrdf& base,
                  float scale, float* out);

}  // namespace glint::bake
