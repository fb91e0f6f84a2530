#include "measure/normal_search.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "glint/math/gaussian.h"
#include "glint/query/detail/common/footprint_weights.h"

namespace glint::apps {

int NormalSearch::cellOf(float coordinate) {
  constexpr float kHalf = 0.5f * kCells;
  return std::clamp(static_cast<int>(std::floor(kHalf * (coordinate + 1))), 0, kCells - 1);
}

NormalSearch::NormalSearch(const NormalMap& map, float sigma_r)
    : map_(map),
      sigma_r_(sigma_r),
      reference_(map, sigma_r, Surface::flat, Boundary::wrap, Reference::Search::pruned),
      first_(std::size_t{kCells} * kCells + 1),
      texels_(map.normals.size()) {
  const auto cell = [](Vec2 normal) {
    return static_cast<std::size_t>(cellOf(normal.y)) * kCells + static_cast<std::size_t>(cellOf(normal.x));
  };
  for (const Vec2 normal : map.normals) ++first_[cell(normal) + 1];
  for (std::size_t k = 1; k < first_.size(); ++k) first_[k] += first_[k - 1];
  std::vector<std::size_t> next = first_;
  for (std::size_t k = 0; k < map.normals.size(); ++k) texels_[next[cell(map.normals[k])]++] = static_cast<std::uint32_t>(k);
}

float NormalSearch::density(const Footprint& footprint, Vec2 half) const {
  const FootprintWeights weights(footprint, map_.width, map_.height);
  const float reach = kLobeReach * sigma_r_;
  const int left = cellOf(half.x - reach), right = cellOf(half.x + reach);
  const auto row = [&](int y) {  // cells beside each other lie one after the other
    const std::size_t begin = static_cast<std::size_t>(y) * kCells;
    return std::array{first_[begin + static_cast<std::size_t>(left)], first_[begin + static_cast<std::size_t>(right) + 1]};
  };
  std::size_t facing = 0;
  for (int y = cellOf(half.y - reach); y <= cellOf(half.y + reach); ++y) facing += row(y)[1] - row(y)[0];
  const double in_footprint =
      static_cast<double>(weights.column_end - weights.column_begin) * (weights.row_end - weights.row_begin);
  if (!weights.hasClosedFormTotal() || in_footprint < static_cast<double>(facing)) return reference_.density(footprint, half);
  double sum = 0;
  const auto add = [&](int i, int j, Vec2 normal) {
    const double lobe = double{gaussianDensity(normal - half, sigma_r_)};
    // Every copy of the texel on the endless plane that the footprint reaches.
    const int first_x = weights.column_begin + wrapIndex(i - weights.column_begin, map_.width);
    const int first_y = weights.row_begin + wrapIndex(j - weights.row_begin, map_.height);
    for (int y = first_y; y < weights.row_end; y += map_.height)
      for (int x = first_x; x < weights.column_end; x += map_.width) sum += lobe * double{weights.texel(x, y)};
  };
  for (int y = cellOf(half.y - reach); y <= cellOf(half.y + reach); ++y) {
    const auto [begin, end] = row(y);
    for (std::size_t k = begin; k < end; ++k) {
      const auto texel = static_cast<int>(texels_[k]);
      const Vec2 normal = map_.normals[texels_[k]];
      if (near({half, half}, normal, normal, reach)) add(texel % map_.width, texel / map_.width, normal);
    }
  }
  return static_cast<float>(sum / weights.closedFormTotal());
}

}  // namespace glint::apps
