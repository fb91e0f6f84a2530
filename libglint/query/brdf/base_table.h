#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "glint/math/rgb.h"
#include "glint/math/tangents.h"
#include "glint/model/displacement.h"

namespace glint {

/// Two directions as an isotropic table sees them (Rusinkiewicz 1998): a frame around the half vector, in which only the normal
/// moves. Exchanging the directions turns the frame around by half a turn, which `tablePoint` does not see.
struct TablePair {
  Vec3 half;             ///< unit half vector
  Vec3 along;            ///< unit vector across the half vector, in the plane of both directions
  Vec3 across;           ///< unit vector across both
  float difference = 0;  ///< sqrt(1 - cos theta_d), 0 to 1
};

/// @param wi, wo  unit vectors; opposite ones have no half vector, and get the normal of the surface as one
inline GLINT_HD TablePair tablePair(Vec3 wi, Vec3 wo) {
  constexpr float kTiny = 1e-14f;
  const Vec3 sum = wi + wo, gap = wi - wo;
  const float sum2 = dot(sum, sum), gap2 = dot(gap, gap), length = std::sqrt(sum2);
  TablePair pair;
  pair.half = sum2 > kTiny ? (1 / length) * sum : Vec3{0, 0, 1};
  pair.along = gap2 > kTiny ? (1 / std::sqrt(gap2)) * gap : tangentsOf(pair.half).s;
  const Vec3 h = pair.half, a = pair.along;
  pair.across = {h.y * a.z - h.z * a.y, h.z * a.x - h.x * a.z, h.x * a.y - h.y * a.x};
  // 1 - cos = sin^2 / (1 + cos), without the loss of digits near 0.
  pair.difference = std::sqrt(0.25f * gap2 / (1 + 0.5f * length));
  return pair;
}

/// The place of a normal around the half vector: rho (|cos phi_d|, |sin phi_d|) with rho^4 = (1 - cos theta_h) / 2. Nodes are
/// dense where theta_h is small, as MERL's are. Tables hold one quarter: the others are its mirror images.
inline GLINT_HD Vec2 tablePoint(const TablePair& pair, Vec3 normal) {
  const float c = dot(normal, pair.half);
  const float p = std::fabs(dot(normal, pair.along)), q = std::fabs(dot(normal, pair.across));
  const float sine2 = std::max(p * p + q * q, 1e-30f);
  const float rho4 = c > 0 ? 0.5f * sine2 / (1 + c) : 0.5f * (1 - c);
  const float scale = std::sqrt(std::sqrt(rho4) / sine2);
  return {scale * p, scale * q};
}

/// Position of a lookup in a table of `nodes`^2 nodes for each of `slices` differences: the first of eight nodes, and weights.
struct TablePlace {
  std::size_t node = 0;
  float x = 0, y = 0, z = 0;
};

/// @param slices, nodes  two or more
inline GLINT_HD TablePlace tablePlace(float difference, Vec2 point, int slices, int nodes) {
  const auto axis = [](float value, int count, int& low) {
    const float last = static_cast<float>(count - 1);
    const float at = value > 0 ? std::min(value * last, last) : 0.0f;  // NaN counts as 0
    low = std::min(static_cast<int>(at), count - 2);
    return at - static_cast<float>(low);
  };
  int i, j, k;
  TablePlace place;
  place.x = axis(point.x, nodes, i), place.y = axis(point.y, nodes, j), place.z = axis(difference, slices, k);
  place.node = (static_cast<std::size_t>(k) * static_cast<std::size_t>(nodes) + static_cast<std::size_t>(j)) *
                   static_cast<std::size_t>(nodes) +
               static_cast<std::size_t>(i);
  return place;
}

/// out[c] += scale * the table's value at a place, linear between nodes.
/// @param table  [slices][nodes][nodes][kStride]
template <std::size_t kStride>
inline GLINT_HD void addTableValue(const float* table, const TablePlace& at, int nodes, float scale, float* out) {
  const std::size_t row = static_cast<std::size_t>(nodes), slice = row * row;
  for (std::size_t z = 0; z < 2; ++z) {
    for (std::size_t y = 0; y < 2; ++y) {
      const float weight = scale * (z == 0 ? 1 - at.z : at.z) * (y == 0 ? 1 - at.y : at.y);
      const float low = weight * (1 - at.x), high = weight * at.x;
      const float* value = table + (at.node + z * slice + y * row) * kStride;
      for (std::size_t c = 0; c < kStride; ++c) out[c] += low * value[c] + high * value[kStride + c];
    }
  }
}

/// The two tables of an asset between which a lobe's bandwidth lies.
struct TableBlend {
  int first = 0;     ///< one of the averaged tables
  int second = 0;    ///< the next one; kBaseTables - 1: f itself
  float weight = 0;  ///< of the second
};

/// Linear in the logarithm of the bandwidth; beyond the last averaged table linear in the variance, down to no width at all.
/// Bandwidths below 1 count as 1, as for GGX.
inline GLINT_HD TableBlend tableBlend(float kappa) {
  constexpr int kLast = kBaseTables - 2;
  constexpr float kWidest = static_cast<float>(1 << kLast);
  if (kappa >= kWidest) return {kLast, kLast + 1, 1 - kWidest / kappa};
  const float place = kappa > 1 ? std::log2(kappa) : 0.0f;
  const int first = std::min(static_cast<int>(place), kLast - 1);
  return {first, first + 1, place - static_cast<float>(first)};
}

/// Mean over the normals of a lobe of f cos(wi) cos(wo), f from the asset's tables.
/// @param tables  [kBaseTables][nodes][channels]
/// @param channels  1 or 3
inline GLINT_HD Rgb tableLobe(const float* tables, int channels, const TablePair& pair, Vec3 centre, float kappa, Vec3 wi,
                              Vec3 wo) {
  const TableBlend blend = tableBlend(kappa);
  const TablePlace place = tablePlace(pair.difference, tablePoint(pair, centre), kBaseTableDifference, kBaseTableHalf);
  const std::size_t size = kBaseTableNodes * static_cast<std::size_t>(channels);
  const float cosines = std::max(0.0f, dot(centre, wi)) * std::max(0.0f, dot(centre, wo));
  const float low = 1 - blend.weight, high = blend.weight * (blend.second == kBaseTables - 1 ? cosines : 1.0f);
  const float* first = tables + static_cast<std::size_t>(blend.first) * size;
  float value[3] = {};
  if (channels == 1) {
    addTableValue<1>(first, place, kBaseTableHalf, low, value);
    addTableValue<1>(first + size, place, kBaseTableHalf, high, value);
    return Rgb::grey(value[0]);
  }
  addTableValue<3>(first, place, kBaseTableHalf, low, value);
  addTableValue<3>(first + size, place, kBaseTableHalf, high, value);
  return {value[0], value[1], value[2]};
}

}  // namespace glint
