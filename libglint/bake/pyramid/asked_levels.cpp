#include "glint/bake/pyramid/asked_levels.h"

#include <algorithm>
#include <cmath>

#include "glint/model/ndf_pyramid.h"

namespace glint::bake {

int strideFor(double smallest_texels) {
  constexpr double kSmallestOverLevel = 1.2;  // of sizes that level 0 answers as they are asked
  return std::max(2, static_cast<int>(smallest_texels / (kSmallestOverLevel * double{kFootprintPerStride})));
}

int levelsFor(double largest_texels, double stride) {
  constexpr double kLargestOverLevel = 1.9;  // of sizes that a level answers without the next
  const double needed = std::ceil(std::log2(largest_texels / (kLargestOverLevel * double{kFootprintPerStride} * stride))) + 1;
  return std::clamp(static_cast<int>(needed), 1, kMaxPyramidLevels - 1);
}

}  // namespace glint::bake
