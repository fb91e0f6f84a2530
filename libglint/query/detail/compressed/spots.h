#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "glint/model/ndf_cp.h"
#include "glint/query/detail/pyramid/block_mass.h"
#include "glint/query/detail/pyramid/pixel_spline.h"
#include "glint/query/detail/pyramid/pyramid_slices.h"

namespace glint {

/// The spots of one slice.
struct SpotList {
  const NdfSpot* spots;
  int count;
  float scale;  ///< factor of NdfSpot::weight
  float rest;   ///< even density of the mass that is in no spot
};

/// Sum of the eight bytes of a word.
inline GLINT_HD std::uint32_t sumOfBytes(std::uint64_t bytes) {
  constexpr std::uint64_t kEven = 0x00ff00ff00ff00ffu;
  const std::uint64_t pairs = (bytes & kEven) + (bytes >> 8 & kEven);
  return static_cast<std::uint32_t>(pairs * 0x0001000100010001u >> 48);
}

/// Finds the spots of a slice: the group of kSpotGroup slices has a running count, and the counts before the slice are summed.
inline GLINT_HD SpotList spotsOf(const NdfCp& ndf, const NdfCluster& cluster, std::uint64_t slice) {
  const auto* first = static_cast<const std::uint8_t*>(ndf.coefficients) + cluster.first_coefficient;
  const std::uint8_t* counts = first + spotCountsOffset(cluster.slice_count);
  const std::uint64_t group = slice / kSpotGroup;
  const int inside = static_cast<int>(slice % kSpotGroup);
  std::uint32_t before;
  std::memcpy(&before, first + 4 * group, sizeof before);
  std::uint64_t low, high;  // counts of 16 slices; the masks below drop the slice itself and all bytes after it
  std::memcpy(&low, counts + group * kSpotGroup, sizeof low);
  std::memcpy(&high, counts + group * kSpotGroup + 8, sizeof high);
  low &= inside >= 8 ? ~std::uint64_t{0} : (std::uint64_t{1} << 8 * inside) - 1;
  high &= inside > 8 ? (std::uint64_t{1} << 8 * (inside - 8)) - 1 : 0;
  before += sumOfBytes(low) + sumOfBytes(high);
  const float* scales = ndf.scales.data() + cluster.first_scale;
  return {reinterpret_cast<const NdfSpot*>(first + firstSpotOffset(cluster.slice_count)) + before, counts[slice], scales[0],
          scales[1] * blockMass(counts[cluster.slice_count + slice])};
}

/// The profile of a spot along one axis: shares of its weight, by position of its centre (`place`: NdfSpot::x or y).
class SpotProfile {
 public:
  GLINT_HD explicit SpotProfile(const NdfCp& ndf) : sums_(ndf.spot_sums.data()) {}

  /// Share that lies in pixel `p` of the block.
  GLINT_HD float pixel(int p, int place) const {
    const float* at = edge(p, place);
    return at[kSpotSteps] - at[0];
  }
  /// Share that lies in the block.
  GLINT_HD float whole(int place) const {
    const float* at = edge(0, place);
    return at[kSpotSteps * kBlockSize] - at[0];
  }
  /// Share that lies between two edges.
  GLINT_HD float between(const BoxEdge& low, const BoxEdge& high, int place) const {
    return sumBetween(low, high, [&](int p) { return edge(p, place)[0]; });
  }

 private:
  GLINT_HD const float* edge(int p, int place) const { return sums_ + (kSpotSteps * p + kLastSpotPlace - place); }

  const float* sums_;
};

/// Density at one pixel.
inline GLINT_HD float spotsAt(const SpotProfile& profile, const SpotList& list, int x, int y) {
  float sum = 0;
  for (int k = 0; k < list.count; ++k) {
    const NdfSpot spot = list.spots[k];
    sum += static_cast<float>(spot.weight) * profile.pixel(x, spot.x) * profile.pixel(y, spot.y);
  }
  return list.scale * sum + list.rest;
}

/// Adds `weight` times the pixels of a window that lie in the block.
/// @param x, y  column and row of the window's first pixel in the block, -2 to 15
inline GLINT_HD void addSpotWindow(const SpotProfile& profile, const SpotList& list, int x, int y, float weight,
                                   WindowRows& window) {
  const auto inside = [](int pixel) { return pixel >= 0 && pixel < kBlockSize; };
  const auto shares = [&](int first, int place, float(&at)[PixelWindow::kSize]) {
    for (int t = 0; t < PixelWindow::kSize; ++t) at[t] = inside(first + t) ? profile.pixel(first + t, place) : 0.0f;
  };
  const auto add = [&](const float(&at_x)[PixelWindow::kSize], const float(&at_y)[PixelWindow::kSize], float factor) {
    const Float4 lanes = Float4::of(at_x[0], at_x[1], at_x[2], 0);
    for (int row = 0; row < PixelWindow::kSize; ++row)
      window.rows[row] = window.rows[row] + Float4::all(factor * at_y[row]) * lanes;
  };
  float at_x[PixelWindow::kSize], at_y[PixelWindow::kSize];
  for (int k = 0; k < list.count; ++k) {
    const NdfSpot spot = list.spots[k];
    shares(x, spot.x, at_x);
    shares(y, spot.y, at_y);
    add(at_x, at_y, weight * list.scale * static_cast<float>(spot.weight));
  }
  for (int t = 0; t < PixelWindow::kSize; ++t) {
    at_x[t] = inside(x + t) ? 1.0f : 0.0f;
    at_y[t] = inside(y + t) ? 1.0f : 0.0f;
  }
  add(at_x, at_y, weight * list.rest);
}

/// Sum over a box of pixels.
inline GLINT_HD float spotsIn(const SpotProfile& profile, const SpotList& list, const BlockBox& box) {
  float sum = 0;
  for (int k = 0; k < list.count; ++k) {
    const NdfSpot spot = list.spots[k];
    sum += static_cast<float>(spot.weight) * profile.between(box.x0, box.x1, spot.x) * profile.between(box.y0, box.y1, spot.y);
  }
  const auto pixels = [](int p) { return static_cast<float>(p); };
  return list.scale * sum + list.rest * sumBetween(box.x0, box.x1, pixels) * sumBetween(box.y0, box.y1, pixels);
}

/// Sum of each row of a slice.
inline GLINT_HD Float16 spotRowSums(const SpotProfile& profile, const SpotList& list) {
  float sums[kBlockSize];
  for (int y = 0; y < kBlockSize; ++y) sums[y] = kBlockSize * list.rest;
  for (int k = 0; k < list.count; ++k) {
    const NdfSpot spot = list.spots[k];
    const float share = list.scale * static_cast<float>(spot.weight) * profile.whole(spot.x);
    for (int y = 0; y < kBlockSize; ++y) sums[y] += share * profile.pixel(y, spot.y);
  }
  return Float16::load(sums);
}

/// Row y of a slice.
inline GLINT_HD Float16 spotRow(const SpotProfile& profile, const SpotList& list, int y) {
  float pixels[kBlockSize];
  for (int x = 0; x < kBlockSize; ++x) pixels[x] = list.rest;
  for (int k = 0; k < list.count; ++k) {
    const NdfSpot spot = list.spots[k];
    const float row = list.scale * static_cast<float>(spot.weight) * profile.pixel(y, spot.y);
    if (row == 0) continue;
    for (int x = 0; x < kBlockSize; ++x) pixels[x] += row * profile.pixel(x, spot.x);
  }
  return Float16::load(pixels);
}

}  // namespace glint
